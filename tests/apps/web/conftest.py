"""A running server, and a browser whose pages fail on errors, on blocked content and on requests to elsewhere."""

from __future__ import annotations

from urllib.parse import urlsplit

import pytest

import stiction as st
from apps.web.running import ASSETS, Server, start_server
from services import require
from stiction.records.parquet_writer import to_parquet


@pytest.fixture(scope="session")
def web_assets() -> None:
    """The plot library of the page."""
    require(ASSETS.is_file(), "the plot library is missing: make web-assets")


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


@pytest.fixture(scope="session")
def audit_folder(tmp_path_factory):
    """An audit of four loops, two of which share an oscillation's period, and an earlier one."""
    folder = tmp_path_factory.mktemp("audit")
    records = []
    for k, valve in enumerate([st.Kano(5.0, 2.0), st.Kano(4.0, 1.5), st.Ideal(), st.Ideal()]):
        loop = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
        records.append(
            st.simulate(
                loop, 150.0, 2400.0, seed=k, pv_start=148.0, op_start=50.0, tag=f"FIC-{101 + k}", loop_type="flow"
            )
        )
    to_parquet(records, folder / "plant.parquet")
    st.audit(folder / "plant.parquet", folder / "now", workers=1)
    to_parquet(records[1:], folder / "before.parquet")
    st.audit(folder / "before.parquet", folder / "before", workers=1)
    return folder


@pytest.fixture(scope="session")
def audit_server(web_assets, audit_folder):
    """A server with the audit, for tests that leave it as it was."""
    started = start_server(str(audit_folder / "now"), cwd=audit_folder)
    yield started
    started.process.kill()
    started.process.communicate()
