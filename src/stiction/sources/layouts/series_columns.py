"""Further columns of a long table that tell its series apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.sources.roles.column_names import normalise_name
from stiction.sources.roles.vocabulary import COLUMN_WORDS
from stiction.sources.values.number_text import is_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl
    from numpy.typing import NDArray

    from stiction.sources.table import RawTable

__all__ = ["find_series_columns"]

MAX_SERIES = 1000
"""Different cells of a column that tells series apart [-]."""


def find_series_columns(
    table: RawTable,
    texts: Mapping[str, pl.Series],
    keys: Sequence[str],
    seconds: NDArray[np.float64],
    free: Sequence[int],
    *,
    max_columns: int = 3,
    max_double_share: float = 0.01,
) -> list[int]:
    """Find the columns without which a series, named by the texts of `keys`, has several rows at one time.

    Of the `free` columns those are added that leave the fewest double rows, until at most `max_double_share` of the
    rows are double [-]; none where they do not suffice. Columns of names go before columns of numbers.
    """
    import polars as pl

    finite = pl.Series(np.isfinite(seconds))
    frame = pl.DataFrame({**{key: texts[key] for key in keys}, "time": seconds}).filter(finite)

    def count_double(names: Sequence[str]) -> int:
        return frame.height - frame.select(*names, "time").n_unique()

    allowed = max_double_share * frame.height
    if not free or count_double(keys) <= allowed:
        return []
    for i in free:
        column = table.column(i).cast(pl.String).fill_null("").filter(finite).alias(f"{i}")
        if 1 < column.n_unique() <= MAX_SERIES:
            frame = frame.with_columns(column)
    headings = table.header[0] if table.header else [""] * table.width

    def rank(i: int) -> tuple[bool, bool, int]:
        is_name = normalise_name(headings[i]) in (*COLUMN_WORDS["tag"], *COLUMN_WORDS["loop_name"])
        return not is_name, all(is_number(cell, table.decimal) for cell in table.sample_column(i)), i

    left = sorted((i for i in free if f"{i}" in frame.columns), key=rank)
    chosen: list[int] = []
    while left and len(chosen) < max_columns:
        double = {i: count_double([*keys, *(f"{k}" for k in (*chosen, i))]) for i in left}
        best = min(left, key=lambda i: max(double[i], allowed))
        chosen.append(best)
        if double[best] <= allowed:
            return chosen
        left.remove(best)
    return []
