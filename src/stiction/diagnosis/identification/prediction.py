"""Prediction error of many valves at once: how well each stem, together with the past, predicts the PV.

A regression on lags of the PV and of the stem, their values so many samples before (ARX), takes process and disturbance
together: what a load, a wave from outside or a drift leave in a simulation is predicted from the PV's past, and what is
left is the part of the PV that is new in each sample. Slips are new. A few lags of OP stand beside those of the PV,
whatever the valve: OP holds what the controller saw of the PV, and where a record adds to that (noise, rounding, a PV
before its filter) a good valve would predict the PV by it, a sticky one could not. The regression is solved for each
valve from sums of products, which are those of neighbouring lags but for the edges of the window, so that a valve costs
three products for each lag and sample.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.lanes import resting_in_lane, stem_in_lane
from stiction.diagnosis.identification.regression import left_over, past
from stiction.diagnosis.identification.side_by_side import LANES, left_side_by_side
from stiction.models.compiled import kernel
from stiction.models.component import TIE

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["LANES", "Desk", "behind_lag", "desk", "prediction_errors", "stems"]

LINE = 8
"""Values in a line of the cache [-]."""
SIDE = 16
"""Samples after which their stem positions are turned from columns into rows [-]."""
X, MOVING, REACH, EDGE, JUMP, SLIP, GOES_ON = range(0, 7 * LANES, LANES)
"""Where each quantity of the lanes begins in the work space of `stems`. The distances are known when the kernel is
compiled: else it would ask at every sample whether they overlap."""


class Desk(NamedTuple):
    """Work space of `prediction_errors`, one for each thread."""

    air: NDArray[np.float64]
    """OP behind a lag of the actuator [% of span], shape (n_samples * width,)."""
    mv: NDArray[np.float64]
    """Stem positions, a valve a row, shape (n_lanes, n_samples or some more)."""
    valve: NDArray[np.float64]
    """Vectors: S, J, rule, place; shape (4, n_lanes)."""
    lane: NDArray[np.float64]
    """What `stems` knows of each stem, shape (7 * n_lanes,)."""
    mean: NDArray[np.float64]
    """Stem positions of some samples, a valve a column, shape (n_side, n_lanes)."""
    tall: NDArray[np.float64]
    """The same of all samples where the regression has no lags of OP, shape (n_samples, n_lanes)."""
    own: NDArray[np.float64]
    """Factored normal equations of the past, shape (n_past + 1, n_past + 3)."""
    edge: NDArray[np.float64]
    """Stems before the window's first sample and before the one past its last, shape (2, lags + 1, n_lanes)."""
    cross: NDArray[np.float64]
    """Products of the stem's lags with the PV now and the past, shape (lags + 1, n_past + 1, n_lanes)."""
    stem: NDArray[np.float64]
    """Products of the stem's lags with those up to them; column 0 their sums. Shape (lags + 1, lags + 1, n_lanes)."""
    group: NDArray[np.float64]
    """Products of a group of the stem's lags with each lag, shape (lags + 1, n_lanes)."""
    rows: NDArray[np.float64]
    """Normal equations of the groups, then their triangular root; last their scales. Shape (n_groups, n_weights + 1,
    n_lanes)."""
    weights: NDArray[np.float64]
    """Right side, then weights, shape (n_weights, n_lanes)."""
    left: NDArray[np.float64]
    """What the groups take of the sum of squares, shape (n_lanes,)."""
    share: NDArray[np.float64]
    """Weight of each lag, the constant first, shape (n_past + lags + 1,)."""
    residual: NDArray[np.float64]
    """What the regression leaves, shape (n_samples,)."""


def desk(n_samples: int, width: int, order: int, op_order: int, edges: NDArray[np.int64], begin: int) -> Desk:
    """Allocate what `prediction_errors` works in.

    Parameters
    ----------
    n_samples : int
        Length of the PV [samples].
    width : int
        Samples of OP to one of the PV.
    order, op_order : int
        Lags of the PV and of OP [-].
    edges : ndarray, shape (n_groups + 1,)
        Lags of the stem at which groups begin, and one past the last [samples].
    begin : int
        First sample predicted.

    Returns
    -------
    Desk
        Arrays without content.
    """
    lags, groups = int(edges[-1]) - 1, edges.size - 1
    n_past = order + op_order
    weights = 1 + n_past + groups
    return Desk(
        air=np.empty(n_samples * width),
        mv=_in_line(LANES, -(-n_samples // LINE) * LINE, begin - 1),
        valve=np.empty((4, LANES)),
        lane=np.empty(7 * LANES),
        mean=np.empty((SIDE, LANES)),
        tall=_in_line(0 if op_order else n_samples, LANES),
        own=np.empty((n_past + 1, n_past + 3)),
        edge=np.empty((2, lags + 1, LANES)),
        cross=np.empty((lags + 1, n_past + 1, LANES)),
        stem=np.empty((lags + 1, lags + 1, LANES)),
        group=np.empty((lags + 1, LANES)),
        rows=np.empty((groups, weights + 1, LANES)),
        weights=np.empty((weights, LANES)),
        left=np.empty(LANES),
        share=np.empty(n_past + lags + 1),
        residual=np.empty(n_samples),
    )


def in_line(x: NDArray[np.float64], at: int) -> NDArray[np.float64]:
    """A copy of a signal that the processor takes from sample `at` on without touching two lines of the cache at once.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        The signal [any unit].
    at : int
        Where most sums over it begin [samples].

    Returns
    -------
    ndarray, shape (n_samples,)
        The same values [unit of `x`].
    """
    copy = _in_line(1, x.size, at)[0]
    copy[:] = x
    return copy


def _in_line(rows: int, columns: int, at: int = 0) -> NDArray[np.float64]:
    """Room for rows of whole lines of the cache, column `at` of each at the beginning of one."""
    room = np.empty(rows * columns + LINE)
    skip = -(room.__array_interface__["data"][0] // room.itemsize + at) % LINE
    return room[skip : skip + rows * columns].reshape(rows, columns)


@kernel
def behind_lag(op, keep, air):
    """Fill `air` with `op` behind an actuator that keeps a share `keep` of its way to OP from sample to sample."""
    u = op[0]
    for i in range(op.shape[0]):
        u = op[i] + keep * (u - op[i])
        air[i] = u


@kernel
def stems(op, width, lanes, S, J, K, place, w, mean, mv):
    """Fill the first `lanes` rows of `mv` with each stem's mean over blocks of `width` samples of `op`.

    The rule is `stem_in_lane`'s. Where `K` is 0 a stem goes on while OP does; otherwise it rests again after every
    sample, as He and Wang's does, whose K it is. Each begins `place` half bands off the first OP. `w` (7 * LANES,) and
    `mean` (n_side, LANES) are work space; where that takes all blocks they stay there, a stem a column.
    """
    n, side = op.shape[0] // width, mean.shape[0]
    share = 1.0 / width
    before = op[0]
    all_rest = True
    for v in range(lanes):
        reach = 0.5 * (S[v] + J[v])
        w[X + v] = before + place[v] * reach
        w[MOVING + v] = 0.0
        w[REACH + v] = reach
        w[EDGE + v] = reach * (1.0 + TIE)
        w[JUMP + v] = J[v]
        w[GOES_ON + v] = 1.0 if K[v] == 0.0 else 0.0
        w[SLIP + v] = K[v] + w[GOES_ON + v]
        all_rest = all_rest and K[v] > 0.0
    for first in range(0, n, side):
        filled = min(side, n - first)
        for k in range(filled):
            row = mean[k]
            begin = (first + k) * width
            for i in range(begin, begin + width):
                u = op[i]
                du = u - before
                before = u
                if all_rest:
                    for v in range(lanes):
                        w[X + v] = resting_in_lane(u, w[X + v], w[REACH + v], w[EDGE + v], w[JUMP + v], w[SLIP + v])
                else:
                    for v in range(lanes):
                        w[MOVING + v], w[X + v] = stem_in_lane(
                            u, du, w[X + v], w[MOVING + v], w[REACH + v], w[EDGE + v], w[JUMP + v], w[SLIP + v],
                            w[GOES_ON + v],
                        )  # fmt: skip
                if i == begin:
                    for v in range(lanes):
                        row[v] = share * w[X + v]
                else:
                    for v in range(lanes):
                        row[v] += share * w[X + v]
        # Blocks are turned some at a time: rows written a value each would push one another out of the cache.
        for v in range(lanes if side < n else 0):
            out, column = mv[v, first : first + filled], mean[:filled, v]
            for k in range(filled):
                out[k] = column[k]


@kernel
def prediction_errors(
    op, width, pv, op_mean, order, op_order, edges, begin, shocks, floor, S, J, K, place, keep, ends, left, blocks,
    work,
):  # fmt: skip
    """Fill `left` (n,) with the sum of squares that each valve leaves of `pv` (n_samples,) from `begin` on.

    `op` holds `width` samples for each one of `pv`, `op_mean` (n_samples,) their means. The regression takes a
    constant, `order` lags of the PV, `op_order` of `op_mean`, and sums of the stem's lags edges[g] <= lag <
    edges[g + 1]; a lag of at least 1 keeps the noise that the controller hands on to the OP out of its own prediction.
    The samples `shocks` are not predicted, and are past of others all the same. `floor` is the square that no sample
    falls below. `ends` (n_blocks,) are the samples at which blocks of time end, `blocks` (n, n_blocks) what is left in
    each; both may be empty. `S`, `J`, `K` and `place` (n,) are those of `stems`, `keep` (n,) that of `behind_lag`;
    valves side by side are best of one `keep`.
    """
    valve = work.valve
    energy = past(pv, op_mean, order, op_order, begin, shocks, work.own)
    lean = op_order == 0 and shocks.shape[0] == 0 and ends.shape[0] == 0
    kept, lanes = -1.0, 0
    for i in range(S.shape[0]):
        valve[0, lanes], valve[1, lanes], valve[2, lanes], valve[3, lanes] = S[i], J[i], K[i], place[i]
        lanes += 1
        if lanes < work.mv.shape[0] and i + 1 < S.shape[0] and keep[i + 1] == keep[i]:
            continue
        if keep[i] != kept:
            kept = keep[i]
            behind_lag(op, kept, work.air)
        mean, base = work.tall if lean else work.mean, i + 1 - lanes
        stems(work.air, width, lanes, valve[0], valve[1], valve[2], valve[3], work.lane, mean, work.mv)
        if lean:
            left_side_by_side(pv, lanes, order, edges, begin, floor, energy, base, left, work)
        else:
            left_over(
                pv, op_mean, lanes, order, op_order, edges, begin, shocks, floor, energy, ends, base, left, blocks, work
            )
        lanes = 0
