"""Cells of text to numbers: decimal comma, thousands, and every text that is not a number counted by name."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.dialects import MISSING_WORDS
from stiction.records.record import LARGEST

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["as_number", "is_number", "to_numbers"]

_PLAIN = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?"),
}
_GROUPED = {
    ".": re.compile(r"[+-]?[1-9]\d{0,2}([,' ]\d{3})+(\.\d*)?"),
    ",": re.compile(r"[+-]?[1-9]\d{0,2}([.' ]\d{3})+(,\d*)?"),
}
_SPACES = str.maketrans({"\u00a0": " ", "\u202f": " ", "\u2212": "-"})


def _with_point(cell: str) -> str:
    if "." in cell:
        raise ValueError("a point beside a decimal comma groups thousands")
    return cell.replace(",", ".")


def _trim(cell: str) -> str:
    return cell.translate(_SPACES).strip().removesuffix("%").rstrip()


def is_number(cell: str, decimal: str, *, grouped: bool = True) -> bool:
    """Whether a cell is a number, with or without groups of thousands."""
    text = _trim(cell)
    return bool(_PLAIN[decimal].fullmatch(text) or (grouped and _GROUPED[decimal].fullmatch(text)))


def as_number(cell: str, decimal: str) -> float:
    """One cell as a number; NaN when it is none."""
    text = _trim(cell)
    if _PLAIN[decimal].fullmatch(text):
        return float(text.replace(",", "."))
    if _GROUPED[decimal].fullmatch(text):
        return float(re.sub(r"[.' ]" if decimal == "," else r"[,' ]", "", text).replace(",", "."))
    return float("nan")


def to_numbers(cells: Sequence[str], decimal: str) -> tuple[NDArray[np.float64], Counter[str]]:
    """Numbers of a column, NaN where there is none, and how often each other text stood there.

    Parameters
    ----------
    cells : sequence of str, shape (n_rows,)
        The column.
    decimal : str
        "." or ",".

    Returns
    -------
    values : ndarray, shape (n_rows,)
        The numbers, in the column's unit.
    texts : Counter
        Text -> number of cells; empty cells are counted under "", numbers beyond 1e100 under "infinite".

    Examples
    --------
    >>> to_numbers(["1,5", "Bad Input", ""], ",")
    (array([1.5, nan, nan]), Counter({'Bad Input': 1, '': 1}))
    """
    texts: Counter[str] = Counter()
    try:
        if any("_" in cell for cell in cells):
            raise ValueError("numpy takes 1_2 for 12, a reader does not")
        values = np.array(cells if decimal == "." else [_with_point(cell) for cell in cells], dtype=np.float64)
    except ValueError:
        values = np.empty(len(cells))
        for i, cell in enumerate(cells):
            values[i] = value = as_number(cell, decimal)
            if value != value:
                text = cell.strip()
                texts["" if text.upper() in MISSING_WORDS else text[:40]] += 1
    else:
        if missing := int(np.isnan(values).sum()):
            texts[""] += missing
    infinite = np.abs(values) > LARGEST
    if infinite.any():
        values[infinite] = np.nan
        texts["infinite"] += int(infinite.sum())
    return values, texts
