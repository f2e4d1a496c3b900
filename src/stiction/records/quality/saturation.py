"""Saturation: OP stays at 0 or 100 %, or is clipped at its own extreme, so the loop is open."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.check_result import CheckResult, check_excluded
from stiction.records.gaps import fill_short_gaps, unchanged_mask
from stiction.records.quality.manual_steps import find_manual_steps
from stiction.records.quality.quantisation import count_values
from stiction.records.runs import is_rarely_constant, run_bounds, run_lengths, runs, varies_within

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

__all__ = ["check_saturation", "find_clipping", "find_saturation", "find_shutdown", "find_span_ends"]

SPANS = ((0.0, 100.0), (0.0, 1.0), (4.0, 20.0))
"""Spans of OP: %, fraction, mA. OP at the end of a span is there when all of OP lies inside that span."""


def find_saturation(
    op: NDArray[np.float64],
    pv: NDArray[np.float64] | None = None,
    auto: NDArray[np.bool_] | None = None,
    *,
    min_samples: int = 10,
    min_samples_if_moving: int = 3,
    tolerance: float = 0.001,
    clipped: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Mark where OP stays at a limit: at an end of its span, or clipped (see `find_clipping`).

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span, fraction or mA]; NaN is missing.
    pv : ndarray, shape (n_samples,), optional
        Process variable [engineering units]; clipping is only looked for when it is given.
    auto : ndarray of bool, shape (n_samples,), optional
        True where the controller is in automatic; elsewhere OP is not saturated.
    min_samples : int
        Shortest stay at a limit [samples].
    min_samples_if_moving : int
        Shortest stay when OP is almost never constant elsewhere [samples].
    tolerance : float
        Largest distance from an end of the span [share of span].
    clipped : ndarray of bool, shape (n_samples,), optional
        What `find_clipping` gives with the same numbers of samples, when it is known.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True where OP is at a limit: there is no feedback there.

    Examples
    --------
    >>> op = np.concatenate([np.linspace(80.0, 100.0, 20), np.full(11, 100.0), [90.0, 80.0]])
    >>> int(find_saturation(op).sum())
    12
    """
    if clipped is None:
        clipped = find_clipping(op, pv, auto, min_samples=min_samples, min_samples_if_moving=min_samples_if_moving)
    mask, ends = clipped.copy(), list(_at_span_ends(fill_short_gaps(op), tolerance))
    needed = _needed_samples(op, min_samples, min_samples_if_moving) if ends else 0
    for at_end in ends:
        for first, last in _stays(op, at_end, needed):
            mask[first:last] = True
    return mask if auto is None else mask & auto


def find_clipping(
    op: NDArray[np.float64],
    pv: NDArray[np.float64] | None,
    auto: NDArray[np.bool_] | None = None,
    *,
    min_samples: int = 10,
    min_samples_if_moving: int = 3,
    min_values: int = 12,
    steps: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Mark where OP stays at its own largest or smallest value, inside its span, while PV moves.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span, fraction or mA] and process variable [engineering units]; NaN is missing.
    auto : ndarray of bool, shape (n_samples,), optional
        True where the controller is in automatic; what is in manual, or in manual steps, is not clipped.
    min_samples, min_samples_if_moving : int
        Shortest stay, and the same when OP is almost never constant elsewhere [samples].
    min_values : int
        Values of OP between its extremes below which these are no limits but two of the few stored values [-].
    steps : ndarray of bool, shape (n_samples,), optional
        What `find_manual_steps` gives for this OP, when it is known.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True where OP is clipped. The valve need not have received the OP that was stored there.

    Examples
    --------
    >>> wave = 10.0 * np.sin(np.arange(200) / 9.0)
    >>> clipped = find_clipping(np.minimum(50.0 + wave, 57.0), wave)
    >>> bool(np.array_equal(clipped, wave >= 7.0))
    True
    """
    steps = find_manual_steps(op) if steps is None else steps
    manual = steps if auto is None else steps | ~auto
    own = np.where(manual, np.nan, op)
    filled = np.where(manual, np.nan, fill_short_gaps(own))
    mask = np.zeros(op.size, dtype=bool)
    finite = filled[np.isfinite(filled)]
    if finite.size == 0 or count_values(finite, min_values + 2) < min_values + 2:
        return mask
    ends = [at_end for at_end in _at_span_ends(fill_short_gaps(op), 0.001) if at_end.any()]
    fewest = min(min_samples, min_samples_if_moving)
    extremes = [at for at in (filled == finite.min(), filled == finite.max()) if _stays(op, at, fewest)]
    needed = _needed_samples(own, min_samples, min_samples_if_moving) if extremes else 0
    for at_extreme in extremes:
        if any(at_end[at_extreme].all() for at_end in ends):
            continue
        for first, last in _stays(op, at_extreme, needed):
            mask[first:last] = varies_within(pv, first, last)
    return mask


def find_span_ends(
    op: NDArray[np.float64], auto: NDArray[np.bool_] | None = None, *, min_samples: int = 2, tolerance: float = 0.001
) -> NDArray[np.bool_]:
    """Mark where OP is at an end of its span: 0 or 100 %, 0 or 1, 4 or 20 mA.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span, fraction or mA]; NaN is missing.
    auto : ndarray of bool, shape (n_samples,), optional
        True where the controller is in automatic; elsewhere nothing is marked.
    min_samples : int
        Shortest stay [samples].
    tolerance : float
        Largest distance from an end of the span [share of span].

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True at an end of the span.

    Examples
    --------
    >>> find_span_ends(np.array([40.0, 100.0, 100.0, 70.0, 100.0])).tolist()
    [False, True, True, False, False]
    """
    mask = np.zeros(op.size, dtype=bool)
    for at_end in _at_span_ends(op, tolerance):
        bounds = run_bounds(at_end)
        for first, last in bounds[run_lengths(bounds) >= min_samples].tolist():
            mask[first:last] = True
    return mask if auto is None else mask & auto


def find_shutdown(
    op: NDArray[np.float64],
    auto: NDArray[np.bool_] | None = None,
    *,
    min_samples: int = 10,
    min_share: float = 0.1,
    min_share_at_ends: float = 0.9,
) -> NDArray[np.bool_]:
    """Mark the one long stay of OP at an end of its span: the loop is shut down, or held there.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span, fraction or mA]; NaN is missing.
    auto : ndarray of bool, shape (n_samples,), optional
        True where the controller is in automatic.
    min_samples : int
        Shortest stay at an end [samples].
    min_share, min_share_at_ends : float
        Share of the record, and of all time at the ends, that the stay must exceed [-]. A loop that returns to its
        limits again and again is in operation.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True during the shutdown.

    Examples
    --------
    >>> int(find_shutdown(np.concatenate([40.0 + np.arange(80.0) % 7, np.zeros(20)])).sum())
    20
    """
    at_end, mask = find_span_ends(op, auto, min_samples=min_samples), np.zeros(op.size, dtype=bool)
    first, last = max(runs(at_end), key=lambda run: run[1] - run[0], default=(0, 0))
    if last - first > max(min_share * op.size, min_share_at_ends * at_end.sum()):
        mask[first:last] = True
    return mask


def check_saturation(at_limit: NDArray[np.bool_], clipped: NDArray[np.bool_], *, is_cut_too_short: bool) -> CheckResult:
    """Time of OP at a limit: no feedback there, and a clipped OP need not be the one that the valve received."""
    finding = "OP is at a limit for {share} of the samples in {segments}" + (" (excluded)" if clipped.any() else "")
    remedy = "check valve sizing and OP limits, then record while OP is between its limits"
    return check_excluded("saturation", at_limit, finding, reject=80, remedy=remedy, is_cut_too_short=is_cut_too_short)


def _needed_samples(op: NDArray[np.float64], usual: int, if_moving: int) -> int:
    """Samples that OP must stay at a limit: few when it is almost never constant elsewhere."""
    finite = op[np.isfinite(op)]
    if finite.size == 0:
        return usual
    ends = (finite.min(), finite.max())
    inside = np.isfinite(op) & (op != ends[0]) & (op != ends[1])
    constant = run_bounds(unchanged_mask(op) & inside)
    if is_rarely_constant(run_lengths(constant), int(np.count_nonzero(inside))):
        return if_moving
    # A controller returns to its limit, and to no other value; a rounded OP returns to many.
    no_value_returns = np.unique(op[constant[:, 0]]).size == len(constant)
    returns = max(np.count_nonzero(run_lengths(run_bounds(op == end)) >= if_moving) for end in ends)
    return if_moving if no_value_returns and returns >= 3 else usual


def _stays(op: NDArray[np.float64], at: NDArray[np.bool_], needed: int) -> list[tuple[int, int]]:
    """Runs of `at` in which so many samples were recorded."""
    bounds = run_bounds(at)
    long = bounds[run_lengths(bounds) >= needed].tolist()
    return [(first, last) for first, last in long if np.isfinite(op[first:last]).sum() >= needed]


def _at_span_ends(op: NDArray[np.float64], tolerance: float) -> Iterator[NDArray[np.bool_]]:
    """Where OP is at an end of each span that it could have, shape (n_samples,) each."""
    finite = op[np.isfinite(op)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    for zero, full in SPANS:
        near = tolerance * (full - zero)
        if low >= zero - near and zero + 0.05 * (full - zero) < high <= full + near and low < high:
            yield (op <= zero + near) | (op >= full - near)
