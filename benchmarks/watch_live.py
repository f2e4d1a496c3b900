"""A watch on a server of this machine: `python benchmarks/watch_live.py load|restarts|kills FOLDER`.

load: many loops at 1 Hz; processor time and memory of the collecting process, values lost, delay of the verdicts.
restarts: the server is restarted at random moments; each value that its history kept is there once, in order.
kills: the watch is killed at random moments; no window, value or alarm is lost or counted twice.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import suppress
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[0] = str(ROOT / "tests")  # instead of this folder, which has a page `sources` too

CONFIG = """\
window = "{window}"
workers = 2
[[source]]
address = "{url}"
publishing = "1s"
[alarms]
raise_windows = 1
max_per_day = 1000
[[channel]]
kind = "webhook"
url = "{hook}"
"""


def serve(port: int, loops: int, seconds: float, report: Path) -> None:
    """Serve loops whose values change once a second, without a history, and note how many were written."""
    from asyncua import Server, ua

    async def run() -> None:
        server = Server()
        await server.init()
        server.set_endpoint(f"opc.tcp://127.0.0.1:{port}/plant")
        server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
        index = await server.register_namespace("urn:plant")
        nodes = []
        for k in range(loops):
            loop = await server.nodes.objects.add_object(index, f"FIC-{1000 + k}")
            nodes += [(await loop.add_variable(index, role, 50.0)).nodeid for role in ("PV", "SP", "OP")]
        await server.start()
        print("ready", flush=True)
        rng, written, begin = np.random.default_rng(0), 0, time.monotonic()
        levels = np.full(len(nodes), 50.0)
        while (passed := time.monotonic() - begin) < seconds:
            levels += rng.normal(size=levels.size) / 10.0
            stamp = datetime.now(UTC)
            for number, (node, value) in enumerate(zip(nodes, levels.tolist(), strict=True)):
                shown = 50.0 if number % 3 == 1 else value  # a constant set point
                data = ua.DataValue(ua.Variant(shown, ua.VariantType.Double), SourceTimestamp=stamp)
                await server.write_attribute_value(node, data)
                if number % 200 == 199:
                    await asyncio.sleep(0)
            written += len(nodes)
            report.write_text(json.dumps({"written": written, "last": stamp.timestamp()}))
            await asyncio.sleep(max(0.0, 1.0 - (time.monotonic() - begin - passed)))
        await asyncio.sleep(3600.0)

    asyncio.run(run())


def start_watch(file: Path) -> subprocess.Popen:
    """Start the watch as a user does."""
    return subprocess.Popen([sys.executable, "-m", "stiction", "watch", str(file)], stderr=subprocess.DEVNULL)


def cpu_and_memory(pid: int) -> tuple[float, float]:
    """Processor time [s] and largest memory [MB] of a process, without those that it started."""
    cells = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    status = Path(f"/proc/{pid}/status").read_text()
    memory = next(float(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM"))
    return (int(cells[11]) + int(cells[12])) / os.sysconf("SC_CLK_TCK"), memory / 1024.0


def status_of(folder: Path) -> dict:
    from stiction.watch.store import WatchStore

    store = WatchStore(folder / "watch", read_only=True)
    try:
        return store.fact("status", {}) | {"windows": store.query("SELECT * FROM window ORDER BY start")}
    finally:
        store.close()


def load(folder: Path, loops: int, seconds: float, window: str) -> None:
    """Collect from many loops."""
    from sources.opc_ua_plant import free_port

    port, report = free_port(), folder / "server.json"
    arguments = [sys.executable, __file__, "serve", str(folder), "--port", str(port), "--loops", str(loops)]
    server = subprocess.Popen([*arguments, "--seconds", str(seconds)], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    assert server.stdout.readline().strip() == "ready"
    file = folder / "plant.toml"
    file.write_text(CONFIG.format(window=window, url=f"opc.tcp://127.0.0.1:{port}/plant", hook="http://127.0.0.1:9/"))
    watch = start_watch(file)
    url, figures = f"opc.tcp://127.0.0.1:{port}/plant", []
    end = time.monotonic() + seconds
    first = None
    while time.monotonic() < end:
        time.sleep(10.0)
        with suppress(Exception):
            source = status_of(folder)["sources"][url]
            now = (time.monotonic(), cpu_and_memory(watch.pid)[0], source["received"])
            if source["connected"]:
                first = first or now
                figures.append(now)
                print(f"{now[2]} values, {cpu_and_memory(watch.pid)[1]:.0f} MB", flush=True)
    known = status_of(folder)
    last, memory = figures[-1], cpu_and_memory(watch.pid)[1]
    delays = [row["judged"] - row["finish"] / 1e6 for row in known["windows"] if row["judged"]]
    watch.send_signal(signal.SIGTERM)
    began = time.monotonic()
    watch.wait(30)
    server.kill()
    values = last[2] - first[2]
    print(json.dumps({
        "loops": loops, "values a second": values / (last[0] - first[0]),
        "processor time of the collector [% of a core]": 100.0 * (last[1] - first[1]) / (last[0] - first[0]),
        "processor time [us a value]": 1e6 * (last[1] - first[1]) / values, "memory [MB]": memory,
        "delays from the end of a window to its verdict [s]": delays,
        "ends after SIGTERM [s]": time.monotonic() - began,
        **{name: known["sources"][url][name] for name in ("received", "lost", "late", "breaks")},
        "server": json.loads(report.read_text()),
    }, indent=1))  # fmt: skip


def restarts(folder: Path, count: int, seconds: float, server: str) -> None:
    """Restart the server at random moments while it is written to at 10 Hz."""
    from sources.node_opcua_plant import NodeOpcuaPlant
    from sources.opc_ua_plant import OpcUaPlant
    from stiction.sources.historians.address import parse_address
    from stiction.sources.historians.opc_ua_connection import trust_server
    from watch.test_collector import collected, drive, kept, make

    is_node = server == "node-opcua"
    plant = NodeOpcuaPlant(folder / "history.jsonl") if is_node else OpcUaPlant(1)
    plant.start()

    async def run() -> None:
        await trust_server(parse_address(plant.url))
        collector, store = make(folder, plant, time.time_ns() // 1000, **({"sampling": "0.05s"} if is_node else {}))
        task, ended = asyncio.create_task(collector.run()), asyncio.Event()

        async def flush_for(wait_s: float, is_done=lambda: False) -> None:
            end = time.monotonic() + wait_s
            while time.monotonic() < end and not is_done():
                await asyncio.sleep(0.2)
                await collector.flush(0)

        await flush_for(60.0, lambda: collector.is_current)
        driving = None if is_node else asyncio.create_task(drive(plant, ended))
        rng = random.Random(1)
        begin, first = time.monotonic(), time.time_ns() // 1000
        for moment in sorted(rng.uniform(0.0, seconds) for _ in range(count)):
            await flush_for(moment - (time.monotonic() - begin))
            await asyncio.to_thread(plant.stop)
            await asyncio.to_thread(plant.start)
        await flush_for(seconds - (time.monotonic() - begin))
        await flush_for(60.0, lambda: collector.is_current)
        last = time.time_ns() // 1000
        ended.set()
        if driving:
            await driving
        await flush_for(8.0)
        task.cancel()
        written, rows = plant.written() if is_node else kept(plant), collected(collector, store)
        for tag in ("FIC-101.PV", "FIC-101.OP"):
            wanted = [(k, status) for k, value, status in written[tag] if first <= k < last and value]
            stamps = {k for k, _ in wanted}
            inside = [(k, status) for k, _, status in rows[tag] if first <= k < last]
            mine = [one for one in inside if one[0] in stamps]
            print(json.dumps({
                "tag": tag, "kept by the history": len(wanted), "lost": sum((Counter(wanted) - Counter(mine)).values()),
                "double": sum((Counter(mine) - Counter(wanted)).values()), "in order": mine == wanted,
                "others": len(inside) - len(mine), **collector.counts,
            }))  # fmt: skip
        store.close()

    asyncio.run(run())
    plant.stop()


def kills(folder: Path, count: int, seconds: float) -> None:
    """Kill the watch at random moments while four sticky loops are served at 5 Hz."""
    from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

    import stiction as st
    from sources.opc_ua_plant import OpcUaPlant
    from stiction.watch.alarm import read_alarms
    from stiction.watch.store import WatchStore

    taken: list[tuple[str, str]] = []

    class Hook(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            taken.append((body["id"], body["event"]))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    hook = ThreadingHTTPServer(("127.0.0.1", 0), Hook)
    threading.Thread(target=hook.serve_forever, daemon=True).start()
    loop = st.Loop(st.PID(0.2, 2.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 2.0, 2.0), dt=0.2)
    record = st.simulate(loop, sp=10.0, duration=3600.0)
    with OpcUaPlant(4) as plant:
        ended = threading.Event()

        async def drive() -> None:
            k = 0
            while not ended.is_set():
                now = datetime.now(UTC)
                for j in range(4):
                    for role, x in (("PV", record.pv), ("OP", record.op)):
                        await plant.write_now(f"FIC-{101 + j}.{role}", float(x[k]), now)
                k += 1
                await asyncio.sleep(0.2)

        asyncio.run_coroutine_threadsafe(drive(), plant._loop)
        file = folder / "plant.toml"
        url = f"http://127.0.0.1:{hook.server_port}/"
        file.write_text(CONFIG.format(window="20s", url=plant.url, hook=url))
        rng = random.Random(2)
        for _ in range(count):
            watch = start_watch(file)
            time.sleep(rng.uniform(0.3, 2.0 * seconds / count))
            watch.kill()
            watch.wait()
        watch = start_watch(file)
        time.sleep(90.0)
        watch.send_signal(signal.SIGTERM)
        watch.wait(30)
        ended.set()
    store = WatchStore(folder / "watch", read_only=True)
    windows = store.query("SELECT start, finish, state FROM window ORDER BY start")
    gaps = [two["start"] - one["finish"] for one, two in pairwise(windows)]
    alarms, sent, thin = read_alarms(store), Counter(taken), 0
    for row in windows[1:]:
        name = f"{datetime.fromtimestamp(row['start'] / 1e6, UTC):%Y%m%dT%H%M%SZ}"
        for path in (folder / "watch" / "parts" / name).glob("*/*"):
            [one] = st.read(path)
            thin += float(np.isfinite(one.pv).mean()) < 0.9
    raised = [one.id for one in alarms if one.is_announced]
    print(json.dumps({
        "kills": count, "windows": Counter(row["state"] for row in windows), "windows missing": sum(map(bool, gaps)),
        "records with less than 0.9 of their values": thin, "alarms": len(alarms),
        "alarms never sent": sum((one, "raised") not in sent for one in raised),
        "sent twice": sum(n > 1 for n in sent.values()),
        "sent for no alarm": len({ident for ident, _ in sent} - {one.id for one in alarms}),
    }, indent=1))  # fmt: skip
    store.close()


def main() -> None:
    """Run one of the benchmarks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("serve", "load", "restarts", "kills"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--loops", type=int, default=1000)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--count", type=int)
    parser.add_argument("--window", default="300s")
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--server", choices=("asyncua", "node-opcua"), default="asyncua")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    os.environ["STICTION_CONFIG"] = str(given.folder / "settings")
    if given.what == "serve":
        serve(given.port, given.loops, given.seconds, given.folder / "server.json")
    elif given.what == "load":
        load(given.folder, given.loops, given.seconds or 600.0, given.window)
    elif given.what == "restarts":
        restarts(given.folder, given.count or 10, given.seconds or 180.0, given.server)
    else:
        kills(given.folder, given.count or 20, given.seconds or 240.0)


if __name__ == "__main__":
    main()
