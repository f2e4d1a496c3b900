"""One recorded signal of a source: its heading, its cells and the clock on which they were stored."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    import polars as pl

    from stiction.sources.table import RawTable
    from stiction.sources.time.stamps import Stamps

__all__ = ["Clock", "TagColumn"]


@dataclass(eq=False)
class Clock:
    """Time stamps that one or several columns share, parsed when they are first needed."""

    parse: Callable[[], Stamps]

    @cached_property
    def stamps(self) -> Stamps:
        """Time of each row."""
        return self.parse()


@dataclass(eq=False)
class TagColumn:
    """One column of cells. Columns with the same `clock` object have the same rows."""

    name: str
    """Heading as written, such as ``FIC-101.PV``; of a long table the tag."""
    table: RawTable
    """The table it comes from."""
    clock: Clock | None
    """Time of each row; None when the source has no time column, and rows are evenly spaced."""
    load: Callable[[], pl.Series]
    """Gives the cells, shape (n_rows,)."""
    unit: str = ""
    """Unit as written; empty when the source names none."""
    description: str = ""
    """Description as written; empty when there is none."""
    position: int | None = None
    """Column position in the table (from 0), where the user may name it by number."""
    quality: Callable[[], pl.Series] | None = None
    """Gives the quality that stands with each value, where each row has one (long tables)."""
    own_clock: bool = False
    """Whether this tag was stored at times of its own, so that it must be aligned with the loop's other tags."""

    @cached_property
    def cells(self) -> pl.Series:
        """The cells, shape (n_rows,)."""
        return self.load()
