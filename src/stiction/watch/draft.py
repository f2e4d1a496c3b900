"""A commented configuration for a source, and a check of what a configuration names."""

from __future__ import annotations

import json
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
    lines = [
        f"# A watch over {len(found)} loops. Run it with: stiction watch plant.toml",
        "# Check it first with: stiction watch plant.toml --check",
        "",
        'folder = "watch"  # results, beside this file',
        'window = "4h"     # length of a window, which is judged as one record',
        "",
        "[[source]]",
        f"address = {json.dumps(source)}",
        f"tags = {json.dumps(list(tags))}  # patterns such as FIC*; all when empty" if tags else
        '# tags = ["FIC*"]  # patterns; all when not given',
        f"map = {json.dumps(map_file)}" if map_file else
        '# map = "map.csv"  # loop, role, unit and span of tags; stiction read SOURCE --write-map map.csv writes one',
        "# Loops that were found:",
        *(f"#   {tag}" for tag in found[:MAX_LISTED]),
        *([f"#   and {len(found) - MAX_LISTED} more"] if len(found) > MAX_LISTED else []),
        "",
        "[alarms]",
        "raise_at = 0.8     # probability of stiction",
        "raise_windows = 2  # consecutive windows",
        "clear_windows = 3",
        "max_per_day = 10   # further new alarms are in the digest alone",
        'digest = "daily"',
        "",
        "# [[channel]]",
        '# kind = "webhook"',
        '# url = "https://host/path"',
        "",
        "# [[channel]]",
        '# kind = "smtp"',
        '# host = "mail.plant:587"',
        '# sender = "stiction@plant"',
        '# to = ["maintenance@plant"]',
        "",
        "# [metrics]",
        "# port = 9464",
        "",
    ]  # fmt: skip
    return "\n".join(lines)


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
