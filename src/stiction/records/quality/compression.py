"""Compression by the historian: straight lines between stored points, and storage by exception."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.check_result import MIN_SAMPLES, CheckResult, check_minimum
from stiction.records.gaps import forward_fill
from stiction.records.quality.quantisation import ROUNDING, is_coarse, peak_to_peak, quantisation_step
from stiction.records.runs import runs
from stiction.records.straight_line import fit_line

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "EXACT",
    "check_compression",
    "check_exception_reporting",
    "controller_saw_hold",
    "count_interpolated",
    "exception_deviation",
    "is_stored_on_change",
]

EXACT = 1e-7
"""Share of a signal's range within which points lie on a straight line [-]."""
MOVING = 1e-6
"""Share of a signal's range above which a change from sample to sample is a movement [-]."""


def count_interpolated(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    x_step: float = 0.0,
    y_step: float = 0.0,
    *,
    min_points: int = 5,
    min_share_both: float = 0.25,
) -> int:
    """Count the samples of `x` on straight lines that no control loop makes.

    Parameters
    ----------
    x, y : ndarray, shape (n_samples,)
        The signal and its companion, OP and PV or PV and OP, without NaN [any unit].
    x_step, y_step : float
        Their quantisation steps [units of `x` and `y`]; 0 for none.
    min_points : int
        Fewest points of a line that has a kink at both ends [samples].
    min_share_both : float
        Share of the samples in which both signals must lie between their neighbours for shorter lines to count [-].

    Returns
    -------
    int
        Samples on such lines [-].

    Examples
    --------
    >>> k, noise = np.arange(400), np.random.default_rng(1).normal(size=400)
    >>> count_interpolated(np.interp(k, k[::10], noise[::10]), noise)
    351
    """
    if len(x) < 10 or _is_scaled_copy(x, y, x_step, y_step):
        return 0
    x_range, y_range = peak_to_peak(x), peak_to_peak(y)
    if not (x_step or y_step):
        together = _between_neighbours(x, x_range) & _between_neighbours(y, y_range)
        if together.mean() > min_share_both:
            return int(together.sum())
    tolerance, y_tolerance = max(EXACT * x_range, 2.01 * x_step), max(EXACT * y_range, 2.01 * y_step)
    slope, y_slope = np.diff(x), np.diff(y)
    bend, y_bend = np.abs(np.diff(slope)), np.abs(np.diff(y_slope))
    steep = np.abs(slope) > max(MOVING * x_range, 5.0 * x_step)
    lines = np.array(runs((bend <= tolerance) & steep[1:] & steep[:-1]), dtype=np.int64).reshape(-1, 2)
    lines = lines[lines[:, 1] - lines[:, 0] >= min_points - 2]
    kink = np.concatenate([bend > 3.0 * tolerance, [True]])
    lines = lines[kink[lines[:, 0] - 1] & kink[lines[:, 1]]]
    if not lines.size:
        return 0
    first, last = lines.T
    if _at_one_rate(slope, first, last, 2.01 * x_step):
        return 0
    y_steep = np.abs(y_slope) > max(MOVING * y_range, 5.0 * y_step)
    both = _sums((y_bend <= y_tolerance) & y_steep[1:] & y_steep[:-1], first, last) >= last - first
    if not x_step:
        # Lines between the levels of a coarse signal make a finer step, beside which they are not steep.
        moves = np.abs(y_slope) > MOVING * y_range
        both |= _sums((y_bend <= EXACT * y_range) & moves[1:] & moves[:-1], first, last) >= last - first
    second = _sums(y_bend, first, last)
    third = _sums(np.abs(np.diff(np.diff(y_slope), append=np.nan)), first, last - 1)
    rough = (third > second) & (second > 3.0 * max(y_tolerance, y_step) * (last - first))
    return int(np.sum((last - first)[both | rough]))


def _at_one_rate(
    slope: NDArray[np.float64],
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    tolerance: float,
    *,
    near: float = 0.02,
    min_share: float = 0.7,
) -> bool:
    """Whether most of the straight lines have the largest slope of the signal, up or down: a limit of its rate."""
    rates, length = np.abs(slope[first]), last - first
    largest = float(np.quantile(np.abs(slope), 0.99))
    same = np.abs(rates - largest) <= near * largest + tolerance
    return float(length[same].sum()) >= min_share * float(length.sum())


def exception_deviation(
    x: NDArray[np.float64], step: float = 0.0, *, min_changes: int = 12, min_ratio: float = 0.3
) -> float:
    """Estimate the exception deviation with which a signal was stored.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal [any unit]; NaN is missing.
    step : float
        Its quantisation step [unit of `x`]; 0 for none.
    min_changes : int
        Fewest changes of the signal [-].
    min_ratio : float
        Smallest ratio of the 5 % quantile of the changes to their median [-].

    Returns
    -------
    float
        The deviation [unit of `x`]; 0 when the signal was not stored by exception.

    Examples
    --------
    >>> x, stored = np.random.default_rng(1).normal(size=400).cumsum(), [0.0]
    >>> for value in x:
    ...     stored.append(value if abs(value - stored[-1]) > 2.0 else stored[-1])
    >>> 2.0 < exception_deviation(np.array(stored)) < 2.2, exception_deviation(x)
    (True, 0.0)
    """
    x = x[np.isfinite(x)]
    moves = np.abs(np.diff(x))
    places = np.flatnonzero(moves > ROUNDING * peak_to_peak(x))
    changes = moves[places]
    if changes.size < min_changes or changes.size > 0.75 * moves.size or is_coarse(x):
        return 0.0
    smallest, median = np.percentile(changes, (5, 50))
    intervals = np.diff(places)
    is_even = np.mean(intervals == np.median(intervals)) > 0.9
    return 0.0 if smallest < max(1.5 * step, min_ratio * median) or is_even else float(smallest)


def is_stored_on_change(
    x: NDArray[np.float64], t: NDArray[np.float64], *, min_values: int = 12, min_ratio: float = 0.3
) -> bool:
    """Say whether values [any unit] at times `t` [s] were stored only when the signal had changed.

    No value repeats the one before; changes are a deviation or more (their 5 % quantile is `min_ratio` of the median),
    or few quantisation steps, and do not grow with the time between them, as where values were lost.
    """
    known = np.isfinite(x) & np.isfinite(t)
    changes, gaps = np.abs(np.diff(x[known])), np.diff(t[known])
    if changes.size < min_values or np.mean(changes == 0.0) > 0.02 or np.mean(gaps == np.median(gaps)) > 0.9:
        return False
    if np.std(changes) > 0.0 and np.corrcoef(gaps, changes)[0, 1] > 0.5:
        return False
    (smallest, median), step = np.percentile(changes, (5, 50)), quantisation_step(x[known])
    return bool(smallest >= max(1.5 * step, min_ratio * median) or 0.0 < median <= 4.0 * step)


def controller_saw_hold(
    op: NDArray[np.float64], pv: NDArray[np.float64], op_step: float = 0.0, *, min_samples: int = 8, min_holds: int = 3
) -> bool:
    """Whether OP runs straight while PV is constant: the controller received the constant PV, no historian made it.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span] and process variable [engineering units]; NaN is missing.
    op_step : float
        Quantisation step of OP [% of span]; 0 for none.
    min_samples : int
        Shortest constant run of PV [samples].
    min_holds : int
        Fewest such runs with a straight OP; at most a quarter as many may have a bent one [-].

    Returns
    -------
    bool
        True when the valve or the transmitter held PV.

    Examples
    --------
    >>> pv = np.where(np.arange(400) // 40 % 2, 1.0, -1.0)
    >>> controller_saw_hold(50.0 - 0.1 * np.cumsum(pv), pv)
    True
    """
    constant = np.diff(forward_fill(pv)) == 0.0
    holds = sorted((run for run in runs(constant) if run[1] - run[0] >= min_samples), key=lambda run: run[0] - run[1])
    tolerance = max(op_step, 1e-5 * peak_to_peak(op))
    straight = bent = 0
    for first, last in holds[:30]:
        # The derivative still answers the change of PV in the first half; after the last stored PV it may have moved.
        end = first + int(np.flatnonzero(np.isfinite(pv[first : last + 1]))[-1])
        part = op[(first + end) // 2 : end + 1]
        known = np.flatnonzero(np.isfinite(part))
        if known.size < 4:
            continue
        part = part[known]
        line = fit_line(known, part)
        if abs(line.slope) * float(np.ptp(known) + 1.0) > 3.0 * tolerance:
            is_straight = np.abs(part - line.at(known)).max() <= tolerance
            straight, bent = straight + is_straight, bent + (not is_straight)
    return bool(straight >= min_holds and straight >= 4 * bent)


def check_compression(
    op: NDArray[np.float64], pv: NDArray[np.float64], steps: tuple[float, float], samples_per_cycle: float
) -> CheckResult | None:
    """Straight lines that no controller makes; the quantisation steps of OP and PV [their units] are known."""
    n = len(op)
    if n < 10:
        return None
    drawn = {"OP": count_interpolated(op, pv, *steps), "PV": count_interpolated(pv, op, *steps[::-1])}
    signal = max(drawn, key=lambda name: drawn[name])
    percent, stored = 100.0 * drawn[signal] / n, n - drawn[signal]
    finding = f"{signal} lies on exact straight lines at {percent:.3g} % of the samples"
    if percent <= 10.0:
        return CheckResult("compression", "ok", percent, 10.0, "%", finding)
    points = (1.0 - drawn[signal] / n) * samples_per_cycle
    finding += f": the historian interpolated, and stored {points:.1f} points per cycle, {stored} in all"
    remedy = "export raw values, or switch compression off and record again"
    if points < 8 or stored < MIN_SAMPLES:
        remedy = f"the shape of the cycle is lost: {remedy}"
        return CheckResult("compression", "reject", points, 8, "points per cycle", finding, remedy)
    return CheckResult("compression", "warn", percent, 10.0, "%", finding, remedy)


def check_exception_reporting(
    op: NDArray[np.float64], pv: NDArray[np.float64], steps: tuple[float, float], at_limit: NDArray[np.bool_]
) -> CheckResult | None:
    """OP or PV stored only after it had moved by a deviation: small movements are lost, and it seems to stick."""
    if len(op) < 10:
        return None
    deviations = {"OP": exception_deviation(op, steps[0]), "PV": exception_deviation(pv, steps[1])}
    if deviations["PV"] and controller_saw_hold(np.where(at_limit, np.nan, op), pv, steps[0]):
        deviations["PV"] = 0.0
    covered = [(peak_to_peak(x) / deviations[name], name) for name, x in (("OP", op), ("PV", pv)) if deviations[name]]
    if not covered:
        finding = "OP and PV also change by small steps: the historian leaves out no small changes"
        return CheckResult("exception reporting", "ok", 0.0, 0.0, "deviations", finding)
    levels, signal = min(covered)
    finding = (
        f"{signal} is constant and then changes by {deviations[signal]:.3g} or more, and covers {levels:.1f} such "
        "deviations: it was stored by exception"
    )
    return check_minimum(
        "exception reporting", levels, "deviations", warn=20, reject=6, finding=finding,
        remedy="set the exception deviation to 0 and record again",
    )  # fmt: skip


def _between_neighbours(x: NDArray[np.float64], width: float) -> NDArray[np.bool_]:
    """Where a moving signal lies exactly between its neighbours, shape (n_samples - 2,)."""
    return (np.abs(np.diff(x, 2)) <= EXACT * width) & (np.abs(np.diff(x)[1:]) > MOVING * width)


def _is_scaled_copy(x: NDArray[np.float64], y: NDArray[np.float64], x_step: float, y_step: float) -> bool:
    """Whether one signal is the other in another scale, and both bend: proportional action alone."""
    if np.abs(np.diff(x, 2)).max() <= EXACT * peak_to_peak(x):
        return False
    a, b = x - x.mean(), y - y.mean()
    x_size, y_size = (float(np.abs(one).max()) or 1.0 for one in (a, b))  # squares of tiny signals would vanish
    a, b, x_step, y_step = a / x_size, b / y_size, x_step / x_size, y_step / y_size
    power, other = float(np.mean(a * a)), float(np.mean(b * b))
    slope = float(np.mean(a * b)) / other if other > 0.0 else 0.0
    # Rounding to a step leaves a variance of a twelfth of its square; twice that is allowed.
    return power - slope**2 * other <= 1e-10 * power + (x_step**2 + (slope * y_step) ** 2) / 6.0


def _sums(x: NDArray, first: NDArray[np.int64], last: NDArray[np.int64]) -> NDArray[np.float64]:
    """Sum of `x` over each segment, NaN as 0."""
    total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(x))])
    return total[last] - total[first]
