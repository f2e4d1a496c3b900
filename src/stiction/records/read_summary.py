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
    from datetime import datetime

    from stiction.records.record import LoopRecord

__all__ = ["LoopSummary", "ReadSummary", "summarise"]

MAX_BAD_VALUES = 5
"""Kinds of bad values that the text lists, the most frequent first [-]."""
MAX_UNUSED = 20
"""Unused columns that the text lists [-]."""
MAX_LOOPS = 3
"""Loops that the text names before an assumption [-]."""


@dataclass(frozen=True, slots=True)
class LoopSummary(Result):
    """What was read of one loop."""

    _json_keys = (
        "record.tag as tag", "record.provenance.source as source", "record.loop_type as loop_type",
        "record.provenance.rows as rows", "samples", "record.dt as dt", "record.missing_percent as bad_percent", "gaps",
        "longest_gap_s", "auto_percent", "record.provenance.pv_unit as pv_unit", "op_unit",
        "record.provenance.columns as columns", "record.provenance.unused_columns as unused_columns",
        "record.provenance.bad_values as bad_values", "record.start as start", "end",
    )  # fmt: skip

    record: LoopRecord
    """The record, with its provenance."""
    gaps: int
    """Gaps of OP or PV [-]."""
    longest_gap_s: float
    """Longest of them [s]."""

    @property
    def samples(self) -> int:
        """Samples of the record, gaps included."""
        return len(self.record)

    @property
    def auto_percent(self) -> float | None:
        """Samples in automatic [%]; None when the mode was not recorded."""
        return None if self.record.auto is None or not self.samples else 100.0 * float(np.mean(self.record.auto))

    @property
    def op_unit(self) -> str:
        """Unit of OP, by the source or by its values."""
        return self.record.provenance.op_unit or self.record.op_unit

    @property
    def end(self) -> datetime | None:
        """Time of the last sample; None when the source has no date."""
        start = self.record.start
        return start and start + timedelta(seconds=max(0, self.samples - 1) * self.record.dt)

    def summary(self) -> str:
        """Return the loop as text."""
        record, origin = self.record, self.record.provenance
        columns = ", ".join(f"{signal.upper()} = {column}" for signal, column in origin.columns.items())
        gaps = (
            f" ({count_noun(self.gaps, 'gap')}, the longest {format_seconds(self.longest_gap_s)})" if self.gaps else ""
        )
        auto = "" if self.auto_percent is None else f", {self.auto_percent:.3g} % in automatic"
        span = f" from {format_time(record.start)} to {format_time(self.end)}" if record.start else ""
        unit = f"PV in {origin.pv_unit}" if origin.pv_unit else ""
        tail = "".join(f"; {part}" for part in (columns, unit) if part)
        lines = [
            f"{record.tag} ({record.loop_type}) from {origin.source}: {count_noun(origin.rows, 'row')}, "
            f"{count_noun(self.samples, 'sample')} every "
            f"{record.dt:.6g} s{span}, {record.missing_percent:.3g} % without OP or PV{gaps}{auto}{tail}"
        ]
        if origin.bad_values:
            kinds = [f"{n} x {kind!r}" for kind, n in Counter(origin.bad_values).most_common()]
            lines.append(f"  bad values: {list_first(kinds, MAX_BAD_VALUES)}")
        if origin.unused_columns:
            lines.append(f"  not used: {list_first(origin.unused_columns, MAX_UNUSED)}")
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
    gaps = runs(missing_mask(record.op, record.pv))
    return LoopSummary(record, len(gaps), int(run_lengths(gaps).max(initial=0)) * record.dt)
