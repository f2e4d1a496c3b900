"""What the findings say against one another: a valve is then neither surely good nor surely sticking.

The tables of `probability` add what the findings say. A few of them say something that no sum of others outweighs: a
sticky valve that predicts the PV far better than every rival in a loop that is otherwise calm, a cycle that the loop
found does not make. Beside the doubts about the data (`doubt`) these keep a probability between `doubt.LEAST` and
`doubt.MOST`, and two of them turn "no stiction" into `undecided`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.diagnosis.verdict.doubt import FAULT_SEEN
from stiction.diagnosis.verdict.objection import Objection
from stiction.diagnosis.verdict.probability import kept_by_plant

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from stiction.diagnosis.identified import ControllerFit, Identification
    from stiction.diagnosis.verdict.features import Features
    from stiction.diagnosis.verdict.stem import Shown
    from stiction.records.assess import Quality

__all__ = [
    "BEATS_EVERY",
    "HARDLY_JUMPS",
    "LIKE_A_PLANTS",
    "MUCH_MORE",
    "NOT_OF_ONE_LOOP",
    "OWN_CYCLE",
    "PLAIN_JUMP",
    "PREDICTS",
    "REGULAR",
    "SHORT",
    "STEADILY",
    "UNLAWFUL",
    "against_both",
    "against_good",
    "against_moving",
    "against_short",
    "against_sticking",
    "beats_every_rival",
    "explains_much_more",
    "explains_nothing",
]

NOT_OF_ONE_LOOP = "OP and PV are not of one loop"
"""What may be where OP does not move the PV, and no controller makes OP of it."""
BY_CHANCE = 15.0
"""Share of the PV [%] below which a search says nothing of the valve. With the OP of one simulated loop and the PV of
another (76 pairs of `simulation.population`, seed 61) the better valve explained less than 20 % in 39 % of the pairs;
of 3 400 loops' own PV (seed 51) it explained less than 15 % in 4 %, five of them sticky."""

UNLAWFUL = 0.3
"""Share of OP's moves that no form of controller explains beyond which nothing is sure [-]. Of 106 sticky loops that
faults of the data which no gate asks for turned into surely good ones (another hand's: a neighbour's OP, one of OP and
PV rounded or stored slower, bursts of noise) it tells 60, and 8 of 13 the other way; of 3 120 told surely and right
(`simulation.population`, seeds 10 and 12, and that hand's) 25."""
MUCH_MORE = 30.0
"""Share of the PV [%] that a sticky valve explains beyond a good one, and predicts better, with which no calm speaks
for the latter: when it was chosen three of 6 857 loops that do not stick and were called so had it
(`simulation.population`, seeds 10, 12, 13 and 14)."""
BEATS_EVERY, STEADILY = 60.0, 1.64
"""Twice the log likelihood by which a sticky valve beats each of its rivals, and Vuong's statistic over the nearest (19
in 20 are less by chance), beyond which "no stiction" is not said [-]. When they were chosen 18 of 22 loops told so with
both, neither a transmitter nor a limit to blame, stuck (2 000 of `simulation.population`, seed 10, and 1 200 of another
hand); of six more with the first alone two did. No good recorded loop has more than 11 of the first. Beside a
limit of OP ten of 960 good valves have it that are told below `doubt.LEAST`, and 54 of 137 sticky ones (seed 101, the
latter of `two_fault_population`, by tables that knew none of these)."""
PLAIN_JUMP = 0.33
"""`features.likely_jump_clear` beyond which a jump is plain whatever else is wrong with the loop [-]: of 91 loops told
below `doubt.LEAST` with a faulty transmitter or a limit to blame and a likely jump, one of them sticky, none had 0.33
(seeds 10, 12, 13, 14)."""
PREDICTS = 8.0
"""Vuong's statistic over a good valve beyond which a sticky one may be there though something else drives the loop [-].
A good valve with a bend, or beside a wave from outside, must not predict the PV better. Of 14 800 loops
(`simulation.population`, seeds 10, 12, 13, 14 and 17, and two seeds of another hand) 48 are told below `doubt.LEAST`
but for this, 16 of which stick."""
BESIDE_PLAY = 15.0
"""Twice the log likelihood over play from which a valve may stick beside a wave from outside [-]: that wave explains
most of the PV whatever the valve does, so that what counts is which valve predicts the rest. Of 3 000 loops that stick,
that a disturbance moves or that have nothing wrong (`simulation.population`, seed 101) 31 are told below `doubt.LEAST`
with it and more than `BEATS_EVERY` over a good valve beside the wave, six of which stick."""
REGULAR, OWN_CYCLE, HARDLY_JUMPS = 0.95, 0.3, 0.15
"""`features.regularity` above which an oscillation is regular, and `own_amplitude` and `jump` below which the loop
found does not make it [-]. Of the same loops 34 are told beyond `doubt.MOST` but for these, 12 of which are good."""
NO_JUMP, A_JUMP = (0.1, 0.3), 20.0
"""J told and the upper end of its interval, as shares of S, below which a valve does not jump, where none is likelier
either; twice the log likelihood of a jump from which it is one whatever is explained [-]. Of 5 800 loops, 4 000
of them of `simulation.population` (seeds 10 and 12), 521 sticky ones and 42 others are told beyond `doubt.MOST` but for
these, which bound seven and 20. Where a good valve explains as much and nothing oscillates eleven of 25 told beyond
`doubt.MOST` do not stick (seed 101, short and upset loops among them)."""
TAKEN = 0.5
"""Share of what a sticky valve predicts beyond a good one that a good one with a bend, or given the past of the PV
without its noise, takes from it at most if it is sure [-]: relaxation oscillations from outside whose period wanders
pass for slips, and these take more than half of it. Of 6 860 loops (`simulation.population`, seed 101) 698 are told
beyond `doubt.MOST`, 26 of which do not stick; it bounds 16 of these and 78 of the others."""
SMALL, LEAVES = 0.1, 0.95
"""S over OP's swing below which, and share of what a good valve leaves of the PV that a sticky one leaves beyond which,
a likelihood beyond `BEATS_EVERY` says nothing of the valve [-]: where a load steps, as the neighbour of a sticky valve
sees it, and there is little noise, a band somewhere predicts some of the steps. Of 258 good loops of another hand, most
under such loads, 91 are called sticky without this and 30 with it, and none of 163 calls of sticky ones is lost; of
1 450 loops of ours, half of them upset, moved by wandering waves or with a second fault (seeds 9801 to 9805), it takes
six of 62 false calls and one of 263 others."""
PLAY = 0.5
"""Probability of play beyond which it is what speaks against stiction [-]. Of 4 000 loops (`simulation.population`,
seeds 10 and 17) 144 are told below `doubt.LEAST` but for a J that may be all of S, six of which stick, and of seeds 10
and 12 67 more whose J is said to be less, one of which does."""
SHORT = 500
"""Samples of the shortest record that the tables were found on [-]: in a shorter one a valve is not told to stick by
an OP of which the check "op reversals" warns. Of 240 records of 80 to 400 samples that a wandering load moves, and 330
cut out of `simulation.population` (seeds 44 and 45), 142 were told to stick, 90 of which do; of the 59 whose OP turns
round fewer than six times 15 do. From 500 samples on 6 of 13 do (`simulation.upset_population` and others, seeds 4402
to 4405), and all of three recorded ones."""
STILL = 1.0
"""OP's swing above which a position that stands still is more than one too coarse to show the stem move [% of span]."""
BESIDE_THE_VALVE = ("external disturbance", "none")
"""Causes of a PV that moves as it does though the stem be stuck; all others need a stem that moves, or hide it."""
LIKE_A_PLANTS = 0.5
"""Likeness to a plant historian's record beyond which a slip may have left nothing to see [-]. When it was chosen 382
of 1 500 such loops (`simulation.population.plant_population`, seed 16) were told below `doubt.LEAST` but for it, 55 of
which stick."""


def against_both(controller: ControllerFit) -> tuple[Objection, ...]:
    """Say what keeps a valve from being surely anything, whatever is to blame.

    Parameters
    ----------
    controller : ControllerFit
        The controller found.

    Returns
    -------
    tuple of Objection
        An OP whose moves no controller explains (`UNLAWFUL`): it is not what a controller made of this PV, or not what
        was sent to the valve.
    """
    return (Objection.NO_LAW,) if controller.left > UNLAWFUL else ()


def against_good(found: Identification, row: Features, causes: Mapping[str, float]) -> tuple[Objection, ...]:
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
    tuple of Objection
        A jump beyond chance (`features.CLEAR_JUMP`), a sticky valve that explains much more, one that predicts better
        in cycle after cycle, than any good one, and is no play, one that jumps and predicts better with a wave from
        outside beside both, play where the samples are not the controller's own, or
        values such as a plant's historian keeps, slower than these: in them slips drown. Where the transmitter or a
        limit of OP is to blame only a jump that is plain (`PLAIN_JUMP`) or a sticky valve that beats each of its rivals
        (`BEATS_EVERY`): of samples that are not the controller's own, or, play among them, beside a limit. What else
        such a loop shows is of their making.
    """
    if causes["sensor"] + causes["saturation"] >= FAULT_SEEN:
        plain = {
            Objection.JUMP_PLAIN: row.likely_jump_clear > PLAIN_JUMP,
            Objection.PREDICTS: not found.own_samples and found.likelier_than_any > BEATS_EVERY,
            Objection.EVERY_RIVAL: causes["saturation"] > causes["sensor"] and beats_every_rival(found),
        }
        return tuple(one for one, true in plain.items() if true)
    beside = found.own_samples and max(causes, key=lambda one: causes[one]) in BESIDE_THE_VALVE
    predicts = found.own_samples and causes["deadband"] < FAULT_SEEN and found.beats_any > 0.0
    seen = {
        Objection.JUMP_LIKELY: row.likely_jump_clear > 0.0,
        Objection.MUCH_MORE: explains_much_more(found),
        Objection.EVERY_RIVAL: beats_every_rival(found),
        Objection.PREDICTS: predicts and found.over("good").beats > PREDICTS,
        Objection.BESIDE_WAVE: beside
        and found.over("beside_wave").likelier > BEATS_EVERY
        and found.likelier_than_play > BESIDE_PLAY,
        Objection.JUMP_OPEN: causes["deadband"] > PLAY and not found.own_samples,
        Objection.SLIPS_DROWN: not found.own_samples and kept_by_plant(row) > LIKE_A_PLANTS,
    }
    return tuple(one for one, true in seen.items() if true)


def against_moving(stem: Shown | None, causes: Mapping[str, float]) -> tuple[Objection, ...]:
    """Say what keeps a valve from being good where its recorded position does not go with OP.

    Parameters
    ----------
    stem : Shown or None
        What the recorded position shows; None where none was recorded.
    causes : mapping of str to float
        Probability of each cause, before any doubt [-].

    Returns
    -------
    tuple of Objection
        A position that stands still while OP moves by more than `STILL`, where a wave from outside or nothing is the
        likeliest cause: either its transmitter hangs, or the stem is stuck fast and PV moves without it. And one that
        moves otherwise than OP: another valve's, or of a stem that seldom leaves its band.
    """
    if stem is not None and stem.what == "unrelated":
        return (Objection.ANOTHER_STEM,)
    still = stem is not None and stem.what == "frozen" and stem.swing > STILL
    return (Objection.STANDS_STILL,) if still and max(causes, key=lambda one: causes[one]) in BESIDE_THE_VALVE else ()


def against_short(quality: Quality) -> tuple[Objection, ...]:
    """What keeps a valve from being told to stick by a short record.

    Parameters
    ----------
    quality : Quality
        The data checks of the record.

    Returns
    -------
    tuple of Objection
        An OP that hardly turns round in a record of fewer than `SHORT` samples.
    """
    few = any(check.name == "op reversals" for check in quality.warnings)
    return (Objection.FEW_TURNS,) if few and quality.last - quality.first < SHORT else ()


def against_sticking(
    found: Identification, valve: Identification, row: Features, makes_cycle: Callable[[], bool]
) -> tuple[Objection, ...]:
    """Say what keeps a valve from surely sticking, though nothing is wrong with the data.

    Parameters
    ----------
    found : Identification
        The comparison that the verdict rests on.
    valve : Identification
        The valve that is told, whose J may be another: the same or one by the samples between.
    row : Features
        What was found in the record.
    makes_cycle : callable
        Says whether the likeliest valve, its process and the controller make the loop's cycle by themselves. It takes a
        run of that loop, and is asked only where the answer counts.

    Returns
    -------
    tuple of Objection
        A regular oscillation that the valve, process and controller found do not make by themselves, the valve hardly
        jumping: a band alone makes no cycle with a self-regulating process, and fits many that come from outside or
        from a characteristic that is not straight; unless a jump is plain (`A_JUMP`), which the dense search may miss,
        and the likeliest valve makes the cycle. With such a process, a valve that does not jump, to within `NO_JUMP`,
        which is play; a good valve that explains as much, unless a jump is plain and the loop oscillates; one with a
        bend, or given the past of the PV without its noise, that takes `TAKEN` of what the sticky one adds; a band that
        is `SMALL` and explains nothing; and the valve told and a good one that both explain next to nothing
        (`BY_CHANCE`).
    """
    regular = row.oscillating > 0.0 and row.regularity > REGULAR
    plainly_jumps = found.likelier_than_play >= A_JUMP
    not_its_own = row.own_amplitude < OWN_CYCLE and row.jump < HARDLY_JUMPS and not row.integrating
    jumps = max(valve.J / NO_JUMP[0], valve.J_high / NO_JUMP[1]) > valve.S or found.likelier_than_play > 0.0
    added, kept = found.over("good").likelier, found.nearest("good", "bent", "gated").likelier
    seen = {
        Objection.NOT_ITS_OWN: regular and not_its_own and not (plainly_jumps and makes_cycle()),
        Objection.NO_JUMP: not jumps and not valve.process.integrating,
        Objection.NOTHING_EXPLAINED: max(valve.fit, valve.fit_linear) < BY_CHANCE,
        Objection.MOST_OF_IT: added > BEATS_EVERY and kept < TAKEN * added,
        Objection.SMALL_BAND: added > BEATS_EVERY
        and row.likely_band < SMALL
        and 100.0 - valve.fit > LEAVES * (100.0 - valve.fit_linear),
        Objection.AS_MUCH: valve.fit <= valve.fit_linear and not (plainly_jumps and row.oscillating > 0.0),
    }
    return tuple(one for one, true in seen.items() if true)


def explains_much_more(found: Identification) -> bool:
    """Whether a sticky valve explains so much more of the PV than a good one that the loop's calm says nothing.

    Parameters
    ----------
    found : Identification
        The comparison that the verdict rests on.

    Returns
    -------
    bool
        True where the likeliest one, or that of the dense search, explains `MUCH_MORE`, and it predicts the PV
        better as well: of a stem that rests but for one slip the likelihood may see a smaller band than the search.
    """
    return _explained(found) - found.fit_linear > MUCH_MORE and found.over("good").likelier > 0.0


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
    rivals = (found.likelier_than_any, found.over("beside_wave").likelier, found.likelier_than_play)
    likelier = [by for by in rivals if not math.isnan(by)]
    compared = not math.isnan(found.over("good").likelier)
    return compared and min(likelier) > BEATS_EVERY and found.beats_any > STEADILY


def explains_nothing(found: Identification, controller: ControllerFit | None = None) -> str:
    """Say that OP does not move PV, where neither valve explains more of the PV than it would of any other loop's.

    Parameters
    ----------
    found : Identification
        The comparison that the verdict rests on.
    controller : ControllerFit, optional
        The controller found: where one makes OP of this PV, the two are of one loop.

    Returns
    -------
    str
        A sentence; empty where a valve explains more than `BY_CHANCE`.
    """
    best = max(_explained(found), found.fit_linear)
    if best >= BY_CHANCE:
        return ""
    apart = "" if controller is not None and controller.left <= UNLAWFUL else f", or {NOT_OF_ONE_LOOP}"
    return (
        f"OP explains no more than {best:.0f} % of the PV's movement, be the valve good or sticky: something else "
        f"moves the PV{apart}, and the valve is not seen."
    )


def _explained(found: Identification) -> float:
    """Share of the PV that a sticky valve explains, the likeliest one or that of the dense search [%]."""
    return max(found.fit, (found.rough or found).fit)
