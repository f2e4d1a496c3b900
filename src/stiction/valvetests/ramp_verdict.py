"""Verdict of a ramp test in words, and its open questions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.valvetests.stem_signal import no_response_text

if TYPE_CHECKING:
    from stiction.valvetests.friction_fit import FrictionFit
    from stiction.valvetests.ramp_intervals import SystematicError
    from stiction.valvetests.result import Estimate, Ramp, Verdict
    from stiction.valvetests.stem_signal import StemSignal

__all__ = ["open_questions", "ramp_verdict"]

MAX_NEGATIVE_VALUE = 0.25
"""Largest negative value that noise gives a quantity in a good test [% of span], also as a share of S."""


def ramp_verdict(
    sb: Estimate,
    sj: Estimate,
    S: Estimate,
    stuck: float,
    limit: float,
    signal: str,
    doubt: SystematicError | None = None,
) -> tuple[Verdict, str]:
    """Verdict on deadband plus stickband S [% of span], read from `signal`; the intervals include `doubt`.

    `stuck` is the longest OP travel without any slip [% of span]. A stem that starts in
    the middle of its band of S + J can rest that long with half of it as S.
    """
    allowed = MAX_NEGATIVE_VALUE * max(1.0, S.value if S.known else 0.0)
    for key, name, estimate in (("S", "S, deadband plus stickband,", S), ("sb", "sb", sb), ("sj", "sj", sj)):
        # A systematic error can put an interval below 0 in a good test too, so only scatter counts.
        known = doubt.bounds(key)[0] if doubt else 0.0
        lowest = estimate.low + known if math.isfinite(estimate.low) else estimate.value
        if lowest < -allowed:
            return "undecided", (
                f"{name} is {estimate.text()}, below 0, which no valve can have: the slips do not follow OP. Ramp in "
                "manual, while nothing but OP changes the flow."
            )
    if not S.known:
        if stuck > limit and signal == "pv":
            return "undecided", no_response_text(stuck)
        if 0.5 * stuck > limit:
            return (
                "beyond limit",
                f"The stem did not move over {stuck:.3g} % of OP travel, so S, deadband plus stickband, is at least "
                f"{0.5 * stuck:.3g} %; limit {limit:g} %.",
            )
        return "undecided", "S, deadband plus stickband, cannot be measured by this test."
    text = f"S, deadband plus stickband, is {S.text()}, limit {limit:g} %."
    if math.isfinite(S.low) and S.low <= limit <= S.high:
        return "undecided", f"{text} The limit lies within the interval."
    return ("within limit" if S.value <= limit else "beyond limit"), text


def open_questions(
    reading: StemSignal,
    ramps: tuple[Ramp, ...],
    fit: FrictionFit | None,
    stuck: float,
    r_low: float,
    r_high: float,
    contradiction: bool,
) -> tuple[str, ...]:
    """Quantities that the test does not show, and the test that would show them."""
    lines: list[str] = []
    if fit is None and all(ramp.behaviour == "follow" for ramp in ramps):
        smallest = min(ramp.smallest_stair for ramp in ramps)
        what, unit = ("stem", "%") if reading.signal == "mv" else ("flow", "of its unit")
        lines.append(
            f"sb, sj and r: the {what} followed every ramp; slips below {smallest:.2g} {unit} cannot be detected."
        )
        return tuple(lines)
    if fit is None:
        never = "the stem never moved; it" if reading.signal == "mv" else "the flow never reacted; it"
        lines.append(f"sb, sj and r: {never} rested over up to {stuck:.3g} % of OP travel. Use longer ramps.")
        return tuple(lines)
    if not fit.both_directions:
        lines.append(
            "the zero: slips in one direction only, so the position was assumed to equal OP without friction. "
            "Ramp up and down."
            if reading.signal == "mv"
            else "sb and deadband: slips in one direction only, so the stick band cannot be separated from the zero "
            "of the flow. Ramp up and down."
        )
    if reading.signal == "pv" and fit.systematic_error.late > 0.0:
        pace = max(abs(ramp.rate) for ramp in ramps)
        lines.append(
            f"lag from deadband: the slips came at one rate, {pace:.3g} %/s, at which the lag and the dead time of the "
            f"flow look like deadband and make S too large, by up to {2.0 * pace:.2g} % per second of each. The "
            f"intervals allow for the {fit.systematic_error.late / pace:.2g} s that a slip took to show. Use a "
            "second rate of at most half of it."
        )
    lines += _rate_questions(ramps, r_low, r_high, contradiction)
    if fit.sb.known and fit.sb.n < 3:
        lines.append(f"intervals: {fit.sb.n} slip{'s' if fit.sb.n > 1 else ''} only. Repeat the ramp.")
    coarse = [ramp for ramp in ramps if ramp.behaviour == "cannot tell"]
    lines += [f"what happened at {abs(ramp.rate):.3g} %/s: {ramp.reason}." for ramp in coarse]
    blurred = [f"{abs(ramp.rate):.3g}" for ramp in ramps if "regularity" in ramp.reason]
    if blurred:
        rates = ", ".join(dict.fromkeys(blurred))
        lines.append(f"each slip at {rates} %/s: the noise hides them; they were counted by their regularity.")
    if reading.signal == "pv":
        lines.append(
            "the travel itself: it was read from the flow, as if flow were proportional to travel in this range."
        )
    return tuple(lines)


def _rate_questions(ramps: tuple[Ramp, ...], r_low: float, r_high: float, contradiction: bool) -> list[str]:
    if contradiction:
        return [
            f"r: stairs at {r_high:.3g} %/s but following at {r_low:.3g} %/s; r varies over the travel or the "
            "direction, or noise hides the stairs. See the table of ramps."
        ]
    if math.isnan(r_low) and math.isnan(r_high):
        return ["r: no ramp shows clearly whether the stem moves in stairs or follows. Use longer ramps."]
    if math.isnan(r_low):
        smallest = min(ramp.smallest_stair for ramp in ramps)
        return [
            f"r: the stem followed every rate, so r is at most {r_high:.3g} %/s, or the stairs are smaller than "
            f"{smallest:.2g} %. "
            "Use slower ramps."
        ]
    if math.isnan(r_high):
        return [f"r: every rate gave stairs, so r is above {r_low:.3g} %/s. Use faster ramps."]
    return []
