"""Cells of text to numbers: decimal comma, thousands, and every text that is not a number counted by name."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.errors import RecordError
from stiction.records.dialects import CELL_UNITS, MISSING_WORDS
from stiction.records.record import LARGEST

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["Numbers", "as_number", "is_number", "one_unit", "to_numbers", "usual_unit"]

_PLAIN = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?"),
}
_GROUPED = {
    ".": re.compile(r"[+-]?[1-9]\d{0,2}([,' ]\d{3})+(\.\d*)?"),
    ",": re.compile(r"[+-]?[1-9]\d{0,2}([.' ]\d{3})+(,\d*)?"),
}
_SPACES = str.maketrans({"\u00a0": " ", "\u202f": " ", "\u2212": "-"})
_UNITS = "|".join(map(re.escape, CELL_UNITS))
_WITH_UNIT = re.compile(rf"(.*[\d.,])\s*({_UNITS})", re.IGNORECASE)


class Numbers(NamedTuple):
    """A column of text as numbers."""

    values: NDArray[np.float64]
    """The numbers, in the column's unit; NaN where there is none, shape (n_rows,)."""
    texts: Counter[str]
    """Text that is no number -> cells; empty cells are counted under "", numbers beyond 1e100 under "infinite"."""
    units: Counter[str]
    """Unit behind the number as it is written, "" where there is none -> cells."""


def _with_point(cell: str) -> str:
    if "." in cell:
        raise ValueError("a point beside a decimal comma groups thousands")
    return cell.replace(",", ".")


def _cut(cell: str) -> tuple[str, str]:
    """The number of a cell, and the unit behind it as it is written; empty where there is none."""
    text = cell.translate(_SPACES).strip()
    found = None if text[-1:].isdigit() else _WITH_UNIT.fullmatch(text)
    return (found[1], found[2]) if found else (text, "")


def is_number(cell: str, decimal: str, *, grouped: bool = True) -> bool:
    """Whether a cell is a number, with or without groups of thousands and a unit."""
    text, _ = _cut(cell)
    return bool(_PLAIN[decimal].fullmatch(text) or (grouped and _GROUPED[decimal].fullmatch(text)))


def as_number(cell: str, decimal: str) -> float:
    """One cell as a number; NaN when it is none."""
    return _with_unit(cell, decimal)[0]


def _with_unit(cell: str, decimal: str) -> tuple[float, str]:
    text, unit = _cut(cell)
    if _PLAIN[decimal].fullmatch(text):
        return float(text.replace(",", ".")), unit
    if _GROUPED[decimal].fullmatch(text):
        return float(re.sub(r"[.' ]" if decimal == "," else r"[,' ]", "", text).replace(",", ".")), unit
    return float("nan"), ""


def to_numbers(cells: Sequence[str], decimal: str) -> Numbers:
    """Numbers of a column, and how often each unit and each other text stood there.

    Parameters
    ----------
    cells : sequence of str, shape (n_rows,)
        The column.
    decimal : str
        "." or ",".

    Examples
    --------
    >>> to_numbers(["1,5", "Bad Input", "", "2 bar"], ",")[:2]
    (array([1.5, nan, nan, 2. ]), Counter({'Bad Input': 1, '': 1}))
    """
    texts: Counter[str] = Counter()
    units: Counter[str] = Counter()
    try:
        if any("_" in cell for cell in cells):
            raise ValueError("numpy takes 1_2 for 12, a reader does not")
        values = np.array(cells if decimal == "." else [_with_point(cell) for cell in cells], dtype=np.float64)
    except ValueError:
        values = np.empty(len(cells))
        for i, cell in enumerate(cells):
            values[i], unit = _with_unit(cell, decimal)
            if values[i] == values[i]:
                units[unit] += 1
            else:
                text = cell.strip()
                texts["" if text.upper() in MISSING_WORDS else text[:40]] += 1
    else:
        missing = int(np.isnan(values).sum())
        texts += Counter({"": missing})
        units += Counter({"": len(values) - missing})
    infinite = np.abs(values) > LARGEST
    if infinite.any():
        values[infinite] = np.nan
        texts["infinite"] += int(infinite.sum())
    return Numbers(values, texts, units)


def one_unit(units: Counter[str], where: str) -> str:
    """Return the unit of a column's numbers; empty where they have none.

    Parameters
    ----------
    units : Counter
        Those of the column, as `to_numbers` counts them.
    where : str
        The file and the column, for the error.

    Raises
    ------
    RecordError
        When there are several: numbers in mbar beside numbers in bar are no record.

    Examples
    --------
    >>> one_unit(Counter({"bar": 90}), "FIC-1.csv, column PV")
    'bar'
    """
    if len(units) > 1:
        listed = ", ".join(f"{n} {f'in {unit}' if unit else 'without a unit'}" for unit, n in units.most_common(4))
        raise RecordError(f"{where}: mixes units ({listed}); export all its values in one unit, or without units.")
    return next(iter(units), "")


def usual_unit(cells: Sequence[str], decimal: str) -> str:
    """Return the unit that most numbers have behind them; empty where most have none.

    Examples
    --------
    >>> usual_unit(["52.3 %", "52.4 %", "-"], ".")
    '%'
    """
    units = to_numbers(cells, decimal).units
    return max(units, key=lambda unit: units[unit], default="")
