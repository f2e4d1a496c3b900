"""Pictures of screens, and what tests of screens need to know of a served audit."""

from __future__ import annotations

import os
from pathlib import Path

SCREENSHOTS = os.environ.get("STICTION_SCREENSHOTS")
"""Folder for pictures of the screens; none are kept without it."""


def picture(page, name: str) -> None:
    if SCREENSHOTS:
        Path(SCREENSHOTS).mkdir(parents=True, exist_ok=True)
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            page.wait_for_timeout(300)
            page.screenshot(path=f"{SCREENSHOTS}/{name}-{scheme}.png", full_page=True)
        page.emulate_media(color_scheme="light")


def first_key(server) -> str:
    return str(server.call("GET", "/api/sets/audit1/rows?since=0").json["rows"][0]["key"])
