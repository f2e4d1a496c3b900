"""Points and commas that may separate thousands: a note says so, or the column is refused."""

from __future__ import annotations

import itertools
import re
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.sources.values.numeric_cells import is_number, parse_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl
    from numpy.typing import NDArray

__all__ = ["GROUPS", "find_ambiguous_cell", "find_torn_number", "may_hold_thousands", "refuse_ambiguous_thousands"]

GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_ONE_GROUP = {".": r"[+-]?[1-9][0-9]{0,2}\.[0-9]{3}", ",": r"[+-]?[1-9][0-9]{0,2},[0-9]{3}"}
_IS_ONE_GROUP = {mark: re.compile(pattern) for mark, pattern in _ONE_GROUP.items()}
_TORN = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}(\.\d*)?")
_OTHER_MARK = {".": ",", ",": "."}


def find_ambiguous_cell(
    rows: Sequence[Sequence[str]], decimal: str, *, delimiter: str, width: int
) -> tuple[str, float, str] | None:
    """Find a cell whose mark may be the other one.

    Beside a decimal point "1,234" is read as 1234. Between delimiters other than a comma "1.234" is read as 1.234,
    which is in doubt when no cell settles it and another signal is written without decimals. Gives the cell, its number
    and the decimal mark that gives the other reading.

    Examples
    --------
    >>> find_ambiguous_cell([["0.5", "49,612", "50,125"]], ".", delimiter=";", width=3)
    ('49,612', 49612.0, ',')
    >>> find_ambiguous_cell([["0", "1.234", "50"]], ".", delimiter=";", width=3)
    ('1.234', 1.234, ',')
    >>> find_ambiguous_cell([["0", "1.234", "50.5"]], ".", delimiter=";", width=3)
    """
    with_comma = (cell.strip() for row in rows for cell in row if "," in cell)
    grouped = next((cell for cell in with_comma if GROUPS.fullmatch(cell)), None)
    if decimal == "." and (grouped or delimiter == ","):
        return (grouped, parse_number(grouped, decimal), ",") if grouped else None
    columns = list(zip(*([cell.strip() for cell in row] for row in rows if len(row) == width), strict=True))[1:]
    signals = [column for column in columns if all(is_number(cell, decimal) for cell in column if cell)]
    marked = [cell for column in signals for cell in column if decimal in cell]
    has_whole_signal = any(not any(decimal in cell for cell in column) for column in signals if any(column))
    if not (marked and has_whole_signal and all(_IS_ONE_GROUP[decimal].fullmatch(cell) for cell in marked)):
        return None
    return marked[0], parse_number(marked[0], decimal), _OTHER_MARK[decimal]


def may_hold_thousands(values: NDArray[np.float64], *, min_share: float = 0.02, min_ratio: float = 100.0) -> bool:
    """Whether whole numbers up to 999 stand beside decimals that may be thousands, such as 999 beside 1.003.

    Parameters
    ----------
    values : ndarray, shape (n_rows,)
        Numbers of a column [any unit]; NaN is missing.
    min_share : float
        Share of whole numbers, and of decimals, that both must have [-].
    min_ratio : float
        Largest whole number over the median decimal from which it is so [-].

    Examples
    --------
    >>> may_hold_thousands(np.array([998.0, 999.0, 1.0, 1.001, 1.002]))
    True
    >>> may_hold_thousands(np.array([7.12, 7.0, 6.9]))
    False
    """
    size = np.abs(values[np.isfinite(values)])
    if not size.size or size.max() <= min_ratio:  # decimals above 1, and a whole number 100 times as large
        return False
    is_whole = size == np.floor(size)
    decimals, whole = size[~is_whole], size[is_whole]
    if min(decimals.size, whole.size) < max(2.0, min_share * size.size):
        return False
    return bool(decimals.min() > 1.0 and whole.max() <= 999.0 and whole.max() > min_ratio * np.median(decimals))


def refuse_ambiguous_thousands(cells: pl.Series, values: NDArray[np.float64], decimal: str, where: str) -> None:
    """Refuse text cells whose mark may separate thousands: all have three digits after it, beside larger whole ones."""
    if not may_hold_thousands(values):
        return
    is_value = np.isfinite(values)
    numbers, size = cells.filter(is_value).str.strip_chars(), np.abs(values[is_value])
    has_mark = numbers.str.contains(decimal, literal=True)
    marked = numbers.filter(has_mark)
    if not len(marked) or has_mark.all() or not marked.str.contains(f"^(?:{_ONE_GROUP[decimal]})$").all():
        return
    largest_whole = numbers[int(np.argmax(np.where(has_mark.to_numpy(), -1.0, size)))]
    raise RecordError(
        f"{where}: {largest_whole!r} beside {marked[0]!r} may be thousands separated by {decimal!r}; give "
        f"decimal={_OTHER_MARK[decimal]!r} if they are, decimal={decimal!r} if not."
    )


def find_torn_number(row: Sequence[str]) -> str:
    """Find the first number that a comma between its thousands has split into two cells; empty when there is none.

    Examples
    --------
    >>> find_torn_number(["2026-02-01", "1", "408.6", "50.1"]), find_torn_number(["2026-02-01", "408.6", "50.1"])
    ('1,408.6', '')
    """
    pairs = (f"{one.strip()},{other.strip()}" for one, other in itertools.pairwise(row))
    return next((pair for pair in pairs if _TORN.fullmatch(pair)), "")
