"""Wall-clock times of a named time zone to UTC; the hour that a clock repeats is kept in the order of the file."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.sources.time.time_order import is_newest_first, to_datetime

if TYPE_CHECKING:
    import polars as pl
    from numpy.typing import NDArray

    from stiction.sources.time.stamps import Stamps

__all__ = ["localise"]

_MIN_STEP_BACK_US = 600_000_000
"""Step back with which the second pass of an hour begins, where there are several: smaller ones are rows out of order
[us]."""


def localise(stamps: Stamps, timezone: str) -> Stamps:
    """Convert wall-clock stamps to UTC; stamps of another kind are returned as they are.

    Of two passes through a repeated hour the first is summer time; a single pass goes to the side where it leaves the
    smaller gap.

    Examples
    --------
    >>> from stiction.sources.time.stamps import Stamps
    >>> local = np.array([7200.0, 9000.0, 7200.0, 9000.0]) + 1792886400.0  # 02:00, 02:30, 02:00, 02:30
    >>> (localise(Stamps(local, "local"), "Europe/Berlin").seconds - 1792886400.0).tolist()
    [0.0, 1800.0, 3600.0, 5400.0]
    """
    if stamps.kind != "local":
        return stamps
    import polars as pl

    known = np.flatnonzero(np.isfinite(stamps.seconds))
    reverse = known.size > 1 and is_newest_first(stamps.seconds[known])
    rows = known[::-1] if reverse else known
    local = pl.Series(np.round(stamps.seconds[rows] * 1e6).astype(np.int64)).cast(pl.Datetime("us"))
    first, skipped = _to_utc(local, timezone, "earliest")
    second, _ = _to_utc(local, timezone, "latest")
    seconds = np.full(len(stamps.seconds), np.nan)
    changes: list[str] = []
    is_second = np.zeros(len(rows), dtype=bool)
    edges = np.flatnonzero(np.diff((first != second).astype(np.int8), prepend=0, append=0)).tolist()
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        steps = np.diff(first[begin:end])
        back = np.flatnonzero(steps <= -_MIN_STEP_BACK_US) if (steps < 0).sum() > 1 else np.flatnonzero(steps < 0)
        if back.size:
            is_second[begin + back[0] + 1 : end] = True
        else:
            before = first[begin] - first[begin - 1] if begin else np.inf
            after = second[end] - second[end - 1] if end < len(rows) else np.inf
            is_second[begin:end] = abs(after) < abs(before)
        moment = to_datetime(float(stamps.seconds[rows[begin]]), "local")
        changes.append(
            f"The clock of {timezone} shows the hour of {moment:%Y-%m-%d %H}:00 twice: its rows are kept in the "
            "order of the file."
        )
    changes = list(dict.fromkeys(changes))  # the tags of a long table repeat the same hour
    n_changes, notes = len(changes), [*stamps.notes, *changes]
    if n_skipped := int(skipped.sum()):
        notes.append(
            f"{count_noun(n_skipped, 'stamp')} in an hour that the clock of {timezone} skips: taken as winter time."
        )
    seconds[rows] = np.where(is_second, second, first) / 1e6
    return replace(
        stamps, seconds=seconds, kind="utc", notes=notes,
        clock_jumps=stamps.clock_jumps + n_changes, dst_changes=stamps.dst_changes + n_changes,
    )  # fmt: skip


def _to_utc(local: pl.Series, timezone: str, ambiguous: str) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Convert to microseconds since 1970 UTC; mark what lies in an hour that the clock skips."""
    utc = local.dt.replace_time_zone(timezone, ambiguous=ambiguous, non_existent="null")  # pyright: ignore
    skipped = utc.is_null()
    if skipped.any():
        earlier = local.dt.offset_by("-1h").dt.replace_time_zone(timezone, ambiguous=ambiguous, non_existent="null")  # pyright: ignore
        utc = utc.fill_null(earlier.dt.offset_by("1h"))
    return utc.dt.epoch("us").fill_null(0).to_numpy(), skipped.to_numpy()
