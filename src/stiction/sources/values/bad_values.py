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
MAX_PLAUSIBLE = 1e29
"""Size from which a number is no measurement [any unit]."""
OP_LIMITS = (0.0, 1.0, 100.0)
"""Values at which all signals of a loop can rest in a shutdown [any unit]."""
_TOLERANCE = 1e-6


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
    _mark_numbers(bad, unmarked, numbers, "number", "numbers that stand for a bad value")
    states = find_common_states(unmarked)
    _mark_numbers(bad, unmarked, states, "state", "the same number in all signals, so no measurement")
    return bad


def _mark_flags(
    bad: BadValues,
    signals: Mapping[str, NDArray[np.float64]],
    flags: Mapping[str, tuple[str, pl.Series]],
    labels: Mapping[str, str],
) -> None:
    """Mark what the quality columns and the bad flags mark."""
    rows = 0
    shared: dict[int, NDArray[np.bool_]] = {}
    for key, (heading, cells) in flags.items():
        role, kind = _split_flag(key)
        if kind == "bad":
            mask = bad_flag_mask(cells)
        else:
            mask, note = bad_status_mask(cells, heading)
            bad.notes += [f"Column {heading}: {note}"] if note else []
        if role is None:
            shared[len(mask)] = shared.get(len(mask), False) | mask
        elif role in signals and len(mask) == len(signals[role]):
            bad.masks[role] |= mask
    for role, x in signals.items():
        if n := int(bad.masks[role].sum()):
            bad.notes.append(
                f"Missing: {n} {'value' if n == 1 else 'values'} of {labels.get(role, role.upper())}, flagged as bad."
            )
        if len(x) in shared:
            rows = max(rows, int(shared[len(x)].sum()))
            bad.masks[role] |= shared[len(x)]
        if n := int((bad.masks[role] & np.isfinite(x)).sum()):
            bad.counts["bad quality"] = bad.counts.get("bad quality", 0) + n
    if rows:
        bad.notes.append(f"Missing: {rows} {'row' if rows == 1 else 'rows'}, flagged as bad.")


def _split_flag(key: str) -> tuple[str | None, str]:
    """``"pv quality 2"`` -> ``("pv", "quality")``; no role for a flag of all signals."""
    words = [word for word in key.split() if not word.isdigit()]
    return (words[0] if len(words) > 1 else None), words[-1]


def _mark_numbers(
    bad: BadValues,
    values: dict[str, NDArray[np.float64]],
    masks: Mapping[str, NDArray[np.bool_]],
    kind: str,
    meaning: str,
) -> None:
    """Add masks of one kind to the bad values and blank the values."""
    counts: Counter[float] = Counter()
    rows: dict[int, NDArray[np.bool_]] = {}
    for role, mask in masks.items():
        if mask.any():
            found, n = np.unique(values[role][mask], return_counts=True)
            counts.update(dict(zip(found.tolist(), n.tolist(), strict=True)))
            rows[len(mask)] = rows.get(len(mask), False) | mask
            bad.masks[role] |= mask
            values[role][mask] = np.nan
    if counts:
        bad.counts |= {f"{kind} {value:.8g}": n for value, n in counts.most_common()}
        listed = ", ".join(f"{value:.8g}" for value, _ in counts.most_common(5))
        total = max(int(mask.sum()) for mask in rows.values())
        bad.notes.append(f"Missing: {total} {'row' if total == 1 else 'rows'} with {listed}: {meaning}.")


def _is_isolated(value: float, others: NDArray[np.float64], min_distance: float) -> bool:
    """Whether a value lies outside all others by some widths of their range."""
    if not others.size:
        return True
    low, high = float(others.min()), float(others.max())
    distance = max(low - value, value - high)
    scale = high - low if high > low else 0.1 * max(abs(high), 1.0)
    return distance > min_distance * scale


def find_sentinels(
    x: NDArray[np.float64], *, numbers: tuple[float, ...] = SENTINEL_NUMBERS, min_distance: float = 0.5
) -> NDArray[np.bool_]:
    """Mark the numbers that stand for "no value".

    Parameters
    ----------
    x : ndarray, shape (n_rows,)
        A signal [any unit]; NaN is missing.
    numbers : tuple of float
        Numbers to look for.
    min_distance : float
        Distance from all other values, in widths of their range, from which such a number is no measurement [-].

    Returns
    -------
    ndarray of bool, shape (n_rows,)
        True where the value is one of `numbers` and lies apart from all others, or is too large to be measured.

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
    candidates = [number for number in numbers if low <= number <= high and abs(number) < MAX_PLAUSIBLE]
    equal = {number: same for number in candidates if (same := np.abs(x - number) <= _TOLERANCE * abs(number)).any()}
    if equal:
        others = x[known & ~np.logical_or.reduce(list(equal.values()))]
        for number, same in equal.items():
            if _is_isolated(number, others, min_distance) and (others.size or abs(number) >= 999.0):
                mask |= same
    return mask


def find_common_states(
    signals: Mapping[str, NDArray[np.float64]], *, min_distance: float = 0.5, max_limit_run: int = 30
) -> dict[str, NDArray[np.bool_]]:
    """Mark rows in which all signals of a loop have the same number: a digital state, stored as a number.

    Parameters
    ----------
    signals : mapping
        Role -> values, shape (n_rows,). PV, OP and SP are compared, as far as they have the same rows.
    min_distance : float
        Distance of the number from all other values of each signal, in widths of their range, from which it is no
        measurement [-].
    max_limit_run : int
        Longest run of rows in which a common 0, 1 or 100 is a state and no shutdown [rows].

    Returns
    -------
    dict
        Role -> mask, shape (n_rows,). A number that is a state in all signals at once is marked as well where it
        stands apart in one signal alone.

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
    same = np.isfinite(pv)
    for role in compared[1:]:
        same &= np.abs(signals[role] - pv) <= _TOLERANCE * np.abs(pv)
    values = np.unique(pv[same])
    apart = {
        role: [value for value in values if _is_isolated(value, x[np.isfinite(x) & ~np.isin(x, values)], min_distance)]
        for role, x in signals.items()
    }
    for value in values:
        rows = same & (pv == value)
        if not all(value in apart[role] for role in compared):
            continue
        if value in OP_LIMITS and (len(compared) < 3 or _longest_run(rows) > max_limit_run or rows[0] or rows[-1]):
            continue
        for role, x in signals.items():
            if value in apart[role]:
                masks[role] |= x == value
    return masks


def _longest_run(mask: NDArray[np.bool_]) -> int:
    """Length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.r_[False, mask, False]))
    return int((edges[1::2] - edges[::2]).max(initial=0))
