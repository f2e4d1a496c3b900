"""What tests need beside Python: a browser and a PostgreSQL server; missing ones fail on CI and skip elsewhere."""

from __future__ import annotations

import os
import shutil
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
MARKS = {"browser": pytest.mark.browser, "postgres": pytest.mark.database}
"""The mark that a test gets from a fixture that it uses, directly or through another fixture."""


def require(condition: object, reason: str) -> None:
    """Skip a test on a machine without something; fail where everything must be there."""
    if condition:
        return
    if os.environ.get("CI"):
        pytest.fail(f"{reason}, and CI is set")
    pytest.skip(reason)


@contextmanager
def open_browser() -> Iterator[Any]:
    """Start Chromium."""
    from playwright.sync_api import sync_playwright

    require(CHROMIUM, "no chromium on this machine")
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@contextmanager
def open_postgres() -> Iterator[Any]:
    """Start a PostgreSQL server."""
    from sources.postgres import PostgresServer, has_postgres

    require(has_postgres(), "no PostgreSQL server on this machine: initdb and postgres (Debian: postgresql)")
    with PostgresServer() as server:
        yield server
