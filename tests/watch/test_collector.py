"""Collecting: each value that the history of the server kept is there once, in order, through breaks of the server."""

from __future__ import annotations

import asyncio
import time
from contextlib import suppress
from datetime import UTC, datetime

import numpy as np
import pytest

from sources.opc_ua_plant import OpcUaPlant
from stiction.watch.collector import Collector
from stiction.watch.configuration import SourceSettings
from stiction.watch.samples import SampleFiles
from stiction.watch.store import WatchStore

pytestmark = pytest.mark.processes
LENGTH_S = 3600.0


@pytest.fixture(autouse=True)
def _own_settings(tmp_path, monkeypatch):
    monkeypatch.setenv("STICTION_CONFIG", str(tmp_path / "settings"))


def make(folder, plant, begin, **settings):
    (folder / "samples").mkdir(exist_ok=True)
    store = WatchStore(folder)
    samples = SampleFiles(folder / "samples", LENGTH_S)
    samples.mend()
    chosen = SourceSettings(address=plant.url, publishing="0.2s", **settings)
    return Collector(chosen, samples, store, max(begin, store.last_window_end())), store


def kept(plant) -> dict[str, list[tuple[int, float, int]]]:
    """The list of values that the history of the server kept: microseconds, value, status."""
    names = {node.to_string(): tag for tag, node in plant.nodes.items()}
    return {
        names[node]: [
            (round(1e6 * one.SourceTimestamp.timestamp()), one.Value.Value, one.StatusCode.value) for one in rows
        ]
        for node, rows in plant.kept.items()
    }


def collected(collector, store) -> dict[str, list[tuple[int, float, int]]]:
    names = {number: body["name"] for number, body in store.tags(collector.settings.address).items()}
    found: dict[str, list[tuple[int, float, int]]] = {name: [] for name in names.values()}
    for start in collector.samples.windows():
        rows, _ = collector.samples.read(start)
        for one in rows:
            found[names[int(one["tag"])]].append((int(one["stamp"]), float(one["value"]), int(one["status"])))
    return found


async def drive(plant, ended: asyncio.Event) -> None:
    """Write values at 10 Hz; what a stopped server does not take is not in its history."""
    k = 0
    while not ended.is_set():
        now = datetime.now(UTC)
        for tag in ("FIC-101.PV", "FIC-101.OP"):
            status = 0x80310000 if k % 17 == 3 else 0
            with suppress(Exception):
                future = asyncio.run_coroutine_threadsafe(plant.write_now(tag, 50.0 + k, now, status), plant._loop)
                await asyncio.wait_for(asyncio.wrap_future(future), 1.0)
        k += 1
        await asyncio.sleep(0.1)


async def flush_until(collector, is_done, limit_s=30.0) -> None:
    end = time.monotonic() + limit_s
    while not is_done():
        assert time.monotonic() < end, collector.failure
        await asyncio.sleep(0.1)
        await collector.flush(0)


def test_breaks_of_the_server_leave_no_hole(tmp_path, monkeypatch):
    monkeypatch.setattr("stiction.watch.collector.SETTLE_S", 0.5)

    async def run(plant) -> None:
        collector, store = make(tmp_path, plant, time.time_ns() // 1000)
        task = asyncio.create_task(collector.run())
        await flush_until(collector, lambda: collector.is_current)
        ended = asyncio.Event()
        driving = asyncio.create_task(drive(plant, ended))
        await asyncio.sleep(1.5)
        await collector.flush(0)
        await asyncio.to_thread(plant.stop)
        await asyncio.to_thread(plant.start)
        await flush_until(collector, lambda: collector.is_current and collector.counts["breaks"] >= 1)
        await asyncio.sleep(1.0)
        ended.set()
        await driving
        await asyncio.sleep(0.5)
        await collector.flush(0)
        task.cancel()
        # nodes begin with 0 at each start of the server
        stored = {tag: [one for one in rows if one[1] != 0.0] for tag, rows in kept(plant).items()}
        expected = {tag: rows for tag, rows in stored.items() if rows}
        found = {tag: rows for tag, rows in collected(collector, store).items() if tag in expected}
        store.close()
        for tag, rows in expected.items():
            assert len(rows) > 15
            mine = [one for one in found[tag] if one[0] >= rows[0][0]]
            live = {stamp for stamp, *_ in rows}
            others = [one for one in mine if one[0] not in live]
            assert len(others) <= 3  # the first value after each start of the server, which its history does not keep
            assert [(stamp, status) for stamp, _, status in mine if stamp in live] == [(s, c) for s, _, c in rows]
            good = [(stamp, value) for stamp, value, status in mine if stamp in live and not status]
            assert good == [(stamp, value) for stamp, value, status in rows if not status]
        assert any(status for rows in expected.values() for *_, status in rows)

    with OpcUaPlant(1) as plant:
        asyncio.run(run(plant))


def test_a_tag_that_vanishes_while_connected_is_named_and_collected_again_when_it_is_back(tmp_path, monkeypatch):
    monkeypatch.setattr("stiction.watch.collector.SETTLE_S", 0.2)
    monkeypatch.setattr("stiction.watch.collector.TAGS_CHECK_S", 0.3)

    async def run(plant) -> None:
        collector, store = make(tmp_path, plant, time.time_ns() // 1000)
        task = asyncio.create_task(collector.run())
        await flush_until(collector, lambda: collector.is_current)
        await asyncio.to_thread(plant.delete, "FIC-101.PV")
        await flush_until(collector, lambda: collector.missing)
        assert collector.missing == {plant.nodes["FIC-101.PV"].to_string(): "BadNodeIdUnknown"}
        assert collector.is_current  # the other tags are collected as before
        await asyncio.to_thread(plant.write, "FIC-101.OP", 7.0, datetime.now(UTC))
        await asyncio.to_thread(plant.add_again, "FIC-101.PV")
        await flush_until(collector, lambda: not collector.missing and collector.is_current)
        await asyncio.to_thread(plant.write, "FIC-101.PV", 51.0, datetime.now(UTC))
        await flush_until(
            collector, lambda: [v for _, v, _ in collected(collector, store)["FIC-101.PV"][-1:]] == [51.0]
        )
        assert collected(collector, store)["FIC-101.OP"][-1][1] == 7.0
        assert not collector.missing
        task.cancel()
        store.close()

    with OpcUaPlant(1) as plant:
        asyncio.run(run(plant))


def test_what_was_missed_while_the_watch_was_killed_is_read_from_history(tmp_path, monkeypatch):
    monkeypatch.setattr("stiction.watch.collector.SETTLE_S", 0.2)

    async def once(plant, begin, rows) -> dict[str, list[tuple[int, float, int]]]:
        """Collect, then end as a kill does: nothing is closed."""
        collector, store = make(tmp_path, plant, begin)
        task = asyncio.create_task(collector.run())
        await flush_until(collector, lambda: collector.is_current)
        for moment, value in rows:
            await asyncio.to_thread(plant.write, "FIC-101.PV", value, moment)
        await asyncio.sleep(0.6)
        await collector.flush(0)
        found = collected(collector, store)
        task.cancel()
        store.close()
        return found

    with OpcUaPlant(1) as plant:
        begin = time.time_ns() // 1000
        asyncio.run(once(plant, begin, [(datetime.now(UTC), 1.0)]))
        for value in (2.0, 3.0):
            plant.write("FIC-101.PV", value, datetime.now(UTC))
        with next((tmp_path / "samples").iterdir()).open("ab") as file:
            file.write(b"half a block")
        found = asyncio.run(once(plant, begin, [(datetime.now(UTC), 4.0)]))
        values = [value for _, value, _ in found["FIC-101.PV"] if value]
    np.testing.assert_array_equal(values, [1.0, 2.0, 3.0, 4.0])


def test_a_full_disk_loses_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("stiction.watch.collector.SETTLE_S", 0.2)

    async def run(plant) -> list[float]:
        collector, store = make(tmp_path, plant, time.time_ns() // 1000)
        task = asyncio.create_task(collector.run())
        await flush_until(collector, lambda: collector.is_current)
        plain, fails = collector.samples.append, [True]

        def append(*arguments):
            if fails[0]:
                raise OSError(28, "No space left on device")
            return plain(*arguments)

        monkeypatch.setattr(collector.samples, "append", append)
        for value in (1.0, 2.0):
            await asyncio.to_thread(plant.write, "FIC-101.PV", value, datetime.now(UTC))
            await asyncio.sleep(0.5)
            await collector.flush(0)
            assert "No space left on device" in collector.failure
        fails[0] = False
        await collector.flush(0)
        found = collected(collector, store)
        task.cancel()
        store.close()
        return [value for _, value, _ in found["FIC-101.PV"] if value]

    with OpcUaPlant(1) as plant:
        assert asyncio.run(run(plant)) == [1.0, 2.0]


@pytest.mark.parametrize("refused", ["nodes", "service"])
def test_a_hole_that_no_history_fills_is_named_as_a_gap(tmp_path, monkeypatch, refused):
    monkeypatch.setattr("stiction.watch.collector.SETTLE_S", 0.2)

    async def run(plant) -> None:
        collector, store = make(tmp_path, plant, time.time_ns() // 1000)
        before = time.time_ns() // 1000
        task = asyncio.create_task(collector.run())
        await flush_until(collector, lambda: collector.is_current)
        await asyncio.sleep(0.2)
        after = time.time_ns() // 1000
        minute = 60_000_000
        assert collector.has_gap(before - minute, after)
        assert not collector.has_gap(after, after + minute)
        assert not collector.has_gap(before - 2 * minute, before - minute)
        task.cancel()
        store.close()

    plant = OpcUaPlant(1)
    plant.refuse_history = refused
    with plant:
        asyncio.run(run(plant))
