"""Blocks of a page: headings, text, figures, tables, and blocks that hold other blocks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from stiction.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = [
    "Block",
    "Cell",
    "Collapsible",
    "Definitions",
    "Figure",
    "Heading",
    "Headline",
    "Sheet",
    "SideBySide",
    "StatusIcon",
    "Table",
    "Text",
    "TrustedHtml",
]

StatusIcon = Literal["", "alert", "good", "unknown"]


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading inside the page; the page's title is level 1."""

    text: str
    """The words."""
    level: int = 2
    """2 for a section, 3 for a part of it."""
    anchor: str = ""
    """Name that `#anchor` links to; none when empty."""

    def __post_init__(self) -> None:
        if self.level not in (2, 3, 4):
            raise ParameterError(f"Heading level {self.level} is not one of 2, 3, 4; level 1 is the page's title.")


@dataclass(frozen=True, slots=True)
class Headline:
    """The finding on one loop, and what to do."""

    name: str
    """Name of the loop; on a page it is the title."""
    verdict: str
    """`stiction`, `no_stiction` or `undecided`."""
    mark: StatusIcon
    """Symbol before the line."""
    line: str
    """The finding, without a full stop."""
    confidence: str
    """How sure it is, or what it brings; without a full stop, may be empty."""
    reason: str
    """Why, in sentences."""
    action: str = ""
    """What to do; empty when nothing is to be done."""
    facts: Sequence[tuple[str, str]] = ()
    """Name and value of the main numbers."""
    severity: TrustedHtml | None = None
    """Scale of S."""


@dataclass(frozen=True, slots=True)
class Text:
    """A paragraph of plain text; it is escaped."""

    text: str
    """The words; an empty line starts a new paragraph."""
    kind: Literal["plain", "lead", "note"] = "plain"
    """`lead` is larger, `note` is smaller and grey."""


@dataclass(frozen=True, slots=True)
class TrustedHtml:
    """Markup that this package made itself. It is not escaped: never put text from a file in it."""

    markup: str
    """The markup."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A plot with its title and the sentence that says what it shows."""

    plot: Mapping[str, Any]
    """`{"data": [...], "layout": {...}}` for plotly.js; numpy arrays are allowed and NaN is a gap."""
    title: str
    """Title above the plot."""
    caption: str
    """What the plot shows, as a sentence below it; screen readers read it."""
    height: int = 340
    """Height [px]."""
    table: Table | None = None
    """The numbers of the plot, folded below it; a terminal prints them in its place."""

    def __post_init__(self) -> None:
        if not self.title.strip() or not self.caption.strip():
            raise ParameterError("A Figure needs a title and a one-sentence caption; one of them is empty.")


@dataclass(frozen=True, slots=True)
class Cell:
    """A table cell with a sort key, a link or a mark."""

    value: str | float | TrustedHtml | None
    """What is shown; a float gets four significant digits, None and NaN a dash."""
    sort: float | str | None = None
    """Sort by this instead of the value."""
    href: str = ""
    """`#anchor` on the page, or an https address."""
    mark: StatusIcon = ""
    """Symbol before the value: never colour alone, always a shape with it."""

    def __post_init__(self) -> None:
        if self.href and not self.href.startswith(("#", "https://")):
            raise ParameterError(f"A cell links to {self.href!r}; give '#anchor' or an https address.")

    @property
    def key(self) -> float | str:
        """What the cell sorts by."""
        key = self.value if self.sort is None else self.sort
        if isinstance(key, TrustedHtml) or key is None or (isinstance(key, float) and math.isnan(key)):
            return ""
        return key


@dataclass(frozen=True, slots=True)
class Table:
    """Rows under named columns."""

    columns: Sequence[str]
    """Headings, with the unit in brackets where there is one."""
    rows: Sequence[Sequence[Cell | TrustedHtml | str | float | None]]
    """Values, one sequence per row, as many as there are columns."""
    caption: str = ""
    """What the table shows, in a sentence."""
    sortable: bool = False
    """Whether a click (or Enter) on a heading sorts the rows."""

    def __post_init__(self) -> None:
        for k, row in enumerate(self.rows):
            if len(row) != len(self.columns):
                raise ParameterError(f"Table row {k} has {len(row)} cells for {len(self.columns)} columns.")


@dataclass(frozen=True, slots=True)
class Definitions:
    """Names with their values."""

    rows: Sequence[tuple[str, Sequence[str]]]
    """Name, and its values, one line each; a name without a value is left out."""

    @property
    def given(self) -> list[tuple[str, list[str]]]:
        """The rows that have values."""
        rows = [(name, [value for value in values if value]) for name, values in self.rows]
        return [(name, values) for name, values in rows if values]


@dataclass(frozen=True, slots=True)
class Sheet:
    """A text to print on a page of its own."""

    title: str
    """What it is."""
    text: str
    """Markdown with headings, lists and paragraphs."""

    @property
    def lines(self) -> list[tuple[str, str]]:
        """Kind (title, heading, item or text) and words of each line."""
        kinds = (("## ", "heading"), ("# ", "title"), ("- ", "item"), ("", "text"))
        pairs = [(line, *next(pair for pair in kinds if line.startswith(pair[0]))) for line in self.text.splitlines()]
        return [(kind, line.removeprefix(sign)) for line, sign, kind in pairs if line]


@dataclass(frozen=True, slots=True)
class SideBySide:
    """Blocks side by side, one column each."""

    blocks: Sequence[Block]
    """Two or three blocks."""


@dataclass(frozen=True, slots=True)
class Collapsible:
    """Blocks that open on a click; their figures are drawn when they first come into view."""

    title: str
    """The line that is always visible."""
    blocks: Sequence[Block] = field(repr=False)
    """The blocks inside."""
    anchor: str = ""
    """Name that `#anchor` links to; following such a link opens it."""
    mark: StatusIcon = ""
    """Symbol before the title."""
    open: bool = False
    """Whether it starts open."""


Block: TypeAlias = (
    Heading | Headline | Text | TrustedHtml | Figure | Table | Definitions | Sheet | SideBySide | Collapsible
)
