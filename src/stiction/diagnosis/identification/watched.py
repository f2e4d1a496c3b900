r"""A stem watched: simulated on OP, and taken to be where it is seen when its position says otherwise.

The position is held against the stem of Kano's valve on the recorded OP, behind a lag, late by whole samples, on a
scale of its own. Where it leaves the prediction by more than c standard deviations :math:`\sigma` of its noise, the
stem is taken to be where it is seen, and goes on from there. What a valve leaves is

.. math:: E = \frac{1}{n} \sum_k \min\big((y_k - a - b\,z_k)^2, (m\,c\,\sigma)^2\big)

with y the position, z the stem behind its lag, m = `LIMIT`. So a slip that comes a sample early, as it does where the
record is slower than the controller, costs one sample and not all that follow. A stem may rest after every sample, as
He's and Stenman's do, or go on while OP does, as Kano's and Choudhury's.
"""

from __future__ import annotations

from stiction.models.compiled import kernel
from stiction.models.component import TIE

__all__ = ["watched"]

LIMIT = 3.0
"""Largest deviation that counts, over the one at which the stem is taken to be where it is seen [-]."""
TOLERANCE = 0.08
"""Share of its reach, beside one sample's movement of OP, by which a stem may slip early or late at first [-]."""
HOPELESS = 2.0
"""Times the best so far that a valve may leave before it is given up [-]."""


@kernel
def watched(op, y, rows, cap, loose, begin, least, left, turns):
    """Fill `left` (n,) with the mean square that each of `rows` (n, 7) leaves of `y` (n_samples,); `cap` is c sigma.

    A row holds S, J, slope, offset, the decay per sample of the lag, the whole samples that the position is late, and 1
    for a stem that rests after every sample, 0 for one that goes on. With `loose` a slip may come early or late at no
    cost (see `TOLERANCE`). A row is given up when it leaves `HOPELESS` times `least` or the least of those before.
    `turns` (n,) counts how often the stem set out in another direction than before.
    """
    n = op.shape[0]
    for v in range(rows.shape[0]):
        behind = 0.5 * (rows[v, 0] - rows[v, 1])
        reach = 0.5 * (rows[v, 0] + rows[v, 1]) * (1.0 + TIE)
        good = rows[v, 0] == 0.0
        slope, offset, decay, late = rows[v, 2], rows[v, 3], rows[v, 4], int(rows[v, 5])
        before = op[0]
        x = (y[late] - offset) / slope
        z = x = min(max(x, before - reach), before + reach) if x == x else before
        moving = last = total = 0.0
        averaged = 100.0
        turned = compared = 0
        for k in range(1, n - late):
            u = op[k]
            if (u - before) * moving > 0.0 and rows[v, 6] == 0.0:
                x = u - moving * behind
            else:
                moving = 0.0
                way = 1.0 if u > x else -1.0
                room = loose * (TOLERANCE * reach + abs(u - before))
                slips = abs(u - x) > reach
                if not good and abs(abs(u - x) - reach) < room:
                    seen = (y[k + late] - offset) / slope
                    rests = decay * z + (1.0 - decay) * x
                    slipped = decay * z + (1.0 - decay) * (u - way * behind)
                    slips = abs(seen - slipped) < abs(seen - rests)
                if slips:
                    moving = way
                    x = u - moving * behind
                    if moving * last < 0.0:
                        turned += 1
                    last = moving
            before = u
            z = decay * z + (1.0 - decay) * x
            r = y[k + late] - offset - slope * z
            if not abs(r) >= 0.0:
                continue
            if k >= begin:
                compared += 1
                total += min(r * r, LIMIT * LIMIT * cap * cap)
                if total > HOPELESS * least * n:
                    break
            if abs(r) > cap:
                way = 1.0 if r * slope > 0.0 else -1.0
                x = min(max(x + r / slope / (1.0 - decay), u - reach), u + reach)
                z += r / slope
                moving = way if abs(u - way * behind - x) * abs(slope) < cap else 0.0
                averaged = 1.0
            elif moving == 0.0 and averaged < 8.0:
                averaged += 1.0
                x = min(max(x + r / slope / averaged, u - reach), u + reach)
        left[v] = total / max(compared, 1)
        least = min(least, left[v])
        turns[v] = turned
