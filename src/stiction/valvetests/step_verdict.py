"""Verdict of a step test in words, and its open questions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.valvetests.stem_signal import no_response_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.valvetests.result import Estimate, Verdict
    from stiction.valvetests.step_readings import NoResponse
    from stiction.valvetests.step_result import BandReading, Step

__all__ = ["open_questions", "step_verdict"]


MAX_OPPOSITE_SHARE = 0.25
"""Largest share of responses in the opposite direction, caused by noise [-]."""


def step_verdict(
    steps: Sequence[Step],
    readings: Sequence[BandReading],
    S: Estimate,
    still: NoResponse,
    limit: float,
    signal: str,
) -> tuple[Verdict, str]:
    """Verdict on deadband plus stickband S [% of span], read from `signal`.

    Noise hides the start of a response, so that a reading is too large. The hidden travel is subtracted before a
    reading counts against the limit. The lower end of a reading is travel without a response.
    """
    what = "stem" if signal == "mv" else "flow"
    ways = [(step.stem_after - step.stem_before) * (step.op_after - step.op_before) for step in steps if step.responded]
    op_range = float(np.ptp([steps[0].op_before, *(step.op_after for step in steps)]))
    if not ways and op_range > limit and signal == "pv":
        return "undecided", no_response_text(op_range)
    against = min(sum(way < 0.0 for way in ways), sum(way > 0.0 for way in ways))
    if against > MAX_OPPOSITE_SHARE * len(ways):
        return "undecided", (
            f"The {what} moved against the OP in {against} of {len(ways)} responses and with the OP in the others: "
            "something else moves it. Make the steps in manual, while nothing but OP moves it."
        )
    least = S.low - still.hidden
    text = (
        f"S, deadband plus stickband, is {S.value:.3g} % "
        f"(at least {min(max(least, still.sure, 0.0), S.value):.3g} %), limit {limit:g} %."
    )
    if least > limit:
        return "beyond limit", text
    if still.sure > limit:
        return "beyond limit", (
            f"The {what} did not respond to {still.travel:.3g} % of OP travel, so S, deadband plus stickband, is at "
            f"least {still.sure:.3g} %; limit {limit:g} %."
        )
    if not ways:
        return (
            "undecided",
            f"The {what} did not respond to {op_range:.3g} % of OP travel; limit {limit:g} %. Use larger steps.",
        )
    if not S.known:
        return "undecided", "The test does not show S, deadband plus stickband (no reversal with a response)."
    finest = min(r.step for r in readings if r.kind == "reversal")
    # If noise hides whole steps, the response before the reversal may be detected late and S be too small.
    if S.value + (still.hidden if still.hidden > finest else 0.0) <= limit * (1.0 + 1e-9):
        return "within limit", text
    if still.hidden > finest:
        return "undecided", f"{text} Noise hides responses below {still.hidden:.3g} %: use longer steps."
    return "undecided", f"{text} {_finer_steps_text(steps, finest)}"


def open_questions(
    signal: str, steps: Sequence[Step], turned: Sequence[BandReading], onwards: Sequence[BandReading]
) -> tuple[str, ...]:
    """Quantities that the test does not show, and the test that would show them."""
    lines = ["A step test cannot measure r. Use a ramp test."]
    if not any(step.responded for step in steps):
        what = "stem" if signal == "mv" else "flow"
        return (*lines, f"S, deadband and resolution: the {what} never responded. Use larger steps.")
    if not turned:
        lines.append(
            "S and deadband: no reversal with a response before and after it. Use steps up and down that are larger "
            "than S."
        )
    elif all(r.reading <= r.step * 1.001 for r in turned):
        finest = min(r.step for r in turned)
        lines.append(f"S below {finest:.3g} %: every reversal {_first_step_text(steps, finest)}")
    if not onwards:
        lines.append("resolution: no two responses in the same direction. Use larger steps.")
    elif all(r.reading <= r.step * 1.001 for r in onwards):
        finest = min(r.step for r in onwards)
        lines.append(f"resolution below {finest:.3g} %: every move onwards {_first_step_text(steps, finest)}")
    if not any(math.isfinite(step.t63) for step in steps):
        lines.append("response times: no response is clearly above the noise.")
    if signal == "pv":
        lines.append("the stem itself: times and overshoot are those of the flow, its sensor included.")
    return tuple(lines)


def _first_step_text(steps: Sequence[Step], read: float) -> str:
    """Text for a response to the first step of `read` [% of span], with advice for a finer reading."""
    finest = min(abs(step.op_after - step.op_before) for step in steps)
    among = f" of {read:.3g} %; steps of {finest:.3g} % had no response" if finest < 0.999 * read else ""
    return f"had a response to its first step{among}. {_finer_steps_text(steps, read)}"


def _finer_steps_text(steps: Sequence[Step], read: float) -> str:
    """Advice for a finer reading than steps of `read` [% of span]."""
    finest = min(abs(step.op_after - step.op_before) for step in steps)
    if finest < 0.999 * read:
        return f"The steps of {finest:.3g} % did not go far enough: widen the fine range (--fine-range)."
    return "Use finer steps."
