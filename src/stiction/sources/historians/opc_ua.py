"""An OPC UA server as a historian: its tags by browsing, their values by HistoryRead."""

from __future__ import annotations

import fnmatch
from dataclasses import dataclass
from typing import TYPE_CHECKING

from stiction.errors import RecordError
from stiction.sources.historians.opc_ua_browse import browse_variables, describe_tags
from stiction.sources.historians.opc_ua_connection import connect
from stiction.sources.historians.opc_ua_history import RawValue, quality_word, read_last_before, read_pages
from stiction.sources.historians.run_async import run_async
from stiction.sources.historians.tag_history import HistorianTag, begin_with, changed_seldom, make_history

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    from asyncua.client.client import Client

    from stiction.errors import StictionError
    from stiction.sources.historians.address import HistorianAddress
    from stiction.sources.historians.tag_history import Histories, TagHistory

__all__ = ["OpcUaHistorian", "choose_tags", "find_opc_ua_tags"]

NO_HISTORY = ("BadHistoryOperationUnsupported", "BadServiceUnsupported", "BadUserAccessDenied", "BadNotReadable")


@dataclass(frozen=True)
class OpcUaHistorian:
    """The client; each call connects anew."""

    address: HistorianAddress
    """Where the server is."""

    def find_tags(self, wanted: Sequence[str], *, exact: bool) -> list[HistorianTag]:
        """Find tags by patterns, exactly by name, or as ``NAME=NODEID``."""

        async def find() -> list[HistorianTag]:
            async with connect(self.address) as client:
                return await find_opc_ua_tags(client, wanted, exact=exact)

        return run_async(find())

    def read(self, tags: Sequence[HistorianTag], since: datetime, until: datetime) -> Histories:
        """Read the values from `since` on and before `until`."""

        async def read() -> Histories:
            raw: dict[str, list[RawValue] | str] = {tag.address: [] for tag in tags}
            async with connect(self.address) as client:
                async for node, page in read_pages(client, dict.fromkeys(raw, since), until):
                    kept = raw[node]
                    if isinstance(kept, list) and isinstance(page, list):
                        kept += page
                    else:
                        raw[node] = page
                found = {tag.name: self._history(tag, raw[tag.address], until.timestamp()) for tag in tags}
                seldom = changed_seldom(found, tags, since.timestamp())
                names = {tag.address: tag.name for tag in tags}
                for node, one in (await read_last_before(client, seldom, since)).items():
                    begin_with(found, names[node], since.timestamp(), one.value, quality_word(one.status))
                return found

        return run_async(read())

    def _history(self, tag: HistorianTag, answer: list[RawValue] | str, end: float) -> TagHistory | StictionError:
        if isinstance(answer, str):
            remedy = "let the server keep its history" if answer in NO_HISTORY else "check the node on the server"
            return RecordError(
                f"the history of {tag.name} cannot be read ({answer})", remedy=remedy, where=self.address.url
            )
        rows = [one for one in answer if one.seconds < end]
        words = {status: quality_word(status) for status in {row.status for row in rows}}
        return make_history(
            [row.seconds for row in rows], [row.value for row in rows], [words[row.status] for row in rows]
        )


async def find_opc_ua_tags(client: Client, wanted: Sequence[str], *, exact: bool) -> list[HistorianTag]:
    """Find the tags of a connected server, with their units, descriptions and ranges."""
    given = [HistorianTag(name, node) for one in wanted for name, _, node in [one.partition("=")] if node]
    if given and len(given) == len(wanted):
        return await describe_tags(client, given)
    return await describe_tags(client, choose_tags(await browse_variables(client), wanted, exact=exact))


def choose_tags(tags: Sequence[HistorianTag], wanted: Sequence[str], *, exact: bool) -> list[HistorianTag]:
    """Choose tags by name or node id; a pattern without a wildcard is the beginning of a name.

    Examples
    --------
    >>> tags = [HistorianTag("FIC-101.PV", "ns=2;i=7"), HistorianTag("TIC-2.PV", "ns=2;i=8")]
    >>> [one.name for one in choose_tags(tags, ["fic*"], exact=False)]
    ['FIC-101.PV']
    """
    if not wanted:
        return list(tags)
    names = {one.casefold() for one in wanted}
    if exact:
        return [tag for tag in tags if tag.name.casefold() in names or tag.address.casefold() in names]
    patterns = [name if any(mark in name for mark in "*?[") else f"{name}*" for name in names]
    return [tag for tag in tags if any(fnmatch.fnmatchcase(tag.name.casefold(), pattern) for pattern in patterns)]
