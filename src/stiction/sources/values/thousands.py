"""Points and commas that may separate thousands: a note says so, or the column is refused."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import format_number
from stiction.errors import RecordError, Setting
from stiction.sources.values.number_text import is_number, parse_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl
    from numpy.typing import NDArray

__all__ = ["GROUPS", "find_ambiguous_cell", "find_torn_number", "refuse_ambiguous_thousands", "refuse_other_decimal"]

GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_ONE_GROUP = {mark: rf"[+-]?[1-9][0-9]{{0,2}}{re.escape(mark)}[0-9]{{3}}" for mark in ".,"}
_TORN = re.compile(r"(?:^|,)\s*([+-]?[1-9]\d{0,2})\s*,\s*(\d{3}(?:\.\d*)?)\s*(?:,|$)")
_OTHER_MARK = {".": ",", ",": "."}


def find_ambiguous_cell(
    rows: Sequence[Sequence[str]], decimal: str, *, delimiter: str, width: int
) -> tuple[str, float, str] | None:
    """Find a cell such as 1,234 whose mark may be the other one: cell, number and the other decimal mark."""
    with_comma = (cell.strip() for row in rows for cell in row if "," in cell)
    grouped = next(filter(GROUPS.fullmatch, with_comma), None)
    if decimal == "." and (grouped or delimiter == ","):
        return (grouped, parse_number(grouped, decimal), ",") if grouped else None
    columns = list(zip(*([cell.strip() for cell in row] for row in rows if len(row) == width), strict=True))[1:]
    signals = [column for column in columns if all(is_number(cell, decimal) for cell in column if cell)]
    marked = [cell for column in signals for cell in column if decimal in cell]
    has_whole_signal = any(not any(decimal in cell for cell in column) for column in signals if any(column))
    if not (marked and has_whole_signal and all(re.fullmatch(_ONE_GROUP[decimal], cell) for cell in marked)):
        return None
    return marked[0], parse_number(marked[0], decimal), _OTHER_MARK[decimal]


def refuse_ambiguous_thousands(
    cells: pl.Series,
    values: NDArray[np.float64],
    decimal: str,
    where: str,
    *,
    min_share: float = 0.02,
    min_ratio: float = 100.0,
) -> None:
    """Refuse text cells whose mark may separate thousands: 1.003 beside 999.

    Both make up `min_share` of the numbers [-], the largest whole number is `min_ratio` times the median decimal [-].
    """
    is_value = np.isfinite(values)
    size = np.abs(values[is_value])
    if not size.size or size.max() <= min_ratio:
        return
    is_whole = size == np.floor(size)
    decimals, whole = size[~is_whole], size[is_whole]
    if min(decimals.size, whole.size) < max(2.0, min_share * size.size) or decimals.min() <= 1.0:
        return
    if whole.max() > 999.0 or whole.max() <= min_ratio * np.median(decimals):
        return
    numbers = cells.filter(is_value).str.strip_chars()
    has_mark = numbers.str.contains(decimal, literal=True)
    marked = numbers.filter(has_mark)
    if has_mark.all() or not len(marked) or not marked.str.contains(f"^(?:{_ONE_GROUP[decimal]})$").all():
        return
    largest_whole = numbers[int(np.argmax(np.where(has_mark.to_numpy(), -1.0, size)))]
    raise RecordError(
        f"the column has {largest_whole!r} and {marked[0]!r}, so {decimal!r} may be the decimal mark or separate "
        "thousands",
        remedy=(
            "give ",
            Setting("decimal", _OTHER_MARK[decimal]),
            " if it separates thousands, ",
            Setting("decimal", decimal),
            " if it is the decimal mark",
        ),
        where=where,
    )


def refuse_other_decimal(
    texts: Mapping[str, int], n_cells: int, decimal: str, where: str, *, max_share: float = 0.03
) -> None:
    """Refuse a column with more than `max_share` numbers of the other decimal mark [-], by its `texts`."""
    other = _OTHER_MARK[decimal]
    numbers = {text: n for text, n in texts.items() if other in text and is_number(text, other)}
    found = sum(numbers.values())
    if found > max(1.0, max_share * n_cells):
        percent = format_number(100.0 * found / n_cells, significant=2)
        raise RecordError(
            f"{percent} % of its cells, such as {max(numbers, key=numbers.__getitem__)}, "
            f"are numbers only with a decimal {'comma' if other == ',' else 'point'}",
            remedy=("leave out ", Setting("decimal"), ", or give ", Setting("decimal", other)),
            where=where,
        )


def find_torn_number(row: Sequence[str]) -> str:
    """Find the first number that a comma between its thousands has split into two cells; empty when there is none."""
    found = _TORN.search(",".join(row))
    return f"{found[1]},{found[2]}" if found else ""
