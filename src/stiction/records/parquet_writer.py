"""Loop records written to a Parquet file, which gives equal records when it is read back."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from typing import Any

from stiction.atomic_write import output_path, unwritable_error
from stiction.errors import RecordError, Setting
from stiction.records.frames import SIGNALS, as_records, stack_records

__all__ = ["FORMAT_VERSION", "METADATA_KEY", "to_parquet"]

METADATA_KEY = "stiction"
"""Key under which a Parquet file keeps what is not in its columns."""
FORMAT_VERSION = 1
"""Version of what stands under that key."""


def to_parquet(records: Any, path: str | os.PathLike[str]) -> None:
    """Write one or several records to one Parquet file, from which `stiction.read` gives equal records.

    The columns are tag, time, pv, op, sp, mv, valve_signal and auto, which any tool can read; a signal that a loop does
    not have is null. The file's metadata hold the rest (dt, start, loop type, provenance) as JSON under the key
    "stiction". The rows of one loop follow each other, so that one loop is read without the others. The file is
    replaced when all is written.

    Examples
    --------
    >>> import tempfile
    >>> import stiction as st
    >>> record = st.LoopRecord("FIC-101", 2.0, op=[50.0, 51.0], pv=[3.0, 3.1])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     to_parquet(record, f"{folder}/loops.parquet")
    ...     st.read(f"{folder}/loops.parquet") == [record]
    True
    """
    loops = as_records(records)
    if not loops:
        raise RecordError("there is no record to write; give at least one.", where=path)
    if open_tags := [loop.tag for loop in loops if loop.other_readings]:
        raise RecordError(
            f"the quality codes of {open_tags[0]} can be read in several ways",
            remedy=("read it with ", Setting("good_codes"), " before it is written"),
            where=path,
        )
    frame = stack_records(loops, SIGNALS)
    lengths = {len(loop) for loop in loops}
    group = max(lengths) if len(lengths) == 1 else 16_384
    text = json.dumps({"form": FORMAT_VERSION, "loops": [_description(loop) for loop in loops]})
    target = output_path(path)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        frame.write_parquet(part, metadata={METADATA_KEY: text}, row_group_size=max(group, 1))
        os.replace(part, target)
    except OSError as error:
        raise unwritable_error(target, error) from None
    finally:
        part.unlink(missing_ok=True)


def _description(loop: Any) -> dict[str, Any]:
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
