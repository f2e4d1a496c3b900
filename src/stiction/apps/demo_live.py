"""``stiction demo --live``: a simulated plant as an OPC UA server, under watch, ten times as fast as a real one."""

from __future__ import annotations

import asyncio
import json
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from stiction.errors import import_extra

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.records.record import LoopRecord

__all__ = ["demo_live"]

SPEED = 10.0
"""Time of the plant over real time [-]."""
SAMPLE_S = 5.0
"""Sampling period of the plant [s]."""
ONSET_S, REPAIR_S, END_S = 3600.0, 9000.0, 18_000.0
"""Times of the plant at which the valve begins to stick, is repaired, and the plant ends [s]."""
SET_POINT_S = 300.0
"""Time between two set points of the loop [s]."""
WINDOW = "4m"
"""Window of the watch, forty minutes of the plant."""
LOOP = "UNIT9/FIC-900"
"""Loop whose valve begins to stick."""


def demo_live(folder: Path, *, seed: int = 0) -> int:
    """Serve a plant of about sixty loops and watch it until it ends or Ctrl-C; what happens is printed.

    Raises
    ------
    MissingExtraError
        When the extra `live` is not installed.
    """
    from stiction.apps.output import print_out
    from stiction.atomic_write import write_atomically
    from stiction.simulation.plant import simulate_plant
    from stiction.watch.service import Watch

    import_extra("asyncua", "live")
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "plant.toml"

    async def run() -> None:
        server = _PlantServer([*simulate_plant(seed).records, _sticking_record(seed)])
        address = await server.start()
        lines = [f"window = {json.dumps(WINDOW)}", "[[source]]", f"address = {json.dumps(address)}"]
        write_atomically("\n".join([*lines, "[alarms]", "raise_windows = 1", "clear_windows = 2", ""]), file)
        print_out(f"A plant of {len(server.records)} loops is served at {address}, ten times as fast as a real one.")
        print_out(f"The valve of {LOOP} begins to stick after {ONSET_S / SPEED / 60:.0f} minutes and is repaired after")
        print_out(f"{REPAIR_S / SPEED / 60:.0f}. See it with: stiction serve {folder / 'watch' / 'audit'} (page /now)")
        watch = Watch(file.absolute(), report=print_out)
        playing = asyncio.ensure_future(server.play())
        playing.add_done_callback(lambda _: watch.stop())
        try:
            await watch.run()
        finally:
            playing.cancel()
            await server.server.stop()

    asyncio.run(run())
    return 0


def _sticking_record(seed: int) -> LoopRecord:
    """Record of a valve that is in order, sticks, and is repaired."""
    from dataclasses import replace

    import numpy as np

    import stiction as st

    parts = []
    for k, (begin, end, S) in enumerate(((0.0, ONSET_S, 0.1), (ONSET_S, REPAIR_S, 5.0), (REPAIR_S, END_S, 0.1))):
        controller, process = st.PID(0.15, 12.0), st.FOPDT(3.0, 10.0, 10.0)
        loop = st.Loop(controller, st.Kano(S, 0.4 * S), process, dt=SAMPLE_S, noise=0.2)
        length, rng = end - begin, np.random.default_rng(seed + k)
        sp = 100.0 + np.repeat(rng.uniform(-6.0, 6.0, size=round(length / SET_POINT_S)), round(SET_POINT_S / SAMPLE_S))
        parts.append(
            st.simulate(loop, sp=sp, duration=length, seed=seed + k, pv_start=95.0, op_start=50.0, loop_type="flow")
        )
    joined = {name: np.concatenate([getattr(one, name) for one in parts]) for name in ("op", "pv", "sp")}
    return replace(parts[0], tag=LOOP, mv=None, **joined)


class _PlantServer:
    """An OPC UA server that plays records, a sample of all loops at a time, with a history."""

    def __init__(self, records: list[LoopRecord]) -> None:
        self.records = records
        self.nodes: list[tuple[Any, Any]] = []
        """Node and values."""

    async def start(self) -> str:
        """Start at a free port of this machine and give the address."""
        import logging
        import socket

        asyncua, ua = import_extra("asyncua", "live"), import_extra("asyncua.ua", "live")
        logging.getLogger("asyncua").setLevel(logging.CRITICAL)
        with socket.socket() as one:
            one.bind(("127.0.0.1", 0))
            port = one.getsockname()[1]
        self.server = asyncua.Server()
        await self.server.init()
        address = f"opc.tcp://127.0.0.1:{port}"
        self.server.set_endpoint(address)
        self.server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
        index = await self.server.register_namespace("urn:stiction:demo")
        for record in self.records:
            area, _, name = record.tag.rpartition("/")
            loop = await self.server.nodes.objects.add_object(index, f"{area}/{name}" if area else name)
            for role in ("pv", "sp", "op"):
                values = getattr(record, role)
                if values is not None:
                    node = await loop.add_variable(index, role.upper(), float(values[0]))
                    self.nodes.append((node, values))
        await self.server.start()
        for node, _ in self.nodes:
            await self.server.historize_node_data_change(node, count=5000)
        return address

    async def play(self) -> None:
        """Write one sample of all loops after the other, until the records end."""
        ua = import_extra("asyncua.ua", "live")
        loop = asyncio.get_running_loop()
        begin = loop.time()
        for k in range(min(len(values) for _, values in self.nodes)):
            stamp = datetime.now(UTC)
            for node, values in self.nodes:
                data = ua.DataValue(ua.Variant(float(values[k]), ua.VariantType.Double), SourceTimestamp=stamp)
                await node.write_value(data)
            await asyncio.sleep(max(0.0, begin + (k + 1) * SAMPLE_S / SPEED - loop.time()))
