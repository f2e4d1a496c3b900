"""What is found in a record, from every side and without judging: all that a verdict is made from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from stiction.diagnosis.detection import detect_all, with_stem
from stiction.diagnosis.identification.closer import closely
from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.dense_search import search
from stiction.diagnosis.identification.identify import periods_of, speaking
from stiction.diagnosis.identification.in_step import with_pv_earlier
from stiction.diagnosis.identification.restored import restored
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.verdict.features import Features, features
from stiction.diagnosis.verdict.stem import stem_shown
from stiction.display.check_text import describe_check
from stiction.display.duration_format import format_seconds
from stiction.errors import RecordError
from stiction.records.analysis_window import usable_segment
from stiction.records.assess import assess_quality
from stiction.records.check_result import CheckResult
from stiction.records.quality.storage_rate import StoredMasks, find_slower_signal, find_stored_samples
from stiction.records.record import mask_outliers, missing_pv_hint, require_record

if TYPE_CHECKING:
    from stiction.diagnosis.identification.dense_search import Search
    from stiction.diagnosis.identified import ControllerFit, Identification
    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.diagnosis.verdict.stem import Shown
    from stiction.records.assess import Quality
    from stiction.records.record import LoopRecord

__all__ = ["Findings", "findings"]

THINNED = "{0} is updated every {2} and {1} more often. Only the samples with a new {0} are used."
"""What is said of a record in which one of OP and PV is held."""
ENOUGH = 0.01
"""Share of the samples that may be left untold in a record that is as good as one of all of them [-]."""


@dataclass(frozen=True, slots=True)
class Findings:
    """All that a verdict is made from."""

    record: LoopRecord
    """The record, without values far off all others, OP and PV in step and at one rate."""
    part: LoopRecord
    """The stretch that was analysed."""
    oscillation: Oscillation
    """Whether and how the loop oscillates."""
    quality: Quality
    """What the data are worth."""
    evidence: tuple[Evidence, ...]
    """What each method says."""
    found: tuple[Identification, ...]
    """One identification per comparison; none where the record did not allow a search."""
    speaks: int
    """Which of them speaks."""
    told: Identification | None
    """What is told of the valve: the same, or S and J by samples rebuilt between the recorded ones; None without an
    identification."""
    controller: ControllerFit | None
    """The controller found."""
    features: Features | None
    """All of that in a row of numbers; None without an identification."""
    stem: Shown | None = None
    """What the recorded valve position shows; None where none was recorded."""
    every: int = 1
    """Samples of the record to one that is looked at: more than one where OP and PV are not stored at one rate, and no
    law tells what is held."""
    rates: str = ""
    """What is told of a record that is not stored at one rate, in a sentence."""
    stored: StoredMasks | None = None
    """At which samples OP and PV were stored, where what was between is told by the controller's law."""


def findings(record: LoopRecord) -> Findings:
    """Look at a record from every side, without judging.

    Parameters
    ----------
    record : LoopRecord
        A record of one loop, OP and PV at least.

    Returns
    -------
    Findings
        What was found.

    Raises
    ------
    RecordError
        When the record has no PV at all.
    """
    require_record(record)
    if record.pv is None:
        raise RecordError(f"{record.tag} has no PV; a diagnosis needs OP and PV. {missing_pv_hint(record)}")
    record = mask_outliers(record)
    assert record.pv is not None
    kept = find_stored_samples(record.op, record.pv)
    whole = restored(record, kept) if kept.partial else None
    if whole is not None:
        seen = _findings(mask_outliers(whole.record), samples_late=0)
        longest, severity = 1.0 / min(kept.partial.values()), "warn" if whole.untold > ENOUGH else "ok"
        partial: dict[str, float | str] = {"stored_percent": _partial_text(kept.partial)}
        rate = CheckResult("storage rate", severity, longest, 1.0, "samples", "reconstructed", partial)
        n = len(seen.record)  # shorter where PV is late, whose first samples are then left out
        stored = StoredMasks(kept.op[:n], kept.pv[len(record) - n :])
        quality = _add_missing_before(_replace_check(seen.quality, rate), record.missing_percent)
        return replace(seen, quality=quality, rates=describe_check(rate), stored=stored)
    slower = find_slower_signal(record.op, record.pv)
    if slower is None or record.mv is not None:  # whose stem needs every sample of OP
        return _findings(record, samples_late=0)
    thinned = mask_outliers(record.window(slower.first, len(record), slower.every))
    seen = _findings(thinned, samples_late=0)
    [rate] = [check for check in assess_quality(record).checks if check.name == "storage rate"]
    every = format_seconds(slower.every * record.dt)
    told = THINNED.format(slower.name, "OP" if slower.name == "PV" else "PV", every)
    return replace(seen, quality=_replace_check(seen.quality, rate), every=slower.every, rates=told)


def _partial_text(shares: dict[str, float]) -> str:
    """Say which of OP and PV was stored at which share of the samples."""
    return " and ".join(f"{name} is stored at {100.0 * share:.0f} %" for name, share in shares.items())


def _add_missing_before(quality: Quality, before_percent: float) -> Quality:
    """Add to the check of missing values how many were missing before the reconstruction [%]."""
    [check] = [check for check in quality.checks if check.name == "missing values"]
    if not before_percent > quality.bad_percent:
        return quality
    fields = {**check.fields, "before_percent": before_percent}
    return _replace_check(quality, replace(check, finding="missing_reconstructed", fields=fields))


def _replace_check(quality: Quality, check: CheckResult) -> Quality:
    """Return a quality with another result of one check."""
    return replace(quality, checks=tuple(check if one.name == check.name else one for one in quality.checks))


def _findings(record: LoopRecord, *, samples_late: int) -> Findings:
    """Look at a record; once more, with each PV as many samples earlier, where it was stored `samples_late`."""
    part = usable_segment(record)
    oscillation = find_oscillation(part)
    quality = assess_quality(record, oscillation.period if oscillation.oscillating else None)
    stem = stem_shown(record.window(quality.first, quality.last), record.op_unit_short)
    # Weights were found without a stem position, and what a method makes of one must not shift them.
    votes = detect_all(replace(part, mv=None), oscillation)
    evidence = votes if stem is None or not stem.used else with_stem(part, oscillation, votes)
    if stem is not None:
        evidence = (stem.evidence(), *evidence)
    # The search draws lines over what is missing, and a held value is none that the controller saw.
    stored = record.window(quality.first, quality.last)
    gappy = replace(part, op=stored.op, pv=stored.pv)
    controller = _controller(gappy) if quality.usable else None
    if controller is not None and samples_late:
        controller = controller._replace(samples_late=samples_late)
    elif controller is not None and controller.samples_late:
        earlier = mask_outliers(with_pv_earlier(record, controller.samples_late))
        return _findings(earlier, samples_late=controller.samples_late)
    searches = () if controller is None else _searched(gappy, oscillation, controller)
    if controller is None or not searches:
        return Findings(record, part, oscillation, quality, evidence, (), 0, None, None, None, stem)
    speaks = speaking(searches, oscillation)
    closer = closely(searches[speaks])
    found = tuple(closer.recorded if i == speaks else one.rough for i, one in enumerate(searches))
    row = features(record, part, found, speaks, controller, oscillation, votes)
    return Findings(record, part, oscillation, quality, evidence, found, speaks, closer.told, controller, row, stem)


def _controller(part: LoopRecord) -> ControllerFit | None:
    """The controller; None where the stretch does not hold enough to look for one."""
    try:
        return fit_controller(part)
    except RecordError:
        return None


def _searched(part: LoopRecord, oscillation: Oscillation, controller: ControllerFit) -> tuple[Search, ...]:
    """Compare about the local mean over one period, where there is one, and about the mean of the record.

    The one about the period speaks where the loop oscillates, else the one that explains more; only that one is then
    searched closely.
    """
    try:
        return tuple(search(part, period, controller) for period in periods_of(part, oscillation))
    except RecordError:
        return ()
