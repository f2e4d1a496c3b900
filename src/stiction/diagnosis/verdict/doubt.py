r"""What doubts about the data do to a probability, and to the word of a record that they refuse.

A gate that lowers the confidence says that the record is not what the controller saw. Put through the effects of
`simulation.historian`, alone and in pairs, sticky loops lose what shows the valve and look like loops with a good one;
few go the other way. A record that may have lost it does not speak beyond `LEAST` and `MOST`: one that certain gates
call in question (`HIDES`), or others by more than `BEYOND`, one whose OP is rounded to few steps (`STEPS`), one much of
which is left out (`KEPT`, `MOST_KEPT`), and one whose samples are not the controller's own and few (`FEW`, but for
`SURELY`). The limits were chosen so that no trial turns a probability beyond 0.9 into one below 0.1, or back, and few
sound records are bound; `docs/verdict.md` says which trials chose and which only counted.

What is not known of a loop lies between one valve in four, the share of the loops that oscillate because of it (20 to
30 %: [srinivasan2005c]_), and even. Each doubt draws the log odds towards that, and none of them to the other side:

.. math:: \ell \to \ell_0 + k\,(\ell - \ell_0), \quad k = F\, G^{n - 1}, \quad
    \ell_0 = \min\{\max\{\ell, -\ln 3\}, 0\}

with n doubts, F = `FIRST` and G = `FURTHER`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from stiction.diagnosis.verdict.probability import kept_by_plant
from stiction.records.digits import chance

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.diagnosis.identified import Identification
    from stiction.diagnosis.verdict.features import Features
    from stiction.records.quality import Quality

__all__ = [
    "APART",
    "BEATS_EVERY",
    "BEGINS",
    "BEYOND",
    "EVERY_RIVAL",
    "FAULT_SEEN",
    "FEW",
    "FORETELLS",
    "HARDLY_JUMPS",
    "HIDES",
    "JUMP_LIKELY",
    "KEPT",
    "LEAST",
    "LIKE_A_PLANTS",
    "MOST",
    "MOST_KEPT",
    "MUCH_MORE",
    "OWN_CYCLE",
    "PLAINLY_JUMPS",
    "PLAIN_JUMP",
    "PLAIN_S",
    "REGULAR",
    "SPIKES",
    "STEADILY",
    "STEPS",
    "SURELY",
    "UNKNOWN",
    "HeldBack",
    "against_good",
    "against_sticking",
    "beats_every_rival",
    "explains_much_more",
    "explains_nothing",
    "held_back",
    "only_saturated",
]

UNKNOWN = 0.25, 0.5
"""Probabilities between which a doubt draws nothing [-]: one loop in four, and even."""
FIRST, FURTHER = 0.9, 0.8
"""What the log odds keep for the first doubt, and for each further one [-]."""
HIDES = (
    *("exception", "averaging", "clock", "length", "manual", "op turns", "outages", "outliers"),
    *("resampled", "saturation", "replay"),
)
"""Gates that lower the confidence in a record that may have lost what shows the valve. Where the clock jumped rows may
be lost, and a stem that rests after every sample goes on from elsewhere."""
BEYOND = {"missing": 5.0, "frozen": 5.0, "held": 5.0, "compression": 2.0}
"""Those that may hide or feign a slip beyond a value, whether or not they lower: missing, frozen and held samples [%],
OP on exactly straight lines [%]."""
STEPS = 100.0
"""Steps that OP swings over below which they may hide a slip [-]."""
LEAST, MOST = 0.1, 0.9
"""Probabilities beyond which these do not speak [-]."""
FEW = 880
"""Samples below which a record that does not show the controller's own ones does not speak beyond these either [-]."""
KEPT, MOST_KEPT = 0.75, 0.9
"""Share of the record below which what was left out might have said something else [-]. Below the first it is a doubt
and a bound, below the second a bound alone where the record does not show the controller's own samples."""
FAULT_SEEN = 0.5
"""Probability of a faulty sensor or of saturation that explains why OP explains nothing, and beyond which spikes of the
PV, or an OP at its limit, are a finding and no doubt [-]."""
SPIKES = 5.0
"""Values far off all others beyond which they are the finding and no doubt where the transmitter is to blame [-]: a
historian writes a code for a bad value a few times, a loose contact makes spikes all the time."""
MUCH_LEFT_OUT, FEW_SAMPLES = "much left out", "few samples"
"""Names of the doubt where less is kept, and of the bound of records of fewer than `FEW` samples."""
JUMP_LIKELY = "a jump is likely"
"""What is told of a valve whose jump is beyond chance."""
SURELY, SLIGHT = 0.05, (FEW_SAMPLES, "sampling", JUMP_LIKELY)
"""Probability below which few samples, in all or for a cycle, and a likely jump are no bound by themselves [-]: of
8 000 loops (seeds 10, 12, 13, 14) 620 are told less in spite of them, three of which stick."""
HARMLESS = ("op scale",)
"""Gates that say how to read S and J, and nothing about how sure they are."""
FOLLOWS = ("length", "cycles")
"""Refusals that come of a record cut to pieces by another gate."""
BY_CHANCE = 15.0
"""Share of the PV [%] below which a search says nothing of the valve. With the OP of one simulated loop and the PV of
another (76 pairs of `simulation.population`, seed 61) the better valve explained less than 20 % in 39 % of the pairs;
of 3 400 loops' own PV (seed 51) it explained less than 15 % in 4 %, five of them sticky."""

MUCH_MORE = 30.0
"""Share of the PV [%] that a sticky valve explains beyond a good one, and foretells better, with which no calm speaks
for the latter: when it was chosen three of 6 857 loops that do not stick and were called so had it
(`simulation.population`, seeds 10, 12, 13 and 14)."""
BEATS_EVERY, STEADILY = 60.0, 1.64
"""Twice the log likelihood by which a sticky valve beats each of its rivals, and Vuong's statistic over the nearest (19
in 20 are less by chance), beyond which "no stiction" is not said [-]. When they were chosen 18 of 22 loops told so with
both, neither a transmitter nor a limit to blame, stuck (2 000 of `simulation.population`, seed 10, and 1 200 of another
hand); of six more with the first alone two did. No good recorded loop has more than 11 of the first."""
EVERY_RIVAL = "a sticky valve beats every rival"
"""What is told of such a valve."""
APART = 0.5
"""What a sticky valve leaves less than a good one by simulation, as `features.advantage` has it, beyond which one that
foretells worse is a contradiction [-]: in 28 of 8 000 simulated loops (seeds 10, 12, 13, 14), three of them sticky."""
PLAIN_JUMP = 0.33
"""`features.likely_jump_clear` beyond which a jump is plain whatever else is wrong with the loop [-]: of 91 loops told
below `LEAST` with a faulty transmitter or a limit to blame and a likely jump, one of them sticky, none had 0.33 (seeds
10, 12, 13, 14)."""
PLAINLY_JUMPS = "a jump is plain"
"""What is told of such a valve."""
FORETELLS, PLAIN_S = 8.0, 0.25
"""Vuong's statistic over a good valve, and the lower end of S over S, beyond which a sticky valve may be there though
something else drives the loop [-]. A good valve with a bend, or beside a wave from outside, must not foretell the PV
better: of 79 loops with the first two (same seeds) it does in 57, one of which sticks; of the 22 others four stick."""
REGULAR, OWN_CYCLE, HARDLY_JUMPS, BEGINS = 0.95, 0.3, 0.15, -1.9
"""`features.regularity` above which an oscillation is regular, `own_amplitude` and `jump` below which the loop found
does not make it, and `decay` below which it begins within the record [-]. Of 508 loops told beyond `MOST` (seeds 10,
12, 13, 14) the first three hold for 14, six of which do not stick, the last for six; of 32 good ones told so on loops
of another hand, on which they were chosen, for 17 and 8."""
LIKE_A_PLANTS = 0.5
"""Likeness to a plant historian's record beyond which a slip may have left nothing to see [-]. When it was chosen 382
of 1 500 such loops (`simulation.population.plant_population`, seed 16) were told below `LEAST` but for it, 55 of which
stick."""


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
    against: tuple[str, ...] = (),
    against_sticking: tuple[str, ...] = (),
) -> HeldBack:
    """Draw a probability towards what is not known for each doubt about the data, and keep it from being sure.

    Parameters
    ----------
    probability : float
        Probability from what was found in the record [-].
    quality : Quality
        The gates of the record.
    saturation : float
        Probability that saturation is what is wrong with the loop [-].
    sensor : float
        Probability that the transmitter is [-].
    own_samples : bool
        Whether the record shows the controller's own samples: few of them, for a cycle or in all, then hide nothing.
    valve_seen : bool
        Whether OP explains enough of the PV to see a valve by (`explains_nothing`). Where it does not a faulty sensor
        or saturation may be why; but few samples of a historian may have made the one look so.
    against : tuple of str
        What keeps the valve from being surely good (`against_good`).
    against_sticking : tuple of str
        What keeps it from surely sticking (`against_sticking`).

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
    doubts = _doubts(quality, saturation, sensor)
    sure = min(max(probability, 1e-12), 1.0 - 1e-12)
    unknown = min(max(sure, UNKNOWN[0]), UNKNOWN[1])
    odds, usual = (math.log(p / (1.0 - p)) for p in (sure, unknown))
    kept = FIRST * FURTHER ** (len(doubts) - 1)
    drawn = 1.0 / (1.0 + math.exp(-usual - kept * (odds - usual))) if doubts else probability
    hiding = _hides(doubts, quality, own_samples=own_samples)
    if not valve_seen and saturation + sensor < FAULT_SEEN:
        hiding.append("valve not seen")
    hiding += against if drawn < LEAST else against_sticking if drawn > MOST else ()
    if drawn < SURELY and valve_seen and {*hiding} <= {*SLIGHT}:
        hiding = []
    if hiding and not LEAST <= drawn <= MOST:
        bound = f"no more than {MOST:.2f}" if drawn > MOST else f"no less than {LEAST:.2f}"
        return HeldBack(min(max(drawn, LEAST), MOST), f"The data allow {bound} ({', '.join(hiding)}).")
    if not doubts:
        return HeldBack(probability, "")
    why, before, after = f"The data are in doubt ({', '.join(doubts)})", chance(probability), chance(drawn)
    return HeldBack(drawn, f"{why}, which makes {before} a {after}." if before != after else f"{why}.")


def _doubts(quality: Quality, saturation: float, sensor: float) -> list[str]:
    """Names of the gates that lower, but for those that do not matter here or are the finding themselves."""
    whole = _kept(quality) == 1.0  # at 0 and 100 % the OP is known, and nothing was left out
    harmless = (*HARMLESS, "saturation") if whole or saturation >= FAULT_SEEN else HARMLESS
    spikes = {gate.name: gate.value for gate in quality.gates}.get("outliers", 0.0)
    harmless = (*harmless, "outliers") if spikes > SPIKES and sensor >= FAULT_SEEN else harmless
    doubts = [gate.name for gate in quality.reservations if gate.name not in harmless]
    return [*doubts, MUCH_LEFT_OUT] if _kept(quality) < KEPT else doubts


def _hides(doubts: list[str], quality: Quality, *, own_samples: bool) -> list[str]:
    """What may have hidden a sticky valve: names of gates, and of what the record is short of."""
    value = {gate.name: gate.value for gate in quality.gates}
    names = [name for name in doubts if name in (*HIDES, MUCH_LEFT_OUT)]
    names += [name for name, most in BEYOND.items() if value.get(name, 0.0) > most]
    if value.get("op resolution", STEPS) < STEPS:
        names.append("op resolution")
    if not own_samples and "sampling" in doubts:
        names.append("sampling")
    if not own_samples and MUCH_LEFT_OUT not in names and _kept(quality) < MOST_KEPT:
        names.append(MUCH_LEFT_OUT)
    if not own_samples and "length" not in names and quality.last - quality.first < FEW:
        names.append(FEW_SAMPLES)
    return names


def _kept(quality: Quality) -> float:
    """Share of the record that is analysed [-]."""
    return (quality.last - quality.first) / quality.rows


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


def against_good(found: Identification, row: Features, causes: Mapping[str, float]) -> tuple[str, ...]:
    """Say what keeps a valve from being surely good, though nothing is wrong with the data.

    Parameters
    ----------
    found : Identification
        The comparison that the verdict rests on.
    row : Features
        What was found in the record.
    causes : mapping of str to float
        Probability of each cause, before any doubt [-].

    Returns
    -------
    tuple of str
        A jump beyond chance (`features.CLEAR_JUMP`), a sticky valve that explains much more, one that leaves far less
        by simulation and foretells worse (a few copied samples spoil the likelihood of a record without noise), one
        with a plain S that foretells better in cycle after cycle, than any good one, and is no play, or values such as
        a plant's historian keeps, slower than the controller's own: in these slips drown. Where the transmitter or a
        limit of OP is to blame, a jump that is plain (`PLAIN_JUMP`) only: what such a loop shows is else of their
        making.
    """
    if causes["sensor"] + causes["saturation"] >= FAULT_SEEN:
        return (PLAINLY_JUMPS,) if row.likely_jump_clear > PLAIN_JUMP else ()
    plain_S = found.own_samples and found.S_low > PLAIN_S * found.S and causes["deadband"] < FAULT_SEEN
    seen = {
        JUMP_LIKELY: row.likely_jump_clear > 0.0,
        "a sticky valve explains much more": explains_much_more(found),
        EVERY_RIVAL: beats_every_rival(found),
        "a sticky valve foretells the PV": plain_S and found.beats_good > FORETELLS and found.beats_any > 0.0,
        "the searches disagree": found.gain < 0.0 and row.advantage > APART,
        "a historian's slow record": not found.own_samples and kept_by_plant(row) > LIKE_A_PLANTS,
    }
    return tuple(name for name, true in seen.items() if true)


def against_sticking(row: Features) -> tuple[str, ...]:
    """Say what keeps a valve from surely sticking, though nothing is wrong with the data.

    Parameters
    ----------
    row : Features
        What was found in the record.

    Returns
    -------
    tuple of str
        A regular oscillation that the valve, process and controller found do not make by themselves, the valve hardly
        jumping: a band alone makes no cycle with a self-regulating process, and fits many that come from outside or
        from a characteristic that is not straight. Or a regular one that begins within the record.
    """
    regular = row.oscillating > 0.0 and row.regularity > REGULAR
    not_its_own = row.own_amplitude < OWN_CYCLE and row.jump < HARDLY_JUMPS and not row.integrating
    seen = {
        "the loop found makes no such cycle": regular and not_its_own,
        "the oscillation begins within the record": regular and row.decay < BEGINS,
    }
    return tuple(name for name, true in seen.items() if true)


def explains_much_more(found: Identification) -> bool:
    """Whether a sticky valve explains so much more of the PV than a good one that the loop's calm says nothing.

    Parameters
    ----------
    found : Identification
        The comparison that the verdict rests on.

    Returns
    -------
    bool
        True where the likeliest one, or that of the dense search, explains `MUCH_MORE`, and it foretells the PV
        better as well: of a stem that rests but for one slip the likelihood may see a smaller band than the search.
    """
    return max(found.fit, (found.rough or found).fit) - found.fit_linear > MUCH_MORE and found.gain > 0.0


def beats_every_rival(found: Identification) -> bool:
    """Whether a sticky valve is plainly likelier than all that could pass for one, whatever the loop looks like.

    Parameters
    ----------
    found : Identification
        The comparison that the verdict rests on.

    Returns
    -------
    bool
        True where it beats by `BEATS_EVERY` a good valve, be it straight, bent or beside a wave from outside, a good
        one with that wave beside both, and one that hardly jumps, and the first three `STEADILY` from half cycle to
        half cycle: one upset that a slip explains by chance is worth as much in all.
    """
    gains = [gain for gain in (found.gain_on_any, found.gain_beside_wave, found.jump_gain) if not math.isnan(gain)]
    return not math.isnan(found.gain) and min(gains) > BEATS_EVERY and found.beats_any > STEADILY


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
