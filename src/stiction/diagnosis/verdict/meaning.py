"""What a finding means to a reader, and which one counted most."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.diagnosis.verdict.held import value_of
from stiction.display.number_format import format_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.result import Counted

__all__ = ["FEATURES", "PRIOR", "strongest"]

PRIOR = "usual"
"""Name of the constant among what counted: what is known before anything was found."""
FEATURES = {
    "usual": "a loop of which nothing is known",
    "stem": "what the recorded valve position shows; S takes so much of OP's swing",
    "likeness": "likeness to simulated loops that stick, all findings weighed",
    "plant": "likeness to loops that stick as a plant's historian keeps them, all findings weighed",
    "band": "S takes so much of the OP's swing",
    "floor": "S takes at least so much of it",
    "band_here": "S takes so much of the OP's swing in the closer comparison",
    "advantage": "a sticky valve explains the PV better than a good one",
    "better": "a sticky valve explains the PV better than a good one",
    "better_worst": "a sticky valve explains the PV better than a good one, in the stretch where it does least",
    "better_by": "share of the PV that only a sticky valve explains",
    "better_elsewhere": "share of the PV that only a sticky valve explains, in the other comparison",
    "beats_good": "a sticky valve predicts the PV better, cycle by cycle",
    "likelier_than_good": "likelihood of a sticky valve over a good one",
    "likelier_in_part": "likelihood of a sticky valve over a good one, in the third where it is largest",
    "likelier_seen": "likelihood of a sticky valve over a good one, where the controller's own samples show",
    "beats_bent": "a sticky valve predicts the PV better than a good one of any characteristic, cycle by cycle",
    "likelier_than_bent": "likelihood of a sticky valve over a good one of any characteristic",
    "beats_gated": "a sticky valve predicts the PV better than a good one given the past without noise, cycle by cycle",
    "likelier_than_gated": "likelihood of a sticky valve over a good one given the past without noise",
    "beats_relaxation": "a sticky valve predicts the PV better than a good one and what turns at levels of the PV, "
    "cycle by cycle",
    "likelier_than_relaxation": "likelihood of a sticky valve over a good one and what turns at levels of the PV",
    "keeps_over_bent": "share of its likelihood that a sticky valve keeps over a good one of any characteristic",
    "keeps_over_gated": "share of its likelihood that a sticky valve keeps over one given the past without noise",
    "keeps_over_relaxation": "share of its likelihood that a sticky valve keeps over a good one and what turns at "
    "levels of the PV",
    "keeps_over_wave": "share of its likelihood that a sticky valve keeps over a good one and a wave from outside",
    "beats_wave": "a sticky valve predicts the PV better than a good one and a wave from outside, cycle by cycle",
    "likelier_than_wave": "likelihood of a sticky valve over a good one and a wave from outside",
    "beats_beside_wave": "a sticky valve predicts the PV better than a good one, a wave from outside beside both, "
    "cycle by cycle",
    "likelier_beside_wave": "likelihood of a sticky valve over a good one, a wave from outside beside both",
    "beats_any": "a sticky valve predicts the PV better than any good one, cycle by cycle",
    "likelier_than_any": "likelihood of a sticky valve over the likeliest of all good ones",
    "likelier_than_play": "likelihood of a valve that jumps over one that hardly does",
    "likely_jump_clear": "likelihood of a jump beyond what chance gives",
    "own_samples": "the record shows the controller's own samples",
    "likely_band": "S by likelihood takes so much of the OP's swing",
    "likely_jump": "J over S by likelihood",
    "likely_jump_low": "lower end of the interval of J over S",
    "likely_jump_high": "upper end of the interval of J over S",
    "likely_S_low": "lower end of the interval of S over S",
    "likely_S_high": "upper end of the interval of S over S, a third of it",
    "S_low": "lower end of the rough interval of S over S",
    "S_high": "upper end of the rough interval of S over S, a third of it",
    "significance": "the difference is more than chance",
    "grip": "band times share of the PV explained",
    "fit": "share of the PV that a sticky valve explains",
    "fit_linear": "share of the PV that a good valve explains",
    "at_limit": "share of the record with OP at 0 or 100 %",
    "saturated": "share of the record with OP at a limit",
    "share": "share of the error that the oscillation carries",
    "others": "share of the error that other oscillations carry",
    "wander": "the amplitude changes from period to period",
    "decay": "the oscillation dies out",
    "regularity": "regularity of the oscillation",
    "oscillating": "the loop oscillates",
    "own_period": "valve, process and controller found cycle with the record's period",
    "own_amplitude": "valve, process and controller found cycle with the record's amplitude",
    "own_limit": "the period is that of a loop at its limit of stability",
    "margin": "how near a good valve's loop is to its limit of stability",
    "time_constant": "time constant of the process in periods",
    "time_constant_linear": "time constant that a good valve would need",
    "skew_pv": "PV leans to one side",
    "skew_op": "OP leans to one side",
    "tails_pv": "PV has peaks",
    "tails_op": "OP has peaks",
    "coarse": "PV is coarse",
    "still": "PV rests while OP moves",
    "spikes": "PV has spikes",
    "set_point": "share of the PV that the set point moves",
    "jump": "slip jump as a share of S",
    "better_with_jump": "a jump is needed to explain the PV",
    "shape_op": "shape of OP by He's method",
    "shape_pv": "shape of PV by Haegglund's method",
    "votes": "votes of the published methods",
    "integrating": "the process integrates",
}
"""What a feature means to a reader; the others go by their name."""


def strongest(counted: Sequence[Counted], *, against: bool = False) -> str:
    """Say which finding counted most for stiction, or against it.

    Parameters
    ----------
    counted : sequence of Counted
        What each finding did to the probability of stiction.
    against : bool
        Whether the one against it is asked for.

    Returns
    -------
    str
        What it is, with its value and the usual one; empty where no finding speaks that way.

    Examples
    --------
    >>> from stiction.diagnosis.result import Counted
    >>> strongest([Counted("usual", math.nan, math.nan, 3.0), Counted("band", 0.7, 0.31, 2.4)])
    "S takes so much of the OP's swing (0.7 or more, usually 0.31)"
    """
    sign = -1.0 if against else 1.0
    found = [one for one in counted if one.feature != PRIOR and sign * one.log_odds > 0.0]
    if not found:
        return ""
    most = max(found, key=lambda one: sign * one.log_odds)
    usually = f", usually {format_number(most.usual, significant=2)}" if math.isfinite(most.usual) else ""
    meaning = FEATURES.get(most.feature, most.feature.replace("_", " "))
    return f"{meaning} ({value_of(most)}{usually})"
