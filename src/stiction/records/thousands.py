"""Points and commas that may part thousands, and not the whole number from its decimals: told, or refused."""

from __future__ import annotations

import itertools
import re
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.numbers import as_number, is_number

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray


__all__ = ["GROUPS", "grouped_cell", "may_be_parted", "parted_cells", "torn_number"]

GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_ONE_GROUP = {".": re.compile(r"[+-]?[1-9]\d{0,2}\.\d{3}"), ",": re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")}
_TORN = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}(\.\d*)?")
_OTHER = {".": ",", ",": "."}
SEVERAL, FAR = 0.02, 100.0
"""Share of a column's numbers that have a mark, and that have none, and how much larger these are [-]: 999 beside
1.003 was written as 999 and 1003."""


def grouped_cell(
    rows: Sequence[Sequence[str]], delimiter: str, decimal: str, width: int
) -> tuple[str, float, str] | None:
    """Find a cell whose mark may be the other one after all, how it is read, and the decimal mark that says otherwise.

    Beside a decimal point "1,234" is taken as thousands, and told. Between other delimiters "1.234" is taken as little
    more than one: that is told where no cell settles it and a signal has no mark, as in a table without decimals.

    Examples
    --------
    >>> grouped_cell([["0.5", "49,612", "50,125"]], ";", ".", 3)
    ('49,612', 49612.0, ',')
    >>> [grouped_cell([["0", "1.234", op]], ";", ".", 3) for op in ("50", "50.5")]
    [('1.234', 1.234, ','), None]
    """
    mark = decimal
    seen = next((cell.strip() for row in rows for cell in row if GROUPS.fullmatch(cell.strip())), None)
    if mark == "." and (seen or delimiter == ","):
        return (seen, as_number(seen, mark), ",") if seen else None
    columns = list(zip(*([cell.strip() for cell in row] for row in rows if len(row) == width), strict=True))[1:]
    signals = [column for column in columns if all(is_number(cell, mark) for cell in column if cell)]
    marked = [cell for column in signals for cell in column if mark in cell]
    whole = any(not any(mark in cell for cell in column) for column in signals if any(column))
    if not (marked and whole and all(_ONE_GROUP[mark].fullmatch(cell) for cell in marked)):
        return None
    return marked[0], as_number(marked[0], mark), _OTHER[mark]


def may_be_parted(values: NDArray[np.float64]) -> bool:
    """Whether numbers look like whole ones of which those above 999 were read as decimals.

    Examples
    --------
    >>> may_be_parted(np.array([998.0, 999.0, 1.0, 1.001, 1.002])), may_be_parted(np.array([7.12, 7.0, 6.9]))
    (True, False)
    """
    size = np.abs(values[np.isfinite(values)])
    marked, whole = size[size % 1.0 > 0.0], size[size % 1.0 == 0.0]
    if min(marked.size, whole.size) < max(2.0, SEVERAL * size.size):
        return False
    return bool(marked.min() > 1.0 and whole.max() <= 999.0 and whole.max() > FAR * np.median(marked))


def parted_cells(cells: Iterable[str], mark: str) -> tuple[str, str] | None:
    """A number without the mark and one with it that parts thousands, of a column that `may_be_parted`; else None."""
    texts = [text for cell in cells if is_number(text := cell.strip(), mark)]
    marked = [text for text in texts if mark in text]
    whole = [text for text in texts if mark not in text]
    if not marked or not whole or not all(_ONE_GROUP[mark].fullmatch(text) for text in marked):
        return None
    return max(whole, key=lambda text: abs(as_number(text, mark))), marked[0]


def torn_number(row: Sequence[str]) -> str:
    """The first number of a row that a comma between thousands has torn into two cells; empty where there is none.

    Examples
    --------
    >>> torn_number(["2026-02-01", "1", "408.6", "50.1"]), torn_number(["2026-02-01", "408.6", "50.1"])
    ('1,408.6', '')
    """
    pairs = (f"{one.strip()},{other.strip()}" for one, other in itertools.pairwise(row))
    return next((pair for pair in pairs if _TORN.fullmatch(pair)), "")
