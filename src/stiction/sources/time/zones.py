"""Wall-clock times of a named time zone to UTC; the hour that a clock repeats is kept in the order of the file."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.sources.time.time_order import is_newest_first, to_datetime

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.sources.time.stamps import Stamps

__all__ = ["localise"]


def localise(stamps: Stamps, timezone: str) -> Stamps:
    """Convert wall-clock stamps to UTC; stamps of another kind are returned as they are.

    Of two passes through a repeated hour the first is summer time; a single pass goes to the side where it leaves the
    smaller gap.
    """
    if stamps.kind != "local":
        return stamps
    rows = np.flatnonzero(np.isfinite(stamps.seconds))
    if is_newest_first(stamps.seconds[rows]):
        rows = rows[::-1]
    wall = stamps.seconds[rows]
    first, second = _to_utc(wall, timezone, "earliest"), _to_utc(wall, timezone, "latest")
    skipped = np.isnan(first)
    first[skipped] = second[skipped] = _to_utc(wall[skipped] - 3600.0, timezone, "earliest") + 3600.0
    is_second = np.zeros(len(rows), dtype=bool)
    changes: list[str] = []
    edges = np.flatnonzero(np.diff((first != second).astype(np.int8), prepend=0, append=0)).tolist()
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        steps = np.diff(first[begin:end])
        # Where several steps go back, those of less than ten minutes are rows out of order.
        back = np.flatnonzero(steps <= -600.0) if (steps < 0).sum() > 1 else np.flatnonzero(steps < 0)
        if back.size:
            is_second[begin + back[0] + 1 : end] = True
        else:
            before = first[begin] - first[begin - 1] if begin else np.inf
            after = second[end] - second[end - 1] if end < len(rows) else np.inf
            is_second[begin:end] = abs(after) < abs(before)
        changes.append(
            f"The clock of {timezone} shows the hour of {to_datetime(float(wall[begin]), 'local'):%Y-%m-%d %H}:00 "
            "twice: its rows are kept in the order of the file."
        )
    changes = list(dict.fromkeys(changes))  # the tags of a long table repeat the same hour
    notes = [*stamps.notes, *changes]
    if n_skipped := int(skipped.sum()):
        notes.append(
            f"{count_noun(n_skipped, 'stamp')} in an hour that the clock of {timezone} skips: taken as winter time."
        )
    seconds = np.full(len(stamps.seconds), np.nan)
    seconds[rows] = np.where(is_second, second, first)
    return replace(
        stamps, seconds=seconds, kind="utc", notes=notes,
        clock_jumps=stamps.clock_jumps + len(changes), dst_changes=stamps.dst_changes + len(changes),
    )  # fmt: skip


def _to_utc(seconds: NDArray[np.float64], timezone: str, ambiguous: str) -> NDArray[np.float64]:
    """Convert a wall clock to UTC [s]; NaN in an hour that the clock skips."""
    import polars as pl

    local = pl.Series(np.round(seconds * 1e6).astype(np.int64)).cast(pl.Datetime("us"))
    utc = local.dt.replace_time_zone(timezone, ambiguous=ambiguous, non_existent="null")  # pyright: ignore
    return utc.dt.epoch("us").cast(float).to_numpy(writable=True) / 1e6
