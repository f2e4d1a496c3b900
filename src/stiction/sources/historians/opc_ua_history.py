"""Raw history of an OPC UA server: many nodes a call, page by page."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any, NamedTuple

from stiction.errors import import_extra
from stiction.sources.historians.chunks import chunks

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Mapping, Sequence

    from asyncua.client.client import Client

__all__ = ["RawValue", "quality_word", "raw_value", "read_last_before", "read_pages"]

NODES_PER_CALL = 50
"""Nodes that are read with one call [-]."""
VALUES_PER_NODE = 1000
"""Values of a node that are asked for with one call [-]."""
GOOD, UNCERTAIN, BAD = 0, 0x40000000, 0x80000000
LOOK_BACK = timedelta(days=366)
"""Time before the start in which the value that stood there is looked for."""
LOST_POINT = "BadContinuationPointInvalid"


class RawValue(NamedTuple):
    """A value as the server gave it."""

    seconds: float
    """Time of the source, or of the server where there is none [s since 1970 UTC]."""
    value: float | str | None
    """Number or text; None where there is none."""
    status: int
    """OPC UA status code."""


def raw_value(data: Any) -> RawValue | None:
    """Take a DataValue apart; None where it has no time."""
    stamp = data.SourceTimestamp or data.ServerTimestamp
    if stamp is None:
        return None
    seconds = (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
    value: Any = None if data.Value is None else data.Value.Value
    status = data.StatusCode.value if data.StatusCode is not None else GOOD
    if isinstance(value, bool):
        value = float(value)
    elif hasattr(value, "Text"):
        value = value.Text
    elif value is not None and not isinstance(value, (int, float, str)):
        value, status = None, status | BAD  # an array or a structure
    return RawValue(seconds, value, status)


def quality_word(status: int) -> str:
    """Name of a status code, which begins with Good, Uncertain or Bad.

    Examples
    --------
    >>> quality_word(0x80310000), quality_word(0x480)
    ('BadNoCommunication', 'Good')
    """
    ua = import_extra("asyncua.ua", "live")

    kind = "Bad" if status & BAD else "Uncertain" if status & UNCERTAIN else "Good"
    name = ua.StatusCode(status & 0xFFFF0000).name
    return name if name.startswith(kind) else kind


@dataclass
class _Reading:
    """How far a node was read."""

    node: str
    start: datetime
    point: bytes | None = None
    known: int = 0
    """Values at `start` that were read before [-]."""
    last: float = 0.0
    """Time of the last value so far [s]."""
    at_last: int = 0
    """Values with that time [-]."""


async def read_pages(
    client: Client, since: Mapping[str, datetime], until: datetime
) -> AsyncIterator[tuple[str, list[RawValue] | str]]:
    """Read the history of nodes from a time of their own on: node id -> a page of values, or why there is none.

    A node has as many pages as the server needs; the last one may be empty. Where a server cuts a page without a
    continuation point, the next page begins at the last time of this one.
    """
    for chunk in chunks(since.items(), NODES_PER_CALL):
        waiting = [_Reading(node, first) for node, first in chunk]
        while waiting:
            start = waiting[0].start
            now = [one for one in waiting if one.start == start]
            waiting = [one for one in waiting if one.start != start]
            points = [(one.node, one.point) for one in now]
            results = await _read_history(client, points, start, until, VALUES_PER_NODE)
            for one, result in zip(now, results, strict=True):
                if result.StatusCode.value & BAD:
                    if one.point and one.last and result.StatusCode.name == LOST_POINT:
                        waiting.append(_from_last(one))
                    else:
                        yield one.node, result.StatusCode.name
                    continue
                page = _values(result)
                yield one.node, page[one.known :]
                if following := _next_page(one, result.ContinuationPoint, page):
                    waiting.append(following)


async def _read_history(
    client: Client, points: Sequence[tuple[str, bytes | None]], start: datetime, end: datetime, most: int
) -> Sequence[Any]:
    """Results of one call for nodes with their continuation points, `most` values each [-]."""
    ua = import_extra("asyncua.ua", "live")
    asked = ua.HistoryReadParameters(TimestampsToReturn=ua.TimestampsToReturn.Both, ReleaseContinuationPoints=False)
    asked.HistoryReadDetails = ua.ReadRawModifiedDetails(
        IsReadModified=False, StartTime=start, EndTime=end, NumValuesPerNode=most, ReturnBounds=False
    )
    asked.NodesToRead = [
        ua.HistoryReadValueId(NodeId=ua.NodeId.from_string(node), ContinuationPoint=point) for node, point in points
    ]
    return await client.uaclient.history_read(asked)


def _values(result: Any) -> list[RawValue]:
    data = getattr(result.HistoryData, "DataValues", None) or []
    return [value for item in data if (value := raw_value(item)) is not None]


async def read_last_before(client: Client, nodes: Sequence[str], moment: datetime) -> dict[str, RawValue]:
    """Read the last value of nodes before a time; nodes that have none, or cannot be read, are left out."""
    found: dict[str, RawValue] = {}
    for chunk in chunks(nodes, NODES_PER_CALL):
        # an end before the start: backwards (OPC UA Part 11, 6.4.3)
        results = await _read_history(client, [(node, None) for node in chunk], moment, moment - LOOK_BACK, 1)
        for node, result in zip(chunk, results, strict=True):
            values = _values(result)
            if values and values[0].seconds <= moment.timestamp():
                found[node] = values[0]
    return found


def _next_page(one: _Reading, point: bytes | None, page: list[RawValue]) -> _Reading | None:
    """What to read after a page; None where it was the last one."""
    last, at_last = one.last, one.at_last
    if page:
        last = page[-1].seconds
        same = sum(value.seconds == last for value in page)
        at_last = same + (one.at_last if last == one.last and one.point else 0)
    following = _Reading(one.node, one.start, point, last=last, at_last=at_last)
    if point:
        return following
    is_cut = len(page) >= VALUES_PER_NODE and len(page) > one.known
    return _from_last(following) if is_cut else None


def _from_last(one: _Reading) -> _Reading:
    """Go on at the time of the last value, where there is no continuation point, or the server has lost it."""
    return _Reading(one.node, datetime.fromtimestamp(one.last, UTC), known=one.at_last)
