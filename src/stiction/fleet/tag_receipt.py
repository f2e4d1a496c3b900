"""Tags of the map and of the connections that the source does not have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Sequence

__all__ = ["find_missing_tags"]


def find_missing_tags(
    loops: Iterable[str],
    map_file: str | os.PathLike[str] | None,
    connections: Sequence[tuple[str, str]],
) -> dict[str, list[str]]:
    """Find the tags of a map and of connections that a source does not have.

    `loops`: tags of all loops of the source. `connections`: tags of loops that a stream or a signal connects. Gives
    `map_tags` and `connection_tags`, each in the order of its file. Raises RecordError when no tag of the connections
    is a loop.

    Examples
    --------
    >>> find_missing_tags(["FIC-1", "LIC-2"], None, [("FIC-1", "LIC-2"), ("FIC-1", "LIC-3")])
    {'map_tags': [], 'connection_tags': ['LIC-3']}
    """
    known = {tag.casefold() for tag in loops}
    rows: list[Any] = []
    if map_file is not None:
        from stiction.sources.roles.map_file import read_map

        rows = read_map(map_file)
    named = list(dict.fromkeys(tag for link in connections for tag in link))
    missing = [tag for tag in named if tag.casefold() not in known]
    if named and len(missing) == len(named):
        raise RecordError(
            f"connections: none of its {len(named)} tags is a loop ({', '.join(named[:5])}, ...); write the tags "
            "of loops, which `stiction read` lists."
        )
    return {"map_tags": [row.tag for row in rows if row.loop.casefold() not in known], "connection_tags": missing}
