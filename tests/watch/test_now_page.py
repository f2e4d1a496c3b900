"""The page *Now*: what it shows is what the files of the watch say; alarms are acknowledged on it."""

from __future__ import annotations

import time

import pytest

from stiction.errors import ParameterError
from stiction.fleet import LoopRow
from stiction.report.now_page import now_page
from stiction.watch.alarm import read_alarms
from stiction.watch.alarm_rules import update_alarms
from stiction.watch.configuration import AlarmSettings, SourceSettings, WatchConfig
from stiction.watch.store import WatchStore


@pytest.fixture
def folder(tmp_path):
    """A watch with one lost source and one alarm with a tag that is markup."""
    store = WatchStore(tmp_path)
    counts = dict.fromkeys(("received", "filled", "late", "lost", "breaks"), 3)
    source = {"connected": False, "failure": "cannot be reached", "warning": "", "refused": {}, "tags": 6, **counts}
    store.set_fact("status", {"time": time.time(), "sources": {"opc.tcp://plant": source}, "delay_s": 90.0})
    row = LoopRow(
        tag="<b>FIC-1</b>", status="diagnosed", loop_state="in_control", probability=0.95, finding="sticks",
        priority=0.6, S=4.0, reason="It sticks.", next_step="Ramp OP.",
    )  # fmt: skip
    config = WatchConfig(source=(SourceSettings(address="data"),), alarms=AlarmSettings(raise_windows=1))
    with store.transaction():
        update_alarms(store, config, [row], time.time())
    store.close()
    return tmp_path


def test_the_page_shows_sources_alarms_and_changes(folder):
    page = now_page(folder)
    assert "The watch does not run" not in page
    assert "cannot be reached" in page
    assert "&lt;b&gt;FIC-1&lt;/b&gt;" in page
    assert "<b>FIC-1" not in page
    assert "<b>Next step:</b> Ramp OP." in page
    assert "No window has been judged yet" in page
    assert '<a href="/#/loops">Loops</a>' in page
    assert "Since yesterday: 1 new." in page
    assert 'data-alarm="' in page


def test_a_watch_that_stopped_is_reported(folder):
    store = WatchStore(folder)
    store.set_fact("status", {"time": 0.0})
    store.close()
    assert "The watch does not run; its last sign of life was never." in now_page(folder)


def test_the_server_gives_the_page_and_takes_an_acknowledgement(folder):
    from types import SimpleNamespace

    from starlette.applications import Starlette
    from starlette.testclient import TestClient

    from stiction.apps.web.now_routes import ROUTES, find_watch

    app = Starlette(routes=ROUTES)
    app.state.workspace = SimpleNamespace(audits={"a": SimpleNamespace(folder=folder / "audit")})
    client = TestClient(app)
    assert "It sticks." in client.get("/now").text
    store = WatchStore(folder, read_only=True)
    [alarm] = read_alarms(store)
    assert client.post("/now", json={"alarm": alarm.id, "who": "Ana"}).status_code == 200
    assert read_alarms(store)[0].acknowledged_by == "Ana"
    store.close()
    assert "Ana" in client.get("/now").text
    about = {"alarm": alarm.id, "who": "Bo"}
    assert client.post("/now", json=about | {"action": "comment", "text": "Spare part <ordered>."}).status_code == 200
    assert client.post("/now", json=about | {"action": "out_of_service"}).status_code == 200
    page = client.get("/now").text
    assert "Bo: Spare part &lt;ordered&gt;." in page
    assert 'data-action="in_service"' in page
    assert 'data-action="acknowledge"' not in page
    assert client.post("/now", json=about | {"action": "in_service"}).status_code == 200
    until = f"{time.localtime().tm_year + 1}-01-01"
    assert client.post("/now", json=about | {"action": "shelve", "until": until}).status_code == 200
    assert 'data-action="unshelve"' in client.get("/now").text
    with pytest.raises(ParameterError, match="until is not in the future"):
        client.post("/now", json=about | {"action": "shelve"})
    assert find_watch(app.state.workspace) == folder.absolute()
    app.state.workspace = SimpleNamespace(audits={})
    assert find_watch(app.state.workspace) is None
    assert client.get("/now").status_code == 404
