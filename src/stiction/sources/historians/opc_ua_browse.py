"""The variables of an OPC UA server, with names, units, descriptions and ranges."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from stiction.errors import import_extra
from stiction.sources.historians.chunks import chunks
from stiction.sources.historians.tag_history import HistorianTag
from stiction.sources.layouts.headings import parse_role
from stiction.sources.roles.pair_groups import parse_instrument_tag

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from asyncua import ua
    from asyncua.client.client import Client

__all__ = ["browse_variables", "describe_tags"]

NODES_PER_CALL = 200
"""Nodes that are browsed or read with one call [-]."""
MAX_NODES = 500_000
"""Nodes after which browsing ends [-]."""
SERVER_OBJECT = 2253
"""Number of the node that describes the server itself."""


@dataclass(frozen=True)
class _Place:
    """A node and the names on the way to it."""

    node: ua.NodeId
    path: tuple[str, ...]


async def browse_variables(client: Client) -> list[HistorianTag]:
    """Find all variables below the folder Objects; names are made of the browse names.

    A variable whose name has no loop, such as ``PV``, takes the name of its parent: ``FIC-101.PV``. Where two variables
    then have one name, the names of further parents stand before them.
    """
    ua = import_extra("asyncua.ua", "live")

    start = ua.NodeId(ua.ObjectIds.ObjectsFolder)
    seen = {start, ua.NodeId(SERVER_OBJECT)}
    level, variables = [_Place(start, ())], []
    while level and len(seen) < MAX_NODES:
        following = []
        for place, reference in await _browse(client, level, ua.ObjectIds.HierarchicalReferences):
            node = ua.NodeId(reference.NodeId.Identifier, reference.NodeId.NamespaceIndex)
            if node in seen or reference.ReferenceTypeId.Identifier == ua.ObjectIds.HasProperty:
                continue
            seen.add(node)
            child = _Place(node, (*place.path, str(reference.BrowseName.Name)))
            following.append(child)
            if reference.NodeClass == ua.NodeClass.Variable and node.NamespaceIndex > 0:
                variables.append(child)
        level = following
    short = [_short_name(place.path) for place in variables]
    count = Counter(short)
    names = [
        name if count[name] == 1 else "/".join((*place.path[:-2], name))
        for name, place in zip(short, variables, strict=True)
    ]
    return [HistorianTag(name, place.node.to_string()) for name, place in zip(names, variables, strict=True)]


def _short_name(path: Sequence[str]) -> str:
    """Name of a variable: its own where it names a loop, else with its parent."""
    pair = parse_role(path[-1])
    if len(path) < 2 or (pair and pair[0]) or parse_instrument_tag(path[-1]):
        return path[-1]
    return f"{path[-2]}.{path[-1]}"


async def describe_tags(client: Client, tags: Sequence[HistorianTag]) -> list[HistorianTag]:
    """Add to tags what the server says of them: description, EngineeringUnits, EURange."""
    ua = import_extra("asyncua.ua", "live")

    places = [_Place(ua.NodeId.from_string(tag.address), ()) for tag in tags]
    properties: dict[tuple[int, str], ua.NodeId] = {}
    number = {place.node: k for k, place in enumerate(places)}
    for place, reference in await _browse(client, places, ua.ObjectIds.HasProperty):
        name = str(reference.BrowseName.Name)
        if name in ("EngineeringUnits", "EURange"):
            node = ua.NodeId(reference.NodeId.Identifier, reference.NodeId.NamespaceIndex)
            properties[number[place.node], name] = node
    values = dict(zip(properties, await _read(client, list(properties.values()), ua.AttributeIds.Value), strict=True))
    descriptions = await _read(client, [place.node for place in places], ua.AttributeIds.Description)
    described = []
    for k, (tag, text) in enumerate(zip(tags, descriptions, strict=True)):
        unit = getattr(getattr(values.get((k, "EngineeringUnits")), "DisplayName", None), "Text", None)
        limits = values.get((k, "EURange"))
        low, high = getattr(limits, "Low", 0.0), getattr(limits, "High", 0.0)
        span = (float(low), float(high)) if low < high else None
        about = {"unit": str(unit or ""), "description": str(getattr(text, "Text", None) or ""), "span": span}
        described.append(replace(tag, **about))
    return described


async def _browse(client: Client, places: Sequence[_Place], kind: int) -> Iterable[tuple[_Place, Any]]:
    """References of nodes, in calls of many nodes, and of many pages where the server limits them."""
    ua = import_extra("asyncua.ua", "live")

    found: list[tuple[_Place, Any]] = []
    for chunk in chunks(places, NODES_PER_CALL):
        asked = ua.BrowseParameters(RequestedMaxReferencesPerNode=0)
        asked.NodesToBrowse = [
            ua.BrowseDescription(
                NodeId=place.node, BrowseDirection=ua.BrowseDirection.Forward, ReferenceTypeId=ua.NodeId(kind),
                IncludeSubtypes=True, NodeClassMask=0, ResultMask=ua.BrowseResultMask.All,
            )
            for place in chunk
        ]  # fmt: skip
        waiting = list(zip(chunk, await client.uaclient.browse(asked), strict=True))
        while waiting:
            found += [(place, reference) for place, result in waiting for reference in result.References or []]
            more = [(place, result.ContinuationPoint) for place, result in waiting if result.ContinuationPoint]
            if not more:
                break
            following = ua.BrowseNextParameters(
                ReleaseContinuationPoints=False, ContinuationPoints=[point for _, point in more]
            )
            results = await client.uaclient.browse_next(following)
            waiting = [(place, result) for (place, _), result in zip(more, results, strict=True)]
    return found


async def _read(client: Client, nodes: Sequence[ua.NodeId], attribute: Any) -> list[Any]:
    """An attribute of nodes, None where a node has none."""
    values: list[Any] = []
    for chunk in chunks(nodes, NODES_PER_CALL):
        found = await client.uaclient.read_attributes(chunk, attribute)
        values += [one.Value.Value if one.Value is not None else None for one in found]
    return values
