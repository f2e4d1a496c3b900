"""Block means of all loops of an audit, as Parquet parts that are written whole or not at all."""

from __future__ import annotations

import hashlib
import json
import os
from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import RecordError
from stiction.fleet.block_means import BlockMeans, Clock

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping
    from pathlib import Path

__all__ = ["clock_from_dict", "clock_to_dict", "read_signals", "remove_unused_parts", "write_signals"]

ARRAYS = ("error", "op", "fast_error", "fast_op")
METADATA_KEY = "stiction_clock"


def write_signals(folder: Path, means: Mapping[int, BlockMeans], key: tuple[str, ...] = ()) -> str:
    """Write the block means of some loops (number -> block means) as one part, and give its name.

    The name depends on the loops and the `key` alone, so that a part that is written again replaces itself.

    Raises RecordError when it cannot be written.
    """
    import polars as pl

    if not means:
        return ""
    numbers = sorted(means)
    digest = hashlib.sha256(repr((numbers, key)).encode()).hexdigest()[:16]
    target = folder / f"part-{digest}.parquet"
    columns: dict[str, Any] = {
        "loop": pl.Series(numbers, dtype=pl.Int64),
        "tag": [means[k].tag for k in numbers],
        "secondary_tag": [means[k].secondary_tag for k in numbers],
    }
    for name in ARRAYS:
        columns[name] = pl.Series([_rounded(getattr(means[k], name)) for k in numbers], dtype=pl.List(pl.Float32))
    part = target.with_suffix(f".{os.getpid()}.tmp")
    clock = json.dumps(clock_to_dict(means[numbers[0]].clock))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        pl.DataFrame(columns).write_parquet(part, metadata={METADATA_KEY: clock}, compression="zstd")
        os.replace(part, target)
    except (OSError, pl.exceptions.PolarsError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordError(
            f"block means cannot be written ({reason}); check the access rights and the free space.", where=folder
        ) from None
    finally:
        part.unlink(missing_ok=True)
    return target.name


def read_signals(folder: Path, loops: Mapping[int, str]) -> dict[int, BlockMeans]:
    """Read the block means of some loops (number -> name of the part): number -> block means.

    A part that is missing or damaged gives none.
    """
    import polars as pl

    by_part: dict[str, list[int]] = {}
    for number, name in loops.items():
        if name:
            by_part.setdefault(name, []).append(number)
    found: dict[int, BlockMeans] = {}
    for name, numbers in by_part.items():
        path = folder / name
        try:
            clock = clock_from_dict(json.loads(pl.read_parquet_metadata(path)[METADATA_KEY]))
            frame = pl.read_parquet(path, glob=False).filter(pl.col("loop").is_in(numbers))
        except (OSError, KeyError, ValueError, pl.exceptions.PolarsError, pl.exceptions.PanicException):
            continue
        for row in frame.iter_rows(named=True):
            arrays = [np.array(row[array], dtype=np.float32) for array in ARRAYS]
            found[row["loop"]] = BlockMeans(row["tag"], clock, *arrays, secondary_tag=row["secondary_tag"])
    return found


def remove_unused_parts(folder: Path, used: Collection[str]) -> None:
    """Delete parts that no row of the ledger refers to, and what a killed process left behind."""
    for path in folder.glob("part-*"):
        if path.name not in used:
            path.unlink(missing_ok=True)


def clock_to_dict(clock: Clock) -> dict[str, Any]:
    """JSON-ready form of a clock."""
    return {
        "start": clock.start and clock.start.isoformat(), "dt": clock.dt, "count": clock.count,
        "fast_dt": clock.fast_dt, "fast_first": clock.fast_first, "fast_count": clock.fast_count,
    }  # fmt: skip


def clock_from_dict(stored: Mapping[str, Any]) -> Clock:
    """Clock from its JSON-ready form."""
    start = stored["start"] and datetime.fromisoformat(stored["start"])
    return Clock(**{**stored, "start": start})


def _rounded(x: np.ndarray) -> np.ndarray:
    """Round to 12 bits of mantissa, which zstd packs better."""
    bits = np.ascontiguousarray(x, dtype=np.float32).view(np.uint32)
    return ((bits + np.uint32(1 << 10)) & ~np.uint32((1 << 11) - 1)).view(np.float32)
