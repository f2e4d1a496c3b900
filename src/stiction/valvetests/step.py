"""Step test: S, deadband, resolution and response time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError, Setting, require_positive
from stiction.records.quantiles import robust_std
from stiction.records.record import require_record
from stiction.valvetests.segmentation import Segment, quantisation_step, segment_signal
from stiction.valvetests.stem_signal import MAX_ROUNDING_STEP, read_stem, reject_feedback
from stiction.valvetests.step_readings import (
    band_readings,
    deadband_only,
    find_no_response,
    median_estimate,
    step_rounded_estimate,
)
from stiction.valvetests.step_response import measure_response
from stiction.valvetests.step_result import Step, StepTest
from stiction.valvetests.step_verdict import open_questions, step_verdict

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.records import LoopRecord
    from stiction.valvetests.stem_signal import StemSignal

__all__ = ["analyse_steps"]

MAX_OP_NOISE = 0.5
"""OP noise above which the OP is not a test signal [% of span]."""
MIN_STEP = 1e-3
"""OP moves below this are not steps [% of span]."""
STEP_TEST_NEEDS = ("a step test needs the loop in manual: see ", Setting("plan_step_test"), ".")


def analyse_steps(record: LoopRecord, *, signal: str | None = None, limit: float = 1.0) -> StepTest:
    """Read a valve's deadband, resolution and response time from a test of held steps.

    Parameters
    ----------
    record : LoopRecord
        OP [% of span] moved in steps that are held, with the loop in manual, and the valve position `mv` or a
        flow `pv`.
    signal : {"mv", "pv"}, optional
        Signal that shows the stem; by default `mv` where it was recorded, else `pv`.
    limit : float
        Limit on deadband plus stickband, S [% of span].

    Returns
    -------
    StepTest

    Raises
    ------
    RecordError
        When the OP has no steps or reacts to PV, the stem was not recorded, or more than a fifth of it is missing.
    ParameterError
        When `signal` is unknown or `limit` is not positive.

    Notes
    -----
    A reading is rounded up to a step. ISA-75.25.01 reads a dead band from the turning point; it depends on where in
    the stick band the reversal starts and lies between S and S + J: here it is `reversal_travel`, and deadband is S
    - J, as everywhere. Read from the last response the travel is S. The verdict is on S, as in a ramp test: deadband
    and resolution J together. ISA's dead band and resolution would count the jump twice. Held steps do not
    show the rate r: every published two- and three-parameter model gives the same stem for them.

    References
    ----------
    isa75_25_01, after: the terms dead band, resolution, dead time, T63, T86 and T98. The limit of 1 % on backlash and
    stiction together is customary (entech1998, after).

    Examples
    --------
    >>> import stiction as st
    >>> plan = st.plan_step_test(50.0, fine_step=0.1, fine_range=8.0, sizes=[], hold=5.0)
    >>> test = st.analyse_steps(st.stroke(st.Kano(S=3.0, J=1.0), plan.op, plan.dt))
    >>> round(test.S.value, 1), round(test.resolution.value, 1)
    (3.1, 1.1)
    """
    require_record(record)
    limit = require_positive("limit", limit, "% of span")
    settings = {"signal": signal, "limit": limit}
    reading = read_stem(record, signal, 0.0)
    holds = _find_holds(reading, record.tag)
    sigma, rounding = _stem_noise(reading, holds)
    steps, smallest = _measure_steps(reading, holds, sigma, rounding)
    readings = band_readings(steps)
    turned = [r for r in readings if r.kind == "reversal"]
    onwards = [r for r in readings if r.kind == "resolution"]
    reversal, fine = (
        step_rounded_estimate([r.reading for r in turned], turned),
        step_rounded_estimate([r.reading for r in onwards], onwards),
    )
    S = step_rounded_estimate([r.from_last_move for r in turned], turned)
    unknown = open_questions(reading.signal, steps, turned, onwards)
    still = find_no_response(steps, smallest, reading.signal == "mv")
    verdict, reason = step_verdict(steps, readings, S, still, limit, reading.signal)
    dead_time, t63, t86, t98, overshoot = (
        median_estimate([getattr(s, name) for s in steps]) for name in ("dead_time", "t63", "t86", "t98", "overshoot")
    )
    return StepTest(
        record, reading.signal, verdict, reason, limit, unknown, settings,
        deadband=deadband_only(steps, reading.signal == "mv", S, fine), resolution=fine, S=S, reversal_travel=reversal,
        reversal_range=(S.low, S.high + fine.high), dead_time=dead_time, t63=t63, t86=t86, t98=t98,
        overshoot=overshoot, smallest_response=smallest, steps=steps, readings=readings,
    )  # fmt: skip


def _find_holds(reading: StemSignal, tag: str) -> list[Segment]:
    op = reading.op
    change = np.diff(op)
    sigma = robust_std(change) / math.sqrt(2.0)
    if sigma > MAX_OP_NOISE:
        raise RecordError(
            f"The OP of {tag} moves by {sigma:.2g} % from sample to sample and has no step (is the loop in "
            "automatic?); ",
            *STEP_TEST_NEEDS,
            " For a record of normal operation use diagnose.",
        )
    reject_feedback(reading, tag, STEP_TEST_NEEDS)
    pieces = segment_signal(reading.time, op, max(sigma, 1e-3))
    holds = [piece for piece in pieces if piece.slope == 0.0]
    if sum(piece.n for piece in holds) < 0.5 * op.size:
        raise RecordError(
            f"The OP of {tag} is not constant between moves",
            remedy=("use ", Setting("analyse_ramp"), " for ramps, or hold each step"),
        )
    if np.abs(np.diff([hold.level for hold in holds])).max(initial=0.0) < MIN_STEP:
        raise RecordError(
            f"The OP of {tag} has no step", remedy=("move it as in the plan of ", Setting("plan_step_test"))
        )
    return holds


def _stem_noise(reading: StemSignal, holds: Sequence[Segment]) -> tuple[float, float]:
    """Noise of the stem within the second halves of the holds, and its rounding [unit of the stem]."""
    left: list[NDArray[np.float64]] = []
    freedom = 0
    for hold in holds:
        late = reading.stem[hold.first + hold.n // 2 : hold.last]
        left.append(late - late.mean())
        freedom += late.size - 1
    rest = np.concatenate(left)
    spread = robust_std(rest, centre=0.0) * math.sqrt(rest.size / max(freedom, 1))
    # Few samples per hold and a rounded signal leave a median of 0 where there is noise.
    spread = max(spread, 0.7 * math.sqrt(float(rest @ rest) / max(freedom, 1)))
    scale = 1.0 if reading.signal == "mv" else float(np.ptp(reading.stem) / max(np.ptp(reading.op), 1e-9))
    return spread, quantisation_step(reading.stem, MAX_ROUNDING_STEP * scale)


def _measure_steps(
    reading: StemSignal, holds: Sequence[Segment], sigma: float, rounding: float
) -> tuple[tuple[Step, ...], float]:
    """Every step with its response, and the smallest visible response [unit of the stem]."""
    stem = reading.stem
    scale = 1.0 if reading.signal == "mv" else float(np.ptp(stem) / max(np.ptp(reading.op), 1e-9))
    floor = max(0.6 * rounding, 0.02 * scale)
    late = [stem[hold.first + hold.n // 2 : hold.last] for hold in holds]
    rest, weight = float(late[0].mean()), late[0].size
    table: list[Step] = []
    heading, smallest = 0.0, floor
    for before, hold, level in zip(holds, holds[1:], late[1:], strict=False):
        doubt = max(3.5 * sigma * math.sqrt(1.0 / level.size + 1.0 / weight), floor)
        smallest = max(smallest, doubt)
        final = float(level.mean())
        size = hold.level - before.level
        if abs(size) < MIN_STEP:
            rest, weight = final, level.size
            continue
        responded = abs(final - rest) > doubt
        reversal = responded and heading * size < 0.0
        numbers = (math.nan,) * 5
        if responded:
            part = slice(max(hold.first - 1, 0), hold.last)
            noise = max(sigma, 0.3 * rounding)
            numbers = measure_response(reading.time[part], stem[part], hold.start, rest, final, noise)
        table.append(Step(hold.start, before.level, hold.level, rest, final, responded, reversal, *numbers))
        if responded:
            rest, weight, heading = final, level.size, math.copysign(1.0, size)
        else:
            rest, weight = (rest * weight + final * level.size) / (weight + level.size), weight + level.size
    return tuple(table), smallest
