"""Cells to numbers: decimal comma, thousands, a unit behind the number; every other text is counted."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.errors import RecordError
from stiction.sources.roles.vocabulary import CELL_UNITS, MISSING_WORDS

if TYPE_CHECKING:
    import polars as pl
    from numpy.typing import NDArray

__all__ = ["LARGEST_VALUE", "NumericColumn", "is_number", "parse_number", "parse_numbers", "usual_unit"]

LARGEST_VALUE = 1e100
"""Size above which a number is no measurement [any unit]."""
MAX_TEXT = 40
"""Characters of a text by which it is counted."""

_PLAIN = {".": r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", ",": r"[+-]?(?:\d+,?\d*|,\d+)(?:[eE][+-]?\d+)?"}
_GROUPED = {".": r"[+-]?[1-9]\d{0,2}(?:[,' ]\d{3})+(?:\.\d*)?", ",": r"[+-]?[1-9]\d{0,2}(?:[.' ]\d{3})+(?:,\d*)?"}
_GROUP_MARKS = {".": "[,' ]", ",": "[.' ]"}
_IS_PLAIN = {mark: re.compile(pattern, re.ASCII) for mark, pattern in _PLAIN.items()}
_IS_GROUPED = {mark: re.compile(pattern, re.ASCII) for mark, pattern in _GROUPED.items()}
_SPACES = str.maketrans({"\u00a0": " ", "\u202f": " ", "\u2212": "-"})
_UNITS = "|".join(map(re.escape, CELL_UNITS))
_WITH_UNIT = re.compile(rf"(.*[\d.,])\s*({_UNITS})", re.IGNORECASE)
_MAX_PYTHON_CELLS = 200
"""Distinct cells up to which a loop in Python is faster than regular expressions in polars [-]."""


class NumericColumn(NamedTuple):
    """A column of cells as numbers."""

    values: NDArray[np.float64]
    """The numbers [`unit`]; NaN where there is none, shape (n_rows,)."""
    texts: Counter[str]
    """Text that is no number -> cells. Empty cells are counted under "", numbers beyond 1e100 under "infinite"."""
    unit: str
    """Unit behind the numbers as written; empty when there is none."""


def is_number(cell: str, decimal: str, *, grouped: bool = True) -> bool:
    """Whether a cell is a number, with or without thousands separators and a unit.

    Examples
    --------
    >>> is_number("1,234.5 bar", "."), is_number("1,234.5", ".", grouped=False), is_number("1_2", ".")
    (True, False, False)
    """
    if _IS_PLAIN[decimal].fullmatch(cell):
        return True
    text, _ = _split_unit(cell)
    return bool(_IS_PLAIN[decimal].fullmatch(text) or (grouped and _IS_GROUPED[decimal].fullmatch(text)))


def parse_number(cell: str, decimal: str) -> float:
    """Give the number in a cell; NaN when there is none.

    Examples
    --------
    >>> parse_number("1.234,5", ","), parse_number("Bad", ",")
    (1234.5, nan)
    """
    return _parse_with_unit(cell, decimal)[0]


def usual_unit(cells: list[str], decimal: str) -> str:
    """Give the unit that stands behind most numbers; empty when most have none.

    Examples
    --------
    >>> usual_unit(["52.3 %", "52.4 %", "-"], ".")
    '%'
    """
    if all(cell[-1:].isdigit() for cell in cells):
        return ""
    parsed = (_parse_with_unit(cell, decimal) for cell in cells)
    units = Counter(unit for value, unit in parsed if value == value)
    return max(units, key=lambda unit: units[unit], default="")


def parse_numbers(cells: pl.Series, decimal: str, *, where: str = "", decimal_is_given: bool = True) -> NumericColumn:
    """Parse a column of cells.

    Parameters
    ----------
    cells : polars.Series, shape (n_rows,)
        Text, numbers, truth values (1 and 0) or nothing at all.
    decimal : str
        Decimal mark of numbers in text, "." or ",".
    where : str
        File and column, for messages.
    decimal_is_given : bool
        Whether the user named the decimal mark. Otherwise whole numbers beside numbers such as 1.003, which may be
        1003, are refused.

    Returns
    -------
    NumericColumn
        Numbers, counted texts and the unit.

    Raises
    ------
    RecordError
        When the numbers have several units, or the decimal mark may be a thousands separator.

    Examples
    --------
    >>> import polars as pl
    >>> column = parse_numbers(pl.Series(["1,5 bar", "Bad Input", "Bad Input", "2 bar", None]), ",")
    >>> column.values, column.texts, column.unit
    (array([1.5, nan, nan, 2. , nan]), Counter({'Bad Input': 2, '': 1}), 'bar')
    """
    import polars as pl

    texts: Counter[str] = Counter()
    unit = ""
    if cells.dtype in (pl.Categorical, pl.Enum):
        cells = cells.cast(pl.String)
    if cells.dtype == pl.String:
        values, texts, unit = _parse_texts(cells, decimal, where)
    elif cells.dtype.is_numeric() or cells.dtype in (pl.Boolean, pl.Null):
        values = cells.cast(pl.Float64).to_numpy(writable=True)
        if missing := int(np.isnan(values).sum()):
            texts[""] = missing
    else:  # stamps, lists: no numbers
        values = np.full(len(cells), np.nan)
        texts[str(cells.dtype)[:MAX_TEXT]] = len(cells)
    with np.errstate(invalid="ignore"):
        infinite = np.abs(values) > LARGEST_VALUE
    if infinite.any():
        values[infinite] = np.nan
        texts["infinite"] += int(infinite.sum())
    if cells.dtype == pl.String and not decimal_is_given:
        from stiction.sources.values.thousands import refuse_ambiguous_thousands

        refuse_ambiguous_thousands(cells, values, decimal, where)
    return NumericColumn(values, texts, unit)


def _parse_texts(cells: pl.Series, decimal: str, where: str) -> tuple[NDArray[np.float64], Counter[str], str]:
    """Cast the column at once, then parse what is left by distinct text."""
    import polars as pl

    plain = cells
    if decimal == ",":  # a point beside a decimal comma separates thousands
        has_point = cells.str.contains(".", literal=True)
        if has_point.any():
            plain = cells.set(has_point, None)
        plain = plain.str.replace(",", ".", literal=True)
    cast = plain.cast(pl.Float64, strict=False)
    values = cast.to_numpy(writable=True)
    left = np.flatnonzero(np.isnan(values))
    if not left.size:
        return values, Counter(), ""
    rest = cells.gather(left) if left.size < len(cells) else cells
    if left.size <= _MAX_PYTHON_CELLS:
        per_word = Counter(rest.to_list())
        words, counts = pl.Series(list(per_word), dtype=pl.String), pl.Series(list(per_word.values()))
    else:
        distinct = rest.rename("text").value_counts(name="cells").sort("text")
        words, counts = distinct["text"], distinct["cells"]
    numbers, units = _parse_distinct(words, decimal)
    is_text = np.isnan(numbers)
    texts: Counter[str] = Counter()
    for word, count in zip(words.filter(is_text).to_list(), counts.filter(is_text).to_list(), strict=True):
        text = (word or "").translate(_SPACES).strip()
        texts["" if text.upper() in MISSING_WORDS else text[:MAX_TEXT]] += count
    per_unit = Counter({"": len(values) - int(left.size)} if left.size < len(values) else {})
    if not is_text.all():
        with_unit = pl.DataFrame({"unit": units, "cells": counts}).filter(~is_text).group_by("unit").sum()
        per_unit.update(dict(with_unit.iter_rows()))
        values[left] = rest.replace_strict(words, pl.Series(numbers), return_dtype=pl.Float64).to_numpy()
    return values, texts, _single_unit(per_unit, where)


def _parse_distinct(words: pl.Series, decimal: str) -> tuple[NDArray[np.float64], pl.Series]:
    """Give the number and the unit of each distinct text."""
    import polars as pl

    if len(words) <= _MAX_PYTHON_CELLS:
        pairs = [_parse_with_unit(word or "", decimal) for word in words.to_list()]
        return np.array([value for value, _ in pairs]), pl.Series([unit for _, unit in pairs], dtype=pl.String)
    spaced = words.fill_null("").str.replace_all("[\u00a0\u202f]", " ").str.replace_all("\u2212", "-")
    parts = pl.DataFrame({"text": spaced.str.strip_chars()}).select(
        body=pl.coalesce(pl.col("text").str.extract(rf"(?i)^(.*[0-9.,])\s*(?:{_UNITS})$"), "text"),
        unit=pl.col("text").str.extract(rf"(?i)^.*[0-9.,]\s*({_UNITS})$"),
    )
    body = pl.col("body")
    numbers = parts.select(
        "unit",
        value=pl.when(body.str.contains(_for_polars(_PLAIN[decimal])))
        .then(body)
        .when(body.str.contains(_for_polars(_GROUPED[decimal])))
        .then(body.str.replace_all(_GROUP_MARKS[decimal], ""))
        .str.replace(",", ".", literal=True)
        .cast(pl.Float64, strict=False),
    )
    return numbers["value"].to_numpy(), numbers["unit"].fill_null("")


def _for_polars(pattern: str) -> str:
    """A pattern that must match the whole cell, with ASCII digits only."""
    return f"^(?:{pattern})$".replace(r"\d", "[0-9]")


def _split_unit(cell: str) -> tuple[str, str]:
    """Split a cell into number and unit."""
    text = cell.strip() if cell.isascii() else cell.translate(_SPACES).strip()
    if not text or text[-1].isdigit():
        return text, ""
    match = _WITH_UNIT.fullmatch(text)
    return (match[1], match[2]) if match else (text, "")


def _parse_with_unit(cell: str, decimal: str) -> tuple[float, str]:
    text, unit = _split_unit(cell)
    if _IS_PLAIN[decimal].fullmatch(text):
        return float(text.replace(",", ".")), unit
    if _IS_GROUPED[decimal].fullmatch(text):
        return float(re.sub(_GROUP_MARKS[decimal], "", text).replace(",", ".")), unit
    return float("nan"), ""


def _single_unit(units: Counter[str], where: str) -> str:
    """Give the unit of a column's numbers; refuse several, such as mbar beside bar."""
    if len(units) > 1:
        listed = ", ".join(f"{n} {f'in {unit}' if unit else 'without a unit'}" for unit, n in units.most_common(4))
        raise RecordError(f"{where}: mixes units ({listed}); export all its values in one unit, or without units.")
    return next(iter(units), "")
