"""Likelihood of a valve: how well its position predicts the PV one sample ahead.

An autoregression with exogenous input (ARX) predicts each PV from earlier PVs, earlier OPs and earlier valve
positions. It models process and disturbance together, so that a load, an outside oscillation or a drift is
predicted from the PV's past and does not count against a valve. Candidate valves are compared by the residual sum of
squares that their positions leave.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.diagnosis.identification.candidates import evaluated
from stiction.diagnosis.identification.stems import as_valve_arrays, lag_products, valve_positions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.candidates import Candidates

__all__ = ["Regression", "build_regression", "one_thread", "standardise"]


@dataclass(frozen=True, eq=False)
class Regression:
    """The part of the ARX model that is the same for every valve, solved once."""

    op: NDArray[np.float64]
    """OP at the rate at which valve positions are simulated [% of span], shape (n_blocks * per_block,)."""
    per_block: int
    """Samples of `op` for each sample of the PV [-]."""
    pv: NDArray[np.float64]
    """PV, block means, standardised [-], shape (n_blocks,)."""
    first: int
    """First block that is predicted."""
    edges: tuple[int, ...]
    """Lags of the valve position at which a group of lags with one weight begins, and the end of the last [blocks]."""
    basis: NDArray[np.float64]
    """Orthonormal basis of the regressors that all valves share, shape (n_shared, n_predicted)."""
    target: NDArray[np.float64]
    """What the shared regressors leave of the PV [-], shape (n_predicted,)."""
    op_means: NDArray[np.float64]
    """OP, block means, standardised [-], shape (n_blocks,)."""
    groups: NDArray[np.int64]
    """Group of each lag of the valve position, from lag 1 on."""
    first_products: NDArray[np.float64]
    """A position times this is what `lag_products` begins with, shape (n_blocks, n_products)."""
    weights: NDArray[np.float64]
    """The basis as combinations of a constant, PV lags and OP lags, each from the longest, shape (n_lags, n_basis)."""
    pv_in_basis: NDArray[np.float64]
    """The predicted PV in terms of the basis [-], shape (n_basis,)."""
    pv_lags: int
    """Lags of PV among the shared regressors [-]."""
    op_lags: int
    """Lags of OP among the shared regressors [-]."""
    predicted: NDArray[np.bool_]
    """Whether a block from `first` on is predicted: not in a gap nor so soon after it that an earlier PV is in it."""
    half_cycles: int
    """Half cycles among the predicted samples [-]."""

    @property
    def n_predicted(self) -> int:
        """Samples predicted [-]."""
        return self.target.size

    def positions(self, valves: NDArray[np.float64]) -> NDArray[np.float64]:
        """Valve positions, block means, of candidate rows (S, J / S, rests, start), shape (n_valves, n_blocks)."""
        out = np.empty((len(valves), self.pv.size))
        valve_positions(self.op, self.per_block, *as_valve_arrays(valves), out)
        return out

    def evaluate(self, valves: NDArray[np.float64]) -> Candidates:
        """Candidate valves, rows of (S, J / S, rests, start), with their costs."""
        return evaluated(valves, lambda some: self.cost_of_positions(self.positions(some)))

    def cost_of_positions(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Minus twice the log likelihood of valve positions, but for a constant [-], shape (n_valves,)."""
        return self._solve(*self._products(positions))[1]

    def cost_of_regressors(self, regressors: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same of given regressors, shape (n_candidates, n_regressors, n_predicted)."""
        return self._solve(*self._products_of_regressors(regressors))[1]

    def residuals(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Prediction errors with given valve positions [-], shape (n_valves, n_predicted)."""
        regressors = self._lag_sums(positions)
        weights, _ = self._solve(*self._products_of_regressors(regressors))
        explained = np.einsum("vg,vgk->vk", weights, regressors)
        return self.target - (explained - (explained @ self.basis.T) @ self.basis)

    def gain_over_error(self, position: NDArray[np.float64]) -> float:
        """Steady gain from a valve position to the PV over its standard error [-]; 0 of a position that rests."""
        if not float(np.ptp(position)) > 0.0:
            return 0.0
        sums = self._lag_sums(position[np.newaxis])[0]
        free = sums - (sums @ self.basis.T) @ self.basis
        size = np.sqrt((sums**2).sum(axis=1)) + TINY
        normal = free @ free.T / size / size[:, np.newaxis] + GAIN_RIDGE * np.eye(len(size))
        right, lags = free @ self.target / size, np.diff(self.edges) / size
        weights, spread = np.linalg.solve(normal, np.column_stack([right, lags])).T
        error = float(self.target @ self.target - weights @ right)
        variance = float(lags @ spread) * max(error, MIN_ERROR * self.n_predicted) / self.n_predicted
        return float(lags @ weights / np.sqrt(variance))

    def _lag_sums(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sums of the lags of each group, shape (n_valves, n_groups, n_predicted)."""
        n, first = self.pv.size, self.first
        total = np.zeros((len(positions), n + 1))
        np.cumsum(positions - positions.mean(axis=1, keepdims=True), axis=1, out=total[:, 1:])
        sums = [
            total[:, first - low + 1 : n - low + 1] - total[:, first - high + 1 : n - high + 1]
            for low, high in zip(self.edges[:-1], self.edges[1:], strict=True)
        ]
        return self.choose(np.stack(sums, axis=1))

    def choose(self, blocks: NDArray[np.float64]) -> NDArray[np.float64]:
        """The predicted ones of the blocks from `first` on, along the last axis."""
        return blocks if self.predicted.all() else blocks[..., self.predicted]

    def _products_of_regressors(self, regressors: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Products of regressors with the basis, with each other and with the target, of each candidate."""
        squares = regressors @ regressors.transpose(0, 2, 1)
        return regressors @ self.basis.T, squares, regressors @ self.target

    def _products(self, positions: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """The same of the lag sums of positions, in a record without gaps without forming them."""
        if not self.predicted.all():
            return self._products_of_regressors(self._lag_sums(positions))
        x = positions - positions.mean(axis=1, keepdims=True)
        own = np.zeros((len(x), len(self.edges) - 1, len(self.edges) - 1))
        shared = np.zeros((*own.shape[:2], len(self.weights)))
        lag_products(
            x, self.pv, self.op_means, self.first, self.groups, x @ self.first_products, self.pv_lags + 1,
            np.empty(2 * self.groups.size + len(self.weights) - 1), own, shared,
        )  # fmt: skip
        with_basis = (shared.reshape(-1, len(self.weights)) @ self.weights).reshape(*own.shape[:2], -1)
        return with_basis, own, shared[:, :, 1 + self.pv_lags] - with_basis @ self.pv_in_basis

    def _solve(
        self, shared: NDArray[np.float64], squares: NDArray[np.float64], right: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Weights of the regressors and their cost [-], by normal equations without the shared part."""
        size = np.sqrt(np.einsum("vgg->vg", squares)) + TINY
        normal = (squares - shared @ shared.transpose(0, 2, 1)) / size[:, :, None] / size[:, None, :]
        normal[:, range(normal.shape[1]), range(normal.shape[1])] += RIDGE
        right = right / size
        weights = np.linalg.solve(normal, right[..., None])[..., 0]
        error = (float(self.target @ self.target) - (weights * right).sum(axis=1)) / self.n_predicted
        return weights / size, self.n_predicted * np.log(np.maximum(error, MIN_ERROR))


PV_LAGS, OP_LAGS, SINGLE_LAGS = 12, 4, 8
"""Earlier PVs and OPs in the regression, and lags of the valve position with a weight of their own [-]."""
MAX_POSITION_LAG = 48
"""Longest lag of the valve position [blocks]."""
TINY = 1e-150
"""Size of a regressor that is constant [-]."""
RIDGE = 1e-10
"""Added to the diagonal of the scaled normal equations, since lags of a resting valve are collinear [-]."""
GAIN_RIDGE = 1e-8
"""The same where the standard error of a gain is wanted [-]."""
MIN_ERROR = 1e-8
"""Smallest error, as a share of the variance of what is compared [-]: data without noise are rounded data."""


def standardise(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a signal about its mean over its standard deviation [-]; zeros where it is constant."""
    x = x - x.mean()
    spread = float(x.std())
    return x / spread if spread > 0.0 else x


def build_regression(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    per_block: int,
    time_scale: float,
    *,
    max_position_lag: int = MAX_POSITION_LAG,
    gaps: NDArray[np.bool_] | None = None,
) -> Regression:
    """Set up the regression of one record.

    `op` [% of span] has `per_block` values for each block mean of `pv` [engineering units]; `time_scale` is the period
    of the oscillation, or another time in which the process responds [blocks]. The longest lag of the valve position is
    `max_position_lag` blocks, and at most 0.35 time scales; lags above `SINGLE_LAGS` share weights in groups that grow
    by a quarter from one to the next.

    Lags begin at 1: a valve position of the same sample would predict the noise that the controller passes from the
    PV to the OP. A PV in one of the `gaps` neither is predicted nor predicts. The first cycle is not predicted, because
    where the stem stood before the record is not known.
    """
    n = pv.size
    longest = int(min(max(0.35 * time_scale, 8.0), max_position_lag, n // 8))
    edges = list(range(1, min(SINGLE_LAGS, longest + 1) + 1))
    while edges[-1] < longest + 1:
        edges.append(min(int(np.ceil(1.25 * edges[-1])), longest + 1))
    pv_lags = min(PV_LAGS, n // 8)
    op_lags = min(OP_LAGS, pv_lags)
    first = max(int(min(time_scale, n // 4)), longest + 1, pv_lags + 1)
    y, u = standardise(pv), standardise(op.reshape(n, per_block).mean(axis=1))
    lagged = [(y, lag) for lag in range(pv_lags + 1)] + [(u, lag) for lag in range(1, op_lags + 1)]
    rows = np.array([np.ones(n - first), *(x[first - lag : n - lag] for x, lag in lagged)])
    predicted = np.ones(n - first, dtype=bool) if gaps is None else ~_reaches(gaps, pv_lags)[first:]
    predicted |= 2 * np.count_nonzero(predicted) < n - first  # so many short gaps that the filled values must serve
    y_predicted = rows[1, predicted]
    rows[1] = 0.0
    basis, weights = orthonormal_rows(rows[:, predicted])
    target = y_predicted - (y_predicted @ basis.T) @ basis
    count = max(round(2.0 * target.size / max(time_scale, 8.0)), 4)
    longest_first = [0, *range(pv_lags + 1, 0, -1), *range(pv_lags + 1 + op_lags, pv_lags + 1, -1)]
    return Regression(
        np.ascontiguousarray(op), per_block, y, first, tuple(edges), basis, target, u,
        groups=np.repeat(np.arange(len(edges) - 1), np.diff(edges)),
        first_products=_first_products(y, u, first, longest, pv_lags, op_lags), weights=weights[longest_first],
        pv_in_basis=basis @ y_predicted, pv_lags=pv_lags, op_lags=op_lags, predicted=predicted,
        half_cycles=min(count, target.size),
    )  # fmt: skip


def _reaches(gaps: NDArray[np.bool_], lags: int) -> NDArray[np.bool_]:
    """Where a gap lies in this block or in one of the `lags` before."""
    total = np.concatenate([np.zeros(lags + 1, dtype=np.int64), np.cumsum(gaps)])
    return total[lags + 1 :] > total[: -lags - 1]


def _first_products(
    pv: NDArray[np.float64], op: NDArray[np.float64], first: int, longest: int, pv_lags: int, op_lags: int
) -> NDArray[np.float64]:
    """Columns whose products with a position are those that `lag_products` begins with."""
    pairs = [(1, pv, lag) for lag in range(pv_lags, -1, -1)] + [(1, op, lag) for lag in range(op_lags, 0, -1)]
    pairs += [(lag, pv, 0) for lag in range(2, longest + 1)] + [(lag, op, 1) for lag in range(2, longest + 1)]
    n = pv.size
    columns = np.zeros((n, len(pairs)))
    for k, (of_position, signal, lag) in enumerate(pairs):
        columns[first - of_position : n - of_position, k] = signal[first - lag : n - lag]
    return columns


def orthonormal_rows(rows: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Orthonormal basis of the row space, and the weights which make it of the rows, shape (n_rows, n_basis).

    Rows that are nearly combinations of earlier ones are left out.
    """
    Q, R = np.linalg.qr(rows.T)
    size = np.abs(np.diag(R))
    used = size > 1e-9 * size.max()
    if not used.all():
        Q, R = np.linalg.qr(rows[used].T)
    weights = np.zeros((len(rows), R.shape[0]))
    weights[used] = np.linalg.inv(R)
    return np.ascontiguousarray(Q.T), weights


@cache
def _thread_pools() -> Any:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def one_thread() -> Any:
    """Context in which the linear algebra library uses one thread: its matrices are too small to share."""
    return _thread_pools().limit(limits=1, user_api="blas")
