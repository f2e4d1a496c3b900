"""Check that records belong to one loop, and put them in order."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import RecordError
from stiction.records.record import LoopRecord, require_record

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["order_records"]

SAME_DT = 0.01
"""Largest relative difference of two sampling periods that count as equal [-]."""
ASKED: tuple[tuple[str, str, Callable[[LoopRecord], Any]], ...] = (
    ("tag", "records of different loops are not pooled", lambda record: record.tag),
    ("unit of PV", "convert one of them", lambda record: record.provenance.pv_unit),
    ("unit of OP", "convert one of them to % of span", lambda record: record.op_unit),
)
"""What must be equal in all records: name, remedy and value."""


def order_records(records: LoopRecord | Sequence[LoopRecord]) -> list[LoopRecord]:
    """Put records of one loop in the order of time, times that occur twice left out.

    Parameters
    ----------
    records : LoopRecord or sequence of LoopRecord
        Records of one loop.

    Returns
    -------
    list of LoopRecord
        At least one record. Records without times keep their order.

    Raises
    ------
    RecordError
        When there is no record, or two differ in tag, units or sampling period, or in the values of the same time.
    """
    if not isinstance(records, (list, tuple)):
        require_record(records)
        return [records]  # type: ignore[list-item]
    for record in records:
        require_record(record)
    if not records:
        raise RecordError("there is no record; give at least one record of the loop.")
    first = records[0]
    for other in records[1:]:
        _compare(first, other)
    with_times = [record for record in records if record.start is not None]
    if len(with_times) < len(records):
        if with_times:
            missing = next(record for record in records if record.start is None)
            raise RecordError(f"{_name(missing)} has no times, but {_name(with_times[0])} has; read both with times.")
        return list(records)
    aware = {record.start.tzinfo is not None for record in with_times if record.start}
    if len(aware) > 1:
        raise RecordError(f"{first.tag}: some records have a time zone and others have none; read all with a zone.")
    ordered: list[LoopRecord] = []
    for record in sorted(with_times, key=lambda one: (one.start, len(one))):
        rest = _without_overlap(ordered[-1], record) if ordered else record
        if len(rest):
            ordered.append(rest)
    return ordered


def _compare(first: LoopRecord, other: LoopRecord) -> None:
    """Raise a RecordError where two records cannot be of one loop as it is."""
    for name, remedy, value in ASKED:
        one, two = value(first), value(other)
        if one and two and one != two:
            texts = [f"{_name(record)} ({value(record)})" for record in (first, other)]
            raise RecordError(f"the {name} differs: {texts[0]} and {texts[1]}; {remedy}.")
    if abs(first.dt - other.dt) > SAME_DT * min(first.dt, other.dt):
        raise RecordError(
            f"the sampling period differs: {_name(first)} ({first.dt:g} s) and {_name(other)} ({other.dt:g} s); "
            "export both at the same rate."
        )


def _without_overlap(before: LoopRecord, record: LoopRecord) -> LoopRecord:
    """The part of a record after the end of the one before; where both have values, these must be equal."""
    assert before.start is not None
    assert record.start is not None
    offset = round((record.start - before.start).total_seconds() / record.dt)
    shared = min(len(before) - offset, len(record))
    if shared <= 0:
        return record
    for name in ("op", "pv"):
        one, two = getattr(before, name), getattr(record, name)
        if one is None or two is None:
            continue
        one, two = one[offset : offset + shared], two[:shared]
        known = np.isfinite(one) & np.isfinite(two)
        if not np.allclose(one[known], two[known], rtol=1e-6, atol=1e-9):
            raise RecordError(
                f"{_name(before)} and {_name(record)} have different values of {name.upper()} at the same times, from "
                f"{record.start} on; give only one of them."
            )
    return record.window(shared, len(record))


def _name(record: LoopRecord) -> str:
    """Tag and source of a record, for messages."""
    source = record.provenance.source
    begin = "" if record.start is None else f" from {record.start}"
    return f"{record.tag} in {source}{begin}" if source not in ("", "memory") else f"{record.tag}{begin}"
