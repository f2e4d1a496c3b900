"""The likelihood of a valve: how well its stem predicts the PV.

Prediction errors rather than simulation errors decide (see `prediction`): with the loop closed, a disturbance goes
round through the controller and would otherwise pass for an answer of the process. The likelihood of a valve is
-N/2 ln(sum of squares). Two rules of motion are tried, since a stem on a noisy OP that goes on moving (Kano, Choudhury)
and one that rests after every sample (He, Stenman) go different ways.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.prediction import SIDE, behind_lag, desk, in_line, prediction_errors, stems
from stiction.diagnosis.identification.regression import left_over, past
from stiction.diagnosis.identification.side_by_side import LANES

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from stiction.diagnosis.identification.signals import Signals

__all__ = [
    "Columns",
    "Prediction",
    "Trial",
    "Trials",
    "by_cycle",
    "errors_of",
    "good_valve",
    "joined",
    "kept",
    "prediction_of",
    "scaled",
    "stem_of",
    "trials_of",
    "valves",
]

# What half and twice of each does is counted in docs/verdict-measured.md, "What each constant of the search brings".
ORDER = 12
"""Lags of the PV in the regression, at most [-]; fewer where a record is very short."""
OP_ORDER = 4
"""Lags of OP beside them, at most [-]: of 440 simulated sticky loops (`simulation.population`, seed 31, J visible) S is
within 10 % in 0.736 with so many, in 0.730 without and in 0.725 with eight (by a script of ours)."""
ONE_BY_ONE = 8
"""Lags of the stem that have a weight of their own; longer ones share theirs in groups [-]."""
LONGEST = 24, 48
"""Longest lag of the stem, for the coarse and for the last searches [samples]."""
EQUAL = 5
"""Decimals of the cost that count: valves that slip alike cost the same, and rounding shall not choose [-]."""
FLOOR = 1e-8
"""Prediction error that none falls below, as a share of the PV's variance [-]: noise-free data are rounded data."""
LAG_WORTH = 8.0
"""Twice the log likelihood that a lag of the actuator has to be worth [-]."""
MOST_SAMPLES = 4000
"""Samples predicted at most, those in the middle of the record: more tell S no better, and take longer [-]."""
TINY = float(np.finfo(float).tiny)
"""Standard deviation of a signal that rests, to be divided by [its unit]."""
NONE = np.empty(0, dtype=np.int64)
"""No samples."""
UNKNOWN_SCALE = 36.0
"""Samples taken for a cycle where no period is known [-]."""


class Prediction(NamedTuple):
    """What is predicted, and from what."""

    op: NDArray[np.float64]
    """Controller output [% of span], shape (n_samples * width,)."""
    width: int
    """Samples of OP to one of the PV."""
    pv: NDArray[np.float64]
    """PV over its standard deviation, about its mean [-], shape (n_samples,)."""
    op_mean: NDArray[np.float64]
    """Mean of OP over each sample of the PV, over its standard deviation, about its mean [-], shape (n_samples,)."""
    edges: NDArray[np.int64]
    """Lags at which groups of the stem's lags begin [samples]."""
    begin: int
    """First sample predicted."""
    ends: NDArray[np.int64]
    """Samples at which half cycles end, a slip each, shape (n_halves,)."""
    first: int = 0
    """Where it begins in the whole record [samples of the PV]."""
    most: int = ORDER
    """Lags of the PV in the regression, at most [-]."""
    most_op: int = OP_ORDER
    """Lags of OP beside them, at most [-]."""
    shocks: NDArray[np.int64] = NONE
    """Samples that are not predicted, increasing, none before `begin`, shape (n_shocks,)."""
    spread: float = 1.0
    """The PV's standard deviation, by which it was divided [engineering units]."""

    @property
    def samples(self) -> int:
        """Samples predicted [-]."""
        return self.pv.size - self.begin - self.shocks.size

    @property
    def order(self) -> int:
        """Lags of the PV in the regression [-]."""
        return min(self.most, self.pv.size // 8)

    @property
    def op_order(self) -> int:
        """Lags of OP beside them [-]."""
        return min(self.most_op, self.order)


class Trial(NamedTuple):
    """A valve that is tried."""

    S: float
    """Band [% of span]."""
    ratio: float
    """J / S [-]."""
    K: float
    """0 for a stem that goes on; of one that rests after every sample how far its slip goes [-], He and Wang's K: 1 to
    its balance, J from the edge of the band, up to 2 as much further as OP is beyond that edge."""
    place: float
    """Where the stem begins, in half bands off the first OP [-]."""
    lag: float
    """Lag of the actuator [samples of OP]."""


class Columns(NamedTuple):
    """The same of many valves, shape (n,) each."""

    S: NDArray[np.float64]
    ratio: NDArray[np.float64]
    K: NDArray[np.float64]
    place: NDArray[np.float64]
    lag: NDArray[np.float64]


class Trials(NamedTuple):
    """Valves tried."""

    valve: NDArray[np.float64]
    """A `Trial` a row, shape (n, 5)."""
    cost: NDArray[np.float64]
    """N ln(sum of squares / N): minus twice the log likelihood but for a constant, and what a lag has to be worth;
    shape (n,)."""

    def ranked(self) -> NDArray[np.int64]:
        """Places of the trials, the most likely first, shape (n,)."""
        return np.argsort(np.round(self.cost, EQUAL), kind="stable")

    @property
    def columns(self) -> Columns:
        """Their parameters."""
        return Columns(*self.valve.T)

    @property
    def best(self) -> Trial:
        """The most likely valve."""
        return Trial(*self.valve[int(np.argmin(np.round(self.cost, EQUAL)))].tolist())

    @property
    def rests(self) -> NDArray[np.bool_]:
        """Which stems rest after every sample, shape (n,)."""
        return self.columns.K > 0.0

    def without_lag(self) -> Trials:
        """Those whose actuator does not lag."""
        prompt = self.columns.lag == 0.0
        return Trials(self.valve[prompt], self.cost[prompt])


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
        What is predicted; the first cycle is left out, since where the stem stood before it is not known.
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
    begin = max(int(min(scale, n // 4)), lags + 1, min(ORDER, n // 8) + 1)
    count = max(round(2.0 * (n - begin) / max(scale, 8.0)), 4)
    ends = np.linspace(begin, n, count + 1).round().astype(np.int64)[1:]
    op_mean = op.reshape(n, signals.thinned).mean(axis=1)
    edges = np.array(edges, dtype=np.int64)
    spread = max(float(pv.std()), TINY)
    return Prediction(op, signals.thinned, scaled(pv), scaled(op_mean), edges, begin, ends, first, spread=spread)


def scaled(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """A signal about its mean, over its standard deviation [-]; OP may rest."""
    x = x - x.mean()
    return x / max(float(x.std()), TINY)


def valves(
    S: ArrayLike, ratio: ArrayLike, K: float, place: ArrayLike, swing: float, lag: float = 0.0
) -> NDArray[np.float64]:
    """All combinations.

    Parameters
    ----------
    S : array_like
        S [% of span]; none is taken larger than `swing`, since a limit cycle needs OP_pp >= S.
    ratio : array_like
        J / S [-].
    K : float
        0 for a stem that goes on, 1 to 2 for one that rests after every sample [-].
    place : array_like
        Place at the start [half bands].
    swing : float
        Largest S [% of span].
    lag : float
        Lag of the actuator [samples of OP].

    Returns
    -------
    ndarray, shape (n, 5)
        Valves as in `Trials`.
    """
    S, ratio, place = np.minimum(np.atleast_1d(S), swing), np.atleast_1d(ratio), np.atleast_1d(place)
    valve = np.empty((S.size, ratio.size, place.size, len(Trial._fields)))
    for column, values in enumerate((S[:, np.newaxis, np.newaxis], ratio[:, np.newaxis], K, place, lag)):
        valve[..., column] = values
    return valve.reshape(-1, len(Trial._fields))


def trials_of(prediction: Prediction, valve: NDArray[np.float64]) -> Trials:
    """Try valves.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    valve : ndarray, shape (n, 5)
        Valves as in `Trials`.

    Returns
    -------
    Trials
        The same with the cost of each.
    """
    left = _errors(prediction, valve, NONE)[0]
    cost = prediction.samples * np.log(left / prediction.samples)
    tried = Trials(valve, cost)
    cost[tried.columns.lag > 0.0] += LAG_WORTH
    return tried


def joined(one: Trials, other: Trials) -> Trials:
    """Two sets of trials as one.

    Parameters
    ----------
    one, other : Trials
        Valves tried on the same record.

    Returns
    -------
    Trials
        Both.
    """
    return Trials(np.concatenate([one.valve, other.valve]), np.concatenate([one.cost, other.cost]))


def by_cycle(prediction: Prediction, valve: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum of squares that each valve leaves in each half cycle.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    valve : ndarray, shape (n, 5)
        Valves as in `Trials`.

    Returns
    -------
    ndarray, shape (n, n_halves)
        Sums of squares.
    """
    return _errors(prediction, valve, prediction.ends)[1]


def errors_of(prediction: Prediction, mv: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sum of squares that each of some stems leaves.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    mv : ndarray, shape (n, n_samples)
        Stem positions, a row each.

    Returns
    -------
    tuple of ndarray
        Of all samples, shape (n,), and of each half cycle, shape (n, n_halves).
    """
    pv, op_mean, order, op_order, edges, begin, shocks = (
        in_line(prediction.pv, prediction.begin), in_line(prediction.op_mean, prediction.begin - 1), prediction.order,
        prediction.op_order, prediction.edges, prediction.begin, prediction.shocks,
    )  # fmt: skip
    ends, n = prediction.ends, mv.shape[0]
    left, blocks = np.empty(n), np.empty((n, ends.size))
    work = desk(pv.size, prediction.width, order, op_order, edges, begin)
    energy = past(pv, op_mean, order, op_order, begin, shocks, work.own)
    for base in range(0, n, LANES):
        some = mv[base : base + LANES]
        work.mv[: len(some), : pv.size] = some
        left_over(
            pv, op_mean, len(some), order, op_order, edges, begin, shocks, FLOOR, energy, ends, base, left, blocks, work
        )
    return left, blocks


def stem_of(prediction: Prediction, valve: Trial) -> NDArray[np.float64]:
    """Stem position of one valve, sample by sample of OP.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    valve : Trial
        The valve.

    Returns
    -------
    ndarray, shape (n_samples * width,)
        Stem position [% of span].
    """
    mv, air = np.empty((1, prediction.op.size)), np.empty(prediction.op.size)
    S, ratio, K, place, lag = (np.full(1, x) for x in valve)
    behind_lag(prediction.op, float(kept(lag)[0]), air)
    stems(air, 1, 1, S, S * ratio, K, place, np.empty(7 * LANES), np.empty((SIDE, LANES)), mv)
    return mv[0]


def good_valve(valve: Trial) -> NDArray[np.float64]:
    """A valve that follows OP: the same one with a band too small to matter; a lag before it is the process's.

    Parameters
    ----------
    valve : Trial
        The sticky one.

    Returns
    -------
    ndarray, shape (1, 5)
        The good one, as in `Trials`.
    """
    return np.array([Trial(1e-6 * valve.S, 0.0, 0.0, 0.0, 0.0)])


def kept(lag: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of its way to OP that the air behind a lag still has before it after a sample.

    Parameters
    ----------
    lag : ndarray
        Lags [samples].

    Returns
    -------
    ndarray
        exp(-1 / lag); 0 of no lag.
    """
    return np.exp(-1.0 / np.maximum(lag, 1e-3))


def _errors(
    prediction: Prediction, valve: NDArray[np.float64], ends: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    S, ratio, K, place, lag = (np.ascontiguousarray(column) for column in valve.T)
    left, blocks = np.empty(S.size), np.empty((S.size, ends.size))
    order, op_order, begin = prediction.order, prediction.op_order, prediction.begin
    work = desk(prediction.pv.size, prediction.width, order, op_order, prediction.edges, begin)
    pv, op_mean = in_line(prediction.pv, begin), in_line(prediction.op_mean, begin - 1)
    prediction_errors(
        prediction.op, prediction.width, pv, op_mean, order, op_order, prediction.edges, begin, prediction.shocks,
        FLOOR, S, S * ratio, K, place, kept(lag), ends, left, blocks, work,
    )  # fmt: skip
    return left, blocks
