r"""S and J from the plain moves of a recorded position.

A stem that rests slips when OP is :math:`(S + J) / 2` away from it and comes to rest, or goes on, where OP is
:math:`(S - J) / 2` away (Kano's valve: He's with :math:`f_s, f_d` in their place). The position is
:math:`y = a + b x`. With u the OP of a slip upwards and :math:`y_0, y_1` the position before and after it,

.. math:: u - y_0 / b = (S + J) / 2 - a / b, \quad u - y_1 / b = (S - J) / 2 - a / b

and downwards with both halves negative. Medians over the slips each way give S, J and a. They are no fit, but a start
for one: where a stem goes in few stairs, only valves near the true one make its slips in time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["told_by_moves"]

PLAIN = 5.0
"""Move from sample to sample from which on it is a slip and no noise [standard deviations of the noise]: that of a
difference of two is 1.4 of them, and noise alone moves so far once in 2 500 samples."""


def told_by_moves(
    op: NDArray[np.float64], y: NDArray[np.float64], slope: float, noise: float
) -> tuple[float, float, float] | None:
    """S, J and the offset of the position that its plain moves tell.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output without gaps [% of span].
    y : ndarray, shape (n_samples,)
        Position, in time with OP [any unit]; no move is seen beside NaN.
    slope : float
        b [unit of the position per % of span].
    noise : float
        Standard deviation of the position's noise [its unit].

    Returns
    -------
    tuple of float or None
        S and J [% of span] and a [unit of the position]; None where no move is plain up or none is down, or where they
        are no valve's. J may come out below 0 or beyond S.

    Examples
    --------
    >>> import stiction as st
    >>> op = 50.0 + 4.0 * np.sin(np.arange(1000.0) / 40.0)
    >>> y = 4.0 + 0.16 * st.stroke(st.He(2.0, 0.5), op, dt=1.0).mv
    >>> S, J, a = told_by_moves(op, y, 0.16, 0.001)
    >>> round(S, 1), round(J, 1), round(a, 1)
    (2.5, 1.5, 4.0)
    """
    moves = np.diff(y)
    way = np.where(np.abs(moves) > PLAIN * noise, np.sign(moves), 0.0)
    edges = np.flatnonzero(np.diff(way, prepend=0.0, append=0.0))
    first, last = edges[:-1], edges[1:]
    first, last = first[way[first] != 0.0], last[way[first] != 0.0]
    up = way[first] * slope > 0.0
    if up.all() or not up.any():
        return None
    # OP came to the trip between two samples; the stem went by the second.
    before = 0.5 * (op[first] + op[first + 1]) - y[first] / slope
    after = op[first + 1] - y[last] / slope
    (high, low), (over, under) = ((float(np.median(x[up])), float(np.median(x[~up]))) for x in (before, after))
    S, J = 0.5 * (high - low + over - under), 0.5 * (high - low - over + under)
    return (S, J, -0.25 * slope * (high + low + over + under)) if S > 0.0 else None
