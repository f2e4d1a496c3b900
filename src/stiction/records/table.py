"""A table as any format hands it over: header rows, a first look at the data, and columns on demand."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.records.source import Source

__all__ = ["LOOK_AHEAD", "Columns", "Table"]

LOOK_AHEAD = 200
"""Rows of a table by which its form is told [-]."""


@dataclass
class Columns:
    """The columns that were asked for."""

    text: dict[int, list[str]] = field(default_factory=dict)
    """Column -> its cells as they stand."""
    numbers: dict[int, NDArray] = field(default_factory=dict)
    """Column -> its numbers, NaN where there was none."""
    texts: dict[int, Counter[str]] = field(default_factory=dict)
    """Column of numbers -> text that was no number -> how often."""
    rows: int = 0
    """Rows of data."""

    def part(self, rows: NDArray) -> Columns:
        """Some of the rows; which of them held texts is not known."""
        return Columns(
            text={i: [cells[k] for k in rows] for i, cells in self.text.items()},
            numbers={i: values[rows] for i, values in self.numbers.items()},
            texts={i: Counter() for i in self.texts},
            rows=len(rows),
        )

    def differ(self, one: NDArray, other: NDArray) -> NDArray:
        """Whether rows hold something else than others, pair by pair, shape (n_pairs,)."""
        unlike = np.zeros(len(one), dtype=bool)
        for values in self.numbers.values():
            unlike |= (values[one] != values[other]) & ~(np.isnan(values[one]) & np.isnan(values[other]))
        for cells in self.text.values():
            unlike |= np.array([cells[i] != cells[k] for i, k in zip(one, other, strict=True)], dtype=bool)
        return unlike


class Table(Protocol):
    """What a reader page offers to `stiction.records.loops`."""

    source: Source
    header: list[list[str]]
    """Header rows, each as wide as the data; empty when there is none."""
    sample: list[list[str]]
    """The first rows of data as text."""
    first_line: int
    """Line (from 1) of the first row of data."""
    decimal: str
    """Decimal mark of the numbers."""
    guesses: list[str]
    """What was guessed so far, a sentence each."""

    def take(self, text: Sequence[int], numbers: Sequence[int]) -> Columns:
        """Read some columns as text and some as numbers."""
        ...

    def is_numeric(self, column: int) -> bool:
        """Whether the first rows of a column hold numbers."""
        ...
