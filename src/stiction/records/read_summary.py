"""The summary of what was read: loops, rows, step, units, gaps, bad values and assumptions."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from datetime import timedelta
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds, format_time
from stiction.display.json_form import Result
from stiction.display.number_format import count_noun, list_first
from stiction.records.gaps import missing_mask
from stiction.records.runs import run_lengths, runs

if TYPE_CHECKING:
    from collections.abc import Iterable

    from stiction.records.record import LoopRecord

__all__ = ["LoopSummary", "ReadSummary", "summarise"]

MAX_BAD_VALUES = 5
"""Kinds of bad values that the text lists, the most frequent first [-]."""
MAX_UNUSED = 20
"""Unused columns that the text lists [-]."""
MAX_LOOPS = 3
"""Loops that the text names before an assumption [-]."""


@dataclass(frozen=True, slots=True)
class LoopSummary:
    """What was read of one loop."""

    tag: str
    """Name of the loop."""
    source: str
    """Where it was read from."""
    loop_type: str
    """One of `LOOP_TYPES`."""
    rows: int
    """Rows in the source."""
    samples: int
    """Samples of the record, gaps included."""
    dt: float
    """Sampling period [s]."""
    bad_percent: float
    """Samples in which OP or PV is missing [%]."""
    gaps: int
    """Gaps of OP or PV [-]."""
    longest_gap_s: float
    """Longest of them [s]."""
    auto_percent: float | None
    """Samples in automatic [%]; None when the mode was not recorded."""
    pv_unit: str
    """Unit of PV; empty when unknown."""
    op_unit: str
    """Unit of OP."""
    columns: dict[str, str]
    """Signal -> column of the source."""
    unused_columns: tuple[str, ...]
    """Columns that stand beside a signal of the loop and were not used."""
    bad_values: dict[str, int]
    """Kind of bad value -> how often."""
    start: str | None = None
    """Time of the first sample, ISO 8601; None when the source has no date."""
    end: str | None = None
    """Time of the last sample."""

    def summary(self) -> str:
        """Return the loop as text."""
        columns = ", ".join(f"{signal.upper()} = {column}" for signal, column in self.columns.items())
        gaps = (
            f" ({count_noun(self.gaps, 'gap')}, the longest {format_seconds(self.longest_gap_s)})" if self.gaps else ""
        )
        auto = "" if self.auto_percent is None else f", {self.auto_percent:.3g} % in automatic"
        span = f" from {format_time(self.start)} to {format_time(self.end)}" if self.start else ""
        unit = f"PV in {self.pv_unit}" if self.pv_unit else ""
        tail = "".join(f"; {part}" for part in (columns, unit) if part)
        lines = [
            f"{self.tag} ({self.loop_type}) from {self.source}: {count_noun(self.rows, 'row')}, "
            f"{count_noun(self.samples, 'sample')} every "
            f"{self.dt:.6g} s{span}, {self.bad_percent:.3g} % without OP or PV{gaps}{auto}{tail}"
        ]
        if self.bad_values:
            kinds = [f"{n} x {kind!r}" for kind, n in Counter(self.bad_values).most_common()]
            lines.append(f"  bad values: {list_first(kinds, MAX_BAD_VALUES)}")
        if self.unused_columns:
            lines.append(f"  not used: {list_first(self.unused_columns, MAX_UNUSED)}")
        return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class ReadSummary(Result):
    """What was read from one or more sources; print `summary()`."""

    loops: tuple[LoopSummary, ...]
    """One for each loop."""
    assumptions: tuple[str, ...]
    """What the reader assumed, each sentence once; after the names of its loops, unless it holds for all."""

    def summary(self) -> str:
        """Return the summary as text."""
        head = f"{count_noun(len(self.loops), 'loop')} read"
        return "\n".join(
            [head, *(loop.summary() for loop in self.loops), *(f"assumed: {text}" for text in self.assumptions)]
        )


def summarise(records: Iterable[LoopRecord]) -> ReadSummary:
    """Summarise records as they were read.

    Parameters
    ----------
    records : iterable of LoopRecord
        What `read` returned.

    Returns
    -------
    ReadSummary
        One entry for each record, and the assumptions of all.

    Examples
    --------
    >>> from stiction.records import LoopRecord, summarise
    >>> summarise([LoopRecord("FIC-101", 1.0, op=[50.0, 51.0], pv=[3.0, 3.1])]).loops[0].samples
    2
    """
    records = list(records)
    tags = Counter(record.tag for record in records)
    names = [
        record.tag if tags[record.tag] == 1 else f"{record.tag} from {record.provenance.source}" for record in records
    ]
    owners: dict[str, list[str]] = {}
    for name, record in zip(names, records, strict=True):
        for text in dict.fromkeys(record.provenance.assumptions):
            owners.setdefault(text, []).append(name)
    return ReadSummary(
        tuple(_loop_summary(record) for record in records),
        tuple(
            text if len(of) == len(records) else f"{list_first(list(dict.fromkeys(of)), MAX_LOOPS)}: {text}"
            for text, of in owners.items()
        ),
    )


def _loop_summary(record: LoopRecord) -> LoopSummary:
    origin = record.provenance
    gaps = runs(missing_mask(record.op, record.pv))
    start = record.start
    end = start and start + timedelta(seconds=max(0, len(record) - 1) * record.dt)
    return LoopSummary(
        tag=record.tag,
        source=origin.source,
        loop_type=record.loop_type,
        rows=origin.rows,
        samples=len(record),
        dt=record.dt,
        bad_percent=record.missing_percent,
        gaps=len(gaps),
        longest_gap_s=int(run_lengths(gaps).max(initial=0)) * record.dt,
        auto_percent=None if record.auto is None or not len(record) else 100.0 * float(np.mean(record.auto)),
        pv_unit=origin.pv_unit,
        op_unit=origin.op_unit or record.op_unit,
        columns=dict(origin.columns),
        unused_columns=origin.unused_columns,
        bad_values=dict(origin.bad_values),
        start=start and start.isoformat(),
        end=end and end.isoformat(),
    )
