"""Loop records as Parquet files, which give equal records when they are read back."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, fields
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import RecordError
from stiction.records.frames import SIGNALS, as_records, stack_records
from stiction.records.record import LoopRecord, Provenance

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

__all__ = ["METADATA_KEY", "read_parquet_records", "to_parquet"]

METADATA_KEY = "stiction"
"""Key under which a Parquet file keeps what is not in its columns."""
FORMAT_VERSION = 1
"""Version of what stands under that key."""


def to_parquet(records: LoopRecord | Sequence[LoopRecord], path: str | os.PathLike[str]) -> None:
    """Write records to one Parquet file, from which `stiction.read` gives equal records.

    The columns are tag, time, pv, op, sp, mv, valve_signal and auto, which any tool can read; a signal that a loop does
    not have is null. The file's metadata hold the rest (dt, start, loop type, provenance) as JSON under the key
    "stiction". Nothing is added to the provenance. The rows of one loop follow each other, so that one loop is read
    without the others. Loops may differ in length and sampling period.

    Parameters
    ----------
    records : LoopRecord or sequence of LoopRecord
        What to write.
    path : str or path
        The file; it is replaced when all is written.

    Raises
    ------
    RecordError
        When there is no record, or the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> record = LoopRecord("FIC-101", 2.0, op=[50.0, 51.0], pv=[3.0, 3.1])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     to_parquet(record, f"{folder}/loops.parquet")
    ...     read_parquet_records(f"{folder}/loops.parquet") == [record]
    True
    """
    loops = as_records(records)
    if not loops:
        raise RecordError(f"{path}: there is no record to write; give at least one.")
    frame = stack_records(loops, SIGNALS)
    lengths = {len(loop) for loop in loops}
    group = max(lengths) if len(lengths) == 1 else 16_384
    text = json.dumps({"form": FORMAT_VERSION, "loops": [_description(loop) for loop in loops]})
    target = Path(path)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        frame.write_parquet(part, metadata={METADATA_KEY: text}, row_group_size=max(group, 1))
        os.replace(part, target)
    except OSError as error:
        raise RecordError(f"{path}: cannot be written ({error.strerror or error}); check the folder.") from None
    finally:
        part.unlink(missing_ok=True)


def read_parquet_records(path: str | os.PathLike[str], tag: str | None = None) -> list[LoopRecord] | None:
    """Read the records that `to_parquet` wrote.

    Parameters
    ----------
    path : str or path
        A Parquet file.
    tag : str, optional
        The only loop to read; all by default.

    Returns
    -------
    list of LoopRecord or None
        The records; None when the file was not written by `to_parquet`, or was changed since.

    Raises
    ------
    RecordError
        When there is no loop of that tag; the message names those that there are.
    """
    import polars as pl

    try:
        stored = json.loads(pl.read_parquet_metadata(Path(path)).get(METADATA_KEY, "null"))
        loops = stored["loops"] if isinstance(stored, dict) and stored.get("form") == FORMAT_VERSION else None
        frame = pl.scan_parquet(Path(path), glob=False)
        n_rows = frame.select(pl.len()).collect().item()
        if loops is None or n_rows != sum(loop["rows"] for loop in loops):
            return None
        firsts = np.cumsum([0, *(loop["rows"] for loop in loops)])
        wanted = [k for k, loop in enumerate(loops) if tag is None or loop["tag"].casefold() == tag.casefold()]
        records = [_record(loops[k], frame.slice(int(firsts[k]), loops[k]["rows"])) for k in wanted]
    except (KeyError, TypeError, ValueError, AttributeError, pl.exceptions.PolarsError):
        return None
    if not records and tag is not None:
        names = ", ".join(loop["tag"] for loop in loops[:10])
        raise RecordError(f"{path}: has no loop {tag!r}; give one of {names}.")
    return None if None in records else [record for record in records if record is not None]


def _description(loop: LoopRecord) -> dict[str, Any]:
    """Give what has no column."""
    start = loop.start
    return {
        "tag": loop.tag,
        "rows": len(loop),
        "dt": loop.dt,
        "start": start and start.isoformat(),
        "zone": getattr(start and start.tzinfo, "key", None),
        "signals": [name for name in SIGNALS if getattr(loop, name) is not None],
        "loop_type": loop.loop_type,
        "integrating": loop.integrating,
        "provenance": asdict(loop.provenance),
    }


def _record(stored: dict[str, Any], frame: pl.LazyFrame) -> LoopRecord | None:
    """Make a record of its rows; None when they are those of another loop."""
    names = list(dict.fromkeys(["op", *stored["signals"]]))
    rows = frame.select("tag", *names).collect()
    if rows.height and set(rows["tag"].unique()) != {stored["tag"]}:
        return None
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
