"""Cells to numbers: decimal comma, thousands, a unit after the number; every other text is counted."""

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

__all__ = ["NumericColumn", "is_number", "parse_number", "parse_numbers", "usual_unit"]

MAX_TEXT = 40
"""Characters of a text by which it is counted."""

# The digits are written out, since \d takes those of other scripts too.
_PLAIN = {m: rf"[+-]?(?:[0-9]+\{m}?[0-9]*|\{m}[0-9]+)(?:[eE][+-]?[0-9]+)?" for m in ".,"}
_GROUP_MARKS = {".": "[,' ]", ",": "[.' ]"}
_GROUPED = {m: rf"[+-]?[1-9][0-9]{{0,2}}(?:{_GROUP_MARKS[m]}[0-9]{{3}})+(?:\{m}[0-9]*)?" for m in ".,"}
_SPACES = str.maketrans({"\u00a0": " ", "\u202f": " ", "\u2212": "-"})
_NUMBER_AND_UNIT = rf"(.*[0-9.,])\s*({'|'.join(map(re.escape, CELL_UNITS))})?"
_IS_PLAIN, _IS_GROUPED = ({m: re.compile(form[m]) for m in ".,"} for form in (_PLAIN, _GROUPED))
_HAS_UNIT = re.compile(_NUMBER_AND_UNIT, re.IGNORECASE)


class NumericColumn(NamedTuple):
    """A column of cells as numbers."""

    values: NDArray[np.float64]
    """The numbers [`unit`]; NaN where there is none, shape (n_rows,)."""
    texts: Counter[str]
    """Text that is no number -> cells. Empty cells are counted under "", numbers beyond 1e100 under "infinite"."""
    unit: str
    """Unit after the numbers as written; empty when there is none."""


def is_number(cell: str, decimal: str, *, grouped: bool = True) -> bool:
    """Whether a cell is a number, with or without thousands separators and a unit."""
    if _IS_PLAIN[decimal].fullmatch(cell):
        return True
    text, _ = _split_unit(cell)
    return bool(_IS_PLAIN[decimal].fullmatch(text) or (grouped and _IS_GROUPED[decimal].fullmatch(text)))


def parse_number(cell: str, decimal: str) -> float:
    """Give the number in a cell; NaN when there is none."""
    text, _ = _split_unit(cell)
    if _IS_GROUPED[decimal].fullmatch(text):
        text = re.sub(_GROUP_MARKS[decimal], "", text)
    elif not _IS_PLAIN[decimal].fullmatch(text):
        return float("nan")
    return float(text.replace(",", "."))


def usual_unit(cells: list[str], decimal: str) -> str:
    """Give the unit that stands after most numbers; empty when most have none."""
    if all(cell[-1:].isdigit() for cell in cells):
        return ""
    units = Counter(_split_unit(cell)[1] for cell in cells if is_number(cell, decimal))
    return max(units, key=lambda unit: units[unit], default="")


def _split_unit(cell: str) -> tuple[str, str]:
    """Split a cell into number and unit."""
    text = cell.translate(_SPACES).strip()
    found = None if text[-1:].isdigit() else _HAS_UNIT.fullmatch(text)
    return (found[1], found[2] or "") if found else (text, "")


def parse_numbers(cells: pl.Series, decimal: str, *, where: str = "", decimal_is_given: bool = True) -> NumericColumn:
    """Parse a column of text, numbers, truth values (1 and 0) or nothing at all, shape (n_rows,).

    `where` is the file and column, for messages. Unless the user gave the decimal mark, 1.003, which may be 1003, is
    refused beside 999; so are numbers with several units.

    Examples
    --------
    >>> import polars as pl
    >>> column = parse_numbers(pl.Series(["1,5 bar", "Bad Input", "Bad Input", "2 bar", None]), ",")
    >>> column.values, column.texts, column.unit
    (array([1.5, nan, nan, 2. , nan]), Counter({'Bad Input': 2, '': 1}), 'bar')
    """
    import polars as pl

    texts, unit = Counter(), ""
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
    infinite = np.abs(values) > 1e100
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
        plain = cells.set(cells.str.contains(".", literal=True), None).str.replace(",", ".", literal=True)
    values = plain.cast(pl.Float64, strict=False).to_numpy(writable=True)
    left = np.flatnonzero(np.isnan(values))
    if not left.size:
        return values, Counter(), ""
    rest = cells.gather(left)
    words = rest.rename("word").value_counts(name="cells").sort("word")
    units = Counter({"": len(values) - left.size} if left.size < len(values) else {})
    is_word = np.ones(len(words), dtype=bool)
    if words["word"].str.contains("[0-9]").any():
        numbers, unit = _parse_words(words["word"], decimal)
        is_word = np.isnan(numbers)
        values[left] = rest.replace_strict(words["word"], pl.Series(numbers), return_dtype=pl.Float64).to_numpy()
        with_unit = pl.DataFrame({"unit": unit, "cells": words["cells"]}).filter(~is_word).group_by("unit").sum()
        units.update(dict(with_unit.iter_rows()))
    texts: Counter[str] = Counter()
    for word, count in words.filter(is_word).iter_rows():
        text = (word or "").translate(_SPACES).strip()
        texts["" if text.upper() in MISSING_WORDS else text[:MAX_TEXT]] += count
    if len(units) > 1:
        listed = ", ".join(f"{n} {f'in {unit}' if unit else 'without a unit'}" for unit, n in units.most_common(4))
        raise RecordError(f"{where}: mixes units ({listed}); export all its values in one unit, or without units.")
    return values, texts, next(iter(units), "")


def _parse_words(words: pl.Series, decimal: str) -> tuple[NDArray[np.float64], pl.Series]:
    """Give the number and the unit of each text, as `parse_number` does."""
    import polars as pl

    text = pl.col("text").str.replace_all("[\u00a0\u202f]", " ").str.replace_all("\u2212", "-").str.strip_chars()
    number, marks = pl.col("number"), _GROUP_MARKS[decimal]
    is_plain, is_grouped = (number.str.contains(f"^(?:{form[decimal]})$") for form in (_PLAIN, _GROUPED))
    plain = pl.when(is_plain).then(number).when(is_grouped).then(number.str.replace_all(marks, ""))
    parts = words.alias("text").to_frame().select(text.str.extract_groups(f"(?i)^{_NUMBER_AND_UNIT}$").alias("parts"))
    parts = parts.select(pl.col("parts").struct.rename_fields(["number", "unit"])).unnest("parts")
    found = parts.select("unit", value=plain.str.replace(",", ".", literal=True).cast(pl.Float64, strict=False))
    return found["value"].to_numpy(), found["unit"].fill_null("")
