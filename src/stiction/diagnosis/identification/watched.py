r"""A stem watched: simulated on OP, and taken to be where it is seen when its position says otherwise.

The position is held against the stem of Kano's valve on the recorded OP, behind a lag, late by whole samples, on a
scale of its own. Where it leaves the prediction by more than c standard deviations :math:`\sigma` of its noise, the
stem is taken to be where it is seen, and goes on from there. What a valve leaves is

.. math:: E = \frac{1}{n} \sum_k \min\big((y_k - a - b\,z_k)^2, (m\,c\,\sigma)^2\big)

with y the position, z the stem behind its lag, m = `LIMIT`. So a slip that comes a sample early, as it does where the
record is slower than the controller, costs one sample and not all that follow. A stem may rest after every sample, as
He's and Stenman's do, or go on while OP does, as Kano's and Choudhury's.

Valves stand side by side, so that the processor's lanes are full: a step has no branch. Those that go on move up into
the place of those given up. Which valve is given up, and where, is as if they came one after the other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.models.compiled import inlined, kernel
from stiction.models.component import TIE

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["LANES", "LATEST", "decays", "turns_of", "watched", "work_space"]

LIMIT = 3.0
"""Largest deviation that counts, over the one at which the stem is taken to be where it is seen [-]."""
TOLERANCE = 0.08
"""Share of its reach, beside one sample's movement of OP, by which a stem may slip early or late at first [-]."""
HOPELESS = 2.0
"""Times the best so far that a valve may leave before it is given up [-]."""
AVERAGED = 8.0
"""Samples of its position by which a stem at rest is placed, at most [-]."""
LATEST = 3
"""Latest samples that a position may come [-]."""
LANES = 40
"""Most valves that stand side by side [-]: as many as are tried in one round of the closest search."""
FULL = 8
"""Lanes that a processor takes at once, at most [-]: their number is a multiple."""
LOOK = 32
"""Samples after which it is looked which valves are worth going on with [-]: a look takes as long as a sample."""
NEVER = -1e300
"""In place of how far from its trip a stem may slip: at no time."""
QUANTITIES = 15
"""What is known of a lane [-]."""
X, Z, MOVING, PLACED_BY, TOTAL, BEHIND, REACH = range(0, 7 * LANES, LANES)
SOFT, SLOPE, INVERSE, OFFSET, DECAY, LATE, GOES_ON, MOST = range(7 * LANES, QUANTITIES * LANES, LANES)
"""Where each quantity of the lanes begins in the work space. The distances are known when the kernel is compiled: else
it would ask at every sample whether they overlap."""


def work_space(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Room for the lanes, for what each has left of every sample of up to `n`, and for where it stood at each look."""
    return np.empty(QUANTITIES * LANES), np.empty((n, LANES)), np.empty((n // LOOK + 3, LANES), dtype=np.int64)


def decays(lags: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a lag [samples] keeps of its difference in a sample [-]; 0 without a lag."""
    return np.exp(-1.0 / np.maximum(lags, np.finfo(float).tiny))


@inlined
def _step(
    u, du, about, x, z, moving, averaged, behind, reach, soft, slope, inverse, decay, goes_on, cap, loose, exact
):  # fmt: skip
    """One sample: stem, position behind its lag, way it moves, samples it is placed by, deviation, and way it set out.

    `about` is what was seen less the offset, NaN where nothing was. `exact` says that `loose` is 0; where the caller
    knows that when it is compiled nothing is done for it. Without a branch, see `lanes.stem_in_lane`; `/` would be one,
    since it looks whether it divides by nothing.
    """
    keep = 1.0 - decay
    goes = du * moving * goes_on > 0.0
    e = u - x
    way = 1.0 if e > 0.0 else -1.0
    base = decay * z
    near = (not exact) & (abs(abs(e) - reach) < loose * (soft + abs(du)))
    seen = about * inverse
    earlier = abs(seen - (base + keep * (u - way * behind))) < abs(seen - (base + keep * x))
    slips = earlier if near else abs(e) > reach
    set_out = way if slips else 0.0
    set_out = 0.0 if goes else set_out
    moving = moving if goes else set_out
    x = u - moving * behind if slips | goes else x
    z = base + keep * x
    r = about - slope * z
    off = abs(r) > cap
    calm = (r == r) & (moving == 0.0) & (averaged < AVERAGED)
    averaged = averaged + 1.0 if calm else averaged
    averaged = 1.0 if off else averaged
    away = r * inverse
    placed = min(max(x + np.true_divide(away, keep if off else averaged), u - reach), u + reach)
    x = placed if off | calm else x
    z = z + away if off else z
    way = 1.0 if away > 0.0 else -1.0
    on_its_way = way if abs(u - way * behind - x) * abs(slope) < cap else 0.0
    moving = on_its_way if off else moving
    return x, z, moving, averaged, r, set_out


@inlined
def _begin(op, y, mean, row, decay, w, v):
    """Put a row into lane `v`, its stem where it is seen."""
    behind = 0.5 * (row[0] - row[0] * row[1])
    reach = 0.5 * (row[0] + row[0] * row[1]) * (1.0 + TIE)
    offset = row[3] - row[2] * mean
    x = (y[int(row[5])] - offset) / row[2]
    x = min(max(x, op[0] - reach), op[0] + reach) if x == x else op[0]
    w[X + v] = w[Z + v] = x
    w[MOVING + v] = w[TOTAL + v] = 0.0
    w[PLACED_BY + v] = 100.0
    w[BEHIND + v] = behind
    w[REACH + v] = reach
    w[SOFT + v] = TOLERANCE * reach if row[0] != 0.0 else NEVER
    w[SLOPE + v] = row[2]
    w[INVERSE + v] = 1.0 / row[2]
    w[OFFSET + v] = offset
    w[DECAY + v] = decay
    w[LATE + v] = row[5]
    w[GOES_ON + v] = 1.0 - row[6]


@kernel
def watched(op, y, known, mean, rows, decays, cap, loose, begin, least, left, w, totals, places):
    """Fill `left` (n,) with the mean square that each of `rows` (n, 7) leaves of `y` (n_samples,); `cap` is c sigma.

    A row holds S, J / S, slope, the position at an OP of `mean`, the lag, whose decay is in `decays` (n,), the whole
    samples that the position is late, up to `LATEST`, and 1 for a stem that rests after every sample, 0 for one that
    goes on. With `loose` a slip may come early or late at no cost (see `TOLERANCE`). What is left is counted from
    sample `begin` on. `least` (m,) is the least so far of each of m searches, whose rows stand one after the other; it
    is brought up to date. A row is given up when it leaves `HOPELESS` times as much, none where that is infinite; what
    it has left until then counts. `known` (n_samples + 1,) counts what was seen before each sample; `w`, `totals` and
    `places` are work space.
    """
    n = op.shape[0]
    limit = LIMIT * LIMIT * cap * cap
    each = rows.shape[0] // least.shape[0]
    done, stands = places[places.shape[0] - 2], places[places.shape[0] - 1]
    for first in range(0, rows.shape[0], LANES):
        lanes = min(rows.shape[0] - first, LANES)
        filled = min((lanes + FULL - 1) // FULL * FULL, LANES)
        for v in range(filled):
            i = first + min(v, lanes - 1)
            _begin(op, y, mean, rows[i], decays[i], w, v)
            w[MOST + v] = HOPELESS * least[i // each] * n
            done[v], stands[v] = n, v
        going = lanes
        before = op[0]
        k = 1
        while going > 0 and k < n:
            for v in range(going):
                places[k // LOOK, stands[v]] = v
            until = min((k // LOOK + 1) * LOOK, n)
            while k < until:
                u = op[k]
                du = u - before
                before = u
                y0 = y[k]
                y1 = y[k + 1] if k + 1 < n else np.nan
                y2 = y[k + 2] if k + 2 < n else np.nan
                y3 = y[k + 3] if k + 3 < n else np.nan
                if k == begin:
                    for v in range(filled):
                        w[TOTAL + v] = 0.0
                if loose > 0.0:
                    _sample(u, du, y0, y1, y2, y3, w, filled, cap, limit, loose, False, totals[k])
                else:
                    _sample(u, du, y0, y1, y2, y3, w, filled, cap, limit, loose, True, totals[k])
                k += 1
            if k > begin:
                going = _moved_up(w, stands, done, going, k)
                filled = (going + FULL - 1) // FULL * FULL
        for v in range(lanes):
            late, last = int(rows[first + v, 5]), done[v] - 1
            end, search = n - late, (first + v) // each
            most = HOPELESS * least[search] * n
            if totals[last, places[last // LOOK, v]] > most:
                end = 1 + _passes(totals, places, v, begin, last, most)
            compared = known[end + late] - known[begin + late]
            left[first + v] = totals[end - 1, places[(end - 1) // LOOK, v]] / max(compared, 1)
            if least[search] < np.inf:
                least[search] = min(least[search], left[first + v])


@inlined
def _sample(u, du, y0, y1, y2, y3, w, filled, cap, limit, loose, exact, total):
    """One sample of all lanes, whose positions may come late; `total` gets what each has left so far."""
    for v in range(filled):
        late = w[LATE + v]
        seen = y0 if late == 0.0 else y1 if late == 1.0 else y2 if late == 2.0 else y3
        x, z, moving, averaged, r, _ = _step(
            u, du, seen - w[OFFSET + v], w[X + v], w[Z + v], w[MOVING + v], w[PLACED_BY + v], w[BEHIND + v],
            w[REACH + v], w[SOFT + v], w[SLOPE + v], w[INVERSE + v], w[DECAY + v], w[GOES_ON + v], cap, loose, exact,
        )  # fmt: skip
        w[X + v] = x
        w[Z + v] = z
        w[MOVING + v] = moving
        w[PLACED_BY + v] = averaged
        square = min(r * r, limit)
        so_far = w[TOTAL + v] + (square if r == r else 0.0)
        w[TOTAL + v] = so_far
        total[v] = so_far


@inlined
def _moved_up(w, stands, done, going, k):
    """Close the gaps of the lanes that are given up after `k` samples; how many go on.

    Column c holds the lane `stands[c]`, and `done` tells how far each lane came.
    """
    count = 0
    for c in range(going):
        if w[TOTAL + c] <= w[MOST + c]:
            if count < c:
                for quantity in range(0, QUANTITIES * LANES, LANES):
                    w[quantity + count] = w[quantity + c]
                stands[count] = stands[c]
            count += 1
        else:
            done[stands[c]] = k
    return count


@inlined
def _passes(totals, places, v, low, high, most):
    """First sample from `low` to `high` at which the total of lane `v` is more than `most`; at `high` it is."""
    while low < high:
        middle = (low + high) // 2
        if totals[middle, places[middle // LOOK, v]] > most:
            high = middle
        else:
            low = middle + 1
    return low


@kernel
def turns_of(op, y, mean, row, decay, cap, loose, w):
    """How often the stem of one row, as `watched` takes it, set out in another direction than before."""
    _begin(op, y, mean, row, decay, w, 0)
    x, z, moving, averaged = w[X], w[Z], w[MOVING], w[PLACED_BY]
    last = 0.0
    turns = 0
    late = int(row[5])
    for k in range(1, op.shape[0] - late):
        x, z, moving, averaged, _, set_out = _step(
            op[k], op[k] - op[k - 1], y[k + late] - w[OFFSET], x, z, moving, averaged, w[BEHIND],
            w[REACH], w[SOFT], w[SLOPE], w[INVERSE], w[DECAY], w[GOES_ON], cap, loose, loose == 0.0,
        )  # fmt: skip
        if set_out != 0.0:
            turns += 1 if set_out * last < 0.0 else 0
            last = set_out
    return turns
