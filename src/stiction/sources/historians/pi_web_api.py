"""The PI Web API as a historian: points by name, recorded values of many points a request, page by page.

References
----------
AVEVA, *PI Web API Reference*: `points/multiple`, `dataservers/{webId}/points`, `streamsets/recorded`.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError, StictionError
from stiction.sources.historians.chunks import chunks
from stiction.sources.historians.pi_requests import PiRequests, RequestTooLargeError, error_texts
from stiction.sources.historians.pi_values import PiPages, parse_item
from stiction.sources.historians.tag_history import HistorianTag, begin_with, changed_seldom

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.historians.address import HistorianAddress
    from stiction.sources.historians.tag_history import Histories

__all__ = ["PiWebApi"]

MAX_ITEMS = 40_000
"""Values of a request: tags times maxCount [-]; the server refuses 150 000, and a value takes about 1 kB as JSON."""
MAX_QUERY = 1900
"""Characters of the query of a request [-]; web servers commonly refuse 2 048."""
POINTS_PER_PAGE = 1000
"""Points of a page of a search [-]."""
POINT_FIELDS = ("WebId", "Name", "Descriptor", "EngineeringUnits", "Zero", "Span")
VALUE_FIELDS = ("Timestamp", "Value", "Good", "Questionable", "Substituted", "Errors")


@dataclass(frozen=True)
class PiWebApi:
    """The client."""

    address: HistorianAddress
    """Where the server is."""

    def find_tags(self, wanted: Sequence[str], *, exact: bool) -> list[HistorianTag]:
        """Find points by patterns such as ``FIC*``, exactly by name, or as ``NAME=WEBID``."""
        given = [HistorianTag(name, web_id) for one in wanted for name, _, web_id in [one.partition("=")] if web_id]
        if given and len(given) == len(wanted):
            return given
        with PiRequests(self.address) as server:
            archive, web_id = self._archive(server)
            if exact:
                return _find_exactly(server, archive, wanted)
            patterns = [one if "*" in one or "?" in one else f"{one}*" for one in wanted] or ["*"]
            found = {tag.name: tag for pattern in patterns for tag in _search(server, web_id, pattern)}
            return list(found.values())

    def read(self, tags: Sequence[HistorianTag], since: datetime, until: datetime) -> Histories:
        """Read the recorded values from `since` on and before `until`."""
        histories: Histories = {}
        with PiRequests(self.address) as server:
            for chunk in _by_length(tags):
                for tag, pages in _read_chunk(server, chunk, since, until).items():
                    is_failure = isinstance(pages, StictionError)
                    histories[tag.name] = pages if is_failure else pages.history(since.timestamp(), until.timestamp())
                self._begin(server, chunk, histories, since)
        return histories

    def _begin(self, server: PiRequests, tags: Sequence[HistorianTag], histories: Histories, since: datetime) -> None:
        """Let tags that changed seldom begin with the value that stood at `since`."""
        names = {tag.address: tag.name for tag in tags}
        seldom = changed_seldom(histories, tags, since.timestamp())
        if not seldom:
            return
        query = [*(("webId", one) for one in seldom), ("time", _stamp(since)), ("retrievalMode", "AtOrBefore")]
        try:
            items = server.get("streamsets/recordedattime", query).get("Items", [])
        except RecordError:  # then the tags begin with their first value
            return
        for item in items:
            value, quality = parse_item(item.get("Value") or {"Good": False})
            if value is not None and (name := names.get(str(item.get("WebId")))):
                begin_with(histories, name, since.timestamp(), value, quality)

    def _archive(self, server: PiRequests) -> tuple[str, str]:
        """Name and WebId of the data archive: the one of the address, or the only one."""
        items = server.get("dataservers", [("selectedFields", "Items.Name;Items.WebId")]).get("Items", [])
        names = [str(item["Name"]) for item in items]
        chosen = [item for item in items if item["Name"].casefold() == self.address.server.casefold()]
        if len(items) == 1 and not self.address.server:
            chosen = items
        if not chosen:
            known = ", ".join(names) or "none"
            raise RecordError(
                f"has the data archives {known}; name one as pi+https://HOST/piwebapi?server=NAME.",
                where=self.address.url,
            )
        return str(chosen[0]["Name"]), str(chosen[0]["WebId"])


def _search(server: PiRequests, web_id: str, pattern: str) -> list[HistorianTag]:
    """All points whose name matches a pattern."""
    fields = ";".join(f"Items.{one}" for one in POINT_FIELDS)
    tags: list[HistorianTag] = []
    while True:
        query = [("nameFilter", pattern), ("startIndex", len(tags)), ("maxCount", POINTS_PER_PAGE)]
        items = server.get(f"dataservers/{web_id}/points", [*query, ("selectedFields", fields)]).get("Items", [])
        tags += [_tag(item) for item in items]
        if len(items) < POINTS_PER_PAGE:
            return tags


def _find_exactly(server: PiRequests, archive: str, names: Sequence[str]) -> list[HistorianTag]:
    """Points by their names; those that are not there are left out."""
    fields = ";".join(["Items.Exception", *(f"Items.Object.{one}" for one in POINT_FIELDS)])
    paths = [name if name.startswith("\\\\") else f"\\\\{archive}\\{name}" for name in names]
    tags = []
    for chunk in chunks(paths, 25):
        query = [*(("path", path) for path in chunk), ("selectedFields", fields)]
        items = server.get("points/multiple", query).get("Items", [])
        tags += [_tag(item["Object"]) for item in items if item.get("Object")]
    return tags


def _tag(point: dict[str, Any]) -> HistorianTag:
    low, width = point.get("Zero"), point.get("Span")
    span = (float(low), float(low) + float(width)) if isinstance(low, (int, float)) and width else None
    return HistorianTag(
        str(point["Name"]), str(point["WebId"]), str(point.get("EngineeringUnits") or ""),
        str(point.get("Descriptor") or ""), span if span and span[0] < span[1] else None,
    )  # fmt: skip


def _by_length(tags: Sequence[HistorianTag]) -> list[list[HistorianTag]]:
    """Tags in chunks whose WebIds fit into one query."""
    length = max((len(tag.address) for tag in tags), default=1) + len("webId=&")
    return chunks(tags, max(1, (MAX_QUERY - 300) // length))


def _read_chunk(
    server: PiRequests, tags: Sequence[HistorianTag], since: datetime, until: datetime
) -> dict[HistorianTag, PiPages | StictionError]:
    """Pages of the tags of one query; a tag that fails costs only itself."""
    try:
        return _read_pages(server, tags, since, until)
    except RecordError as error:
        if len(tags) == 1:
            return {tags[0]: error}
        half = len(tags) // 2
        if not isinstance(error, RequestTooLargeError) and "cannot be reached" in str(error):
            return dict.fromkeys(tags, error)
        return {
            **_read_chunk(server, tags[:half], since, until),
            **_read_chunk(server, tags[half:], since, until),
        }


def _read_pages(
    server: PiRequests, tags: Sequence[HistorianTag], since: datetime, until: datetime
) -> dict[HistorianTag, PiPages | StictionError]:
    of_tags = ("WebId", "Errors", "Exception", *(f"Items.{one}" for one in VALUE_FIELDS))
    fields = ";".join(f"Items.{name}" for name in of_tags)
    by_id = {tag.address: tag for tag in tags}
    found: dict[HistorianTag, PiPages | StictionError] = {tag: PiPages() for tag in tags}
    waiting: dict[str, list[HistorianTag]] = {_stamp(since): list(tags)}
    while waiting:
        start, asked = waiting.popitem()
        most = MAX_ITEMS // len(asked)
        query = [*(("webId", tag.address) for tag in asked), ("startTime", start), ("endTime", _stamp(until))]
        query += [("maxCount", most), ("boundaryType", "Inside"), ("selectedFields", fields)]
        answered = set()
        for item in server.get("streamsets/recorded", query).get("Items", []):
            tag = by_id.get(str(item.get("WebId")))
            pages = None if tag is None else found[tag]
            if tag is None or not isinstance(pages, PiPages):
                continue
            answered.add(tag)
            if texts := error_texts(item):
                found[tag] = RecordError(f"cannot be read ({'; '.join(texts)[:200]}); check the tag.", where=tag.name)
                continue
            page = item.get("Items") or []
            try:
                new = pages.add(page)
            except RecordError as error:
                found[tag] = RecordError(error.reason, where=tag.name)
                continue
            if len(page) >= most:
                if not new:
                    found[tag] = RecordError(
                        f"has {most} values at {pages.last}; correct them in the archive.", where=tag.name
                    )
                    continue
                waiting.setdefault(pages.last, []).append(tag)
        for tag in asked:
            if tag not in answered and isinstance(found[tag], PiPages):
                found[tag] = RecordError("is not in the answer of the server; check the tag.", where=tag.name)
    return found


def _stamp(moment: datetime) -> str:
    return moment.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")
