"""Sentences for the data checks: what was found, then what to do. The checks themselves hold only numbers and codes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from stiction.display.duration_format import format_seconds
from stiction.display.number_format import count_noun

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["FINDINGS", "REMEDIES", "describe_check"]

FINDINGS = {
    "length": "the longest segment without manual control, a clipped OP, a frozen PV, a clock jump or a gap has "
    "{value:.0f} "
    "of {samples} samples",
    "cycles": "the usable segment contains {value:.1f} cycles of {period_s}",
    "sampling": "a cycle has {value:.1f} samples",
    "sampling_short": "a cycle has {value:.1f} samples in a short record",
    "sampling_noise": "OP and PV are almost uncorrelated with their last samples (correlation {value:.2f}): the "
    "record contains "
    "only noise, or cycles shorter than {fastest_s}",
    "sampling_alternating": "OP and PV alternate (correlation with the last sample {value:.2f}): a cycle takes less "
    "than {fastest_s}",
    "op_movement": "OP moves by {value:.3g}",
    "op_constant": "OP is constant: the loop is in manual, or OP was not recorded",
    "op_reversals": "OP reverses {time_count}; friction shows only at reversals",
    "pv_movement": "PV moves by {value:.3g}",
    "pv_constant": "PV is constant: the transmitter is frozen, or the column is wrong",
    "pv_not_recorded": "PV was not recorded",
    "pv_equals_op": "PV and OP are the same numbers: one column was exported or assigned twice",
    "saturation": "OP is at a limit for {value:.3g} % of the samples in {segment_count}{excluded}",
    "manual_mode": "the mode is not automatic for {value:.3g} % of the samples in {segment_count} (excluded)",
    "manual_steps": "OP moves in steps, as in manual, for {value:.3g} % of the samples in {segment_count} (excluded)",
    "manual_constant": "OP is constant while PV moves, as in manual or inside a controller's gap, for {value:.3g} % of "
    "the samples in {segment_count} (excluded)",
    "frozen_pv": "PV is frozen for {value:.3g} % of the samples in {segment_count} (excluded)",
    "no_missing_values": "every sample has OP and PV",
    "missing_values": "{missing_percent:.3g} % of the samples have no OP or no PV, the longest gap lasts {longest_s}, "
    "{filled} were filled with the last value",
    "missing_reconstructed": "{missing_percent:.3g} % of the samples have no OP or no PV; it was {before_percent:.3g} "
    "% "
    "before the reconstruction with the controller equation",
    "op_scale": "OP lies between {low:.4g} and {high:.4g} and is taken as % of span",
    "op_scale_unit": "OP lies between {low:.4g} and {high:.4g} in {op_unit} (according to its header): S and J are in "
    "its unit, "
    "not in % of span",
    "op_scale_fraction": "OP lies between {low:.4g} and {high:.4g}, like a fraction of span: S and J are in its unit, "
    "not in % of span",
    "op_scale_normalised": "OP lies between {low:.4g} and {high:.4g}, as if normalised: S and J are in its unit, not "
    "in % of span",
    "op_scale_other": "OP lies between {low:.4g} and {high:.4g}, unlike a percentage: S and J are in its unit, not in "
    "% of span",
    "resolution": "{signal} covers {levels:.0f} quantisation steps",
    "compression": "{signal} lies on exact straight lines at {drawn_percent:.3g} % of the samples",
    "compression_lines": "{signal} lies on exact straight lines at {drawn_percent:.3g} % of the samples: the historian "
    "interpolated, and stored {points:.1f} points per cycle, {stored} in all",
    "no_exception_reporting": "OP and PV also change by small steps: no exception deviation is visible",
    "exception_reporting": "{signal} is constant and then changes by {deviation:.3g} or more, and covers {value:.1f} "
    "such deviations: it was stored by exception",
    "held_values": "OP and PV both repeat their last value at {repeated_percent:.3g} % of the samples",
    "held_cycles": "OP and PV both repeat their last value at {repeated_percent:.3g} % of the samples, and a cycle has "
    "{points:.1f} new values",
    "storage_rate": "OP and PV are stored equally often",
    "unequal_rates": "{signal} is updated only every {value:.0f} samples, {other} more often",
    "reconstructed": "{stored_percent} of the samples; the others were reconstructed with the controller equation",
    "no_outages": "OP and PV are never constant together",
    "outages": "OP and PV are constant together and then jump, in {segment_count} of up to {longest_s}: the historian "
    "had no connection",
    "moving_average": "OP and PV {seem} moving averages over {window_s}",
    "moving_average_cycle": "OP and PV {seem} moving averages over {window_s}, {cycle_percent:.3g} % of a cycle",
    "copied_data": "{value:.3g} % of the samples repeat an earlier segment value for value",
    "exactly_periodic": "the record repeats itself value for value: it was simulated without noise, or its values are "
    "rounded too much",
    "clock_even": "the clock runs evenly",
    "summer_time": "the clock change of summer time was corrected; OP and PV continue without a jump",
    "clock_jumps": "the clock jumped or rows were out of order {time_count}",
    "outliers": "{value_count} far from all others were removed; {spike_count} of PV were not removed",
    "resampled": "{held_percent:.3g} % of the samples repeat an earlier value to fill an even time grid",
    "resampled_cycles": "{held_percent:.3g} % of the samples repeat an earlier value to fill an even time grid, and a "
    "cycle has {points:.1f} recorded values",
}
"""Code of a finding -> its sentence, with the numbers of the check in braces."""

REMEDIES = {
    "record_hundreds": "record some hundreds of samples",
    "record_cycles": "record ten cycles or more",
    "record_fast": "record every {interval_s:.2g} s or faster",
    "record_faster": "record faster",
    "record_ten_times_as_fast": "record ten times as fast",
    "record_longer": "the usable segment is too short: record longer",
    "record_movement": "record a period with more OP movement",
    "record_in_automatic": "put the controller in automatic and record again",
    "record_pv": "record PV together with OP",
    "record_finer": "record without rounding",
    "name_pv": "give the name of the PV column",
    "repair_pv": "repair the transmitter, or name the right column, and record again",
    "repair_transmitter": "repair the transmitter or its connection and record again",
    "repair_historian": "repair the connection to the historian and record again",
    "check_sizing": "check valve sizing and OP limits, then record while OP is between its limits",
    "check_bad_values": "check how the historian writes bad values",
    "give_op_range": "give op_range (--op-range) to convert it",
    "export_raw": "export raw values, or switch compression off and record again",
    "export_raw_lost": "the shape of the cycle is lost: export raw values, or switch compression off and record again",
    "export_raw_values": "export raw values",
    "export_controller_rate": "export raw values at the rate of the controller",
    "export_both": "export both at the rate of the controller",
    "export_even": "export at an even rate",
    "export_even_faster": "export at an even and faster rate",
    "export_raw_record": "some data are copies: export the raw record",
    "set_deviation": "set the exception deviation to 0 and record again",
    "cut_record": "check the assumptions of the reader, or split the record there",
}
"""Code of a remedy -> what to do."""

_PLURALS = {"segment": "segments", "time": "times", "value": "values", "spike": "spikes"}


class Check(Protocol):
    """What a sentence needs of a data check."""

    @property
    def finding(self) -> str:
        """Key of `FINDINGS`."""
        ...

    @property
    def remedy(self) -> str:
        """Key of `REMEDIES`; empty when there is nothing to do."""
        ...

    @property
    def value(self) -> float:
        """Value of the check."""
        ...

    @property
    def fields(self) -> Mapping[str, float | str]:
        """Numbers and names for the sentence."""
        ...


def describe_check(check: Check) -> str:
    """Return the sentences for a data check.

    Parameters
    ----------
    check : CheckResult
        A result of `stiction.records.assess_quality`.

    Returns
    -------
    str
        What was found and, where there is one, the remedy.

    Examples
    --------
    >>> from stiction.records import LoopRecord, assess_quality
    >>> quality = assess_quality(LoopRecord("FIC-101", 1.0, op=[50.0, 51.0] * 20))
    >>> describe_check(next(check for check in quality.rejections if check.name == "pv movement"))
    'PV was not recorded. Record PV together with OP.'
    """
    words = {name: _word(name, value) for name, value in check.fields.items()}
    codes = [(FINDINGS, check.finding), (REMEDIES, check.remedy)]
    texts = [table[code].format(value=check.value, **words) for table, code in codes if code]
    return " ".join(f"{text[0].upper()}{text[1:]}." for text in texts)


def _word(name: str, value: float | str) -> float | str:
    """A field as its template expects it: durations and counts become text."""
    if isinstance(value, str):
        return value
    if name.endswith("_count"):
        noun = name.removesuffix("_count")
        return count_noun(int(value), noun, _PLURALS.get(noun, ""))
    return format_seconds(value) if name.endswith("_s") and name != "interval_s" else value
