"""What columns mean: flagged rows, OP in % of span, mode to automatic or not."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.dialects import FRACTION_UNITS, MISSING_WORDS, MODES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.resample import Grid
    from stiction.records.table import Columns

__all__ = ["automatic", "flagged_rows", "in_percent", "is_good", "not_a_percentage"]


def flagged_rows(signals: dict[str, int], taken: Columns) -> NDArray[np.bool_]:
    """Rows that a `bad` or `quality` column marks, shape (n_rows,)."""
    flagged = np.zeros(taken.rows, dtype=bool)
    if "bad" in signals:
        cells = taken.text[signals["bad"]]
        flagged |= np.array([cell.strip().upper() not in ("0", "0.0", "FALSE", *MISSING_WORDS) for cell in cells])
    if "quality" in signals:
        cells = taken.text[signals["quality"]]
        flagged |= np.array([not is_good(cell.strip().upper()) for cell in cells])
    return flagged


def is_good(quality: str) -> bool:
    """Whether a status in capitals is good: OPC codes from 192 are, an empty cell says nothing."""
    return int(quality) >= 192 if quality.isdigit() else quality.startswith("GOOD") or quality in MISSING_WORDS


def in_percent(op: NDArray, unit: str, op_range: tuple[float, float] | None, guesses: list[str]) -> NDArray:
    """OP in % of span where its range is known; otherwise as it stands, with a word on what it looks like."""
    low, high = float(np.nanmin(op)), float(np.nanmax(op))
    if op_range is not None:
        zero, span = op_range[0], op_range[1] - op_range[0]
        return (op - zero) * (100.0 / span)
    if unit in FRACTION_UNITS and low >= -0.1 and high <= 1.1:
        guesses.append(f"OP is given in {unit.lower()} and was multiplied by 100.")
        return op * 100.0
    if unit == "MA" and low >= 3.6 and high <= 21.0:  # the range in which NAMUR NE 43 lets a signal live
        guesses.append("OP is given in mA: 4 mA are taken as 0 % and 20 mA as 100 %; give op_range if that is wrong.")
        return (op - 4.0) * 6.25
    suspicion = not_a_percentage(low, high)
    if unit == "MA":
        suspicion = "like no current of 4 to 20 mA"
    if suspicion:
        hint = {"MA": "(4, 20)"}.get(unit, "(0, 1)" if low >= 0.0 and high <= 1.0 else "(low, high)")
        guesses.append(
            f"OP lies in {low:.4g} to {high:.4g} and looks {suspicion}: left as it is, S and J are then in its unit; "
            f"give op_range={hint} to convert."
        )
    return op


def not_a_percentage(low: float, high: float) -> str:
    """Say what an OP between `low` and `high` looks like when not like % of span; empty when it does.

    Examples
    --------
    >>> not_a_percentage(0.2, 0.7), not_a_percentage(17.0, 21.0)
    ('like a fraction of span', '')
    """
    if low >= 0.0 and high <= 1.0:
        return "like a fraction of span"
    if low < -0.5 and high <= 5.0:
        return "normalised"
    if low < -10.0 or high > 110.0:
        return "like no percentage"
    return ""


def automatic(signals: dict[str, int], taken: Columns, grid: Grid, guesses: list[str]) -> NDArray[np.bool_] | None:
    """Mark the samples in automatic; a mode holds until the next is written."""
    if "mode" not in signals:
        return None
    cells = [cell.strip().upper() for cell in taken.text[signals["mode"]]]
    unknown = Counter(cell for cell in cells if cell not in MODES and cell not in MISSING_WORDS)
    if sum(unknown.values()) * 2 > len(cells) or not any(cell in MODES for cell in cells):
        guesses.append("The mode column is not understood and was left out.")
        return None
    if unknown:
        listed = ", ".join(f"{n} x {text!r}" for text, n in unknown.most_common(5))
        guesses.append(f"Modes not known count as not automatic: {listed}.")
    auto = np.empty(len(cells), dtype=bool)
    current = next(MODES[cell] for cell in cells if cell in MODES)
    for k, cell in enumerate(cells):
        if cell not in MISSING_WORDS:
            current = MODES.get(cell, False)
        auto[k] = current
    last = np.maximum.accumulate(np.where(grid.pick >= 0, np.arange(len(grid.pick)), 0))
    return auto[grid.pick[last]]
