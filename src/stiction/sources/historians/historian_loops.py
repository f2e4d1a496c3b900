"""The loops of a historian: tags become columns, and columns of the loops read together are fetched together."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError, RecordError, StictionError
from stiction.sources.historians.address import parse_address
from stiction.sources.historians.tag_history import make_history
from stiction.sources.loops import Loops
from stiction.sources.roles.assign import assign_roles
from stiction.sources.signal_values import EmptySignalError
from stiction.sources.table import Clock, Origin, RawTable, TagColumn
from stiction.sources.time.stamps import Stamps

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from stiction.sources.historians.tag_history import Historian, HistorianTag, TagHistory
    from stiction.sources.options import ReadOptions
    from stiction.sources.roles.map_file import MapRow

__all__ = ["find_loops_of_historian", "historian_span", "make_loops", "open_historian"]

DEFAULT_SPAN = timedelta(days=1)
"""Time that is read when none is given."""
LOOPS_AT_ONCE = 4
"""Loops whose tags are fetched together [-]."""
QUALITY = "Quality"


def open_historian(source: str) -> Historian:
    """Make the client of an address; no connection is made yet."""
    address = parse_address(source)
    if address.kind == "opc_ua":
        from stiction.sources.historians.opc_ua import OpcUaHistorian

        return OpcUaHistorian(address)
    from stiction.sources.historians.pi_web_api import PiWebApi

    return PiWebApi(address)


def find_loops_of_historian(source: str, options: ReadOptions, rows: Sequence[MapRow] | None, **asked: Any) -> Loops:
    """Find the loops of a historian by the names of its tags; values are fetched when a loop is read.

    Parameters
    ----------
    source : str
        Address of the historian.
    options : ReadOptions
        Options of the source.
    rows : sequence of MapRow, optional
        Rows of the map: these tags alone are looked up.
    **asked
        `tags`, patterns such as ``FIC*`` or ``NAME=ADDRESS`` of known tags; `since` and `until`, as ISO 8601.

    Raises
    ------
    RecordError
        When the historian cannot be reached, or holds no loop.
    ParameterError
        When another option of databases is given.
    """
    if others := asked.keys() - {"tags", "since", "until"}:
        raise ParameterError(
            f"{', '.join(sorted(others))} can be used only with a database, not with a historian; leave it out."
        )
    span = historian_span(asked.get("since"), asked.get("until"))
    client = open_historian(source)
    tags = _find_tags(client, source, rows, asked.get("tags") or (), options)
    return make_loops(client, tags, source, span, options, rows)


def make_loops(
    client: Historian,
    tags: Sequence[HistorianTag],
    source: str,
    span: tuple[datetime, datetime],
    options: ReadOptions,
    rows: Sequence[MapRow] | None = None,
) -> Loops:
    """Make loops of tags, whose values a client gives when a loop is read.

    Raises
    ------
    RecordError
        When the tags make no loop.
    """
    since, until = span
    block = _TagBlocks(client, *span)
    note = f"Values from {since:%Y-%m-%d %H:%M:%S} to {until:%Y-%m-%d %H:%M:%S} UTC were read from {source}."
    table = RawTable(Origin(source, tags[0].name), [], [], 0, _no_rows, notes=[note])
    columns = [block.column(tag, table) for tag in tags]
    loops = assign_roles(columns, options, rows, source)
    known = {id(column): tag for column, tag in zip(columns, tags, strict=True)}
    for loop in loops:
        for role, column in loop.roles.items():
            if (limits := known[id(column)].span) is not None:
                loop.spans.setdefault(role, limits)
    of_loops = [[known[id(column)] for column in loop.roles.values()] for loop in loops]
    block.required = {loop.roles[role].name for loop in loops for role in ("op", "pv", "mv") if role in loop.roles}
    block.blocks = [
        [tag for tags in of_loops[first : first + LOOPS_AT_ONCE] for tag in tags]
        for first in range(0, len(of_loops), LOOPS_AT_ONCE)
    ]
    return Loops(options, loops, columns=columns)


def historian_span(since: Any, until: Any) -> tuple[datetime, datetime]:
    """Times to read, in UTC; the last day where none is given. A time without a zone is in that of this machine.

    Examples
    --------
    >>> [f"{one:%H:%M}" for one in historian_span("2026-03-02T06:00+01:00", "2026-03-02T08:00Z")]
    ['05:00', '08:00']
    """
    last = _moment("until", until) or datetime.now(UTC)
    first = _moment("since", since) or last - DEFAULT_SPAN
    if first >= last:
        raise ParameterError(f"since = {since} is not before until = {until}; give an earlier since.")
    return first, last


def _moment(name: str, given: Any) -> datetime | None:
    if given is None:
        return None
    try:
        if isinstance(given, (int, float)):
            return datetime.fromtimestamp(given, UTC)
        moment = given if isinstance(given, datetime) else datetime.fromisoformat(str(given))
        return moment.astimezone(UTC)
    except (ValueError, OverflowError, OSError):
        raise ParameterError(
            f"{name} = {given!r} is not a time; write it as 2026-03-02T06:00 or 2026-03-02T06:00Z."
        ) from None


def _find_tags(
    client: Historian, source: str, rows: Sequence[MapRow] | None, patterns: Sequence[str], options: ReadOptions
) -> list[HistorianTag]:
    """The tags of the map, or those of the patterns."""
    patterns = [patterns] if isinstance(patterns, str) else list(patterns)
    if rows is not None and not patterns:
        names, exact = [row.tag for row in rows], True
    else:
        exact = bool(patterns) and all(re.search(r".=.", one) and not one.startswith("ns=") for one in patterns)
        names = patterns or ([f"{options.tag}*"] if options.tag else [])
    found = client.find_tags(names, exact=exact)
    if not found:
        listed = ", ".join(names[:5])
        what = f"no tag matches {listed}" if names else "there is no tag"
        raise RecordError(f"{what}; check the names, and what this user may see.", where=source)
    return found


class _TagBlocks:
    """Histories of the tags of some loops, fetched together; the block fetched last is kept."""

    def __init__(self, client: Historian, since: datetime, until: datetime) -> None:
        self.client, self.since, self.until = client, since, until
        self.blocks: list[list[HistorianTag]] = []
        self.required: set[str] = set()
        """Names of the tags without which a loop cannot be read."""
        self._kept: dict[str, TagHistory | StictionError] = {}

    def column(self, tag: HistorianTag, table: RawTable) -> TagColumn:
        """Column of a tag, with a clock of its own."""
        clock = Clock(lambda: Stamps(self.read(tag).seconds, "utc"), _utc)
        return TagColumn(
            tag.name, table, clock, lambda: self.read(tag).values, tag.unit, tag.description,
            flags={QUALITY: lambda: self.read(tag).quality}, address=tag.address, own_clock=True,
        )  # fmt: skip

    def read(self, tag: HistorianTag) -> TagHistory:
        """History of a tag; one missing value where a tag that a loop can do without has none.

        Raises
        ------
        RecordError
            When it cannot be read, or has no value.
        """
        if tag.name not in self._kept:
            block = next((one for one in self.blocks if tag in one), [tag])
            self._kept = self.client.read(block, self.since, self.until)
        found = self._kept[tag.name]
        if isinstance(found, StictionError):
            raise found
        if found.seconds.size == 0:
            if tag.name in self.required:
                raise EmptySignalError("has no value in this time; give another since or until.", where=tag.name)
            return make_history([self.since.timestamp()], [None], ["Good"])
        return found


def _utc() -> Stamps:
    import numpy as np

    return Stamps(np.empty(0), "utc")


def _no_rows(*_: object) -> pl.DataFrame:
    raise RecordError("a historian has no columns by number; name its tags.")
