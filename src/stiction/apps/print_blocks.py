"""Draw the blocks of a page on a terminal: texts and tables; plots are left out, their numbers are not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.apps.output import print_out, print_table
from stiction.report.blocks import (
    Cell,
    Collapsible,
    Definitions,
    Figure,
    Heading,
    Headline,
    SideBySide,
    Table,
    Text,
    TrustedHtml,
)
from stiction.report.rendering import format_cell

if TYPE_CHECKING:
    from collections.abc import Iterable

    from stiction.report.blocks import Block

__all__ = ["print_blocks"]


def print_blocks(blocks: Iterable[Block], *, details: bool = True) -> None:
    """Print blocks; a heading is printed with the first block below it that a terminal can show.

    Parameters
    ----------
    blocks : iterable of Block
        The blocks of a page.
    details : bool
        Whether to print the numbers of plots and what a page opens on a click.
    """
    headings: list[Heading] = []
    for block in _flat(blocks, details=details):
        if isinstance(block, Heading):
            headings = [*(above for above in headings if above.level < block.level), block]
            continue
        for heading in headings:
            print_out(f"\n{heading.text}")
        headings = []
        if isinstance(block, Headline):
            _print_headline(block)
        elif isinstance(block, Text):
            print_out(block.text)
        elif isinstance(block, Definitions):
            for name, values in block.given:
                print_out(f"{name}: {'; '.join(values)}")
        elif isinstance(block, Table):
            _print_table(block)


def _flat(blocks: Iterable[Block], *, details: bool) -> Iterable[Block]:
    """The blocks that a terminal can show, without those that hold others."""
    for block in blocks:
        if isinstance(block, SideBySide):
            yield from _flat(block.blocks, details=details)
        elif isinstance(block, Collapsible) and details:
            yield from (Heading(block.title, level=3), *_flat(block.blocks, details=details))
        elif isinstance(block, Figure) and details and block.table is not None:
            yield from (Heading(block.title, level=3), block.table, Text(block.caption))
        elif isinstance(block, Heading | Headline | Text | Definitions | Table):
            yield block


def _print_headline(block: Headline) -> None:
    sure = f" {block.confidence}." if block.confidence else ""
    print_out(f"{block.name}: {block.line}.{sure}")
    print_out(block.reason)
    if block.action:
        print_out(f"What to do: {block.action}")


def _print_table(table: Table) -> None:
    """Print a table without its drawings."""
    rows = [[cell.value if isinstance(cell, Cell) else cell for cell in row] for row in table.rows]
    shown = [k for k in range(len(table.columns)) if not any(isinstance(row[k], TrustedHtml) for row in rows)]
    print_table(
        [table.columns[k] for k in shown],
        [[format_cell(value) for k in shown if not isinstance(value := row[k], TrustedHtml)] for row in rows],
    )
    if table.caption:
        print_out(table.caption)
