"""Which valves predict the PV no worse than the best one, cycle by cycle: intervals of S and J, and the drift of S."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.interval import CHI2_1, FLOOR, NORMAL, student
from stiction.diagnosis.identification.likelihood import EQUAL, LAG_WORTH, Columns, Trial, by_cycle, good_valve
from stiction.diagnosis.identification.valleys import one_each
from stiction.diagnosis.identified import Rival
from stiction.models.compiled import summing

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Prediction, Trials

__all__ = ["OWN", "REBUILT", "UNSEEN", "UNTOLD", "Contest", "Known", "LookAlike", "contest", "drift", "vuong"]


class Known(NamedTuple):
    """How well what OP does between the samples of a record is known, and with it S.

    The limits and widths by how often the interval holds the truth of simulated sticky loops
    (`simulation.population`, seeds 311 to 313), the corrections by the median of S found over S.
    """

    S: float
    """Student's statistic, as of many cycles, up to which a valve stays in the interval of S [-]."""
    J: float
    """The same for J [-]."""
    behind: float = math.inf
    """Part of the likelihood of the likeliest valve over a good one, in twice its logarithm, by which a valve in the
    interval of S may be behind beside `STANDS_OUT` [-]: few cycles, some of which tell much, leave the statistic small
    though all together speak against a valve."""
    wide: float = 1.0
    """Factor up to which S may be off either way [-]."""
    beyond: float = 0.0
    """How much further OP goes between the samples than at them, at both ends of the band together, in standard
    deviations of its noise [-]: white noise of which one value in two or five is recorded would go 1.1 or 2.3 beyond a
    level, were OP not on its way."""
    goes_on: float = 0.0
    """Moves of OP from sample to sample, the median, by which S may be larger [-]: OP goes on between them, and means
    of it hide how far."""


OWN = Known(S=4.2, J=5.0, behind=0.6)
"""The record shows the controller's own samples. Of 1 008 such loops (seeds 20 and 311 to 313) the interval holds S in
0.944, of the 876 that are told in 0.954, and is 0.3 of S wide in the mean, wider than S in 0.05 of these. Without
`behind`, up to 3.7, it held S in 0.957 and 0.963, was 0.43 of S wide and wider than S in 0.14."""
REBUILT = Known(S=3.0, J=6.0, wide=1.25, beyond=0.4, goes_on=4.0)
"""One sample between each two is rebuilt by the controller's integral (see `between`). Of 234 such loops (seeds 311 to
313) it does in 0.95, and the median of S found over S is 1.00. Of 179 of a plant's historian (seed 26), whose
controllers run far more than twice to a sample, it does in 0.92, without `goes_on` in 0.88."""
UNSEEN = Known(S=2.5, J=6.5, behind=0.6, wide=1.3, beyond=0.85, goes_on=4.0)
"""What OP does between the samples trips the valve unseen. With `beyond` the median of S found over S is 0.99 in 808
loops (seeds 301 to 304), without it 0.94. Of 417 loops of a plant's historian (`plant_population`, seed 16) the
interval holds S in 0.93, without `goes_on` in 0.81, both without `behind`; of the first 97 that are slower than their
controller and not rebuilt in 0.99 and with `behind` in 0.96."""
UNTOLD = UNSEEN._replace(beyond=0.0)
"""Without a set point what the controller's law leaves may be that of one, and the samples the controller's own: of 47
such loops (seeds 10, 17, 18 and 20) 24 are. The median of S found over S is 1.00 in these and 0.98 in the others, with
`beyond` 1.05 and 1.00; S is within 10 % in 28 of 47, with it in 21."""
MOST = 60
"""Valves compared at most beside those [-]."""
HARDLY = 0.1
"""J / S up to which a valve hardly jumps [-]."""
STANDS_OUT = 12.0
"""Twice the log likelihood by which a sticky valve beats a good one in a stretch where it sticks: twice the 95 %
point of two parameters, since the best of many valves is taken [-]."""
FEWEST_STRETCHES = 4
"""Stretches below which no drift is told."""


class LookAlike(NamedTuple):
    """A good valve with something that makes its PV look like a sticky one's."""

    error: NDArray[np.float64]
    """Sum of squares that it leaves in each half cycle, shape (n_halves,)."""
    weights: float
    """Weights that it has beyond those of a good valve [-]: so much they are worth by chance in twice the log
    likelihood."""


class Contest(NamedTuple):
    """The most likely valve against its rivals."""

    valve: NDArray[np.float64]
    """Valves compared as in `Trials`; the first is the most likely, the last a good one. Shape (n, 5)."""
    error: NDArray[np.float64]
    """Sum of squares that each leaves in each half cycle, that of the good one less what `weights` are worth by chance,
    that of one whose actuator lags with what its lag must be worth; shape (n, n_halves)."""
    worse: NDArray[np.float64]
    """Student's statistic of each against the first over the half cycles [-], shape (n,)."""
    S_range: tuple[float, float]
    """95 % interval of S [% of span]."""
    J_range: tuple[float, float]
    """95 % interval of J [% of span]."""
    variance: float
    """Variance of what the most likely valve leaves."""
    likelier_than_play: float
    """Twice the log likelihood by which it beats the likeliest valve that hardly jumps [-]."""
    beyond: float
    """What S is larger by than the band that trips at the record's samples [% of span]; the interval has it."""
    weights: int = 0
    """Weights that a sticky valve has beyond those of a good one [-]: OP's lags, which to the latter are its stem's."""

    def over(self, rival: LookAlike) -> Rival:
        """By how much the first beats a good valve that looks like it."""
        return vuong((rival.error - self.error[0]) / self.variance, rival.weights - self.weights)

    @property
    def best(self) -> Trial:
        """The most likely valve."""
        return Trial(*self.valve[0].tolist())

    def best_in(self, cycles: slice) -> Trial:
        """The sticky valve that leaves least in some of the cycles."""
        left = self.error[:-1, cycles].sum(axis=1) / self.variance
        return Trial(*self.valve[int(np.argmin(np.round(left, EQUAL)))].tolist())

    def likelier_than_good(self, parts: int = 1) -> float:
        """Twice the log likelihood by which the first beats a good valve, in the best stretch of 1 / `parts` [-]."""
        by_half = (self.error[-1] - self.error[0]) / self.variance
        width = max(by_half.size // parts, 1)
        sums = np.concatenate([[0.0], by_half.cumsum()])
        return float((sums[width:] - sums[:-width]).max())

    def likelier_in(self, cycles: slice) -> float:
        """Twice the log likelihood by which some sticky valve beats a good one in some of the cycles [-]."""
        left = self.error[:, cycles].sum(axis=1)
        return float(left[-1] - left[:-1].min()) / self.variance

    def bootstrap(self, draws: int = 200, seed: int = 0) -> tuple[float, float]:
        """Ends between which S of the likeliest valve lies in 95 of 100 draws of the half cycles [% of span]."""
        n = self.error.shape[1]
        weights = np.random.default_rng(seed).multinomial(n, np.full(n, 1.0 / n), draws)
        left = np.empty((draws, len(self.error) - 1))
        drawn_errors(self.error, weights.astype(np.float64), left)
        left /= self.variance
        drawn = Columns(*self.valve.T).S[np.round(left, EQUAL).argmin(axis=1)] + self.beyond
        low, high = np.quantile(drawn, (0.025, 0.975))
        return float(low), float(high)


def contest(prediction: Prediction, trials: Trials, known: Known) -> Contest:
    r"""Compare the valves tried, one for each S and each J, with the most likely.

    .. math:: t = \bar d\,\sqrt{n} \Big/ s_d, \qquad d_c = (e_c - e_c^*)\, N \Big/ \sum_c e_c^*, \quad c = 1 \dots n

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    trials : Trials
        Every valve tried.
    known : Known
        How well what OP does between the samples is known.

    Returns
    -------
    Contest
        The valves compared and the intervals.

    Notes
    -----
    No (S, J) valve is the true one, so that the curvature of the likelihood says too little of the error. Vuong's
    test asks whether a rival predicts worse by its own scatter from half cycle to half cycle, a slip each. A rival
    less than 3.84 in twice the log likelihood behind is never left out.

    Between samples that are not the controller's own the noise on OP trips the valve: the band that trips at the
    samples is smaller than S, by what OP goes beyond its samples, and no likelihood tells S within a third, nor, where
    OP moves far from sample to sample, within some of these moves (see `Known`).

    References
    ----------
    vuong1989.
    """
    best = trials.best
    chosen = one_each(trials)
    close = np.flatnonzero(trials.cost < trials.cost[chosen[0]] + CHI2_1)[:MOST]
    chosen = np.concatenate([chosen, close])
    valve = np.concatenate([trials.valve[chosen], good_valve(best)])
    error = by_cycle(prediction, valve)
    variance = float(error[0].sum()) / prediction.samples
    S, ratio, _, _, lag = Columns(*valve.T)
    n = error.shape[1]
    error[-1] -= variance * prediction.op_order / n  # what a sticky valve's weights alone are worth
    error[lag > 0.0] += variance * LAG_WORTH / n
    apart = (error - error[0]) / variance
    behind = apart.sum(axis=1)
    worse = behind / np.sqrt(np.maximum(n * apart.var(axis=1, ddof=1), 1e-300))
    few = student(n - 1) / NORMAL
    S, J = S[:-1], (S * ratio)[:-1]
    beyond = known.beyond * _noise(prediction.op)
    least = FLOOR * best.S
    most = STANDS_OUT + known.behind * max(float(behind[-1]), 1.0)

    def ends(x: NDArray[np.float64], limit: float, most: float, low: float, high: float) -> tuple[float, float]:
        inside = x[((worse[:-1] < few * limit) & (behind[:-1] < most)) | (behind[:-1] < CHI2_1)]
        return max(min(float(inside.min()), low), 0.0), max(float(inside.max()), high)

    size, jump = best.S + beyond, best.S * best.ratio
    away = known.goes_on * float(np.median(np.abs(np.diff(prediction.op))))
    low, high = min(size / known.wide, size - least), max(size * known.wide, size + away, size + least)
    S_low, S_high = ends(S + beyond, known.S, most, low, high)
    # A valve that slips in both directions sticks by no more than OP swings.
    S_range = S_low, min(S_high, max(float(np.ptp(prediction.op)), size + least))
    J_range = ends(J, known.J, np.inf, jump - least, jump + least)
    small = trials.cost[trials.columns.ratio < HARDLY]
    likelier_than_play = float(small.min() - trials.cost.min()) if small.size else 0.0
    return Contest(valve, error, worse, S_range, J_range, variance, likelier_than_play, beyond, prediction.op_order)


@summing
def drawn_errors(error, weights, left):
    """Fill `left` (n_draws, n_valves) with what valves leave in `weights` (n_draws, n_halves) times each half.

    Not by `@`: the threads of a linear algebra library take longer to start than so small a product takes.
    """
    for d in range(left.shape[0]):
        drawn = weights[d]
        for i in range(left.shape[1]):
            by_half, total = error[i], 0.0
            for c in range(drawn.shape[0]):
                total += drawn[c] * by_half[c]
            left[d, i] = total


def vuong(by_half: NDArray[np.float64], free: float = 0.0) -> Rival:
    """Vuong's test of two models.

    Parameters
    ----------
    by_half : ndarray, shape (n_halves,)
        Twice the log likelihood by which one beats the other in each half cycle [-].
    free : float
        What the other is worth by chance in all of them together, for weights of its own [-].

    Returns
    -------
    Rival
        By how much the one beats the other.

    References
    ----------
    vuong1989.
    """
    total = float(by_half.sum()) + free
    return Rival(total / math.sqrt(max(by_half.size * float(by_half.var(ddof=1)), 1e-300)), total)


def _noise(op: NDArray[np.float64]) -> float:
    """Standard deviation of the noise on OP [% of span], from its third differences, which its cycle hardly moves."""
    third = np.diff(op, 3)
    return float(np.median(np.abs(third - np.median(third)))) / (0.6745 * math.sqrt(20.0))


def drift(hours: Sequence[float], S: Sequence[float]) -> tuple[float, float]:
    """Slope of S over time and its standard error [% of span per h], by least squares; NaN of too few stretches.

    Parameters
    ----------
    hours : sequence of float
        Middle of each stretch [h].
    S : sequence of float
        S of each stretch [% of span].

    Returns
    -------
    tuple of float
        Slope and standard error.
    """
    n = len(hours)
    if n < FEWEST_STRETCHES:
        return math.nan, math.nan
    t, y = np.asarray(hours) - np.mean(hours), np.asarray(S) - np.mean(S)
    spread = float(t @ t)
    slope = float(t @ y) / spread
    left = y - slope * t
    return slope, math.sqrt(float(left @ left) / (n - 2) / spread)
