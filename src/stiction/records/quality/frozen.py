"""Signals that stop: a frozen PV, manual control without a recorded mode, and lost connections to the historian."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.display.number_format import count_noun
from stiction.records.check_result import CheckResult, check_excluded, check_maximum
from stiction.records.gaps import fill_short_gaps, unchanged_mask
from stiction.records.quality.manual_steps import find_manual_steps
from stiction.records.quality.saturation import find_saturation
from stiction.records.quantiles import quantiles
from stiction.records.runs import is_rarely_constant, run_bounds, run_lengths, runs, varies_within

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["check_frozen_pv", "check_manual", "check_outages", "find_frozen", "find_manual", "find_outages"]


def find_manual(
    op: NDArray[np.float64],
    pv: NDArray[np.float64] | None = None,
    auto: NDArray[np.bool_] | None = None,
    *,
    min_samples: int = 60,
    min_share: float = 0.05,
    min_samples_if_moving: int = 12,
    at_limit: NDArray[np.bool_] | None = None,
    steps: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Mark where the loop is in manual: by its mode, or because OP is constant or moves in steps while PV varies.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span] and process variable [engineering units]; NaN is missing.
    auto : ndarray of bool, shape (n_samples,), optional
        True where the controller is in automatic.
    min_samples : int
        Shortest constant OP [samples].
    min_share : float
        The same as a share of the record; the larger of both counts [-].
    min_samples_if_moving : int
        Shortest constant OP when it is almost never constant elsewhere [samples].
    at_limit, steps : ndarray of bool, shape (n_samples,), optional
        What `find_saturation` and `find_manual_steps` give for this OP, when it is known.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True in manual. OP at a limit is not meant (see `find_saturation`).

    Examples
    --------
    >>> op, pv = 50.0 + np.sin(np.arange(200.0)), np.cos(np.arange(200.0))
    >>> op[100:130] = 50.0
    >>> int(find_manual(op, pv).sum())
    30
    """
    mask = np.zeros(op.size, dtype=bool) if auto is None else ~auto
    steps = find_manual_steps(op) if steps is None else steps
    at_limit = find_saturation(op, pv, auto) if at_limit is None else at_limit
    for first, last in runs(steps):
        mask[first:last] |= varies_within(pv, first, last) & ~at_limit[first:last]
    constant = run_bounds(unchanged_mask(op)) - (1, 0)
    known = np.concatenate([[0], np.cumsum(at_limit | steps)])
    constant = constant[known[constant[:, 1]] - known[constant[:, 0]] < run_lengths(constant)]
    moving = is_rarely_constant(run_lengths(constant), op.size, min_long_run=min_samples_if_moving)
    needed = min_samples_if_moving if moving else max(min_samples, int(min_share * op.size))
    for first, last in constant[run_lengths(constant) >= needed].tolist():
        if varies_within(pv, first, last):
            mask[first:last] = True
    return mask


def find_frozen(
    pv: NDArray[np.float64], *, min_samples: int = 60, min_share: float = 0.05, min_samples_if_moving: int = 12
) -> NDArray[np.bool_]:
    """Mark where PV is constant for long, as it is only a few times in the record.

    Parameters
    ----------
    pv : ndarray, shape (n_samples,)
        Process variable [engineering units]; NaN is missing.
    min_samples : int
        Fewest repeats of a value [samples].
    min_share : float
        The same as a share of the record; the larger of both counts [-].
    min_samples_if_moving : int
        Fewest repeats when PV almost never repeats a value elsewhere [samples].

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True where PV is frozen; not where it is held again and again, by a sticking valve or a coarse transmitter.

    Examples
    --------
    >>> pv = np.sin(np.arange(200.0))
    >>> pv[100:120] = 0.3
    >>> int(find_frozen(pv).sum())
    20
    """
    unchanged = unchanged_mask(pv)
    usual = max(min_samples, int(min_share * pv.size))
    return _long_runs(unchanged, run_bounds(unchanged), min_samples_if_moving, usual)


def find_outages(
    op: NDArray[np.float64], pv: NDArray[np.float64], *, min_samples: int = 6, min_jump: float = 3.0
) -> NDArray[np.bool_]:
    """Mark where OP and PV are constant together and one of them jumps after: the historian had no connection.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span] and process variable [engineering units]; NaN is missing.
    min_samples : int
        Fewest repeats when OP and PV almost never repeat a value elsewhere [samples]; else 60 samples and 5 %.
    min_jump : float
        Smallest jump at its end [median moves from sample to sample].

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True during an outage. A record below 60 samples has none.

    Examples
    --------
    >>> k = np.arange(200.0)
    >>> k[100:110] = 100.0
    >>> int(find_outages(50.0 + np.sin(k / 9.0), np.cos(k / 9.0)).sum())
    10
    """
    if op.size < 60:
        return np.zeros(op.size, dtype=bool)
    op_unchanged, pv_unchanged = unchanged_mask(op), unchanged_mask(pv)
    together = run_bounds(op_unchanged & pv_unchanged)
    together = together[together[:, 0] > 1]
    if not together.size:
        return np.zeros(op.size, dtype=bool)
    moves = [np.abs(np.diff(fill_short_gaps(x), append=x[-1])) for x in (op, pv)]
    jumps = np.any([move > min_jump * quantiles(move, 0.5)[0] for move in moves], axis=0)
    together = together[jumps[together[:, 1] - 1]]
    return _long_runs(op_unchanged | pv_unchanged, together, min_samples, max(60, op.size // 20))


def check_manual(manual: NDArray[np.bool_], *, has_mode: bool, in_steps: bool, is_cut_too_short: bool) -> CheckResult:
    """Time in manual, by the recorded mode, by steps of OP or by a constant OP: no feedback there."""
    if has_mode:
        finding = "the mode is not automatic for {share} of the samples in {segments} (excluded)"
    elif in_steps:
        finding = "OP moves in steps, as in manual, for {share} of the samples in {segments} (excluded)"
    else:
        finding = (
            "OP is constant while PV moves, as in manual or inside a controller's gap, for {share} of the samples in "
            "{segments} (excluded)"
        )
    remedy = "put the controller in automatic and record again"
    return check_excluded("manual", manual, finding, reject=90, remedy=remedy, is_cut_too_short=is_cut_too_short)


def check_frozen_pv(frozen: NDArray[np.bool_], *, is_cut_too_short: bool) -> CheckResult:
    """Time of a constant PV that is never constant elsewhere."""
    finding = "PV is frozen for {share} of the samples in {segments} (excluded)"
    remedy = "repair the transmitter or its connection and record again"
    return check_excluded("frozen pv", frozen, finding, reject=80, remedy=remedy, is_cut_too_short=is_cut_too_short)


def check_outages(op: NDArray[np.float64], pv: NDArray[np.float64], dt: float) -> CheckResult:
    """Segments in which OP and PV, sampled every `dt` [s], are constant together and then jump."""
    outages = runs(find_outages(op, pv))
    finding = "OP and PV are never constant together"
    if outages:
        longest = int(run_lengths(outages).max()) * dt
        finding = (
            f"OP and PV are constant together and then jump, in {count_noun(len(outages), 'segment')} of up to "
            f"{format_seconds(longest)}: the historian had no connection"
        )
    remedy = "repair the connection to the historian and record again"
    return check_maximum("historian outages", len(outages), "-", warn=0, finding=finding, remedy=remedy)


def _long_runs(
    unchanged: NDArray[np.bool_], constant: NDArray[np.int64], if_moving: int, usual: int
) -> NDArray[np.bool_]:
    """Mark at most five constant runs, four times as long as all others and `usual` or `if_moving` samples long."""
    mask = np.zeros(unchanged.size, dtype=bool)
    lengths = run_lengths(constant)
    others_unchanged = np.count_nonzero(unchanged) - lengths[lengths >= if_moving].sum()
    long = lengths >= (if_moving if others_unchanged < 0.02 * unchanged.size else usual)
    short = lengths[~long]
    if not 1 <= long.sum() <= 5 or (short.size and 4 * short.max() > lengths[long].min()):
        return mask
    for first, last in constant[long].tolist():
        mask[first - 1 : last] = True
    return mask
