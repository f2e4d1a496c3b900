"""Columns of cells to numbers; every other text is counted."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl

from stiction.sources.roles.vocabulary import CELL_UNITS, MISSING_WORDS
from stiction.sources.values.number_text import GROUP_MARKS, GROUPED, NUMBER_AND_ANY_UNIT, PLAIN, SPACES
from stiction.sources.values.thousands import refuse_ambiguous_thousands
from stiction.sources.values.units import scale_between, to_one_unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["NumericColumn", "parse_numbers"]

_DIGIT = re.compile("[0-9]")
MAX_SHORT_WORDS = 100
"""Different texts up to which it is found out first whether any of them holds a digit, as parsing takes longer [-]."""
MAX_UNITS = 20
"""Different unknown texts after numbers above which none is a unit [-]."""
MAX_TEXT = 40
"""Characters of a text by which it is counted."""


class NumericColumn(NamedTuple):
    """A column of cells as numbers."""

    values: NDArray[np.float64]
    """The numbers [`unit`]; NaN where there is none, shape (n_rows,)."""
    texts: Counter[str]
    """Text that is no number -> cells. Empty cells are counted under "", numbers beyond 1e100 under "infinite"."""
    unit: str
    """Unit after the numbers as written; empty when there is none."""
    note: str = ""
    """What was converted to that unit."""


def parse_numbers(
    cells: pl.Series, decimal: str, *, where: str = "", decimal_is_given: bool = True, unit: str = ""
) -> NumericColumn:
    """Parse text, numbers, truth values or nothing, shape (n_rows,); `where` is file and column, for errors.

    Without a given decimal mark 1.003 is refused beside 999. Numbers in several units get `unit`, else that of most.
    """
    texts, written, unit, note = Counter(), unit, "", ""
    if cells.dtype in (pl.Categorical, pl.Enum):
        cells = cells.cast(pl.String)
    if cells.dtype == pl.String:
        values, texts, unit, note = _parse_texts(cells, decimal, where, written)
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
        refuse_ambiguous_thousands(cells, values, decimal, where)
    return NumericColumn(values, texts, unit, note)


def _parse_texts(cells: pl.Series, decimal: str, where: str, written: str) -> NumericColumn:
    """Cast the column at once, then parse what is left by distinct text."""
    plain = cells
    if decimal == ",":  # a point beside a decimal comma separates thousands
        plain = cells.set(cells.str.contains(".", literal=True), None).str.replace(",", ".", literal=True)
    values = plain.cast(pl.Float64, strict=False).to_numpy(writable=True)
    left = np.flatnonzero(np.isnan(values))
    if not left.size:
        return NumericColumn(values, Counter(), "")
    rest = cells.filter(pl.Series(np.isnan(values)))
    words = rest.rename("word").value_counts(name="cells")
    words = words if len(words) == 1 else words.sort("word")
    codes = np.zeros(len(values), dtype=np.int64)
    names = [""]
    is_word = np.ones(len(words), dtype=bool)
    if len(words) > MAX_SHORT_WORDS or any(map(_DIGIT.search, filter(None, words["word"]))):
        numbers, unit = _parse_words(words["word"], decimal)
        is_word = np.isnan(numbers)
        values[left] = rest.replace_strict(words["word"], pl.Series(numbers), return_dtype=pl.Float64).to_numpy()
        names += [name for name in unit.unique() if name]
        code = unit.replace_strict(names, range(len(names)), return_dtype=pl.Int64)
        codes[left] = rest.replace_strict(words["word"], code, return_dtype=pl.Int64).to_numpy()
    texts: Counter[str] = Counter()
    for word, count in (words if is_word.all() else words.filter(is_word)).iter_rows():
        text = (word or "").translate(SPACES).strip()
        texts["" if text.upper() in MISSING_WORDS else text[:MAX_TEXT]] += count
    if len(names) == 1:
        return NumericColumn(values, texts, "")
    values, unit, note = to_one_unit(values, names, codes, where, written=written)
    return NumericColumn(values, texts, unit, note)


def _parse_words(words: pl.Series, decimal: str) -> tuple[NDArray[np.float64], pl.Series]:
    """Give the number and the unit of each text, as `parse_number` does."""
    text = pl.col("text").str.replace_all("[\u00a0\u202f]", " ").str.replace_all("\u2212", "-").str.strip_chars()
    number, marks = pl.col("number"), GROUP_MARKS[decimal]
    is_plain, is_grouped = (number.str.contains(f"^(?:{form[decimal]})$") for form in (PLAIN, GROUPED))
    plain = pl.when(is_plain).then(number).when(is_grouped).then(number.str.replace_all(marks, ""))
    parts = (
        words.alias("text").to_frame().select(text.str.extract_groups(f"(?i)^{NUMBER_AND_ANY_UNIT}$").alias("parts"))
    )
    parts = parts.select(pl.col("parts").struct.rename_fields(["number", "unit"])).unnest("parts")
    found = parts.select(
        pl.col("unit").fill_null(""), value=plain.str.replace(",", ".", literal=True).cast(pl.Float64, strict=False)
    )
    others = [unit for unit in found["unit"].unique() if unit and unit.upper() not in CELL_UNITS]
    strange = [unit for unit in others if len(others) > MAX_UNITS or scale_between(unit, unit) is None]
    found = found.with_columns(value=pl.when(pl.col("unit").is_in(strange)).then(None).otherwise("value"))
    return found["value"].to_numpy(), found["unit"]
