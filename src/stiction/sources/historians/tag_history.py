"""A tag of a historian, and its values over some time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    import polars as pl
    from numpy.typing import NDArray

    from stiction.errors import StictionError

    Histories = dict[str, "TagHistory | StictionError"]

__all__ = ["Historian", "HistorianTag", "TagHistory", "begin_with", "changed_seldom", "make_history"]


@dataclass(frozen=True)
class HistorianTag:
    """One recorded signal."""

    name: str
    """Name, such as ``FIC-101.PV``."""
    address: str
    """How the historian finds it: a node id, or a WebId."""
    unit: str = ""
    """Engineering unit; empty when the historian names none."""
    description: str = ""
    """Description."""
    span: tuple[float, float] | None = None
    """Range of the instrument [unit]."""


@dataclass(frozen=True, eq=False)
class TagHistory:
    """Values of a tag in the order of time."""

    seconds: NDArray[np.float64]
    """Seconds since 1970 UTC, shape (n,)."""
    values: pl.Series
    """Numbers, null where there is none; text where the tag holds text, shape (n,)."""
    quality: pl.Series
    """Quality of each value in words: Good, Uncertain..., Bad..., Questionable, Substituted, shape (n,)."""


class Historian(Protocol):
    """What every client of a historian gives. It has no function that writes."""

    def find_tags(self, wanted: Sequence[str], *, exact: bool) -> list[HistorianTag]:
        """Find tags by patterns such as ``FIC*``, or `exact`ly by their names; empty `wanted` finds all."""
        ...

    def read(self, tags: Sequence[HistorianTag], since: datetime, until: datetime) -> Histories:
        """Read the values from `since` on and before `until`: name -> history, or why the tag cannot be read."""
        ...


def changed_seldom(
    histories: Histories, tags: Sequence[HistorianTag], since: float, *, steps: float = 5.0
) -> list[str]:
    """Addresses of tags that need the value that stood at `since` [s]: the first one comes some steps [-] later."""
    times = {tag.address: one.seconds for tag in tags if isinstance(one := histories[tag.name], TagHistory)}
    return [node for node, t in times.items() if t.size < 2 or t[0] - since > steps * float(np.median(np.diff(t)))]


def begin_with(histories: Histories, name: str, since: float, value: object, quality: str) -> None:
    """Put the value that stood before at `since` [s] in front of a history."""
    if isinstance(one := histories[name], TagHistory):
        cells, words = one.values.to_list(), one.quality.to_list()
        histories[name] = make_history([since, *one.seconds], [value, *cells], [quality, *words])


def make_history(seconds: Sequence[float], values: Sequence[object], quality: Sequence[str]) -> TagHistory:
    """Make a history of values as they came: sorted by time, booleans as 0 and 1, of several types all text."""
    import polars as pl

    stamps = np.asarray(seconds, dtype=np.float64)
    plain = [float(value) if isinstance(value, bool) else value for value in values]
    is_text = any(isinstance(one, str) for one in plain)
    if is_text:
        cells = pl.Series([None if one is None else str(one) for one in plain], dtype=pl.String)
    else:
        numbers = [float(one) if isinstance(one, (int, float)) else None for one in plain]
        cells = pl.Series(numbers, dtype=pl.Float64).fill_nan(None)
    words = pl.Series(list(quality), dtype=pl.String)
    if stamps.size and (np.diff(stamps) < 0.0).any():
        order = np.argsort(stamps, kind="stable")
        return TagHistory(stamps[order], cells.gather(order), words.gather(order))
    return TagHistory(stamps, cells, words)
