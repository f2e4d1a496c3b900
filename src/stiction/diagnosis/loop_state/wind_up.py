"""Wind-up: OP runs far in one direction, the error stays, and PV does not follow."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.loop_state.arrays import block_means, moving_average, oscillation_period
from stiction.records.gaps import interpolate_gaps

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["WindUp", "find_wind_up", "smooth_error"]

MIN_ONE_SIDED = 0.97
"""Share of the samples in which an error with one sign has that sign [-]."""
BLOCKS = 10
"""Blocks into which the travel of OP is divided; its first and last three are compared."""


@dataclass(frozen=True, slots=True)
class WindUp:
    """One long travel of OP that PV did not answer."""

    first: int
    """First sample of the travel."""
    last: int
    """One past the last sample at which OP stays near the end of the travel."""
    last_move: int
    """Sample at which OP reaches the end of the travel."""
    op_start: float
    """OP at the start [% of span]."""
    op_end: float
    """OP at the end [% of span]."""
    mean_error: float
    """Mean of SP less PV during the travel [unit of PV]."""
    period: float
    """Period of a regular oscillation of PV from `first` to `last` [samples]; NaN when there is none."""


def smooth_error(pv: NDArray[np.float64], sp: NDArray[np.float64]) -> NDArray[np.float64]:
    """SP less PV, averaged over one period of a regular oscillation of PV, else over a hundredth of the record."""
    pv = interpolate_gaps(pv)
    period = oscillation_period(pv)
    width = max(5, pv.size // 100) if math.isnan(period) else round(period)
    return moving_average(interpolate_gaps(sp) - pv, width)


def find_wind_up(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    sp: NDArray[np.float64],
    *,
    min_travel: float = 15.0,
    min_samples: int = 20,
    max_swing_elsewhere: float = 0.5,
    max_return: float = 0.25,
    min_one_sided: float = MIN_ONE_SIDED,
    min_error_ratio: float = 1.2,
    min_error_left: float = 0.5,
    max_answer: float = 0.3,
    min_error_share: float = 0.01,
    max_error_growth: float = 2.5,
    min_integral_share: float = 0.5,
    min_travel_left: float = 0.7,
) -> WindUp | None:
    """Find the longest travel of OP in one direction that PV did not answer.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span]; NaN is missing.
    pv, sp : ndarray, shape (n_samples,)
        Process variable and set point [unit of PV].
    min_travel : float
        Smallest travel of OP [% of span].
    min_samples : int
        Shortest travel [samples].
    max_swing_elsewhere : float
        Largest range of OP in the rest of the record, over the travel [-]. A valve that sticks makes OP travel there
        and back.
    max_return : float
        Move of OP back from the end of the travel, over the travel, at which the stretch ends [-].
    min_one_sided : float
        Share of the travel in which the smoothed error has one sign [-].
    min_error_ratio : float
        Mean error over the standard deviation of its block means [-].
    min_error_left : float
        Error at the end of the travel over its mean [-].
    max_answer : float
        Largest change of PV towards SP during the travel, over the mean error [-].
    min_error_share : float
        Mean error over the larger of the usual |SP| and the range of PV [-], where PV does not oscillate. A smaller one
        is what a slow ramp of the load leaves in a loop that is in control.
    max_error_growth : float
        Error in the second half of the stay after the travel, over the mean during the travel [-]. A larger one is a
        valve that is too small: the error grows when OP has reached its limit.
    min_integral_share : float
        Share of the travel that the integral action makes [-].
    min_travel_left : float
        Share of the travel that must be left from where the error takes its sign [-].

    Returns
    -------
    WindUp or None
        The travel; None when PV answers, or OP makes no such travel.

    Notes
    -----
    Integral action moves OP for as long as the error lasts. In a loop that is in control the valve moves with it, PV
    answers within a few process time constants, and the error ends. A travel that is far larger than all other moves
    of OP, while the error stays, shows that OP has no effect on PV.

    Examples
    --------
    >>> import numpy as np
    >>> pv = 150.0 + np.random.default_rng(1).normal(0.0, 0.3, 600)
    >>> sp = np.where(np.arange(600) < 200, 150.0, 154.0)
    >>> op = 40.0 + 0.03 * np.cumsum(sp - pv)
    >>> found = find_wind_up(op, pv, sp)
    >>> round(found.op_end), found.last
    (88, 600)
    """
    op, pv, sp = interpolate_gaps(op), interpolate_gaps(pv), interpolate_gaps(sp)
    if op.size < 2 * min_samples or not np.ptp(op) >= min_travel:
        return None
    direction = 1.0 if _largest_rise(op)[0] >= _largest_rise(-op)[0] else -1.0
    travel, start, top = _largest_rise(direction * op)
    if travel < min_travel:
        return None
    x = direction * op
    near_start = np.flatnonzero(x[start : top + 1] <= x[start] + 0.05 * travel)
    first = start + int(near_start[-1])
    last_move = first + int(np.argmax(x[first : top + 1] >= x[top] - 0.02 * travel))
    returned = np.flatnonzero(x[last_move:] < x[top] - max_return * travel)
    last = last_move + int(returned[0]) if returned.size else x.size
    elsewhere = np.concatenate([x[:first], x[last:]])
    if last_move - first < min_samples or (elsewhere.size and np.ptp(elsewhere) > max_swing_elsewhere * travel):
        return None
    error = smooth_error(pv, sp)
    if not np.isfinite([error, pv]).all():
        return None
    side = math.copysign(1.0, float(error[first : last_move + 1].mean()))
    before = np.flatnonzero(side * error[first : (first + last_move) // 2] <= 0.0)
    if before.size and x[top] - x[first + before[-1] + 1] >= min_travel_left * travel:
        first += int(before[-1]) + 1
    moving = slice(first, last_move + 1)
    errors, values = block_means(error[moving], BLOCKS), block_means((sp - error)[moving], BLOCKS)
    mean = float(error[moving].mean())
    period = oscillation_period(pv[first:last])
    scale = max(float(np.median(np.abs(sp))), float(np.ptp(pv)))
    small = math.isnan(period) and abs(mean) < min_error_share * scale
    after = side * error[(last_move + last) // 2 : last]
    grown = last - last_move > 0.1 * (last_move - first) and float(after.mean()) > max_error_growth * abs(mean)
    answered = side * (values[-3:].mean() - values[:3].mean()) > max_answer * abs(mean)
    ended = side * errors[-3:].mean() < min_error_left * abs(mean)
    one_sided = np.mean(side * error[moving] > 0.0) >= min_one_sided and abs(mean) > min_error_ratio * errors.std()
    integral = 1.0 - _proportional_travel(op[moving], sp[moving] - pv[moving]) / travel
    if small or grown or answered or ended or not one_sided or integral < min_integral_share:
        return None
    opposite = np.flatnonzero(side * error[:first] <= 0.0)
    first = int(opposite[-1]) + 1 if opposite.size else 0
    return WindUp(first, last, last_move, float(op[first]), float(op[top]), mean, period)


def _largest_rise(x: NDArray[np.float64]) -> tuple[float, int, int]:
    """Largest rise of `x` from one sample to a later one, and both samples."""
    rise = x - np.minimum.accumulate(x)
    top = int(np.argmax(rise))
    return float(rise[top]), int(np.argmin(x[: top + 1])), top


def _proportional_travel(op: NDArray[np.float64], error: NDArray[np.float64]) -> float:
    """OP change due to the proportional term, by a PI equation in increments."""
    columns = np.stack([np.diff(error), error[1:]], axis=1)
    gain = np.linalg.lstsq(columns, np.diff(op), rcond=None)[0][0]
    ends = block_means(error, BLOCKS)
    return abs(float(gain) * float(ends[-1] - ends[0]))
