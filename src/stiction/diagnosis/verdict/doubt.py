"""What doubts about the data do to a probability, and to the word of a record that they refuse.

A gate that lowers the confidence says that the record is not what the controller saw. Put through every effect of
`simulation.historian`, sticky loops lose what shows the valve and look like loops with a good one: 11 of 1 738 trials
(79 loops, each effect alone and pairs of them) turned a probability beyond 0.9 into one below 0.1, and in every one of
them some gate had lowered the confidence. Such a record therefore never speaks beyond `LEAST` and
`MOST`; with them none of 2 288 trials (104 loops) turned round.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from stiction.diagnosis.result import Identification
    from stiction.records.quality import Quality

__all__ = ["DOUBTS", "LEAST", "MOST", "HeldBack", "explains_nothing", "held_back", "only_saturated"]

LEAST, MOST = 0.1, 0.9
"""Probabilities beyond which a record in doubt does not speak [-]."""
KEPT = 0.85
"""What the log odds keep for each doubt [-]."""
DOUBTS = (
    *("cycles", "sampling", "compression", "held", "replay", "length", "exception", "averaging", "frozen"),
    *("clock", "missing", "resampled"),
)
"""Gates that draw the odds towards even. The others that lower (resolution, saturation, manual) only hold them back."""
HARMLESS = ("op scale",)
"""Gates that say how to read S and J, and nothing about how sure they are."""
FOLLOWS = ("length", "cycles")
"""Refusals that come of a record cut to pieces by another gate."""
BY_CHANCE = 15.0
"""Share of the PV [%] below which a search says nothing of the valve. With the OP of one simulated loop and the PV of
another (76 pairs of `simulation.population`, seed 61) the better valve explained less than 20 % in 39 % of the pairs;
of 3 400 loops' own PV (seed 51) it explained less than 15 % in 4 %, five of them sticky."""


class HeldBack(NamedTuple):
    """A probability after the doubts."""

    probability: float
    """Probability that the valve sticks [-]."""
    why: str
    """What held it back, in a sentence; empty where nothing did."""


def held_back(probability: float, quality: Quality) -> HeldBack:
    """Draw a probability towards even for each doubt about the data, and keep it from being sure.

    Parameters
    ----------
    probability : float
        Probability from what was found in the record [-].
    quality : Quality
        The gates of the record.

    Returns
    -------
    HeldBack
        The probability that the data allow, never beyond `LEAST` or `MOST` where a gate lowers the confidence, and why.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records import LoopRecord, assess
    >>> k, rng = np.arange(150.0), np.random.default_rng(1)
    >>> record = LoopRecord("FIC-101", 1.0, op=50 + np.sin(k / 3) + 0.1 * rng.normal(size=150), pv=np.cos(k / 3))
    >>> round(held_back(0.999, assess(record)).probability, 3), held_back(0.999, assess(record)).why
    (0.9, 'The data allow no more than 0.90 (length).')
    """
    whole = quality.last - quality.first == quality.rows  # at 0 and 100 % the OP is known, and nothing was left out
    harmless = (*HARMLESS, "saturation") if whole else HARMLESS
    doubts = [gate.name for gate in quality.reservations if gate.name not in harmless]
    if not doubts:
        return HeldBack(probability, "")
    kept = KEPT ** sum(name in DOUBTS for name in doubts)
    sure = min(max(probability, 1e-12), 1.0 - 1e-12)
    drawn = 1.0 / (1.0 + ((1.0 - sure) / sure) ** kept)
    allowed = min(max(drawn, LEAST), MOST)
    named = ", ".join(doubts)
    if math.isclose(allowed, drawn):
        return HeldBack(allowed, f"The data are in doubt ({named}), which makes {probability:.2f} a {allowed:.2f}.")
    bound = f"no more than {MOST:.2f}" if drawn > MOST else f"no less than {LEAST:.2f}"
    return HeldBack(allowed, f"The data allow {bound} ({named}).")


def only_saturated(quality: Quality) -> bool:
    """Whether a record is refused because OP lies at a limit, and for nothing that does not follow from it.

    Parameters
    ----------
    quality : Quality
        The gates of the record.

    Returns
    -------
    bool
        True where saturation refuses and the other refusals, if any, are the shortness of what it leaves.
    """
    names = {gate.name for gate in quality.refusals}
    return "saturation" in names and names <= {"saturation", *FOLLOWS}


def explains_nothing(found: Identification) -> str:
    """Say that OP does not move PV, where neither valve explains more of the PV than it would of any other loop's.

    Parameters
    ----------
    found : Identification
        The comparison that the verdict rests on.

    Returns
    -------
    str
        A sentence; empty where a valve explains more than `BY_CHANCE`.
    """
    best = max(one.fit for one in (found, found.rough or found))
    best = max(best, found.fit_linear)
    if best >= BY_CHANCE:
        return ""
    return (
        f"OP explains no more than {best:.0f} % of the PV's movement, be the valve good or sticky: something else "
        "moves the PV, or OP and PV are not of one loop, and the valve is not seen."
    )
