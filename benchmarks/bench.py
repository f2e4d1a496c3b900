"""What every section needs: a stopwatch, a row, a table."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

REPEATS = 7


@dataclass(frozen=True)
class Row:
    """One measurement, beside another's where there is one."""

    what: str
    value: float
    unit: str
    other: str = ""
    other_value: float | None = None
    ratio: float | None = None
    """How many times better than the other [-]."""
    target: float | None = None
    """What the ratio should reach [-]."""


@dataclass(frozen=True)
class Section:
    """A headline and its rows; `notes` say what was checked first."""

    title: str
    rows: list[Row]
    notes: tuple[str, ...] = ()


def median_time(task: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median run time of `task` [s] over `repeats` runs, after one to warm up."""
    task()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        task()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def in_turn(first: Callable[[], object], second: Callable[[], object]) -> tuple[float, float]:
    """Shortest times of two calls made in turn, so that both see the same moods of the machine [s]."""
    times = []
    for _ in range(4 * REPEATS):
        for work in (first, second):
            start = time.perf_counter()
            work()
            times.append(time.perf_counter() - start)
    return min(times[2::2]), min(times[3::2])


def show(section: Section) -> None:
    """Print a section as a plain table."""
    print(f"\n{section.title}")
    for note in section.notes:
        print(f"  {note}")
    head = ("", "stiction", "beside", "", "ratio", "target")
    lines = [head] + [_line(row) for row in section.rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(head))]
    for line in lines:
        cells = [line[0].ljust(widths[0]), line[1].rjust(widths[1]), line[2].ljust(widths[2])]
        cells += [line[i].rjust(widths[i]) for i in (3, 4, 5)]
        print("  " + "  ".join(cells).rstrip())


def _line(row: Row) -> tuple[str, ...]:
    other = "" if row.other_value is None else _number(row.other_value, row.unit)
    ratio = "" if row.ratio is None else f"{row.ratio:,.3g} x" if row.ratio < 1000.0 else f"{row.ratio:,.0f} x"
    target = ""
    if row.target is not None and row.ratio is not None:
        target = f">= {row.target:,g} {'met' if row.ratio >= row.target else 'MISSED'}"
    return (row.what, _number(row.value, row.unit), row.other, other, ratio, target)


def _number(value: float, unit: str) -> str:
    if unit.endswith("/s") and value >= 1e5:
        return f"{value / 1e6:,.1f} M{unit}"
    return f"{value:,.0f} {unit}" if value >= 100.0 else f"{value:,.3g} {unit}"
