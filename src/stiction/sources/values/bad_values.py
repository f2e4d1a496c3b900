"""Bad values: texts, quality columns, numbers that historians write for "no value", and digital states as numbers."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.sources.values.status_codes import bad_flag_mask, bad_status_mask

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl
    from numpy.typing import NDArray

__all__ = ["SENTINEL_NUMBERS", "BadValues", "find_bad_values", "find_common_states", "find_sentinels"]

SENTINEL_NUMBERS = (
    *(-99.0, -99.9, -99.99, -999.0, -999.25, -999.9, -999.99, -9999.0, -9999.9, -9999.99, -99999.0, -999999.0),
    *(999.0, 999.99, 9999.0, 9999.99, 99999.0, 999999.0, -32768.0, 32767.0, 65535.0, 2147483647.0, -2147483648.0),
    *(-1e6, -1e9, -1e30, 1e30, -1e31, 1e31, -1e38, 1e38, -3.4028235e38, 3.4028235e38),
)
"""Numbers that historians, loggers and analog inputs write for "no value"."""
SURE_SENTINEL = -999.0
"""Sentinel number from which, downwards, a signal of nothing else has no value at all [any unit]."""
MAX_PLAUSIBLE = 1e29
"""Size from which a number is no measurement [any unit]."""
REST_VALUES = (0.0, 1.0, 100.0)
"""Values at which all signals of a loop can rest in a shutdown [any unit]."""
TOLERANCE = 1e-6
"""Relative distance within which two numbers are the same [-]."""


@dataclass(eq=False)
class BadValues:
    """Values of one loop that are no measurements."""

    masks: dict[str, NDArray[np.bool_]]
    """Role -> True where the value is bad, shape (n_rows,)."""
    counts: dict[str, int] = field(default_factory=dict)
    """Kind ("Bad Input", "bad quality", "number -9999", "state 246") -> values of all signals."""
    notes: list[str] = field(default_factory=list)
    """What was found and assumed, a sentence each."""


def find_bad_values(
    signals: Mapping[str, NDArray[np.float64]],
    *,
    texts: Mapping[str, Counter[str]] | None = None,
    flags: Mapping[str, tuple[str, pl.Series]] | None = None,
    labels: Mapping[str, str] | None = None,
) -> BadValues:
    """Find the values of a loop that are no measurements, in all signals alike.

    Parameters
    ----------
    signals : mapping
        Role -> values [any unit], NaN where the cell is no number, shape (n_rows,). Signals of equal length share
        their rows.
    texts : mapping, optional
        Role -> texts in the place of numbers, as `parse_numbers` counts them.
    flags : mapping, optional
        Role as in `LoopRoles.roles` ("bad", "quality", "pv quality", "op bad 2") -> heading and cells.
    labels : mapping, optional
        Role -> heading, for the notes.

    Returns
    -------
    BadValues
        Masks, counts and notes. A value counts once, under the first kind that marks it.

    Examples
    --------
    >>> t = np.arange(200.0)
    >>> pv, op, sp = 150 + 8 * np.sin(t / 9), 50 + 5 * np.cos(t / 9), np.full(200, 150.0)
    >>> pv[40:43] = op[40:43] = sp[40:43] = -9999.0
    >>> pv[90:92] = op[90:92] = sp[90:92] = 246.0
    >>> find_bad_values({"pv": pv, "op": op, "sp": sp}).counts
    {'number -9999': 9, 'state 246': 6}
    """
    bad = BadValues({role: np.zeros(len(x), dtype=bool) for role, x in signals.items()})
    listed: Counter[str] = Counter()
    for found in (texts or {}).values():
        listed.update({text: n for text, n in found.items() if text})
    bad.counts |= dict(listed.most_common())
    if listed:
        named = ", ".join(f"{n} x {text!r}" for text, n in listed.most_common(5))
        bad.notes.append(f"Texts in the place of numbers count as missing: {named}.")
    _mark_flags(bad, signals, flags or {}, labels or {})
    unmarked = {role: np.where(bad.masks[role], np.nan, x) for role, x in signals.items()}
    numbers = {role: find_sentinels(x) for role, x in unmarked.items()}
    _mark_numbers(bad, unmarked, numbers, "number", "which stand for a bad value")
    states = find_common_states(unmarked)
    _mark_numbers(bad, unmarked, states, "state", "the same number in all signals at one time, so no measurement")
    return bad


def _mark_flags(
    bad: BadValues,
    signals: Mapping[str, NDArray[np.float64]],
    flags: Mapping[str, tuple[str, pl.Series]],
    labels: Mapping[str, str],
) -> None:
    """Mark what the quality columns and the bad flags mark."""
    for key, (heading, cells) in flags.items():
        words = [word for word in key.split() if not word.isdigit()]
        owners = words[:-1] or list(signals)
        mask, note = (bad_flag_mask(cells), "") if words[-1] == "bad" else bad_status_mask(cells, heading)
        bad.notes += [f"Column {heading}: {note}"] if note else []
        for role in owners:
            if role in signals and len(mask) == len(signals[role]):
                bad.masks[role] |= mask
        if n := int(mask.sum()):
            of = f"values of {labels.get(owners[0], owners[0].upper())}" if len(words) > 1 else "rows"
            bad.notes.append(f"Missing: {n} {of if n > 1 else of.replace('s', '', 1)}, flagged as bad.")
    if n := sum(int((bad.masks[role] & np.isfinite(x)).sum()) for role, x in signals.items()):
        bad.counts["bad quality"] = n


def _mark_numbers(
    bad: BadValues, values: dict[str, NDArray[np.float64]], masks: Mapping[str, NDArray[np.bool_]], kind: str, why: str
) -> None:
    """Add masks of one kind to the bad values, and blank the values."""
    counts: Counter[float] = Counter()
    for role, mask in masks.items():
        found, n = np.unique(values[role][mask], return_counts=True)
        counts.update(dict(zip(found.tolist(), n.tolist(), strict=True)))
        bad.masks[role] |= mask
        values[role][mask] = np.nan
    if counts:
        bad.counts |= {f"{kind} {value:.8g}": n for value, n in counts.most_common()}
        listed = ", ".join(f"{n} x {value:.8g}" for value, n in counts.most_common(5))
        bad.notes.append(f"Missing: {listed}, {why}.")


def _is_apart(values: NDArray[np.float64], others: NDArray[np.float64], min_distance: float) -> NDArray[np.bool_]:
    """Mark the values that lie outside all others by some widths of their range; none when there are no others."""
    if not others.size:
        return np.zeros(len(values), dtype=bool)
    low, high = float(others.min()), float(others.max())
    width = high - low or 0.1 * max(abs(high), 1.0)
    return np.maximum(low - values, values - high) > min_distance * width


def find_sentinels(
    x: NDArray[np.float64], *, numbers: tuple[float, ...] = SENTINEL_NUMBERS, min_distance: float = 0.5
) -> NDArray[np.bool_]:
    """Mark the numbers that stand for "no value", shape (n_rows,).

    Parameters
    ----------
    x : ndarray, shape (n_rows,)
        A signal [any unit]; NaN is missing.
    numbers : tuple of float
        Numbers to look for; one that is too large to be measured is bad anyway.
    min_distance : float
        Distance from all other values, in widths of their range, from which such a number is no measurement [-].

    Examples
    --------
    >>> find_sentinels(np.array([5.0, 6.0, -9999.0, 7.0])).tolist(), find_sentinels(np.array([-98.0, -99.0])).tolist()
    ([False, False, True, False], [False, False])
    """
    mask = np.abs(x) >= MAX_PLAUSIBLE
    known = np.isfinite(x) & ~mask
    if not known.any():
        return mask
    low, high = x[known].min(), x[known].max()
    present = [n for n in numbers if low <= n <= high and (np.abs(x - n) <= TOLERANCE * abs(n)).any()]
    if present:
        same = [np.abs(x - number) <= TOLERANCE * abs(number) for number in present]
        others = x[known & ~np.logical_or.reduce(same)]
        numbers_here = np.array(present)
        apart = _is_apart(numbers_here, others, min_distance) if others.size else numbers_here <= SURE_SENTINEL
        mask = np.logical_or.reduce([mask, *(rows for rows, is_apart in zip(same, apart, strict=True) if is_apart)])
    return mask


def find_common_states(
    signals: Mapping[str, NDArray[np.float64]], *, min_distance: float = 0.5, max_share: float = 0.5, max_run: int = 30
) -> dict[str, NDArray[np.bool_]]:
    """Mark rows in which all signals of a loop have the same number: a digital state, stored as a number.

    A number that is a state in all signals at once is marked as well where it stands apart in one signal alone.

    Parameters
    ----------
    signals : mapping
        Role -> values, shape (n_rows,). PV, OP and SP are compared, as far as they have the same rows.
    min_distance : float
        Distance of the number from all other values of each signal, in widths of their range, from which it is no
        measurement [-].
    max_share : float
        Share of the rows above which equal signals are copies of one another [-].
    max_run : int
        Longest run of rows in which a common 0, 1 or 100 is a state and no shutdown [rows].

    Examples
    --------
    >>> t = np.arange(100.0)
    >>> pv, op = 148 + np.sin(t), 50 + np.cos(t)
    >>> pv[:3] = op[:3] = 253.0
    >>> op[50] = 253.0
    >>> [int(mask.sum()) for mask in find_common_states({"pv": pv, "op": op}).values()]
    [3, 4]
    """
    masks = {role: np.zeros(len(x), dtype=bool) for role, x in signals.items()}
    compared = [role for role in ("pv", "op", "sp") if role in signals and np.isfinite(signals[role]).any()]
    if not {"pv", "op"} <= set(compared) or len({len(signals[role]) for role in compared}) > 1:
        return masks
    pv = signals["pv"]
    same = np.logical_and.reduce([np.abs(signals[role] - pv) <= TOLERANCE * np.abs(pv) for role in compared[1:]])
    if not same.any() or same.mean() > max_share:
        return masks
    values = np.unique(pv[same])
    apart = {
        role: _is_apart(values, x[np.isfinite(x) & ~np.isin(x, values)], min_distance) for role, x in signals.items()
    }
    is_state = np.logical_and.reduce([apart[role] for role in compared])
    if len(compared) == 3:
        is_state |= apart["op"] & ((values < -10.0) | (values > 110.0))  # no percentage, whatever PV and SP are
    for k in np.flatnonzero(is_state):
        rows = same & (pv == values[k])
        if values[k] in REST_VALUES and (len(compared) < 3 or rows[0] or rows[-1] or _longest_run(rows) > max_run):
            continue
        for role, x in signals.items():
            masks[role] |= x == values[k] if apart[role][k] else rows & (x == values[k])
    return masks


def _longest_run(mask: NDArray[np.bool_]) -> int:
    """Length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.r_[False, mask, False]))
    return int((edges[1::2] - edges[::2]).max(initial=0))
