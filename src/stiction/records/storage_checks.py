"""Checks of what a historian or a reader did to a record."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.check_result import MIN_SAMPLES, CheckInput, CheckResult, check_maximum, check_minimum
from stiction.records.quality.clock_jumps import find_discontinuities
from stiction.records.quality.compression import controller_saw_hold, count_interpolated, exception_deviation
from stiction.records.quality.copied_data import find_copied_data
from stiction.records.quality.frozen import find_outages
from stiction.records.quality.moving_average import detect_averaging_window
from stiction.records.quality.outliers import find_outliers
from stiction.records.quality.quantisation import is_coarse, peak_to_peak
from stiction.records.quality.storage_rate import find_repeated, find_slower_signal
from stiction.records.runs import run_lengths, runs

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["STORAGE_CHECKS"]


def _compression(data: CheckInput) -> CheckResult | None:
    """Straight lines that no controller makes: swinging door compression, or interpolation."""
    n = len(data.part)
    if n < 10 or data.record.pv is None:
        return None
    drawn = {
        "OP": count_interpolated(data.op, data.pv, *data.steps),
        "PV": count_interpolated(data.pv, data.op, *data.steps[::-1]),
    }
    signal = max(drawn, key=lambda name: drawn[name])
    percent, stored = 100.0 * drawn[signal] / n, n - drawn[signal]
    points = (1.0 - drawn[signal] / n) * (data.cycle or data.part.duration) / data.record.dt
    fields = {"signal": signal, "drawn_percent": percent, "points": points, "stored": stored}
    if percent <= 10.0:
        return CheckResult("compression", "ok", percent, 10.0, "%", "compression", fields)
    if points < 8 or stored < MIN_SAMPLES:
        unit, remedy = "points per cycle", "export_raw_lost"
        return CheckResult("compression", "reject", points, 8, unit, "compression_lines", fields, remedy)
    return CheckResult("compression", "warn", percent, 10.0, "%", "compression_lines", fields, "export_raw")


def _exception_reporting(data: CheckInput) -> CheckResult | None:
    """OP or PV stored only after it had moved by a deviation: small movements are lost, and it seems to stick."""
    record = data.record
    if len(record) < 10 or record.pv is None:
        return None
    # The whole record, because a long hold of OP counts as manual and is cut out.
    op, pv = (exception_deviation(x, step) for x, step in zip((record.op, record.pv), data.steps, strict=True))
    if pv and controller_saw_hold(np.where(data.masks.at_limit, np.nan, record.op), record.pv, data.steps[0]):
        pv = 0.0
    signals = zip(("OP", "PV"), data.whole, (op, pv), strict=True)
    found = [(peak_to_peak(x) / deviation, name, deviation) for name, x, deviation in signals if deviation]
    if not found:
        return CheckResult("exception reporting", "ok", 0.0, 0.0, "deviations", "no_exception_reporting")
    levels, signal, deviation = min(found)
    return check_minimum(
        "exception reporting", levels, "deviations", warn=20, reject=6, remedy="set_deviation",
        fields={"signal": signal, "deviation": deviation},
    )  # fmt: skip


def _held_values(data: CheckInput) -> CheckResult | None:
    """OP and PV repeated together: the historian stored less often than it was asked."""
    if len(data.part) < 2 or data.record.pv is None:
        return None
    op, pv, moves = data.op, data.pv, len(data.part) - 1
    new = moves - int(find_repeated(op, pv).sum())
    percent = 100.0 * (moves - new) / moves
    fields: dict[str, float | str] = {"repeated_percent": percent}
    remedy = "export_controller_rate"
    # Rounding repeats values too, but not those of OP and PV together; a slow historian renews both at once.
    is_rounded = is_coarse(op) and is_coarse(pv) and 2 * np.sum((np.diff(op) != 0.0) & (np.diff(pv) != 0.0)) < new
    if percent > 20.0 and data.period is not None and not is_rounded:
        points = new / moves * data.period / data.record.dt
        fields["points"] = points
        if points < 4:
            return CheckResult("held values", "reject", points, 4, "values per cycle", "held_cycles", fields, remedy)
    finding = "held_cycles" if "points" in fields else "held_values"
    return check_maximum("held values", percent, "%", warn=20.0, finding=finding, remedy=remedy, fields=fields)


def _storage_rate(data: CheckInput) -> CheckResult | None:
    """One of OP and PV is held for several samples while the other moves."""
    if len(data.part) < 2 or data.record.pv is None:
        return None
    slower = find_slower_signal(data.op, data.pv)
    if slower is None:
        return CheckResult("storage rate", "ok", 1.0, 1.0, "samples", "storage_rate")
    fields: dict[str, float | str] = {"signal": slower.name, "other": "OP" if slower.name == "PV" else "PV"}
    return CheckResult(
        "storage rate", "warn", float(slower.every), 1.0, "samples", "unequal_rates", fields, "export_both"
    )


def _historian_outages(data: CheckInput) -> CheckResult | None:
    """OP and PV are constant together, which they almost never are, and then jump."""
    if data.part.pv is None:
        return None
    found = runs(find_outages(data.part.op, data.part.pv))
    longest = int(run_lengths(found).max(initial=0)) * data.record.dt
    finding, count = "outages" if found else "no_outages", len(found)
    return check_maximum(
        "historian outages", count, "-", warn=0, finding=finding, remedy="repair_historian",
        fields={"segment_count": count, "longest_s": longest},
    )  # fmt: skip


def _moving_average(data: CheckInput) -> CheckResult | None:
    """OP and PV averaged over several samples."""
    window = 0 if data.record.pv is None else detect_averaging_window(data.op, data.pv)
    if not window:
        return None
    # In a short record notches may be there by chance.
    fields: dict[str, float | str] = {
        "seem": "are" if len(data.part) >= 150 else "look like",
        "window_s": window * data.record.dt,
    }
    if data.period is None:
        return CheckResult(
            "moving average", "warn", window, 1, "samples", "moving_average", fields, "export_raw_values"
        )
    share = window * data.record.dt / data.period
    return check_maximum(
        "moving average", share, "cycles", warn=0.0, reject=1 / 3, finding="moving_average_cycle",
        remedy="export_raw_values", fields={**fields, "cycle_percent": 100.0 * share},
    )  # fmt: skip


def _copied_data(data: CheckInput) -> CheckResult | None:
    """Segments that occur twice, value for value: a copy breaks the record at both ends."""
    if len(data.part) < 2 or data.record.pv is None:
        return None
    mask, is_periodic = find_copied_data(data.op, data.pv, *data.steps)
    percent = 100.0 * float(np.mean(mask))
    if is_periodic:
        return CheckResult("copied data", "ok", percent, 0.5, "%", "exactly_periodic")
    return check_maximum("copied data", percent, "%", warn=0.5, remedy="export_raw_record")


def _clock_jumps(data: CheckInput) -> CheckResult:
    """Clock changes that the reader met; a change of summer time without a break of OP and PV lost no rows."""
    origin, record = data.record.provenance, data.record
    breaks = (
        record.pv is not None
        and find_discontinuities(record.op, record.pv, max_count=min(origin.clock_jumps, 20)).any()
    )
    undone = 0 if breaks else origin.summer_time
    jumps = origin.clock_jumps - undone
    finding = "clock_jumps" if jumps else "summer_time" if undone else "clock_even"
    return check_maximum(
        "clock jumps", jumps, "-", warn=0, finding=finding, remedy="cut_record", fields={"time_count": jumps}
    )


def _outliers(data: CheckInput) -> CheckResult | None:
    """Values far from all others, and nearer spikes of PV."""
    excluded, record = data.record.provenance.outliers, data.record
    samples = record.samples_per_stored_value
    spikes = 0 if record.pv is None else int(find_outliers(record.pv, samples_per_value=samples).sum())
    if not excluded + spikes:
        return None
    return check_maximum(
        "outliers",
        excluded + spikes,
        "-",
        warn=0,
        remedy="check_bad_values",
        fields={"value_count": excluded, "spike_count": spikes},
    )


def _resampled(data: CheckInput) -> CheckResult | None:
    """Values that the reader repeated to fill an even time grid."""
    held = data.record.provenance.held_samples
    if not held or len(data.record) < held:
        return None
    percent = 100.0 * held / len(data.record)
    fields: dict[str, float | str] = {"held_percent": percent}
    finding = "resampled"
    if data.period is not None:
        points = (1.0 - percent / 100.0) * data.period / data.record.dt
        finding, fields["points"] = "resampled_cycles", points
        if points < 4:
            remedy = "export_even_faster"
            return CheckResult("resampled", "reject", points, 4, "values per cycle", finding, fields, remedy)
    return check_maximum(
        "resampled", percent, "%", warn=25, reject=50, finding=finding, remedy="export_even", fields=fields
    )


STORAGE_CHECKS: tuple[Callable[[CheckInput], CheckResult | None], ...] = (
    *(_compression, _exception_reporting, _held_values, _storage_rate, _historian_outages, _moving_average),
    *(_copied_data, _clock_jumps, _outliers, _resampled),
)
"""The checks, in the order in which they are reported."""
