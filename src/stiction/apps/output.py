"""Output of the commands: text, tables and JSON on standard output; progress and notes on standard error."""

from __future__ import annotations

import contextlib
import json
import re
import sys
import threading
import time
from functools import partial
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any, TypeVar

from stiction.display.visible_text import visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

__all__ = ["print_err", "print_json", "print_out", "print_table", "progress_callback", "track"]

PROGRESS_DELAY_S = 1.0
"""Time before a progress bar appears [s]."""

_NUMBER = re.compile(r"(?:[-+<>\u2212]?\d\S*(?: (?:%|s|min|h|d))?|-|\u2013|)")
"""Text of a number with its unit, or of a missing one."""

Item = TypeVar("Item")


def print_out(text: str) -> None:
    """Print text on standard output, with plain spaces in place of no-break spaces."""
    _write(sys.stdout, text)


def print_err(text: str) -> None:
    """Print text on standard error."""
    sys.stdout.flush()
    _write(sys.stderr, text)


def print_json(data: Any) -> None:
    """Print JSON without NaN or infinity."""
    from stiction.display.json_form import to_json

    _write(sys.stdout, json.dumps(to_json(data), indent=2, allow_nan=False))


def print_table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a table: fitted to the width of a terminal, in one line per row elsewhere, without colours.

    Columns of numbers stand to the right. On a terminal that is too narrow for the longest words, each row is printed
    as a list.

    Parameters
    ----------
    columns : sequence of str
        Headings.
    rows : iterable
        One sequence of values per row.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    width = get_terminal_size().columns if sys.stdout.isatty() else 10_000
    # Without a height, Rich uses 80 columns when TERM is dumb.
    console = Console(width=width, height=25, highlight=False)
    shown_rows = [[_plain(str(value)) for value in row] for row in rows]
    texts = [list(column) for column in zip(columns, *shown_rows, strict=True)]
    widths = _widths(texts, width)
    if widths is None:
        for row in shown_rows:
            _write(sys.stdout, "")
            for name, text in zip(columns, row, strict=True):
                if text:
                    _write(sys.stdout, f"{name}: {text}" if name else text)
        return
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for (name, *cells), width in zip(texts, widths, strict=True):
        are_numbers = any(cells) and all(_NUMBER.fullmatch(cell) for cell in cells)
        table.add_column(Text(name), justify="right" if are_numbers else "left", width=width)
    for row in shown_rows:
        table.add_row(*map(Text, row))
    with console.capture() as shown:
        console.print(table)
    for line in shown.get().splitlines():
        _write(sys.stdout, line.rstrip())


def _widths(columns: Sequence[Sequence[str]], most: int) -> list[int] | None:
    """Return the width of each column, at least that of its longest word; None when the words do not fit."""
    widths = [max(len(word) for text in column for word in (text.split() or [""])) for column in columns]
    wanted = [max(map(len, column)) for column in columns]
    spare = most - sum(widths) - 2 * (len(widths) - 1)
    if spare < 0:
        return None
    for i in sorted(range(len(widths)), key=wanted.__getitem__):
        grows = min(spare, wanted[i] - widths[i])
        widths[i], spare = widths[i] + grows, spare - grows
    return widths


def track(items: Sequence[Item], doing: str) -> Iterator[Item]:
    """Iterate over items, with a progress bar on a terminal when that takes longer than a second."""
    with progress_callback(doing) as show:
        for k, item in enumerate(items):
            show(k, len(items))
            yield item


@contextlib.contextmanager
def progress_callback(doing: str) -> Iterator[Callable[[int, int], None]]:
    """Provide a function of the finished and the total count that shows a progress bar, from any thread."""
    with contextlib.ExitStack() as stack:
        began, lock, shown = time.monotonic(), threading.Lock(), {}

        def show(done: int, total: int) -> None:
            with lock:
                if not shown:
                    if not sys.stderr.isatty() or time.monotonic() - began <= PROGRESS_DELAY_S:
                        return
                    from rich.console import Console
                    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

                    looks = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
                    bar = stack.enter_context(Progress(*looks, console=Console(stderr=True), transient=True))
                    shown["update"] = partial(bar.update, bar.add_task(doing))
                shown["update"](completed=done, total=total)

        yield show


def _write(stream: Any, text: str) -> None:
    text = _plain(text)
    with contextlib.suppress(LookupError):
        text = text.encode(stream.encoding or "utf-8", "replace").decode(stream.encoding or "utf-8")
    print(text, file=stream)


def _plain(text: str) -> str:
    return visible(text.replace("\u00a0", " "))
