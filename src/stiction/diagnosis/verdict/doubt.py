r"""What doubts about the data do to a probability, and to the word of a record that they refuse.

A gate that lowers the confidence says that the record is not what the controller saw. Put through every effect of
`simulation.historian`, sticky loops lose what shows the valve and look like loops with a good one: of 2 430 trials (90
loops, each effect alone and pairs of them, seed 95) 46 turned a probability beyond 0.9 into one below 0.1 or the other
way round, and in 45 of them some gate had lowered the confidence, in the last one most of the record was left out.

What is not known of a loop lies between one valve in four, the share of the loops that oscillate because of it (20 to
30 %: [srinivasan2005c]_), and even. A doubt draws the log odds towards that, and none of them to the other side:

.. math:: \ell \to \ell_0 + k\,(\ell - \ell_0), \quad k = F\, G^{n - 1}, \quad
    \ell_0 = \min\{\max\{\ell, -\ln 3\}, 0\}

with n doubts, F = `FIRST` and G = `FURTHER`. A record that may have lost what shows the valve (`HIDES`) does not speak
beyond `LEAST` and `MOST`, nor one whose samples are not the controller's own and few, for a cycle or in all; a coarse
transmitter or a part in manual hides less than that.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from stiction.diagnosis.result import Identification
    from stiction.records.quality import Quality

__all__ = [
    "FAULT_SEEN",
    "HIDES",
    "LEAST",
    "MOST",
    "UNKNOWN",
    "HeldBack",
    "explains_nothing",
    "held_back",
    "only_saturated",
]

UNKNOWN = 0.25, 0.5
"""Probabilities between which a doubt draws nothing [-]: one loop in four, and even."""
FIRST, FURTHER = 0.6, 0.8
"""What the log odds keep for the first doubt, and for each further one [-]."""
HIDES = (
    *("held", "compression", "exception", "averaging", "op resolution", "length", "missing", "resampled"),
    *("saturation", "clock", "frozen", "replay", "most left out"),
)
"""Doubts about records that may have lost what shows the valve."""
LEAST, MOST = 0.1, 0.9
"""Probabilities beyond which these do not speak [-]."""
FEW = 650
"""Samples below which a record that does not show the controller's own ones does not speak beyond these either. Of ten
verdicts on sticky loops that a historian turned round (`fault_injection.py`, seed 301, rules of before) seven were on
records sampled or averaged slower, five of these shorter than that."""
LEFT_OUT = 0.5
"""Share of the record beyond which what was left out might have said something else [-]."""
FAULT_SEEN = 0.5
"""Probability of a faulty sensor or of saturation that explains why OP explains nothing; of saturation, beyond which an
OP at its limit is a finding and no doubt [-]."""
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


def held_back(probability: float, quality: Quality, saturation: float = 0.0, *, own_samples: bool = False) -> HeldBack:
    """Draw a probability towards what is not known for each doubt about the data, and keep it from being sure.

    Parameters
    ----------
    probability : float
        Probability from what was found in the record [-].
    quality : Quality
        The gates of the record.
    saturation : float
        Probability that saturation is what is wrong with the loop [-].
    own_samples : bool
        Whether the record shows the controller's own samples: few of them, for a cycle or in all, then hide nothing.

    Returns
    -------
    HeldBack
        The probability that the data allow, and why.

    References
    ----------
    srinivasan2005c.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records import LoopRecord, assess
    >>> k, rng = np.arange(150.0), np.random.default_rng(1)
    >>> record = LoopRecord("FIC-101", 1.0, op=50 + np.sin(k / 3) + 0.1 * rng.normal(size=150), pv=np.cos(k / 3))
    >>> round(held_back(0.999, assess(record)).probability, 3), held_back(0.999, assess(record)).why
    (0.9, 'The data allow no more than 0.90 (length).')
    """
    doubts = _doubts(quality, saturation)
    few = not own_samples and quality.last - quality.first < FEW
    if not doubts and (not few or LEAST <= probability <= MOST):
        return HeldBack(probability, "")
    sure = min(max(probability, 1e-12), 1.0 - 1e-12)
    unknown = min(max(sure, UNKNOWN[0]), UNKNOWN[1])
    odds, usual = (math.log(p / (1.0 - p)) for p in (sure, unknown))
    kept = FIRST * FURTHER ** (len(doubts) - 1) if doubts else 1.0
    drawn = 1.0 / (1.0 + math.exp(-usual - kept * (odds - usual)))
    named = ", ".join([*doubts, "few samples"] if few and "length" not in doubts else doubts)
    hides = {*HIDES} if own_samples else {*HIDES, "sampling"}
    if LEAST <= drawn <= MOST or not (few or hides & set(doubts)):
        return HeldBack(drawn, f"The data are in doubt ({named}), which makes {probability:.2f} a {drawn:.2f}.")
    allowed = min(max(drawn, LEAST), MOST)
    bound = f"no more than {MOST:.2f}" if drawn > MOST else f"no less than {LEAST:.2f}"
    return HeldBack(allowed, f"The data allow {bound} ({named}).")


def _doubts(quality: Quality, saturation: float) -> list[str]:
    """Names of the gates that lower, but for those that do not matter here."""
    whole = quality.last - quality.first == quality.rows  # at 0 and 100 % the OP is known, and nothing was left out
    harmless = (*HARMLESS, "saturation") if whole or saturation >= FAULT_SEEN else HARMLESS
    doubts = [gate.name for gate in quality.reservations if gate.name not in harmless]
    if quality.last - quality.first < LEFT_OUT * quality.rows:
        doubts.append("most left out")
    return doubts


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
