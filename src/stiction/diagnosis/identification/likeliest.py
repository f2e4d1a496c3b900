"""The search for the valve that predicts the PV best.

The likelihood is a narrow dip: a band that is wrong by a per cent slips at other samples. So a coarse grid over the
plane comes first, then finer ones about the best valleys, a fan of fine steps about the best, and for a stem that
rests after every sample the search from a reversal of OP (`reversals`).

What trips the valve must be in the record. Of 63 simulated loops recorded 2 to 10 times slower than their controller
(`simulation.population`, seed 501, J visible) S is within 10 % in 0.52, mostly low where it is not; in 0.90 with OP at
the controller's rate beside means of the PV, in 0.97 of the same runs at that rate (by a script of ours). What a PI
controller's integral tells of it is in the signals (`between`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.likelihood import good_valve, joined, trials_of, valves
from stiction.diagnosis.identification.parts import lean, part_of
from stiction.diagnosis.identification.reversals import from_reversals
from stiction.diagnosis.identification.tried_once import NOTHING, tried_too
from stiction.diagnosis.identification.valleys import one_each, surroundings, valleys_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Prediction, Trials

__all__ = ["most_likely", "most_likely_between", "tried_again", "tried_recorded"]

# What half and twice of each does is counted in docs/verdict-measured.md, "What each constant of the search brings".
LEAST_SWING = 0.07
"""Smallest S looked for first, as a share of the OP's swing [-]."""
USUAL = (3.0, 30.0, 0.15)
"""OP's usual swing is so many times [-] what it moves in a quarter of a cycle, at this percentile [%], from a share of
its whole swing on [-]: where large steps of the set point make the latter many times what the valve's cycle needs."""
AT_EDGE = 2.0
"""S over the smallest looked for first up to which the likeliest valve may be the slope of one below [-]."""
WINDOWS, CYCLES, SHORTEST = 2, 6, 120
"""Windows searched by themselves first, and their length [cycles] but not less than [samples]."""
N_S, N_J, N_PLACES = 75, 8, 3
"""Points of a window's grid over S, over J / S, and over the place of a stem that rests after every sample [-]."""
COARSE = (40, 6)
"""Points of the whole record's grid over S and J / S [-]."""
IN_WINDOW = ((0.018, 0.06, 0.25, 12), (0.007, 0.03, 0.12, 8))
"""Steps of each finer search in a window: relative over S, over J / S, over the place; and valleys followed [-]."""
STAGES = ((0.0045, 0.02, 0.15, 10), (0.003, 0.02, 0.1, 5), (0.0012, 0.01, 0.05, 3), (0.0005, 0.005, 0.03, 3))
"""The same in the whole record."""
PLACES = np.linspace(-0.5, 0.5, 2), np.linspace(-0.8, 0.8, 5)
"""Places at the start that a valley of another stretch is tried with, by the rule of its stem [half bands]."""
FAN_STEP, FAN_REACH, FAN_J, FAN_PLACES = 0.008, 1.5, 6, 3
"""Relative step of the fan over S, how far it reaches either way, and its points over J / S and over the place [-]."""
FAN_SAMPLES, FAN_VALLEYS = 500, (0.008, 0.05, 12)
"""Samples in the middle of the record that the fan is looked at on, and the valleys followed from there [-]."""
LEAST_LAG, LAG_CYCLES, LAG_STEP = 0.7, 0.1, 0.6
"""Smallest lag of the actuator looked for [samples of OP], the largest [cycles], and the step over ln of it [-]."""
LAG_S, LAG_J, LAG_VALLEYS = (-0.5, 0.2, 0.02), 4, (0.02, 0.1, 3)
"""The fan behind each lag: ln S about the best valve's from, to, step; points over J / S; valleys followed [-]."""
LAG_STAGES, LAG_POINTS = ((0.35, 0.08), (0.15, 0.04)), 7
"""Steps over ln of the lag about the best, how far S is tried either way beside them, and its points [-]."""
LAG_RIVAL = 0.3
"""Share of what beats a good valve by which a resting stem may be better than one that goes on, for a lag to be looked
for [-]: of 66 loops with published actuators it was 0.28 at most."""
WORTH = 12.0
"""Twice the log likelihood by which the best valve must beat a good one for the fan to be worth its time [-]."""
CLEAR = 60.0
"""The same for reversals to be: less is no needle [-]."""
RIVAL = 0.3
"""Share of that by which a resting stem may be worse than the best for reversals to be gone through [-]. Of 50 clear
loops of He's and Stenman's valve (`tests/diagnosis/verdict/textbook.py`, seed 2) it was 0.24 at most."""
FROM_WINDOW, FROM_WHOLE = (0.01, 0.05, 10), (0.03, 0.2, 6)
"""How far apart the valleys are that the closer searches begin with, over S and J / S, and how many [-]."""
ABOUT = np.array([-1.0, 0.0, 1.0])
"""A step back, none, and a step on [-]."""
BEST = 100
"""Valves taken on to another record beside those [-]."""


def most_likely(prediction: Prediction, fine: Prediction, swing: float, *, own_samples: bool) -> Trials:
    """Search the plane: in short windows, where the dip is wide, then from their valleys in the whole record.

    Parameters
    ----------
    prediction, fine : Prediction
        What is predicted, for the coarse and for the last searches.
    swing : float
        Largest S to look for [% of span].
    own_samples : bool
        The record shows every sample of the controller: between samples that do not, the stem may have turned where
        none can see it, and the reversals of those recorded say too little for what their search takes.

    Returns
    -------
    Trials
        The valves tried on the whole record in the last searches.
    """
    tried, likelier, swing = _coarsely(prediction, fine, swing)
    if likelier > WORTH:
        tried = _fanned(fine, tried, swing)
        going_on, resting = (float(tried.cost[of].min(initial=np.inf)) for of in (~tried.rests, tried.rests))
        if going_on - resting < LAG_RIVAL * likelier:
            tried = _lagged(fine, tried, swing)
        if own_samples and likelier > CLEAR and resting - going_on < RIVAL * likelier:
            tried = joined(tried, trials_of(fine, from_reversals(prediction, fine, swing)))
    return _closer(fine, tried, STAGES[1:], swing)


def most_likely_between(prediction: Prediction, fine: Prediction, swing: float) -> Trials:
    """Search a record whose samples between the recorded ones are rebuilt (see `between`).

    Parameters
    ----------
    prediction, fine : Prediction
        What is predicted, for the coarse and for the last searches.
    swing : float
        Largest S to look for [% of span].

    Returns
    -------
    Trials
        The valves tried on the whole record in the last searches, none with a lag: what is left of OP between the
        samples would pass for one. A fan finds no more: of 187 simulated loops (`simulation.population`, seeds 10, 17,
        18 and 20, J visible) S is within 10 % in 127 with one, in 128 without.
    """
    tried, _, swing = _coarsely(prediction, fine, swing)
    return _closer(fine, tried, STAGES[1:], swing)


def tried_again(prediction: Prediction, tried: Trials, swing: float) -> Trials:
    """Go on from valves tried, where some samples of the record are no longer predicted.

    Parameters
    ----------
    prediction : Prediction
        What is predicted now.
    tried : Trials
        Valves tried before.
    swing : float
        Largest S to look for [% of span].

    Returns
    -------
    Trials
        The best of them for each S and each J, and those about the best of these.
    """
    return _closer(prediction, tried_too(prediction, NOTHING, _of_each(tried)), STAGES, swing)


def tried_recorded(prediction: Prediction, tried: Trials, swing: float) -> Trials:
    """Go on from valves tried on a record with rebuilt samples, where only those recorded are predicted.

    Parameters
    ----------
    prediction : Prediction
        What is predicted by the recorded samples.
    tried : Trials
        Valves tried with those between.
    swing : float
        Largest S to look for [% of span].

    Returns
    -------
    Trials
        The best of them for each S and each J, those about the best of these, and some behind a lag. Of the loops of
        `most_likely_between` half beat a good valve by as much as after a search from the beginning, which takes more
        than twice as long, and one in 20 by less than two thirds of that.
    """
    tried = _closer(prediction, tried_too(prediction, NOTHING, _of_each(tried)), STAGES[:1], swing)
    return _closer(prediction, _lagged(prediction, tried, swing), STAGES[1:], swing)


def _coarsely(prediction: Prediction, fine: Prediction, swing: float) -> tuple[Trials, float, float]:
    """Valves tried so far, how much likelier the best of them is than a good one, and the largest S."""
    tried, likelier = _within(prediction, fine, LEAST_SWING * swing, swing)
    usual = _usual_swing(prediction, swing)
    if usual < swing and (likelier <= WORTH or AT_EDGE * LEAST_SWING * swing > tried.best.S):
        below, more = _within(prediction, fine, LEAST_SWING * usual, LEAST_SWING * swing)
        if more > CLEAR + max(likelier, 0.0):
            return below, more, usual
    return tried, likelier, swing


def _within(prediction: Prediction, fine: Prediction, least: float, most: float) -> tuple[Trials, float]:
    """Valves with S between two bounds, tried so far, and how much likelier the best of them is than a good one."""
    valleys = []
    for window in _windows(prediction):
        tried = trials_of(window, _plane(least, most, N_S, N_J, N_PLACES))
        tried = _closer(window, tried, IN_WINDOW, most)
        valleys += valleys_of(tried, *FROM_WINDOW)
    tried = trials_of(prediction, _plane(least, most, *COARSE, 1))
    valleys += valleys_of(tried, *FROM_WHOLE)
    # Where the stem stood when a window began says nothing of where it stood when the record did.
    seeds = [valves(valley.S, valley.ratio, valley.K, PLACES[valley.K > 0.0], most) for valley in valleys]
    tried = tried_too(prediction, tried, np.concatenate(seeds))
    if fine.width < prediction.width:
        tried = _closer(prediction, tried, STAGES[:1], most)
        tried = tried_too(fine, NOTHING, _of_each(tried))
    tried = _closer(fine, tried, STAGES[:1], most)
    return tried, float(trials_of(fine, good_valve(tried.best)).cost[0] - tried.cost.min()) - fine.op_order


def _of_each(tried: Trials) -> NDArray[np.float64]:
    """Of each S and each J the best, since another record may prefer another, and the best of all."""
    return np.concatenate([tried.valve[one_each(tried)], tried.valve[tried.ranked()[:BEST]]])


def _fanned(prediction: Prediction, tried: Trials, swing: float) -> Trials:
    """Look about the best valve in steps fine enough for the dip of a few cycles, at every J and by both rules.

    The valleys of the coarse grids can all lie beside a dip narrower than their steps; the best of them is then off by
    a tenth or two. Of 158 simulated loops whose true valve is more likely than any that was tried (seeds 201 and 202)
    the fan finds the dip of 72 when it reaches 1.3 either way.
    """
    reach = int(np.log(FAN_REACH) / FAN_STEP)
    S = tried.best.S * np.exp(FAN_STEP * np.arange(-reach, reach + 1))
    S, ratio = S[swing > S], np.linspace(0.0, 1.0, FAN_J)
    middle = _middle(prediction)
    rests = valves(S, ratio, 1.0, np.linspace(-0.8, 0.8, FAN_PLACES), swing)
    fan = trials_of(middle, np.concatenate([valves(S, ratio, 0.0, 0.0, swing), rests]))
    about = 1.0 + 0.5 * FAN_STEP * ABOUT
    seeds = [
        valves(valley.S * about, valley.ratio, valley.K, PLACES[valley.K > 0.0], swing)
        for valley in valleys_of(fan, *FAN_VALLEYS)
    ]
    return joined(tried, trials_of(prediction, np.concatenate(seeds)))


def _lagged(prediction: Prediction, tried: Trials, swing: float) -> Trials:
    """Look for an actuator that lags: its valve trips late, and looks stickier than it is by OP itself."""
    cycle = 2.0 * prediction.samples * prediction.width / prediction.ends.size
    lags = np.exp(np.arange(np.log(LEAST_LAG), np.log(LAG_CYCLES * cycle), LAG_STEP))
    if lags.size == 0:
        return tried
    middle = _middle(prediction)
    S = tried.best.S * np.exp(np.arange(*LAG_S))
    S, ratio = S[swing > S], np.linspace(0.0, 1.0, LAG_J)
    about, seeds = np.exp(0.5 * LAG_S[2] * ABOUT), []
    for lag in lags:
        fan = trials_of(middle, valves(S, ratio, 0.0, 0.0, swing, lag))
        seeds += [
            valves(valley.S * about, valley.ratio, 0.0, 0.0, swing, lag) for valley in valleys_of(fan, *LAG_VALLEYS)
        ]
    found = trials_of(prediction, np.concatenate(seeds))
    for step, reach in LAG_STAGES:
        best = found.best
        S = best.S * np.exp(reach * np.linspace(-1.0, 1.0, LAG_POINTS))
        closer = [valves(S, best.ratio, 0.0, 0.0, swing, best.lag * np.exp(way)) for way in (-step, 0.0, step)]
        found = joined(found, trials_of(prediction, np.concatenate(closer)))
    return joined(tried, found)


def _middle(prediction: Prediction) -> Prediction:
    """Samples in the middle of the record, for a fan."""
    n = prediction.pv.size
    size = min(n, FAN_SAMPLES)
    return part_of(lean(prediction), (n - size) // 2, size, min(prediction.begin, size // 4))


def _windows(prediction: Prediction) -> list[Prediction]:
    """Short stretches: a slip too early or too late leaves its mark on fewer slips after it."""
    n = prediction.pv.size
    cycle = 2.0 * prediction.samples / prediction.ends.size
    size = int(min(n, max(CYCLES * cycle, SHORTEST)))
    count = max(1, min(WINDOWS, n // size))
    begin = min(prediction.begin // 2, size // 3)
    return [part_of(lean(prediction), first, size, begin) for first in np.linspace(0, n - size, count).astype(int)]


def _usual_swing(prediction: Prediction, swing: float) -> float:
    """OP's swing where no large step of the set point makes it larger [% of span]."""
    op, (times, percentile, share) = prediction.op, USUAL
    quarter = round(0.5 * prediction.samples * prediction.width / prediction.ends.size)
    quarter = min(max(quarter, 2), op.size)
    moves = np.ptp(op[: op.size // quarter * quarter].reshape(-1, quarter), axis=1)
    return min(max(times * float(np.percentile(moves, percentile)), share * swing), swing)


def _plane(least: float, most: float, n_S: int, n_J: int, n_places: int) -> NDArray[np.float64]:
    """Valves of both rules over the plane."""
    S, ratio = np.geomspace(least, most, n_S), np.linspace(0.0, 1.0, n_J)
    places = np.linspace(-0.6, 0.6, n_places) if n_places > 1 else 0.0
    goes_on = valves(S, ratio, 0.0, 0.0, most)
    rests = valves(S[2.0 * S[0] < S], ratio, 1.0, places, most)
    return np.concatenate([goes_on, rests])


def _closer(
    prediction: Prediction, tried: Trials, stages: tuple[tuple[float, float, float, int], ...], swing: float
) -> Trials:
    """Go on about the best valleys, step by step."""
    for S_step, J_step, place_step, keep in stages:
        valve = surroundings(tried, S_step, J_step, place_step, keep, swing)
        tried = tried_too(prediction, tried, valve)
    return tried
