"""Numbers of a watch for Prometheus, in the OpenMetrics format, by an HTTP server that is started only when asked."""

from __future__ import annotations

import asyncio
import json
import threading
import time
from collections import Counter
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError, StictionError, import_extra
from stiction.watch.alarm import read_alarms
from stiction.watch.store import WatchStore

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from stiction.fleet import LoopRow
    from stiction.watch.configuration import MetricsSettings

__all__ = ["WatchMetrics", "serve_metrics"]

MAX_VALVES = 500
"""Loops whose probability and S are given, the worst first [-]."""
SOURCE_COUNTS = {
    "received": "Values that came by subscription",
    "filled": "Values that were read from history after a break",
    "lost": "Reports of a server that a queue lost values",
    "late": "Values that came after their window was closed",
    "breaks": "Times that the connection was lost",
}


class WatchMetrics:
    """The collector that prometheus-client asks at each scrape; it reads the files of the watch and changes nothing."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._lock = threading.Lock()
        self._rows: tuple[float, list[LoopRow]] = (0.0, [])

    def collect(self) -> Iterator[Any]:
        """Families of numbers."""
        core = import_extra("prometheus_client.core", "live")

        def family(name: str, about: str, labels: list[str], values: dict[tuple[str, ...], float], kind: str) -> Any:
            make = core.CounterMetricFamily if kind == "counter" else core.GaugeMetricFamily
            one = make(f"stiction_{name}", about, labels=labels)
            for key, value in values.items():
                one.add_metric(list(key), value)
            return one

        store = WatchStore(self.folder, read_only=True)
        try:
            status = store.fact("status", {})
            alarms = read_alarms(store, only_open=True)
            judged = store.query(
                "SELECT state, COUNT(*) AS n, COALESCE(MAX(judged), 0) AS last FROM window GROUP BY state"
            )
            messages = store.query("SELECT channel, COUNT(*) AS n FROM message WHERE sent IS NULL GROUP BY channel")
            newest = max((row["last"] for row in judged), default=0.0)
        finally:
            store.close()
        rows = self._read_rows(newest)
        sources = status.get("sources", {})
        yield family("up", "Whether the watch has noted its state within a minute", [],
                     {(): float(time.time() - status.get("time", 0.0) < 60.0)}, "gauge")  # fmt: skip
        connected = {(name,): float(one["connected"]) for name, one in sources.items()}
        yield family("source_connected", "Whether a source gives all of its values", ["source"], connected, "gauge")
        for name, about in SOURCE_COUNTS.items():
            values = {(source,): float(one[name]) for source, one in sources.items()}
            yield family(f"source_{name}", about, ["source"], values, "counter")
        yield family("windows", "Windows by state", ["state"], {(r["state"],): float(r["n"]) for r in judged}, "gauge")
        yield family("delay_seconds", "Age of the oldest window that is not judged", [],
                     {(): float(status.get("delay_s", 0.0))}, "gauge")  # fmt: skip
        by_finding = Counter((row.finding or row.status, row.area) for row in rows)
        yield family("loops", "Loops by finding and area", ["finding", "area"],
                     {key: float(n) for key, n in by_finding.items()}, "gauge")  # fmt: skip
        worst = [row for row in rows if row.in_control][:MAX_VALVES]
        for name, about in (("probability", "Probability that the valve sticks"), ("S", "Deadband plus stickband")):
            known = {(r.tag, r.area): float(x) for r in worst if (x := getattr(r, name)) is not None}
            yield family(f"valve_{name.lower()}", about, ["loop", "area"], known, "gauge")
        open_alarms = {(a.loop, a.kind, a.priority, a.state): 1.0 for a in alarms}
        yield family("alarm", "Open alarms", ["loop", "kind", "priority", "state"], open_alarms, "gauge")
        yield family("messages_waiting", "Messages that a channel has not taken", ["channel"],
                     {(r["channel"],): float(r["n"]) for r in messages}, "gauge")  # fmt: skip

    def _read_rows(self, judged: float) -> list[LoopRow]:
        """Rows of the newest audit; read again only when a window was judged."""
        from stiction.fleet import open_audit

        with self._lock:
            if judged > self._rows[0]:
                try:
                    self._rows = (judged, open_audit(self.folder / "audit").rows)
                except (StictionError, json.JSONDecodeError):
                    return self._rows[1]
            return self._rows[1]


async def serve_metrics(settings: MetricsSettings, folder: Path) -> None:
    """Serve ``/metrics`` until cancelled, on this machine alone unless another address is given.

    Raises
    ------
    RecordError
        When the port is taken.
    """
    client = import_extra("prometheus_client", "live")
    registry = client.CollectorRegistry()
    registry.register(WatchMetrics(folder))
    try:
        server, thread = client.start_http_server(settings.port, settings.address, registry)
    except OSError as error:
        place = f"{settings.address}:{settings.port}"
        raise RecordError(f"port {place} cannot be opened ({error.strerror}); give another port.") from None
    try:
        await asyncio.Event().wait()
    finally:
        server.shutdown()
        server.server_close()
        thread.join(1.0)
