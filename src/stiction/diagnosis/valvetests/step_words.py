"""What a step test says in words: the verdict, and what it leaves unknown."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.valvetests.reading import no_answer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.valvetests.result import Estimate, Verdict
    from stiction.diagnosis.valvetests.step_result import BandReading, Step

__all__ = ["judge_steps", "steps_not_known"]


def judge_steps(
    steps: Sequence[Step], deadband: Estimate, fine: Estimate, limit: float, signal: str
) -> tuple[Verdict, str]:
    """Verdict on deadband plus resolution [% of span], read from `signal`."""
    if not any(step.responded for step in steps):
        travel = float(np.ptp([steps[0].op_before, *(step.op_after for step in steps)]))
        if travel > limit and signal == "pv":
            return "undecided", no_answer(travel)
        if travel > limit:
            return "beyond limit", f"The stem did not respond to {travel:.3g} % of OP travel; limit {limit:g} %."
        return "undecided", f"The stem did not respond, but the OP moved by {travel:.3g} % only."
    if not deadband.known or not fine.known:
        missing = "deadband (no reversal with a response)" if not deadband.known else "resolution"
        return "undecided", f"The test does not show the {missing}."
    total, least = deadband.value + fine.value, deadband.low + fine.low
    text = (
        f"Deadband {deadband.value:.3g} % plus resolution {fine.value:.3g} % is {total:.3g} % "
        f"(at least {least:.3g} %), limit {limit:g} %."
    )
    if total <= limit * (1.0 + 1e-9):
        return "within limit", text
    if least > limit:
        return "beyond limit", text
    return "undecided", f"{text} Finer steps would tell."


def steps_not_known(
    signal: str, steps: Sequence[Step], turned: Sequence[BandReading], onwards: Sequence[BandReading]
) -> tuple[str, ...]:
    """Say what the test cannot tell and what would."""
    lines = ["r: held steps look the same at every r; use a ramp test."]
    if not any(step.responded for step in steps):
        what = "stem" if signal == "mv" else "flow"
        return (*lines, f"deadband and resolution: the {what} never responded. Step further.")
    if not turned:
        lines.append("deadband: no reversal with a response before and after it. Step up and down, further than S.")
    elif all(r.reading <= r.step * 1.001 for r in turned):
        finest = min(r.step for r in turned)
        lines.append(f"deadband below {finest:.3g} %: every reversal answered its first step. Use finer steps.")
    if not onwards:
        lines.append("resolution: no two responses in the same direction. Step further.")
    elif all(r.reading <= r.step * 1.001 for r in onwards):
        finest = min(r.step for r in onwards)
        lines.append(f"resolution below {finest:.3g} %: every step was answered. Use finer steps.")
    if not any(math.isfinite(step.t63) for step in steps):
        lines.append("response times: no response stands clear of the noise.")
    if signal == "pv":
        lines.append("the stem itself: times and overshoot are those of the flow, its sensor included.")
    return tuple(lines)
