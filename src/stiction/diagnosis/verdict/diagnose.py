"""The main question: whether the valve sticks, how much, how sure that is, and what to do."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection import detect_all
from stiction.diagnosis.identification import identify
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.result import Diagnosis, Evidence, Identification
from stiction.diagnosis.verdict.cause import other_cause, sticky_cause
from stiction.diagnosis.verdict.probability import UNDECIDED, features, probability
from stiction.errors import RecordError
from stiction.records.quality import assess, usable_part

if TYPE_CHECKING:
    from stiction.diagnosis.result import Oscillation
    from stiction.records.quality import Quality
    from stiction.records.record import LoopRecord

__all__ = ["diagnose"]

SHORTEST_PERIOD = 8
"""Samples per period below which a local mean over one period says nothing about the valve."""
DOUBTS = (
    *("cycles", "sampling", "compression", "held", "replay", "length", "exception", "averaging", "frozen"),
    *("clock", "missing", "resampled"),
)
"""Gates whose reservation draws the odds towards even."""
PLAIN_REASONS = ("missing", "op moves", "pv moves", "manual", "saturation")
"""Refusals that others follow from; that of a record which is too short as a whole comes before them."""


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
        When the record has no PV at all.

    Notes
    -----
    The probability follows from the joint identification of valve and process (see `verdict.probability`); the
    methods of the evidence table are shown beside it with their condition of validity.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> st.diagnose(st.simulate(loop, sp=10.0, duration=2000.0, loop_type="flow")).verdict
    'stiction'
    """
    if record.pv is None:
        raise RecordError(f"{record.tag} has no PV; a diagnosis needs OP and PV.")
    if record.sp is not None and not np.isfinite(record.sp).any():
        record = replace(record, sp=None)
    part = usable_part(record)
    oscillation = find_oscillation(part)
    quality = assess(record, oscillation.period if oscillation.oscillating else None)
    evidence = detect_all(part, oscillation)
    found, speaks = _identify(part, oscillation) if quality.usable else ((), 0)
    if not found:
        return _cannot_tell(record, oscillation, evidence, quality)
    swing = float(np.ptp(part.op[np.isfinite(part.op)]))
    says = features([one.rough or one for one in found], swing, oscillating=oscillation.oscillating)
    sure = probability(says, sum(gate.name in DOUBTS for gate in quality.reservations))
    main = found[speaks]
    sticky = sticky_cause(main)
    follows = main.fit_linear > 80.0
    if sticky.name == "deadband" and sure > UNDECIDED[0]:
        sure = 0.2 * sure
        cause = sticky
    elif sure >= UNDECIDED[0]:
        cause = sticky
    else:
        cause = other_cause(part, main, oscillation, quality, follows)
    verdict = "stiction" if sure > UNDECIDED[1] else "no_stiction" if sure < UNDECIDED[0] else "undecided"
    reason, action, name = cause.reason, cause.action, cause.name
    if verdict == "undecided":
        name = "unknown"
        reason = f"The data do not decide: {reason[0].lower()}{reason[1:]}"
        action = "Record more cycles at a faster sampling, or stroke the valve with a ramp in manual."
    return Diagnosis(
        record=record,
        verdict=verdict,
        probability=sure,
        cause=name,
        reason=reason,
        action=action,
        oscillation=oscillation,
        evidence=(_own_row(main, says.band, sure, swing), *evidence),
        quality=quality,
        identification=main,
        settings={"model": main.model, "undecided": list(UNDECIDED), "features": says._asdict()},
    )


def _identify(part: LoopRecord, oscillation: Oscillation) -> tuple[tuple[Identification, ...], int]:
    """Compare about the local mean over one period, where there is one, and about the mean of the record.

    Returns both and which of them speaks: the one about the period where the loop oscillates, else the one that
    explains more. Only that one is searched closely.
    """
    periods: list[float | None] = [None]
    if SHORTEST_PERIOD * part.dt < oscillation.period < part.duration / 2.0:
        periods.insert(0, oscillation.period)
    try:
        if oscillation.oscillating or len(periods) == 1:
            return tuple(identify(part, period=period, closer=i == 0) for i, period in enumerate(periods)), 0
        found = [identify(part, period=period, closer=False) for period in periods]
        main = max(range(len(found)), key=lambda i: found[i].fit)
        found[main] = identify(part, period=periods[main])
    except RecordError:
        return (), 0
    return tuple(found), main


def _own_row(found: Identification, band: float, sure: float, swing: float) -> Evidence:
    """The identification as a row of the evidence table."""
    vote = "stiction" if sure > UNDECIDED[1] else "no_stiction" if sure < UNDECIDED[0] else "undecided"
    return Evidence(
        method="simulation_error",
        index=band,
        threshold=0.45,
        vote=vote,
        valid=True,
        why=(
            f"S takes {100.0 * found.S / swing:.0f} % of the OP's swing; the PV simulated from OP is explained to "
            f"{found.fit:.1f} % with a sticky valve, to {found.fit_linear:.1f} % with a good one."
        ),
        source="srinivasan2005",
    )


def _cannot_tell(
    record: LoopRecord, oscillation: Oscillation, evidence: tuple[Evidence, ...], quality: Quality
) -> Diagnosis:
    """A record that no search can judge."""
    first = ("length",) if any(g.name == "length" and quality.rows < g.limit for g in quality.gates) else PLAIN_REASONS
    refusals = sorted(quality.refusals, key=lambda gate: first.index(gate.name) if gate.name in first else len(first))
    why = " ".join(gate.why for gate in refusals[:2]) or "OP or PV does not vary enough for a search."
    return Diagnosis(
        record=record,
        verdict="undecided",
        probability=0.5,
        cause="unknown",
        reason=f"The record cannot be judged: {why}",
        action="Record the loop again as the reason asks.",
        oscillation=oscillation,
        evidence=evidence,
        quality=quality,
        settings={"undecided": list(UNDECIDED)},
    )
