"""The main question: whether the valve sticks, how much, how sure that is, and what to do."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from stiction.diagnosis.detection.evidence import judge
from stiction.diagnosis.identification.in_step import late_said
from stiction.diagnosis.loop_state import assess_loop_state, describe_action, describe_state
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.result import Diagnosis, Evidence
from stiction.diagnosis.verdict.cause import named_cause, not_seen, stuck_or_not
from stiction.diagnosis.verdict.contradiction import (
    OWN_CYCLE,
    against_both,
    against_good,
    against_moving,
    against_short,
    against_sticking,
    explains_much_more,
    explains_nothing,
)
from stiction.diagnosis.verdict.doubt import FAULT_SEEN, MOST, UNKNOWN, held_back, only_saturated
from stiction.diagnosis.verdict.findings import Findings, findings
from stiction.diagnosis.verdict.in_part import suspects, told_of_part
from stiction.diagnosis.verdict.objection import Objection
from stiction.diagnosis.verdict.own_cycle import near, own_cycle
from stiction.diagnosis.verdict.probability import UNDECIDED, causes, counted
from stiction.diagnosis.verdict.windows import changes, said, windows
from stiction.display.check_text import describe_check
from stiction.errors import RecordError
from stiction.records.analysis_window import forward_fill_sp, usable_segment
from stiction.records.assess import assess_quality
from stiction.records.check_result import MIN_SAMPLES
from stiction.records.quality.quantisation import peak_to_peak
from stiction.records.record import mask_outliers, missing_pv_hint, require_record

if TYPE_CHECKING:
    from stiction.diagnosis.identified import Identification
    from stiction.diagnosis.loop_state import LoopState
    from stiction.diagnosis.result import Counted, Verdict
    from stiction.diagnosis.verdict.features import Features
    from stiction.diagnosis.verdict.stem import Shown
    from stiction.records.record import LoopRecord

__all__ = ["diagnose"]

PLAIN_REASONS = (
    *("exception reporting", "compression", "missing values", "op movement", "pv movement", "manual", "saturation"),
)
"""Refusals that others follow from; that of a record which is too short as a whole comes before them."""

STICKS, FOLLOWS = 0.45, 0.1
"""S over the OP's swing from which the identification by itself votes for stiction, and up to which against [-]: a loop
that cycles because of its valve moves OP through the band and little more, noise and drift fit bands of a tenth."""

AT_LIMIT = "Check sizing and limits of the valve, then record the loop off its limits."
"""What to do where OP rests at a limit."""
FOLLOWED = 0.5
"""Share of the PV that the set point moves beyond which the stem is seen to move [-]."""


def diagnose(record: LoopRecord) -> Diagnosis:
    """Say whether the valve of a loop sticks, how much, how sure that is, and what to do.

    Parameters
    ----------
    record : LoopRecord
        A record of one loop, OP and PV at least.

    Returns
    -------
    Diagnosis
        Verdict with probability, reason and action; the evidence; the identified valve and process. A record
        that cannot be judged is `undecided`, with the reason.

    Raises
    ------
    RecordError
        When the record has no PV at all, or is a path or the list that `read` gives.

    Notes
    -----
    The probability of each cause is weighed from features of the joint identification of valve and process, of the
    oscillation, the controller, the sensor and the methods of the evidence table (see `verdict.features` and
    `verdict.probability`), and by the valve's position where it was recorded (`verdict.stem`); doubts about the data
    and findings that contradict one another (`verdict.contradiction`) hold it back (`verdict.doubt`).

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> st.diagnose(st.simulate(loop, sp=10.0, duration=2000.0, loop_type="flow")).verdict
    'stiction'
    """
    require_record(record)
    if record.pv is None:
        raise RecordError(f"{record.tag} has no PV; a diagnosis needs OP and PV. {missing_pv_hint(record)}")
    state = assess_loop_state(record)
    if not state.in_control:
        return _not_in_control(record, state)
    found = _diagnosed(record)
    if found.quality.rejections and found.identification is None:
        state = assess_loop_state(record, [describe_check(check) for check in found.quality.rejections])
    return replace(found, loop_state=state)


def _not_in_control(record: LoopRecord, state: LoopState) -> Diagnosis:
    """A record in which the controller does not move the valve, or the process does not answer."""
    record = mask_outliers(record)
    oscillation = find_oscillation(usable_segment(record))
    return Diagnosis(
        record=record,
        verdict="undecided",
        probability=UNKNOWN[0],
        probability_before_doubts=UNKNOWN[0],
        cause="saturation" if state.state == "saturated" else "unknown",
        reason=describe_state(state, record.start, record.provenance.pv_unit),
        action=describe_action(state),
        oscillation=oscillation,
        evidence=(),
        quality=assess_quality(record, oscillation.period if oscillation.oscillating else None),
        settings={"undecided": list(UNDECIDED)},
        loop_state=state,
    )


def _diagnosed(record: LoopRecord, start: int | None = None) -> Diagnosis:
    """Judge a record, or a part that begins at sample `start` of one, and a part of it that may tell more."""
    seen = findings(record)
    if seen.features is None:
        return _cannot_tell(seen)
    weighed = _weigh(seen, seen.features)
    whole = _told(seen, seen.features, weighed, _judge(seen, seen.features, weighed), start)
    if whole.probability >= MOST:
        return whole
    first, last = whole.quality.first, whole.quality.last
    begun = start or 0
    # PV that is late is found late in the part as well; two rates are one already.
    came = record if seen.every == 1 else seen.record
    shown = windows(seen.part, seen.found[seen.speaks]) if whole.verdict != "stiction" else ()
    for cut in suspects(seen.record.window(first, last), seen.stem, shown):
        begin, end = first + cut.start, first + cut.stop
        told = told_of_part(whole, _diagnosed(came.window(begin, end), begun + begin), begin, begun)
        if told is not whole:
            return told
    return whole


class Weighed(NamedTuple):
    """What all findings together say, before any doubt about the data."""

    causes: dict[str, float]
    """Probability of each cause [-]."""
    counted: tuple[Counted, ...]
    """What each finding did to that of stiction."""
    valve: Identification
    """The valve to tell."""
    stem: Shown | None
    """What the valve's position shows, where it counts."""


class Judged(NamedTuple):
    """What is called, and how sure that is."""

    verdict: Verdict
    """What is called."""
    causes: dict[str, float]
    """Probability of each cause that the data allow [-]."""
    why: str
    """What held the probability back, in a sentence."""
    not_seen: str
    """Why the valve is not seen, in a sentence; empty where it is."""
    still: bool
    """Whether it is not called good because its position stands still."""
    valve: Identification
    """The valve to tell."""


def _weigh(seen: Findings, row: Features) -> Weighed:
    """Weigh the findings, and the valve's position where it shows something."""
    found, told, weights = seen.told or seen.found[seen.speaks], causes(row), counted(row)
    stem = seen.stem if seen.stem is not None and seen.stem.used else None
    if stem is None:
        return Weighed(told, weights, found, None)
    valve = found if stem.what == "good" else stem.identified(found)  # a good valve has no band to give
    return Weighed(stem.weighed(told), (stem.counted(told), *weights), valve, stem)


def _judge(seen: Findings, row: Features, weighed: Weighed) -> Judged:
    """Let the doubts hold the probability back, and call what is left of it."""
    found, told, valve = seen.found[seen.speaks], weighed.causes, weighed.valve
    blind = weighed.stem is None  # no position shows the stem
    by_itself = blind and told["sensor"] + told["saturation"] < FAULT_SEEN
    assert seen.controller is not None
    nothing = explains_nothing(found, seen.controller) if blind else ""
    late = (Objection.PV_LATE,) if seen.controller.samples_late else ()
    both = (*late, *against_both(seen.controller))
    against = (*against_good(found, row, told), *against_moving(seen.stem, told), *both) if blind else ()
    sticking = (*against_sticking(found, valve, row, partial(_makes_cycle, seen)), *against_short(seen.quality), *both)
    held = held_back(
        told["stiction"], seen.quality, told["saturation"], told["sensor"], own_samples=found.own_samples,
        valve_seen=not nothing, against=against, against_sticking=sticking if blind else (),
    )  # fmt: skip
    rest = (1.0 - held.probability) / max(1.0 - told["stiction"], 1e-12)
    told = {name: held.probability if name == "stiction" else rest * share for name, share in told.items()}
    verdict = _verdict(held.probability)
    much_more = by_itself and explains_much_more(found)
    not_seen = nothing if by_itself else ""
    still = verdict == "no_stiction" and Objection.STANDS_STILL in against
    plain = much_more or Objection.JUMP_PLAIN in against or Objection.EVERY_RIVAL in against
    if not_seen or still or (verdict == "no_stiction" and plain):
        verdict = "undecided"
    if much_more and verdict == "undecided":
        valve = max((valve, valve.rough or valve), key=lambda one: one.fit)  # the one that explains so much
    return Judged(verdict, told, held.why, not_seen, still, valve)


def _makes_cycle(seen: Findings) -> bool:
    """Whether the likeliest valve, its process and the controller make the loop's cycle by themselves."""
    period, dt, controller = seen.oscillation.period, seen.part.dt, seen.controller
    if controller is None or not math.isfinite(period):
        return False
    own = own_cycle(seen.found[seen.speaks], controller, period, dt)
    return own is not None and near(seen.oscillation.amplitude_op, own.amplitude_op) >= OWN_CYCLE


def _told(seen: Findings, row: Features, weighed: Weighed, judged: Judged, start: int | None) -> Diagnosis:
    """Put the verdict into words; times count from `start` samples before the record, where it is a part."""
    verdict, valve, found = judged.verdict, judged.valve, seen.found[seen.speaks]
    unit, slave = seen.record.op_unit_short, seen.record.provenance.secondary_tag
    # A master's valve is another loop's; a PV that goes where its set point does has a stem that moves.
    any_band_shows = bool(slave) or row.set_point > FOLLOWED
    cause = named_cause(
        verdict, judged.causes, valve, seen.oscillation, seen.record.dt, weighed.counted,
        kind_known=seen.record.integrating is not None, unit=unit,
        swing=math.inf if any_band_shows else peak_to_peak(seen.part.op),
        by_position=weighed.stem is not None and weighed.stem.what != "good",
    )  # fmt: skip
    if judged.not_seen:
        cause = not_seen(judged.not_seen, judged.causes)
    elif judged.still:
        cause = stuck_or_not(judged.causes)
    shown = windows(seen.part, valve, (start or 0) + seen.quality.first) if verdict != "no_stiction" else ()
    known = weighed.stem is not None or start is not None  # by the position, or as the part that sticks
    if known and not any(window.verdict == "stiction" for window in shown):
        shown = ()
    of_stem = seen.stem.why if seen.stem is not None else ""
    _, of_set_point = forward_fill_sp(seen.record, seen.quality.first, seen.quality.last)
    drift = changes(valve, seen.part.duration, unit) if verdict == "stiction" else ""
    late = late_said(seen.controller.samples_late) if seen.controller is not None else ""
    of_slave = f"OP is the set point of {slave}; the valve is that loop's." if slave else ""
    of_windows = said(shown, seen.record.dt)
    spoken = (cause.reason, of_slave, of_stem, late, seen.rates, of_windows, drift, of_set_point, judged.why)
    return Diagnosis(
        record=seen.record,
        verdict=verdict,
        probability=judged.causes["stiction"],
        probability_before_doubts=weighed.causes["stiction"],
        cause=cause.name,
        reason=" ".join(text for text in spoken if text),
        action=cause.action,
        oscillation=seen.oscillation,
        evidence=(_own_row(found.rough or found, seen.part, explains_nothing(found)), *seen.evidence),
        quality=seen.quality,
        identification=valve,
        settings={"model": valve.model, "undecided": list(UNDECIDED)},
        windows=shown,
        causes=judged.causes,
        features=row._asdict(),
        counted=weighed.counted,
        controller=seen.controller,
        stored=seen.stored,
    )


def _verdict(probability: float) -> Verdict:
    return "stiction" if probability > UNDECIDED[1] else "no_stiction" if probability < UNDECIDED[0] else "undecided"


def _own_row(found: Identification, part: LoopRecord, unseen: str) -> Evidence:
    """The dense search as a row of the evidence table; `unseen` says why it does not see the valve."""
    band = found.S / peak_to_peak(part.op)
    why = (
        f"By simulation alone S takes {100.0 * band:.0f} % of the OP's swing; the PV simulated from OP is explained to "
        f"{found.fit:.1f} % with a sticky valve, to {found.fit_linear:.1f} % with a good one."
    )
    against = ["OP does not move the PV"] if unseen else []
    if found.fit <= found.fit_linear and band > FOLLOWS:
        against.append("a good valve explains as much")
    return judge("simulation_error", band, STICKS, FOLLOWS, why, against, source="srinivasan2005")


def _cannot_tell(seen: Findings) -> Diagnosis:
    """A record that no search can judge: nothing is known of its valve but how often valves stick."""
    quality = seen.quality
    first = ("length",) if quality.rows < MIN_SAMPLES else PLAIN_REASONS
    rank = {name: place for place, name in enumerate(first)}
    rejections = sorted(quality.rejections, key=lambda check: rank.get(check.name, len(first)))
    why = (
        " ".join(describe_check(check) for check in rejections[:2])
        or "OP or PV does not vary enough for a search; record while it does."
    )
    saturated = only_saturated(quality)
    action = AT_LIMIT if saturated else "Record the loop again as the reason asks."
    return Diagnosis(
        record=seen.record,
        verdict="undecided",
        probability=UNKNOWN[0],
        probability_before_doubts=UNKNOWN[0],
        cause="saturation" if saturated else "unknown",
        reason=f"The record cannot be judged: {why} The probability told is that of any loop.",
        action=action,
        oscillation=seen.oscillation,
        evidence=seen.evidence,
        quality=quality,
        settings={"undecided": list(UNDECIDED)},
        stored=seen.stored,
    )
