"""Copied data: segments that occur twice in a record, value for value."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.check_result import CheckResult, check_maximum

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["check_copied_data", "find_copied_data"]


def find_copied_data(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    op_step: float = 0.0,
    pv_step: float = 0.0,
    *,
    min_samples: int = 30,
    min_samples_if_unrounded: int = 8,
    max_cycle_error: float = 0.002,
) -> tuple[NDArray[np.bool_], bool]:
    """Mark the samples of segments that repeat an earlier segment, OP and PV alike.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span] and process variable [engineering units], without NaN.
    op_step, pv_step : float
        Their quantisation steps [% of span, engineering units]; 0 for none.
    min_samples, min_samples_if_unrounded : int
        Shortest copy, and the same when neither signal is rounded [samples]. Both signals must change in half of it.
    max_cycle_error : float
        Largest distance of a cycle from the one before for the record to be periodic [share of the range].

    Returns
    -------
    mask : ndarray of bool, shape (n_samples,)
        True in the later copies.
    is_periodic : bool
        Whether the whole record repeats itself so exactly that the segments need not be copies: a simulation without
        noise, or a coarse cycle.

    Examples
    --------
    >>> x = np.random.default_rng(1).normal(size=200)
    >>> mask, is_periodic = find_copied_data(*2 * [np.concatenate([x, x[20:120]])])
    >>> int(mask.sum()), is_periodic, find_copied_data(np.tile(x, 4), np.tile(x, 4))[1]
    (100, False, True)
    """
    length = min_samples if op_step or pv_step else min_samples_if_unrounded
    n = len(op) - length + 1
    mask = np.zeros(len(op), dtype=bool)
    if n < 2:
        return mask, False
    mix = np.uint64(0x9E3779B97F4A7C15)
    codes = (op + 0.0).view(np.uint64) * mix ^ ((pv + 0.0).view(np.uint64) >> np.uint64(7)) * mix
    codes ^= codes >> np.uint64(29)
    hashes = np.zeros(n, dtype=np.uint64)  # rolling ones (after Karp and Rabin)
    for k in range(length):
        hashes = hashes * np.uint64(0x100000001B3) + codes[k : k + n]
    changes = np.concatenate([[0], np.cumsum((np.diff(op) != 0.0) & (np.diff(pv) != 0.0))])
    moving = np.flatnonzero(2 * (changes[length - 1 :] - changes[:n]) >= length)
    ranked = np.sort(hashes[moving])
    if not np.any(ranked[1:] == ranked[:-1]):
        return mask, False
    order = moving[np.argsort(hashes[moving], kind="stable")]
    repeats = np.flatnonzero(hashes[order][1:] == hashes[order][:-1])
    starts, lags = order[repeats + 1], np.diff(order)[repeats]
    covered = np.zeros(len(op) + 1, dtype=np.int64)
    np.add.at(covered, starts, 1)
    np.add.at(covered, starts + length, -1)
    mask = np.cumsum(covered)[:-1] > 0
    values, counts = np.unique(lags, return_counts=True)
    lag, first = int(values[np.argmax(counts)]), int(starts.min())
    if len(op) - first > 1.5 * lag and mask[first:].mean() > 0.9:
        return mask, True
    near = np.ones(len(op) - lag, dtype=bool)
    for x, step in ((op, op_step), (pv, pv_step)):
        near &= np.abs(x[lag:] - x[:-lag]) <= max(2.01 * step, max_cycle_error * float(x.max() - x.min()))
    rest = near[~mask[lag:]]
    return mask, bool(rest.size and rest.mean() > 0.5)


def check_copied_data(
    op: NDArray[np.float64], pv: NDArray[np.float64], steps: tuple[float, float]
) -> CheckResult | None:
    """Segments that occur twice, value for value; the quantisation steps of OP and PV [their units] are known."""
    if len(op) < 2:
        return None
    mask, is_periodic = find_copied_data(op, pv, *steps)
    percent = 100.0 * float(np.mean(mask))
    if is_periodic:
        finding = (
            "the record repeats itself value for value: it was simulated without noise, or its values are rounded too "
            "much"
        )
        return CheckResult("copied data", "ok", percent, 0.5, "%", finding)
    return check_maximum(
        "copied data", percent, "%", warn=0.5, remedy="some data are copies: export the raw record",
        finding=f"{percent:.3g} % of the samples repeat an earlier segment value for value",
    )  # fmt: skip
