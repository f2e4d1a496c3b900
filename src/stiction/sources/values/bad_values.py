"""Bad values: texts, quality columns, numbers that historians write for "no value", and digital states as numbers."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.runs import run_lengths, runs

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["BadValues", "find_bad_values", "find_common_states", "find_sentinels"]

SENTINEL_NUMBERS = (
    *(-99.0, -99.9, -99.99, -999.0, -999.25, -999.9, -999.99, -9999.0, -9999.9, -9999.99, -99999.0, -999999.0),
    *(999.0, 999.99, 9999.0, 9999.99, 99999.0, 999999.0, -32768.0, 32767.0, 65535.0, 2147483647.0, -2147483648.0),
    *(-1e6, -1e9),  # from 1e29 on any number is one
)
"""Numbers that historians, loggers and analog inputs write for "no value"."""
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
    flags: Mapping[str, NDArray[np.bool_]] | None = None,
    labels: Mapping[str, str] | None = None,
) -> BadValues:
    """Find the values of a loop that are no measurements, each under the first kind that marks it.

    By role: values, the texts of `parse_numbers`, rows that flags mark (as "pv quality"), and headings for the notes.
    """
    bad = BadValues({role: np.zeros(len(x), dtype=bool) for role, x in signals.items()})
    listed = sum((texts or {}).values(), Counter())
    listed.pop("", None)
    bad.counts |= dict(listed.most_common())
    if listed:
        named = ", ".join(f"{n} x {text!r}" for text, n in listed.most_common(5))
        bad.notes.append(f"Missing, because they are texts and not numbers: {named}.")
    _mark_flags(bad, signals, flags or {}, labels or {})
    left = {role: np.where(bad.masks[role], np.nan, x) for role, x in signals.items()}
    sentinels = {role: find_sentinels(x) for role, x in left.items()}
    _mark_numbers(bad, left, sentinels, "number", "which stand for a bad value")
    states = find_common_states(left)
    _mark_numbers(bad, left, states, "state", "the same number in all signals at one time, so it is not a measurement")
    return bad


def _mark_flags(
    bad: BadValues,
    signals: Mapping[str, NDArray[np.float64]],
    flags: Mapping[str, NDArray[np.bool_]],
    labels: Mapping[str, str],
) -> None:
    """Mark what the quality columns and the bad flags mark."""
    for key, mask in flags.items():
        owners = [word for word in key.split() if not word.isdigit()][:-1]
        for role in owners or list(signals):
            if role in signals and len(mask) == len(signals[role]):
                bad.masks[role] |= mask
        if n := int(mask.sum()):
            of = f"values of {labels.get(owners[0], owners[0].upper())}" if owners else "rows"
            bad.notes.append(f"Missing: {n} {of if n > 1 else of.replace('s', '', 1)}, flagged as bad.")
    if n := sum(int((bad.masks[role] & np.isfinite(x)).sum()) for role, x in signals.items()):
        bad.counts["bad quality"] = n


def _mark_numbers(
    bad: BadValues, values: dict[str, NDArray[np.float64]], masks: Mapping[str, NDArray[np.bool_]], kind: str, why: str
) -> None:
    """Add masks of one kind to the bad values, and blank the values."""
    counts: Counter[float] = Counter()
    for role, mask in masks.items():
        bad_numbers, n = np.unique(values[role][mask], return_counts=True)
        counts.update(dict(zip(bad_numbers.tolist(), n.tolist(), strict=True)))
        bad.masks[role] |= mask
        values[role][mask] = np.nan
    if counts:
        bad.counts |= {f"{kind} {value:.8g}": n for value, n in counts.most_common()}
        listed = ", ".join(f"{n} x {value:.8g}" for value, n in counts.most_common(5))
        bad.notes.append(f"Missing: {listed}, {why}.")


def find_sentinels(
    x: NDArray[np.float64], *, numbers: tuple[float, ...] = SENTINEL_NUMBERS, min_distance: float = 0.5
) -> NDArray[np.bool_]:
    """Mark numbers `min_distance` widths of the range from all others [-], or too large, shape (n_rows,)."""
    mask = np.abs(x) >= 1e29
    known = x[np.isfinite(x) & ~mask]
    if not known.size:
        return mask
    low, high = known.min(), known.max()
    near = {n: np.abs(x - n) <= TOLERANCE * abs(n) for n in numbers if low <= n <= high}
    near = {n: rows for n, rows in near.items() if rows.any()}
    if near:
        present, is_one = np.array(list(near)), np.logical_or.reduce(list(near.values()))
        others = x[np.isfinite(x) & ~mask & ~is_one]
        # A signal of nothing else has no value at all from -999 downwards.
        bad = _is_apart(present, others, min_distance) if others.size else present <= -999.0
        mask = np.logical_or.reduce([mask, *(near[n] for n in present[bad])])
    return mask


def find_common_states(
    signals: Mapping[str, NDArray[np.float64]], *, min_distance: float = 0.5, max_share: float = 0.5, max_run: int = 30
) -> dict[str, NDArray[np.bool_]]:
    """Mark rows with one number in PV, OP and SP, a digital state `min_distance` widths from the rest [-].

    Signals equal in more than `max_share` of the rows [-] are copies; a 0, 1 or 100 over `max_run` rows is a shutdown.
    """
    masks = {role: np.zeros(len(x), dtype=bool) for role, x in signals.items()}
    compared = [role for role in ("pv", "op", "sp") if role in signals and np.isfinite(signals[role]).any()]
    if not {"pv", "op"} <= set(compared) or len({len(signals[role]) for role in compared}) > 1:
        return masks
    pv = signals["pv"]
    with np.errstate(invalid="ignore"):  # infinite values
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
        may_be_shutdown = len(compared) < 3 or rows[0] or rows[-1] or run_lengths(runs(rows)).max() > max_run
        if values[k] in (0.0, 1.0, 100.0) and may_be_shutdown:
            continue
        for role, x in signals.items():
            masks[role] |= x == values[k] if apart[role][k] else rows & (x == values[k])
    return masks


def _is_apart(values: NDArray[np.float64], others: NDArray[np.float64], min_distance: float) -> NDArray[np.bool_]:
    """Mark the values that lie outside all others by some widths of their range; none when there are no others."""
    if not others.size:
        return np.zeros(len(values), dtype=bool)
    low, high = float(others.min()), float(others.max())
    width = high - low or 0.1 * max(abs(high), 1.0)
    return np.maximum(low - values, values - high) > min_distance * width
