r"""What doubts about the data do to a probability, and to the word of a record that they refuse.

A gate that lowers the confidence says that the record is not what the controller saw. Put through the effects of
`simulation.historian`, alone and in pairs, sticky loops lose what shows the valve and look like loops with a good
one; few go the other way. A record that may have lost it does not speak beyond `LEAST` and `MOST`: one that certain
gates call in question (`HIDES`), or others by more than `BEYOND`, one whose OP is rounded to few steps (`STEPS`) or
seldom turns round, one much of which is left out (`KEPT`), and one whose samples are not the controller's own and few
(`FEW`, but for `SURELY`); unless only rows are missing and it is plain what the others say (`PLAINLY`).
`contradiction` says what else keeps a probability from being sure. The limits were chosen so that no trial turns a
probability beyond 0.9 into one below 0.1, or back, and few sound records are bound; `docs/verdict-measured.md` says
which trials chose and which only counted.

What is not known of a loop lies between one valve in four, the share of the loops that oscillate because of it (20 to
30 %: [srinivasan2005c]_), and even. Each doubt draws the log odds towards that, and none of them to the other side:

.. math:: \ell \to \ell_0 + k\,(\ell - \ell_0), \quad k = F\, G^{n - 1}, \quad
    \ell_0 = \min\{\max\{\ell, -\ln 3\}, 0\}

with n doubts, F = `FIRST` and G = `FURTHER`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from stiction.diagnosis.verdict.objection import Objection
from stiction.display.number_format import format_probability

if TYPE_CHECKING:
    from stiction.records.assess import Quality

__all__ = [
    "BEYOND",
    "FAULT_SEEN",
    "FEW",
    "HIDES",
    "KEPT",
    "LEAST",
    "MOST",
    "PLAINLY",
    "ROWS",
    "SPIKES",
    "STEPS",
    "SURELY",
    "UNKNOWN",
    "HeldBack",
    "held_back",
    "only_saturated",
]

UNKNOWN = 0.25, 0.5
"""Probabilities between which a doubt draws nothing [-]: one loop in four, and even."""
FIRST, FURTHER = 0.9, 0.8
"""What the log odds keep for the first doubt, and for each further one [-]."""
HIDES = (
    *("exception reporting", "moving average", "clock jumps", "length", "manual", "storage rate", "historian outages"),
    *("outliers", "resampled", "saturation", "copied data"),
)
"""Gates that lower the confidence in a record that may have lost what shows the valve. Where the clock jumped rows may
be lost, and a stem that rests after every sample goes on from elsewhere."""
BEYOND = {"missing values": 10.0, "held values": 5.0, "compression": 2.0}
"""Those that may hide or feign a slip beyond a value, whether or not they lower: missing and held samples [%], OP on
exactly straight lines [%]."""
STEPS = 100.0
"""Steps that OP swings over below which they may hide a slip [-]."""
NO_MORE = {Objection.SMALL_BAND: UNKNOWN[0], Objection.FEW_TURNS: UNKNOWN[1]}
"""Objections to a sticking valve that leave it no more than so much [-]."""
LEAST, MOST = 0.1, 0.9
"""Probabilities beyond which these do not speak [-]."""
FEW = 880
"""Samples below which a record that does not show the controller's own ones does not speak beyond these either [-]."""
KEPT = 0.75
"""Share of the record below which what was left out might have said something else [-]."""
FAULT_SEEN = 0.5
"""Probability of a faulty sensor or of saturation that explains why OP explains nothing, and beyond which spikes of the
PV, or an OP at its limit, are a finding and no doubt [-]."""
SPIKES = 5.0
"""Values far off all others beyond which they are the finding and no doubt where the transmitter is to blame [-]: a
historian writes a code for a bad value a few times, a loose contact makes spikes all the time."""
TOLD = 0.02
"""Change of the probability up to which doubts are named without it [-]."""
SURELY, SLIGHT = 0.05, (Objection.FEW_SAMPLES, "sampling", Objection.JUMP_LIKELY, Objection.JUMP_OPEN)
"""Probability below which few samples, in all or for a cycle, a likely jump and a J that is open are no bound by
themselves [-]: of 8 000 loops (seeds 10, 12, 13, 14) 620 are told less in spite of the first three, three of which
stick; of 2 800 (seeds 31 and 32) 94 in spite of the last, none of which does."""
BOTH = 0.01
"""The same where samples are few in all and for a cycle, or less than half of `FEW` [-]: of means, or of every ninth
sample, a sticky loop may look like a good one or like one with play. Of 2 000 loops (seed 17) five are told between
this and `SURELY` for few of a cycle, of 700 (seed 9801) one for less than half, and none of them sticks; and three of
18 000 trials of `tests/diagnosis/verdict/fault_injection.py` (seeds 936, 938, 939), which were surely sticky before."""
PLAINLY, ROWS = 0.005, (Objection.MUCH_LEFT_OUT, "clock jumps", "missing values", "historian outages", "copied data")
"""Probability below which rows that are lost, left out or repeated are no bound by themselves [-]: the others are what
the controller saw, and what smears these (means, lines, steps) bounds as ever. Of 2 000 loops (`simulation.population`,
1 000 each of seeds 17 and 18) some 50 are told less in spite of them, none of which sticks, and no sticky loop that was
sure is told so by the effects of `tests/diagnosis/verdict/fault_injection.py` (seed 935)."""
HARMLESS = ("op scale", "op reversals")
"""Gates that draw nothing: one says how to read S and J, the other that friction was hardly seen, not that it was seen
badly."""
FOLLOWS = ("length", "cycles")
"""Refusals that come of a record cut to pieces by another gate."""


class HeldBack(NamedTuple):
    """A probability after the doubts."""

    probability: float
    """Probability that the valve sticks [-]."""
    why: str
    """What held it back, in a sentence; empty where nothing did."""


def held_back(
    probability: float,
    quality: Quality,
    saturation: float = 0.0,
    sensor: float = 0.0,
    *,
    own_samples: bool = False,
    valve_seen: bool = True,
    against: tuple[Objection, ...] = (),
    against_sticking: tuple[Objection, ...] = (),
) -> HeldBack:
    """Draw a probability towards what is not known for each doubt about the data, and keep it from being sure.

    Parameters
    ----------
    probability : float
        Probability from what was found in the record [-].
    quality : Quality
        The data checks of the record.
    saturation : float
        Probability that saturation is what is wrong with the loop [-].
    sensor : float
        Probability that the transmitter is [-].
    own_samples : bool
        Whether the record shows the controller's own samples: few of them, for a cycle or in all, then hide nothing.
    valve_seen : bool
        Whether OP explains enough of the PV to see a valve by (`contradiction.explains_nothing`). Where it does not a
        faulty sensor or saturation may be why; but few samples of a historian may have made the one look so.
    against : tuple of Objection
        What keeps the valve from being surely good (`contradiction.against_good`).
    against_sticking : tuple of Objection
        What keeps it from surely sticking (`contradiction.against_sticking`, `against_short`); some of it leaves no
        more than what is not known of a loop (`NO_MORE`).

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
    >>> from stiction.records import LoopRecord, assess_quality
    >>> k, rng = np.arange(150.0), np.random.default_rng(1)
    >>> record = LoopRecord("FIC-101", 1.0, op=50 + np.sin(k / 3) + 0.1 * rng.normal(size=150), pv=np.cos(k / 3))
    >>> round(held_back(0.999, assess_quality(record)).probability, 3), held_back(0.999, assess_quality(record)).why
    (0.9, 'The data allow no more than 0.90 (length).')
    """
    doubts = _doubts(quality, saturation, sensor)
    sure = min(max(probability, 1e-12), 1.0 - 1e-12)
    unknown = min(max(sure, UNKNOWN[0]), UNKNOWN[1])
    odds, usual = (math.log(p / (1.0 - p)) for p in (sure, unknown))
    kept = FIRST * FURTHER ** (len(doubts) - 1)
    drawn = 1.0 / (1.0 + math.exp(-usual - kept * (odds - usual))) if doubts else probability
    for objection, most in NO_MORE.items():
        if objection in against_sticking and drawn > most:
            return HeldBack(most, f"No more than {most:.2f} is told: {objection}.")
    of_data = _hides(doubts, quality, own_samples=own_samples)
    found: list[str] = [Objection.NOT_SEEN] if not valve_seen and saturation + sensor < FAULT_SEEN else []
    found += against if drawn < LEAST else against_sticking if drawn > MOST else ()
    half = quality.last - quality.first < 0.5 * FEW
    few = Objection.FEW_SAMPLES in of_data and (half or "sampling" in of_data)
    slight = drawn < (BOTH if few else SURELY) and valve_seen and {*of_data, *found} <= {*SLIGHT}
    plain = drawn < PLAINLY and not found and {*of_data} <= {*ROWS}
    hiding = [] if slight or plain else of_data + found
    if hiding and not LEAST <= drawn <= MOST:
        bound = f"no more than {MOST:.2f}" if drawn > MOST else f"no less than {LEAST:.2f}"
        return HeldBack(min(max(drawn, LEAST), MOST), f"The data allow {bound} ({', '.join(hiding)}).")
    if not doubts:
        return HeldBack(probability, "")
    why, before, after = (
        f"The data are in doubt ({', '.join(doubts)})",
        format_probability(probability),
        format_probability(drawn),
    )
    told = abs(probability - drawn) > TOLD and before != after
    return HeldBack(drawn, f"{why}, which makes {before} a {after}." if told else f"{why}.")


def _doubts(quality: Quality, saturation: float, sensor: float) -> list[str]:
    """Names of the checks that warn, but for those that do not matter here or are the finding themselves."""
    whole = _kept(quality) == 1.0  # at 0 and 100 % the OP is known, and nothing was left out
    harmless = (*HARMLESS, "saturation") if whole or saturation >= FAULT_SEEN else HARMLESS
    spikes = {check.name: check.value for check in quality.checks}.get("outliers", 0.0)
    harmless = (*harmless, "outliers") if spikes > SPIKES and sensor >= FAULT_SEEN else harmless
    doubts = [check.name for check in quality.warnings if check.name not in harmless]
    return [*doubts, Objection.MUCH_LEFT_OUT] if _kept(quality) < KEPT else doubts


def _hides(doubts: list[str], quality: Quality, *, own_samples: bool) -> list[str]:
    """What may have hidden a sticky valve: names of checks, and of what the record is short of."""
    value = {check.name: check.value for check in quality.checks}
    names = [name for name in doubts if name in (*HIDES, Objection.MUCH_LEFT_OUT)]
    names += [name for name, most in BEYOND.items() if value.get(name, 0.0) > most]
    if value.get("op resolution", STEPS) < STEPS:
        names.append("op resolution")
    names += [check.name for check in quality.warnings if check.name == "op reversals"]
    if not own_samples and "sampling" in doubts:
        names.append("sampling")
    if not own_samples and "length" not in names and quality.last - quality.first < FEW:
        names.append(Objection.FEW_SAMPLES)
    return names


def _kept(quality: Quality) -> float:
    """Share of the record that is analysed [-]."""
    return (quality.last - quality.first) / quality.rows


def only_saturated(quality: Quality) -> bool:
    """Whether a record is refused because OP lies at a limit, and for nothing that does not follow from it.

    Parameters
    ----------
    quality : Quality
        The data checks of the record.

    Returns
    -------
    bool
        True where saturation refuses and the other refusals, if any, are the shortness of what it leaves.
    """
    names = {check.name for check in quality.rejections}
    return "saturation" in names and names <= {"saturation", *FOLLOWS}
