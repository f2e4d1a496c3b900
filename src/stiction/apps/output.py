"""What the verbs print: plain text, tables, JSON on the output; progress and notes on the error stream."""

from __future__ import annotations

import contextlib
import json
import sys
import time
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

__all__ = ["note", "print_json", "print_table", "say", "track"]

PATIENCE = 1.0
"""Seconds of work before a progress bar appears."""

Item = TypeVar("Item")


def say(text: str) -> None:
    """Print text on the output; spaces that must not break become plain ones."""
    _write(sys.stdout, text)


def note(text: str) -> None:
    """Print text on the error stream."""
    sys.stdout.flush()
    _write(sys.stderr, text)


def print_json(data: Any) -> None:
    """Print strict JSON: no NaN, no infinity."""
    from stiction.apps.strict_json import strict

    _write(sys.stdout, json.dumps(strict(data), indent=2, allow_nan=False))


def print_table(columns: Sequence[str], rows: Iterable[Sequence[object]], *, right: Sequence[str] = ()) -> None:
    """Print rows under their columns: fitted to a terminal, unbroken elsewhere, colour nowhere.

    Parameters
    ----------
    columns : sequence of str
        Headings.
    rows : iterable
        One sequence of values per row.
    right : sequence of str
        Headings of the columns that hold numbers.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for name in columns:
        table.add_column(Text(name), justify="right" if name in right else "left", overflow="fold")
    for row in rows:
        table.add_row(*(Text(_plain(str(value))) for value in row))
    console = Console(width=None if sys.stdout.isatty() else 10_000, highlight=False)
    with console.capture() as shown:
        console.print(table)
    for line in shown.get().splitlines():
        _write(sys.stdout, line.rstrip())


def track(items: Sequence[Item], doing: str) -> Iterator[Item]:
    """Go through items; a bar on the error stream when that takes longer than a second and someone is looking."""
    with contextlib.ExitStack() as stack:
        began, bar, task = time.monotonic(), None, None
        for k, item in enumerate(items):
            if bar is None and sys.stderr.isatty() and time.monotonic() - began > PATIENCE:
                from rich.console import Console
                from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

                looks = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
                bar = stack.enter_context(Progress(*looks, console=Console(stderr=True), transient=True))
                task = bar.add_task(doing, total=len(items), completed=k)
            yield item
            if bar is not None and task is not None:
                bar.update(task, completed=k + 1)


def _write(stream: Any, text: str) -> None:
    text = _plain(text)
    with contextlib.suppress(LookupError):
        text = text.encode(stream.encoding or "utf-8", "replace").decode(stream.encoding or "utf-8")
    print(text, file=stream)


def _plain(text: str) -> str:
    return text.replace("\u00a0", " ")
