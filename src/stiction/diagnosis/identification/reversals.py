r"""A stem that rests after every sample, searched for from a reversal of OP on.

Such a stem (He, Stenman) moves in slips, and what it does next depends on nothing but the OP at its last slip, u, and
the way it went: it slips again when OP has gone further that way by more than J, or back by more than S. A slip that
comes a sample too late makes the next ones late, for good: along the record the likelihood is a needle, a thousandth
of S wide. But

- at a reversal of OP the stem's state is known but for how far before it the last slip was, less than J;
- the slips up to any time are the same for all S and J between bounds that the slips themselves give: the shortest way
  back that made it slip and the longest that did not bound S, those onward bound J. Valves within the same bounds are
  one trial, those just beyond are its neighbours. Where slips go beyond their balance (K of He and Wang's valve) the
  bounds are those at this S and J;
- in a few cycles the bounds are wide. So a short window is searched first, and the best go on into longer ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.likelihood import Columns, trials_of, valves
from stiction.diagnosis.identification.parts import lean, part_of
from stiction.models.compiled import kernel
from stiction.models.component import TIE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Prediction

__all__ = ["distinct", "from_reversals", "turns"]

# What half and twice of each does is counted in docs/verdict-measured.md, "What each constant of the search brings".
STARTS = 3
"""Reversals begun from, spread over the first half of the record [-]."""
CYCLES, SHORTEST = 3.0, 60
"""First window [cycles], and what it is at least [samples]."""
GROWS = 2.2
"""How much longer each window is than the one before [-]."""
LEAST_SWING = 0.12
"""Smallest S looked for, as a share of the OP's swing [-]."""
S_STEP, LEAST_STEP = 0.8, 0.01
"""Step over S in the first window, in what OP usually moves in a sample, but at least this share of S [-]."""
RATIOS, PLACES = (0.2, 0.5, 1.0), 10
"""J / S in the first window, and how many places of the last slip are tried where J is S [-]."""
KEPT, LEAST_KEPT, PASSES = 30, 2, 2
"""Trials followed in the first window and at last, half as many in each longer one, and rounds about them in the first
[-]."""
INSIDE = np.array([-1.2, -0.3, 0.1, 0.5, 0.9, 1.3, 2.2])
"""Neighbours in S and in J, 0 and 1 being the bounds [-]."""
CORNERS = np.array([-0.2, 1.2])
"""The same of those that move both."""
LEAPS = np.array([-0.12, -0.06, 0.06, 0.12]), np.array([-0.06, -0.03, 0.03, 0.06])
"""Further neighbours, in S and J at once, as shares of S [-]."""
OTHERS = np.array([-2, -1, 1, 2])
"""Neighbours in the place of the last slip, among those that can be."""
SLIPS = np.array([1.0, 1.25, 1.5, 1.75, 2.0])
"""Neighbours in how far a slip goes, K of He and Wang's valve [-]."""
REACH = 0.1, 0.15
"""How far bounds of S and of J reach at most, as shares of S [-]."""
AT_START = np.linspace(-1.0, 1.0, 80)
"""Places at the start of the record that a valve found is tried with [half bands]."""


class Reversal(NamedTuple):
    """A reversal of OP, and the record from there on."""

    op: NDArray[np.float64]
    """OP from the reversal on [% of span], shape (n_samples,)."""
    way: float
    """1 where OP went up to it, -1 where it went down."""
    past: NDArray[np.float64]
    """How far OP went between the last slip and the reversal, all that can be [% of span], increasing."""
    coarse: Prediction
    """What is predicted from there on."""
    fine: Prediction
    """The same of the fine record."""


def from_reversals(coarse: Prediction, fine: Prediction, swing: float) -> NDArray[np.float64]:
    """Search from some reversals of OP.

    Parameters
    ----------
    coarse, fine : Prediction
        What is predicted, for the first and for the last windows.
    swing : float
        Largest S to look for [% of span].

    Returns
    -------
    ndarray, shape (n, 5)
        The likeliest valve from each reversal, with its likeliest place at the start of the fine record, as in
        `Trials`; none where OP has no reversal with a record of some length after it.
    """
    cycle = 2.0 * fine.samples * fine.width / fine.ends.size
    room = np.empty(fine.op.size, dtype=np.int64)
    ends = room[: turns(fine.op, max(int(cycle / 4.0), 2), fine.op.size // 2, room)]
    if ends.size == 0:
        return np.empty((0, 5))
    shortest = int(max(CYCLES * cycle, SHORTEST * coarse.width))
    found = []
    for at in np.unique(ends[np.linspace(0, ends.size - 1, STARTS).astype(int)]):
        reversal = _reversal(coarse, fine, int(at), int(cycle / 2.0))
        if reversal.op.size >= shortest:
            S, J, _, K = _climb(reversal, swing, shortest)
            tried = trials_of(lean(fine), valves(S, J / S, K, AT_START, swing))
            found.append(tried.best)
    return np.array(found).reshape(-1, 5)


def _reversal(coarse: Prediction, fine: Prediction, at: int, back: int) -> Reversal:
    """The reversal at one sample of the fine record's OP."""
    way = 1.0 if fine.op[at] > fine.op[max(at - back, 0)] else -1.0
    past = np.maximum.accumulate(way * (fine.op[at] - fine.op[max(at - back, 0) : at + 1][::-1]))
    offset = fine.first * fine.width - coarse.first * coarse.width
    parts = []
    for prediction, first in ((coarse, at + offset), (fine, at)):
        whole = -(-first // prediction.width)
        parts.append(part_of(lean(prediction), whole, prediction.pv.size - whole))
    return Reversal(fine.op[at:], way, np.unique(past), *parts)


def _climb(reversal: Reversal, swing: float, size: int) -> NDArray[np.float64]:
    """S, J, the way since the last slip and K of the likeliest valve; the first window holds `size` samples of OP."""
    trials = _first(reversal, swing, size)
    kept, n = KEPT, reversal.op.size
    best = _best(reversal, trials, reversal.coarse, size, kept)
    for _ in range(PASSES):
        best = _best(reversal, _about(reversal, *best, swing), reversal.coarse, size, kept)
    while size < n:
        size, kept = min(int(GROWS * size), n), max(kept // 2, LEAST_KEPT)
        prediction = reversal.coarse if size < n else reversal.fine
        best = _best(reversal, _about(reversal, *best, swing), prediction, size, kept)
    return best[0][0]


def _first(reversal: Reversal, swing: float, size: int) -> NDArray[np.float64]:
    """Trials for the first window: S, J, the way since the last slip and K, shape (n, 4)."""
    usual = float(np.median(np.abs(np.diff(reversal.op[:size]))))
    sizes = [LEAST_SWING * swing]
    while sizes[-1] < swing:
        sizes.append(sizes[-1] + max(S_STEP * usual, LEAST_STEP * sizes[-1]))
    S = np.array(sizes)
    out = []
    for ratio in RATIOS:
        last = np.searchsorted(reversal.past, ratio * S) - 1.0
        at = np.round(np.linspace(0.0, 1.0, int(np.ceil(PLACES * ratio))) * last[:, np.newaxis]).astype(int)
        row, column = np.nonzero(np.diff(at, axis=1, prepend=-1))
        out.append(np.column_stack([S[row], ratio * S[row], reversal.past[at[row, column]], np.ones(row.size)]))
    return np.concatenate(out)


def _best(
    reversal: Reversal, trials: NDArray[np.float64], prediction: Prediction, size: int, kept: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The likeliest trials that slip differently, and their bounds, shape (n, 4) each."""
    part = part_of(prediction, 0, min(prediction.pv.size, size // prediction.width))
    S, J, past, K = trials.T
    stem = reversal.op[0] - reversal.way * (past + 0.5 * (S - J))
    place = (stem - part.op[0]) / (0.5 * (S + J))
    tried = trials_of(part, np.column_stack(Columns(S, J / S, K, place, np.zeros(S.size))))
    chosen, bounds = np.empty(kept, dtype=np.int64), np.empty((kept, 4))
    count = distinct(reversal.op, size, reversal.way, trials, tried.ranked(), chosen, bounds)
    return trials[chosen[:count]], bounds[:count]


def _about(
    reversal: Reversal, best: NDArray[np.float64], bounds: NDArray[np.float64], swing: float
) -> NDArray[np.float64]:
    """Trials within and just beyond the bounds of the best, shape (n, 4)."""
    each = 1 + 2 * INSIDE.size + OTHERS.size + CORNERS.size**2 + LEAPS[0].size * LEAPS[1].size + SLIPS.size
    out = np.empty((len(best) * each, 4))
    neighbours(best, bounds, reversal.past, 0.5 * LEAST_SWING * swing, swing, out)
    return out


@kernel
def neighbours(best, bounds, past, least, most, out):
    """Fill `out` (n, 4) with S, J, way and K of the trials about each of `best` (n_best, 4), S from `least` to `most`.

    First the best themselves, then those that move S, J, the way, both S and J, and K; `bounds` (n_best, 4) as of
    `distinct`.
    """
    count = best.shape[0]
    each = out.shape[0] // count - 1
    for b in range(count):
        S, J, way = best[b, 0], best[b, 1], best[b, 2]
        S_low, S_high = max(bounds[b, 0], (1.0 - REACH[0]) * S), min(bounds[b, 1], (1.0 + REACH[0]) * S)
        J_low, J_high = max(bounds[b, 2], J - REACH[1] * S, 0.0), min(bounds[b, 3], J + REACH[1] * S, S)
        S_wide, J_wide = max(S_high - S_low, 1e-4 * S), max(J_high - J_low, 1e-4 * S)
        out[b] = best[b]
        row = count + b * each
        for i in range(each):
            out[row + i] = best[b]
        for inside in INSIDE:
            out[row, 0], out[row + 1, 1] = S_low + S_wide * inside, J_low + J_wide * inside
            row += 2
        here = np.searchsorted(past, way)
        for other in OTHERS:
            out[row, 2] = past[min(max(here + other, 0), past.size - 1)]
            row += 1
        for in_S in CORNERS:
            for in_J in CORNERS:
                out[row, 0], out[row, 1] = S_low + S_wide * in_S, J_low + J_wide * in_J
                row += 1
        for by_S in LEAPS[0]:
            for by_J in LEAPS[1]:
                out[row, 0], out[row, 1] = S * (1.0 + by_S), J + by_J * S
                row += 1
        for K in SLIPS:
            out[row, 3] = K
            row += 1
    for k in range(out.shape[0]):
        out[k, 0] = min(max(out[k, 0], least), most)
        out[k, 1] = min(max(out[k, 1], 0.0), out[k, 0])


@kernel
def turns(op, reach, last, out):
    """Fill `out` with the samples before `last` where OP is largest or smallest within `reach` either way; how many."""
    count = 0
    for k in range(reach, min(last, op.shape[0] - reach)):
        high = low = True
        for i in range(1, reach + 1):
            high = high and op[k] > op[k - i] and op[k] >= op[k + i]
            low = low and op[k] < op[k - i] and op[k] <= op[k + i]
            if not (high or low):
                break
        if high or low:
            out[count] = k
            count += 1
    return count


@kernel
def distinct(op, size, way, trials, order, chosen, bounds):
    """Fill `chosen` with the first of `trials` in `order` that slip differently, and their `bounds`; how many.

    A trial is S, J, how far OP went since its last slip when `op` begins, a reversal that it came to by `way`, and K.
    Bounds are the largest S that lets it rest and the smallest that it slips at, then those of J. A slip that begins
    with OP further away than its band goes K - 1 times that beyond its balance: OP has so much further to go on, and
    less to come back.
    """
    count = 0
    for i in range(order.shape[0]):
        S, J, past, more = trials[order[i], 0], trials[order[i], 1], trials[order[i], 2], trials[order[i], 3] - 1.0
        S_low, S_high, J_low, J_high = 0.0, np.inf, 0.0, np.inf
        slip, towards = op[0] - way * past, way
        for k in range(size):
            onward = towards * (op[k] - slip)
            if onward > J * (1.0 + TIE):
                J_high = min(J_high, onward)
                slip = op[k] + towards * more * (onward - J)
            elif -onward > S * (1.0 + TIE):
                S_high = min(S_high, -onward)
                slip, towards = op[k] - towards * more * (-onward - S), -towards
            else:
                J_low, S_low = max(J_low, onward), max(S_low, -onward)
        new = True
        for c in range(count):
            same = bounds[c, 0] == S_low and bounds[c, 1] == S_high
            new = new and not (same and bounds[c, 2] == J_low and bounds[c, 3] == J_high)
        if new:
            chosen[count] = order[i]
            bounds[count, 0], bounds[count, 1], bounds[count, 2], bounds[count, 3] = S_low, S_high, J_low, J_high
            count += 1
            if count == chosen.shape[0]:
                break
    return count
