"""A commented configuration for a source, and a check of what a configuration names."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import TYPE_CHECKING

from stiction.errors import StictionError
from stiction.sources import open_loops

if TYPE_CHECKING:
    from stiction.watch.configuration import WatchConfig

__all__ = ["check_configuration", "draft_configuration"]

MAX_LISTED = 200
"""Loops that a configuration lists [-]."""


def draft_configuration(source: str, tags: tuple[str, ...] = (), map_file: str = "") -> str:
    """Browse a source and write the configuration of a watch over its loops.

    Raises
    ------
    RecordError
        When the source cannot be reached, or holds no loop.
    """
    chosen = {"tags": list(tags), "map": map_file}
    loops = open_loops(source, **{name: value for name, value in chosen.items() if value})
    found = loops.tags
    listed = [*found[:MAX_LISTED], *([f"and {len(found) - MAX_LISTED} more"] if len(found) > MAX_LISTED else [])]
    return files("stiction.watch").joinpath("draft.toml").read_text("utf-8").format(
        count=len(found), address=json.dumps(source), loops="\n".join(f"#   {one}" for one in listed),
        tags=f"tags = {json.dumps(list(tags))}" if tags else '# tags = ["FIC*"]',
        map=f"map = {json.dumps(map_file)}" if map_file else '# map = "map.csv"',
    )  # fmt: skip


def check_configuration(config: WatchConfig) -> list[tuple[str, bool, str]]:
    """Try every source and channel: name, whether it works, and what was found."""
    found = []
    for source in config.source:
        options = {"map": source.map or None, **source.reading}
        if "://" in source.address and source.tags:
            options["tags"] = list(source.tags)
        try:
            tags = open_loops(source.address, **options).tags
            found.append((source.address, True, f"{len(tags)} loops, from {tags[0]} to {tags[-1]}"))
        except StictionError as error:
            found.append((source.address, False, str(error)))
    for channel in config.channel:
        from stiction.watch.channels import send

        body = {"id": "check", "event": "check", "title": "Check of stiction watch", "text": "This channel works."}
        try:
            send(channel, body)
            found.append((channel.name, True, "took a message"))
        except StictionError as error:
            found.append((channel.name, False, str(error)))
    return found
