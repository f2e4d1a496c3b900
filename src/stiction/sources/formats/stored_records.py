"""Loop records that were stored as a Parquet file (`LoopRecord.to_parquet`): equal records, one at a time."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from stiction.records.parquet_writer import FORMAT_VERSION, METADATA_KEY
from stiction.records.record import LoopRecord, Provenance

if TYPE_CHECKING:
    import os

__all__ = ["StoredRecords", "open_records"]


@dataclass(eq=False)
class StoredRecords:
    """The records of one file; each is read when it is asked for."""

    frame: pl.LazyFrame
    """Rows of all loops, one loop after the other."""
    loops: list[dict[str, Any]]
    """What the file's metadata say of each loop, and its first row."""
    keep: object = None
    """What must live as long as the file is read."""

    @property
    def tags(self) -> list[str]:
        """Tag of each loop."""
        return [loop["tag"] for loop in self.loops]

    def select(self, tag: str) -> StoredRecords:
        """Give the loops of this tag alone."""
        return replace(self, loops=[loop for loop in self.loops if loop["tag"].casefold() == tag.casefold()])

    def read_one(self, k: int) -> LoopRecord:
        """Read one loop."""
        loop = self.loops[k]
        names = dict.fromkeys(["op", *loop["signals"]])
        return _record(loop, self.frame.slice(loop["first_row"], loop["rows"]).select(*names).collect())


def open_records(path: str | os.PathLike[str], keep: object = None) -> StoredRecords | None:
    """Open records, with `keep` while they are read; None if it is no such file, or its rows were changed since."""
    try:
        stored = json.loads(pl.read_parquet_metadata(Path(path)).get(METADATA_KEY, "null"))
        if not isinstance(stored, dict) or stored.get("form") != FORMAT_VERSION:
            return None
        loops = stored["loops"]
        frame = pl.scan_parquet(Path(path), glob=False)
        n_rows = [loop["rows"] for loop in loops]
        if frame.select(pl.len()).collect().item() != sum(n_rows):
            return None
        starts = np.cumsum([0, *n_rows])[:-1].tolist()
        found = StoredRecords(frame, [{**loop, "first_row": k} for loop, k in zip(loops, starts, strict=True)], keep)
        tags = pl.Series(found.tags, dtype=pl.String).gather(np.repeat(np.arange(len(loops)), n_rows))
        if not frame.select("tag").collect()["tag"].equals(tags):
            return None
        for loop in loops:
            _record(loop, pl.DataFrame(schema=dict.fromkeys(("op", *loop["signals"]), pl.Float64)))
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError, pl.exceptions.PolarsError):
        return None
    return found


def _record(stored: dict[str, Any], rows: pl.DataFrame) -> LoopRecord:
    """Make a record of its rows."""
    names = dict.fromkeys(["op", *stored["signals"]])
    signals: dict[str, Any] = {
        name: rows[name].to_numpy() if name == "auto" else rows[name].fill_null(np.nan).to_numpy() for name in names
    }
    start = stored["start"] and datetime.fromisoformat(stored["start"])
    if stored["zone"]:
        from zoneinfo import ZoneInfo

        start = start.astimezone(ZoneInfo(stored["zone"]))
    known: dict[str, Any] = {each.name: getattr(Provenance(), each.name) for each in fields(Provenance)}
    origin: dict[str, Any] = {
        name: tuple(value) if isinstance(known[name], tuple) else value
        for name, value in stored["provenance"].items()
        if name in known
    }
    return LoopRecord(
        stored["tag"],
        stored["dt"],
        **signals,
        loop_type=stored["loop_type"],
        integrating=stored["integrating"],
        start=start,
        provenance=Provenance(**origin),
    )
