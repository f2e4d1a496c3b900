"""The plan and the progress bar of an audit, on the error stream."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Any

from stiction.apps.output import print_err
from stiction.display import count_noun

if TYPE_CHECKING:
    from stiction.fleet import Progress

__all__ = ["AuditBar"]

STAGES = {
    "find": "Finding loops",
    "compile": "Compiling",
    "screen": "Screening",
    "diagnose": "Diagnosing",
    "group": "Grouping",
}
LINE_EVERY_S = 30.0
"""Time between two lines where the error stream is no terminal [s]."""


class AuditBar:
    """Shows the plan, then a bar with rate, time left and findings; lines where there is no terminal."""

    def __init__(self, *, quiet: bool = False) -> None:
        self.quiet = quiet
        self._bar: Any = None
        self._task: Any = None
        self._last = time.monotonic()

    def __enter__(self) -> AuditBar:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

            looks = (
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[text]}"),
            )
            self._bar = Progress(*looks, console=Console(stderr=True), transient=True)
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def update(self, progress: Progress) -> None:
        """Show how far the audit is."""
        if progress.stage == "plan":
            self._show_plan(progress.details or {})
            return
        text = _describe(progress)
        if self._bar is not None:
            if self._task is None:
                self._task = self._bar.add_task(STAGES[progress.stage], text=text)
            self._bar.update(
                self._task, description=STAGES[progress.stage], completed=progress.done, total=progress.total, text=text
            )
        elif not self.quiet and time.monotonic() - self._last > LINE_EVERY_S:
            self._last = time.monotonic()
            print_err(f"{STAGES[progress.stage]}: {progress.done} of {count_noun(progress.total, 'loop')}. {text}")

    def _show_plan(self, details: dict[str, Any]) -> None:
        if self.quiet:
            return
        work = "all are diagnosed already"
        if details["left"]:
            left = (
                ""
                if details["left"] == details["loops"] + details["unreadable"]
                else f" of the remaining {details['left']}"
            )
            workers = count_noun(details["workers"], "worker")
            work = f"the diagnosis{left} takes about {_format_time(details['seconds'])} with {workers}"
        unreadable = count_noun(details["unreadable"], "file")
        left_out = f" {unreadable} cannot be read; the reasons are in the result." if details["unreadable"] else ""
        print_err(
            f"{count_noun(details['loops'], 'loop')} in {count_noun(details['parts'], 'part')} of the source, about "
            f"{details['samples']:,} samples each; {work}.{left_out}"
        )


def _describe(progress: Progress) -> str:
    parts = []
    if progress.rate:
        parts.append(f"{progress.rate:.1f} loops/s")
    if progress.seconds_left is not None and progress.done < progress.total:
        parts.append(f"{_format_time(progress.seconds_left)} left")
    if progress.stage in ("screen", "diagnose"):
        parts.append(f"{count_noun(progress.sticky, 'sticky valve')} so far")
    return ", ".join(parts)


def _format_time(seconds: float) -> str:
    """Seconds below two minutes, else minutes, else hours.

    Examples
    --------
    >>> [_format_time(seconds) for seconds in (0.2, 75.4, 1234.0, 20000.0)]
    ['1 s', '75 s', '21 min', '5.6 h']
    """
    if seconds < 120.0:
        return f"{max(1.0, seconds):.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"
