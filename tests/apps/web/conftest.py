"""A running server, and a browser whose pages fail on errors, on blocked content and on requests to elsewhere."""

from __future__ import annotations

import os
from urllib.parse import urlsplit

import pytest

from apps.web.running import ASSETS, CHROMIUM, Server, start_server


def need(condition: object, reason: str) -> None:
    """Skip a test on a machine without something; fail where everything must be there."""
    if condition:
        return
    if os.environ.get("CI"):
        pytest.fail(f"{reason}, and CI is set")
    pytest.skip(reason)


@pytest.fixture(scope="session")
def web_assets() -> None:
    """The plot library of the page."""
    need(ASSETS.is_file(), "the plot library is missing: make web-assets")


@pytest.fixture
def serve(web_assets, tmp_path):
    """Start servers; they end with the test."""
    servers: list[Server] = []

    def start(*arguments: str) -> Server:
        servers.append(start_server(*arguments, cwd=tmp_path))
        return servers[-1]

    yield start
    for server in servers:
        server.process.kill()
        server.process.communicate()


@pytest.fixture(scope="session")
def server(web_assets, tmp_path_factory):
    """One server without files, for tests that leave it as it was."""
    started = start_server(cwd=tmp_path_factory.mktemp("serve"))
    yield started
    started.process.kill()
    started.process.communicate()


@pytest.fixture(scope="module")
def browser():
    """A browser for one module: its event loop must end before other modules start browsers of their own."""
    need(CHROMIUM, "no chromium on this machine")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture
def open_page(browser):
    """Open a server's page, signed in; fail on any error, any blocked content and any request to elsewhere.

    The failures that a test expects are given as `expected`, texts of which one must stand in the complaint.
    """
    contexts, trouble = [], []

    def opened(server: Server, place: str = "", expected: tuple[str, ...] = (), **options):
        context = browser.new_context(
            **{"viewport": {"width": 1280, "height": 900}, "accept_downloads": True, **options}
        )
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(120_000)

        def complain(text: str) -> None:
            if not any(part in text for part in expected):
                trouble.append(text)

        page.on("console", lambda message: message.type in ("error", "warning") and complain(message.text))
        page.on("pageerror", lambda error: complain(str(error)))
        page.on("request", lambda request: complain_if_foreign(request.url, complain))
        page.goto(server.address)
        page.wait_for_selector("main h1")
        if place:
            page.evaluate("place => { location.hash = place; }", place)
        return page

    yield opened
    for context in contexts:
        context.close()
    assert not trouble, trouble


def complain_if_foreign(url: str, complain) -> None:
    parts = urlsplit(url)
    if parts.scheme not in ("data", "blob") and parts.hostname != "127.0.0.1":
        complain(f"request to {url}")


@pytest.fixture
def page(server, open_page):
    """The page of the session's server."""
    return open_page(server)
