"""The tags of a live source that make loops."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stiction.watch.configuration import SourceSettings

__all__ = ["find_watched_tags"]


def find_watched_tags(settings: SourceSettings) -> dict[str, dict[str, Any]]:
    """Find the tags of the loops of a source: address -> name, unit, description, span.

    Raises
    ------
    RecordError
        When the source cannot be reached, or holds no loop.
    """
    from stiction.sources import open_loops
    from stiction.sources.historians.historian_loops import open_historian

    loops = open_loops(settings.address, tags=list(settings.tags) or None, map=settings.map or None, **settings.reading)
    columns = [column for loop in loops.roles for column in loop.roles.values()]
    given = [f"{column.name}={column.address}" for column in columns]
    tags = open_historian(settings.address).find_tags(given, exact=True)
    return {tag.address: asdict(tag) for tag in tags}
