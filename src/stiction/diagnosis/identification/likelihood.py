"""The valve by likelihood: which (S, J) foretells the PV best, and which ones do so no worse over the cycles.

Prediction errors rather than simulation errors decide (see `prediction`): with the loop closed, a disturbance goes
round through the controller and would otherwise pass for an answer of the process. The likelihood of a valve is
-N/2 ln(sum of squares). It is a narrow dip: a band that is wrong by a per cent slips at other samples. So a coarse
grid over the plane comes first, then finer ones about the best valleys. Two rules of motion are tried, since a stem
on a noisy OP that goes on moving (Kano, Choudhury) and one that rests after every sample (He, Stenman) go different
ways.

What trips the valve must be in the record. Of 130 simulated loops recorded 2 to 10 times slower than their controller
(`simulation.population`, seeds 41 and 77, J visible, no valve with mass) S is within 10 % in 0.51, mostly low where it
is not; in 0.65 with OP at the controller's rate beside the slow PV, in 0.88 of the same runs at that rate. Rebuilding
OP between the samples from the PV and the true controller gains nothing: noise outside the record trips the valve.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.prediction import LANES, apart, desk, prediction_errors, stems

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.signals import Signals

__all__ = ["Prediction", "Trials", "by_cycle", "good_valve", "most_likely", "one_each", "prediction_of", "stem_of"]

ORDER = 12
"""Lags of the PV in the regression, at most [-]; fewer where a record is very short."""
ONE_BY_ONE = 8
"""Lags of the stem that have a weight of their own; longer ones share theirs in groups [-]."""
LONGEST = 24, 48
"""Longest lag of the stem, for the coarse and for the last searches [samples]."""
FLOOR = 1e-8
"""Prediction error that none falls below, as a share of the PV's variance [-]: noise-free data are rounded data."""
LEAST_SWING = 0.07
"""Smallest S looked for, as a share of the OP's swing [-]."""
MOST_SAMPLES = 4000
"""Samples foretold at most, those in the middle of the record: more tell S no better, and take longer [-]."""
UNKNOWN_SCALE = 36.0
"""Samples taken for a cycle where no period is known [-]."""
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
ALONG_J, FEW = 13, 2
"""Points over J / S tried again about so many of the best valleys [-]."""
PLACES = np.linspace(-0.5, 0.5, 2), np.linspace(-0.8, 0.8, 5)
"""Places at the start that a valley of another stretch is tried with, by the rule of its stem [half bands]."""
FAN_STEP, FAN_REACH, FAN_J, FAN_PLACES = 0.008, 1.5, 6, 3
"""Relative step of the fan over S, how far it reaches either way, and its points over J / S and over the place [-]."""
FAN_SAMPLES, FAN_VALLEYS = 500, (0.008, 0.05, 12)
"""Samples in the middle of the record that the fan is looked at on, and the valleys followed from there [-]."""
WORTH = 12.0
"""Twice the log likelihood by which the best valve must beat a good one for the fan to be looked at [-]."""
FROM_WINDOW, FROM_WHOLE = (0.01, 0.05, 10), (0.03, 0.2, 6)
"""How far apart the valleys are that the closer searches begin with, over S and J / S, and how many [-]."""
S_BIN, J_BIN = 0.02, 0.03
"""Width of the bins over ln S and over J / S of the best, from each of which the most likely valve is compared [-]."""


class Prediction(NamedTuple):
    """What is foretold, and from what."""

    op: NDArray[np.float64]
    """Controller output [% of span], shape (n_samples * width,)."""
    width: int
    """Samples of OP to one of the PV."""
    pv: NDArray[np.float64]
    """PV over its standard deviation, about its mean [-], shape (n_samples,)."""
    edges: NDArray[np.int64]
    """Lags at which groups of the stem's lags begin [samples]."""
    begin: int
    """First sample foretold."""
    ends: NDArray[np.int64]
    """Samples at which half cycles end, a slip each, shape (n_halves,)."""
    first: int = 0
    """Where it begins in the whole record [samples of the PV]."""

    @property
    def samples(self) -> int:
        """Samples foretold [-]."""
        return self.pv.size - self.begin

    @property
    def order(self) -> int:
        """Lags of the PV in the regression [-]."""
        return _order(self.pv.size)


class Trials(NamedTuple):
    """Valves tried."""

    valve: NDArray[np.float64]
    """S [% of span], J / S [-], 1 for a stem that rests after every sample, place at the start; shape (n, 4)."""
    cost: NDArray[np.float64]
    """N ln(sum of squares / N): minus twice the log likelihood but for a constant, shape (n,)."""

    @property
    def best(self) -> NDArray[np.float64]:
        """The most likely valve, shape (4,)."""
        return self.valve[int(np.argmin(self.cost))]


def prediction_of(signals: Signals, *, fine: bool = False) -> Prediction:
    """Set up the regression.

    Parameters
    ----------
    signals : Signals
        The whole record.
    fine : bool
        Whether the signals are those of the last searches.

    Returns
    -------
    Prediction
        What is foretold; the first cycle is left out, since where the stem stood before it is not known.
    """
    n, first = signals.pv.size, 0
    op, pv = signals.op, signals.pv
    if n > MOST_SAMPLES:
        first, n = (n - MOST_SAMPLES) // 2, MOST_SAMPLES
        op = np.ascontiguousarray(op[first * signals.thinned : (first + n) * signals.thinned])
        pv = pv[first : first + n]
    scale = signals.scale if signals.half > 0 else UNKNOWN_SCALE
    lags = int(min(max(0.35 * scale, 8.0), LONGEST[fine], n // 8))
    edges = list(range(1, ONE_BY_ONE + 1))
    while edges[-1] < lags + 1:
        edges.append(min(int(np.ceil(1.25 * edges[-1])), lags + 1))
    edges = [edge for edge in edges if edge <= lags + 1]
    begin = max(int(min(scale, n // 4)), lags + 1, _order(n) + 1)
    count = max(round(2.0 * (n - begin) / max(scale, 8.0)), 4)
    ends = np.linspace(begin, n, count + 1).round().astype(np.int64)[1:]
    pv = pv - pv.mean()
    return Prediction(op, signals.thinned, pv / pv.std(), np.array(edges, dtype=np.int64), begin, ends, first)


def most_likely(prediction: Prediction, fine: Prediction, swing: float) -> Trials:
    """Search the plane: in short windows, where the dip is wide, then from their valleys in the whole record.

    Parameters
    ----------
    prediction, fine : Prediction
        What is foretold, for the coarse and for the last searches.
    swing : float
        Largest S to look for [% of span].

    Returns
    -------
    Trials
        The valves tried on the whole record in the last searches.
    """
    valleys = []
    for window in _windows(prediction):
        tried = _try(window, _plane(swing, N_S, N_J, N_PLACES))
        tried = _closer(window, tried, IN_WINDOW, swing)
        valleys += _valleys(tried, *FROM_WINDOW)
    tried = _try(prediction, _plane(swing, *COARSE, 1))
    valleys += _valleys(tried, *FROM_WHOLE)
    # Where the stem stood when a window began says nothing of where it stood when the record did.
    seeds = [_grid(valley[:1], valley[1:2], valley[2], PLACES[int(valley[2])], swing) for valley in valleys]
    tried = _more(tried, _try(prediction, np.concatenate(seeds)))
    if fine.width < prediction.width:
        tried = _closer(prediction, tried, STAGES[:1], swing)
        # Of each S and each J the best, since a finer record may prefer another.
        again = np.concatenate([tried.valve[one_each(tried)], tried.valve[np.argsort(tried.cost)[:100]]])
        tried = _try(fine, again)
    tried = _closer(fine, tried, STAGES[:1], swing)
    return _closer(fine, _fanned(fine, tried, swing), STAGES[1:], swing)


def _fanned(prediction: Prediction, tried: Trials, swing: float) -> Trials:
    """Look about the best valve in steps fine enough for the dip of a few cycles, at every J and by both rules.

    The valleys of the coarse grids can all lie beside a dip narrower than their steps; the best of them is then off by
    a tenth or two. Of 158 simulated loops whose true valve is more likely than any that was tried (seeds 201 and 202)
    the fan finds the dip of 72 when it reaches 1.3 either way.
    """
    best = tried.best
    good = _try(prediction, good_valve(best)).cost[0]
    if good - tried.cost.min() < WORTH:
        return tried
    reach = int(np.log(FAN_REACH) / FAN_STEP)
    S = best[0] * np.exp(FAN_STEP * np.arange(-reach, reach + 1))
    S, ratio = S[swing > S], np.linspace(0.0, 1.0, FAN_J)
    n = prediction.pv.size
    size = min(n, FAN_SAMPLES)
    middle = _window(prediction, (n - size) // 2, size, min(prediction.begin, size // 4))
    rests = _grid(S, ratio, 1.0, np.linspace(-0.8, 0.8, FAN_PLACES), swing)
    fan = _try(middle, np.concatenate([_grid(S, ratio, 0.0, np.zeros(1), swing), rests]))
    about = 1.0 + 0.5 * FAN_STEP * np.arange(-1, 2)
    seeds = [
        _grid(valley[0] * about, valley[1:2], valley[2], PLACES[int(valley[2])], swing)
        for valley in _valleys(fan, *FAN_VALLEYS)
    ]
    return _more(tried, _try(prediction, np.concatenate(seeds)))


def _windows(prediction: Prediction) -> list[Prediction]:
    """Short stretches: a slip too early or too late leaves its mark on fewer slips after it."""
    n = prediction.pv.size
    cycle = 2.0 * prediction.samples / prediction.ends.size
    size = int(min(n, max(CYCLES * cycle, SHORTEST)))
    count = max(1, min(WINDOWS, n // size))
    begin = min(prediction.begin // 2, size // 3)
    return [_window(prediction, first, size, begin) for first in np.linspace(0, n - size, count).astype(int)]


def _window(prediction: Prediction, first: int, size: int, begin: int) -> Prediction:
    """Part of the record, foretold from `begin` on or from where the lags allow."""
    width = prediction.width
    return prediction._replace(
        op=np.ascontiguousarray(prediction.op[first * width : (first + size) * width]),
        pv=np.ascontiguousarray(prediction.pv[first : first + size]),
        begin=max(begin, int(prediction.edges[-1]), prediction.order + 1),
    )


def _plane(swing: float, n_S: int, n_J: int, n_places: int) -> NDArray[np.float64]:
    """Valves of both rules over the plane."""
    S, ratio = np.geomspace(LEAST_SWING * swing, swing, n_S), np.linspace(0.0, 1.0, n_J)
    places = np.linspace(-0.6, 0.6, n_places) if n_places > 1 else np.zeros(1)
    goes_on = _grid(S, ratio, 0.0, np.zeros(1), swing)
    rests = _grid(S[2.0 * S[0] < S], ratio, 1.0, places, swing)
    return np.concatenate([goes_on, rests])


def _closer(
    prediction: Prediction, tried: Trials, stages: tuple[tuple[float, float, float, int], ...], swing: float
) -> Trials:
    """Go on about the best valleys, step by step."""
    steps = np.arange(-1, 2)
    for S_step, J_step, place_step, keep in stages:
        valleys = _valleys(tried, S_step, J_step, keep)
        about = [
            _grid(
                valley[0] * (1.0 + S_step * steps),
                np.unique(np.clip(valley[1] + J_step * steps, 0.0, 1.0)),
                valley[2],
                np.clip(valley[3] + place_step * steps, -1.0, 1.0),
                swing,
            )
            for valley in valleys
        ]
        # J is a wide valley along the narrow one of S: it moves the size of a slip, S its time.
        about += [
            _grid(valley[0] * (1.0 + S_step * steps), np.linspace(0.0, 1.0, ALONG_J), valley[2], valley[3:], swing)
            for valley in valleys[:FEW]
        ]
        tried = _more(tried, _try(prediction, np.concatenate(about)))
    return tried


def by_cycle(prediction: Prediction, valve: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum of squares that each valve leaves in each cycle.

    Parameters
    ----------
    prediction : Prediction
        What is foretold.
    valve : ndarray, shape (n, 4)
        Valves as in `Trials`.

    Returns
    -------
    ndarray, shape (n, n_cycles)
        Sums of squares.
    """
    return _errors(prediction, valve, prediction.ends)[1]


def one_each(trials: Trials) -> NDArray[np.int64]:
    """The most likely valve of each S and of each J.

    Parameters
    ----------
    trials : Trials
        Valves tried.

    Returns
    -------
    ndarray
        Their places among the trials, the most likely of all first.
    """
    order = np.argsort(trials.cost, kind="stable")
    S, ratio = trials.valve[order, 0], trials.valve[order, 1]
    bins = np.round(np.log(S) / S_BIN).astype(int), np.round(S * ratio / (J_BIN * S[0])).astype(int)
    first = np.concatenate([np.unique(one, return_index=True)[1] for one in bins])
    return order[np.unique(first)]


def stem_of(prediction: Prediction, valve: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stem position of one valve, sample by sample of OP.

    Parameters
    ----------
    prediction : Prediction
        What is foretold.
    valve : ndarray, shape (4,)
        A valve as in `Trials`.

    Returns
    -------
    ndarray, shape (n_samples * width,)
        Stem position [% of span].
    """
    mv, work = np.empty((1, prediction.op.size)), np.empty((3, 1))
    S, ratio, stops, place = (np.full(1, x) for x in valve)
    stems(prediction.op, 1, S, S * ratio, stops, place, work[0], work[1], work[2], mv)
    return mv[0]


def good_valve(valve: NDArray[np.float64]) -> NDArray[np.float64]:
    """A valve that follows OP: the same one with a band too small to matter.

    Parameters
    ----------
    valve : ndarray, shape (4,)
        A valve as in `Trials`.

    Returns
    -------
    ndarray, shape (1, 4)
        The good one.
    """
    return np.array([[1e-6 * valve[0], 0.0, 0.0, 0.0]])


def _order(n: int) -> int:
    """Lags of the PV for so many samples [-]."""
    return min(ORDER, n // 8)


def _try(prediction: Prediction, valve: NDArray[np.float64]) -> Trials:
    left = _errors(prediction, valve, np.empty(0, dtype=np.int64))[0]
    return Trials(valve, prediction.samples * np.log(left / prediction.samples))


def _errors(
    prediction: Prediction, valve: NDArray[np.float64], ends: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    S, ratio, stops, place = (np.ascontiguousarray(column) for column in valve.T)
    left, blocks = np.empty(S.size), np.empty((S.size, ends.size))
    work = desk(prediction.pv.size, prediction.order, prediction.edges)
    prediction_errors(
        prediction.op, prediction.width, prediction.pv, prediction.order, prediction.edges, prediction.begin, FLOOR,
        S, S * ratio, stops, place, ends, left, blocks, work,
    )  # fmt: skip
    return left, blocks


def _grid(
    S: NDArray[np.float64], ratio: NDArray[np.float64], stops: float, place: NDArray[np.float64], swing: float
) -> NDArray[np.float64]:
    """All combinations, shape (n, 4); a limit cycle needs OP_pp >= S."""
    valve = np.empty((S.size, ratio.size, place.size, 4))
    valve[..., 0] = np.minimum(S, swing)[:, np.newaxis, np.newaxis]
    valve[..., 1] = ratio[:, np.newaxis]
    valve[..., 2] = stops
    valve[..., 3] = place
    return valve.reshape(-1, 4)


def _more(one: Trials, other: Trials) -> Trials:
    return Trials(np.concatenate([one.valve, other.valve]), np.concatenate([one.cost, other.cost]))


def _valleys(tried: Trials, S_step: float, J_step: float, keep: int) -> list[NDArray[np.float64]]:
    """The most likely valves, each more than a step and a half away from the better ones."""
    order = np.argsort(tried.cost)[: 32 * LANES]
    rest = tried.valve[order]
    logs = np.column_stack([np.log(rest[:, 0]) / (1.5 * S_step), rest[:, 1] / (1.5 * J_step), rest[:, 2] * 1e3])
    chosen = np.empty(keep, dtype=np.int64)
    return list(rest[chosen[: apart(logs, chosen)]])
