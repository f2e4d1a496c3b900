"""Collect the values of an OPC UA server: a subscription, and after each break the history since the last value."""

from __future__ import annotations

import asyncio
import logging
import time
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import StictionError
from stiction.sources.historians.address import parse_address
from stiction.sources.historians.opc_ua_connection import connect, connection_error
from stiction.sources.historians.opc_ua_history import raw_value, read_pages
from stiction.sources.historians.opc_ua_subscription import LOST_VALUES, missing_nodes, subscribe
from stiction.watch.find_tags import find_watched_tags
from stiction.watch.samples import SAMPLE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.watch.configuration import SourceSettings
    from stiction.watch.samples import SampleFiles
    from stiction.watch.store import WatchStore

__all__ = ["Collector"]

WAITS_S = (0.5, 1.0, 2.0, 5.0, 10.0, 30.0)
"""Times after which a lost server is tried again [s]."""
CHECK_S = 1.0
"""Time between two looks at the connection [s]."""
TAGS_CHECK_S = 60.0
"""Time between two looks at whether the server still has all tags [s]."""
SETTLE_S = 5.0
"""Time after which a history is read once more, as servers store values a little later [s]."""
OVERLAP_S = 10.0
"""Tags whose last values lie in one such span are read together [s]."""
MAX_WAITING = 3_000_000
"""Values in memory above which they are left to the history, while the disk does not take them [-]."""
MAX_GAPS = 20
"""Newest holes that are kept [-]."""
CLOCK_OFF_S = 60.0
"""Difference of the clocks from which it is told [s]."""


class Collector:
    """The values of one server, on their way to the sample files."""

    def __init__(self, settings: SourceSettings, samples: SampleFiles, store: WatchStore, begin: int) -> None:
        self.settings, self.samples, self.store, self.begin = settings, samples, store, begin
        self.address = parse_address(settings.address)
        self.nodes: list[str] = []
        self.numbers: NDArray[np.int32] = np.empty(0, np.int32)
        self.is_current = False
        """Whether all values up to now have come, those of breaks too."""
        self.failure = "not connected yet"
        self.warning = ""
        self.offset_s = 0.0
        """Clock of the server minus ours [s]."""
        self.counts = dict.fromkeys(("received", "filled", "late", "lost", "breaks", "timeless"), 0)
        self.refused: dict[str, str] = {}
        self.missing: dict[str, str] = {}
        """Tags that the server no longer has -> its status code."""
        self._waiting: list[tuple[int, int, int, int, float]] = []
        self._unwritten: list[NDArray] = []
        self._texts = {text: number for number, text in store.texts().items()}
        self._last: NDArray[np.int64] = np.empty(0, np.int64)
        self._from: NDArray[np.int64] = np.empty(0, np.int64)
        self._lost_values = self._is_connected = self._must_close_hole = False
        self.last_message = 0.0

    @property
    def now(self) -> float:
        """Time by the clock of the server [s since 1970]."""
        return time.time() + self.offset_s

    @property
    def hole(self) -> str:
        """Name of the fact that keeps from when on values are still to be read from history."""
        return f"fill {self.settings.address}"

    async def run(self) -> None:
        """Collect until cancelled; a server that is lost is tried again."""
        tries = 0
        while True:
            try:
                await self._session()
            except asyncio.CancelledError:
                raise
            except Exception as error:
                known = error if isinstance(error, StictionError) else connection_error(error, self.address)
                if self.is_current:
                    tries = 0
                    self.counts["breaks"] += 1
                self.is_current = self._is_connected = False
                self.failure = str(known)
                logging.getLogger(__name__).warning("%s", known)
            await asyncio.sleep(WAITS_S[min(tries, len(WAITS_S) - 1)])
            tries += 1

    async def read_once(self) -> None:
        """Read what history has since the last value, without a subscription."""
        await self._find_tags()
        async with connect(self.address) as client:
            self._open_hole()
            await self._fill(client)
            self._must_close_hole = self._is_connected = True

    async def _session(self) -> None:
        """One connection: subscribe, fill the hole, and watch the connection until it is lost."""
        await self._find_tags()
        async with connect(self.address) as client:
            self._is_connected = True
            await self._compare_clocks(client)
            self._open_hole()
            publishing, sampling = self.settings.publishing_s, self.settings.sampling_s
            self.refused = await subscribe(client, self.nodes, self._take, publishing_s=publishing, sampling_s=sampling)
            began = self.now
            await self._fill(client)
            await asyncio.sleep(SETTLE_S)
            await self._fill(client, least=began - 60.0)
            self._must_close_hole = True
            self.failure, self.missing, checked = "", {}, time.monotonic()
            while True:
                await client.check_connection()
                await asyncio.sleep(CHECK_S)
                if time.monotonic() > checked + TAGS_CHECK_S:
                    before, checked = self.missing, time.monotonic()
                    self.missing = await missing_nodes(client, self.nodes)
                    if before.keys() - self.missing.keys():
                        return  # a tag is back: its subscription ended when it went, so connect again
                if self._lost_values:
                    self._lost_values = False
                    self._open_hole()
                    await self._fill(client)
                    self._must_close_hole = True

    async def _find_tags(self) -> None:
        """Find the tags of the loops, once; those of the last time where the server does not answer."""
        if self.nodes:
            return
        known = self.store.tags(self.settings.address)
        try:
            found = await asyncio.to_thread(find_watched_tags, self.settings)
        except StictionError as error:
            if not known:
                raise
            self.warning = f"the tags of the last run are used ({error.reason})"
            found = {str(body["address"]): body for body in known.values()}
        numbers = self.store.tag_ids(self.settings.address, found)
        self.nodes = list(found)
        self.numbers = np.array([numbers[node] for node in self.nodes], np.int32)
        last = self.samples.last_stamps(int(self.numbers.max()) + 1)
        stored = self.store.fact(self.hole)
        self._last = np.maximum(last, self.begin)
        if stored is not None:
            self._last[: len(stored)] = np.array(stored)[: self._last.size]

    async def _compare_clocks(self, client: Any) -> None:
        from stiction.errors import import_extra

        ua = import_extra("asyncua.ua", "live")
        before = time.time()
        node = client.get_node(ua.NodeId(ua.ObjectIds.Server_ServerStatus_CurrentTime))
        shown = await node.read_value()
        moment = (shown if shown.tzinfo else shown.replace(tzinfo=UTC)).timestamp()
        offset = moment - 0.5 * (before + time.time())
        self.offset_s = offset if abs(offset) > 1.0 else 0.0
        if abs(offset) > CLOCK_OFF_S:
            self.warning = f"the clock of the server is {offset:+.0f} s off; windows follow the clock of the server"

    def _take(self, number: int, data: Any) -> None:
        """Take one value of the subscription."""
        self.counts["received"] += 1
        one = raw_value(data)
        if one is None:
            self.counts["timeless"] += 1
            return
        if one.status & LOST_VALUES == LOST_VALUES:
            self._lost_values = True
            self.counts["lost"] += 1
        self._add(int(self.numbers[number]), one.seconds, one.value, one.status)

    def _add(self, tag: int, seconds: float, value: float | str | None, status: int) -> None:
        text = -1
        if isinstance(value, str):
            if value not in self._texts:
                self._texts[value] = self.store.text_id(value)
            text, value = self._texts[value], None
        number = float("nan") if value is None else float(value)
        self._waiting.append((tag, text, status, int(1e6 * seconds + 0.5), number))

    async def _fill(self, client: Any, least: float = 0.0) -> None:
        """Read the history since the last value of each tag, or since a time [s]."""
        start = np.maximum(self._from[self.numbers], round(1e6 * least))
        span = round(1e6 * OVERLAP_S)
        since = {
            node: datetime.fromtimestamp(int(one) // span * span / 1e6, UTC)
            for node, one in zip(self.nodes, start, strict=True)
        }
        first = {node: (int(tag), int(one)) for node, tag, one in zip(self.nodes, self.numbers, start, strict=True)}
        until = datetime.fromtimestamp(self.now, UTC) + timedelta(minutes=1)
        failed = []
        ordered = dict(sorted(since.items(), key=lambda item: item[1]))
        async for node, page in read_pages(client, ordered, until):
            if isinstance(page, str):
                self.refused.setdefault(node, f"no history ({page})")
                failed.append(first[node][1])
                continue
            tag, known = first[node]
            new = [one for one in page if int(1e6 * one.seconds + 0.5) > known]
            for one in new:
                self._add(tag, *one)
            self.counts["filled"] += len(new)
            await asyncio.sleep(0)
        if failed and not least:
            gaps = [*self.store.fact(f"gaps {self.settings.address}", []), [min(failed), round(1e6 * self.now)]]
            self.store.set_fact(f"gaps {self.settings.address}", gaps[-MAX_GAPS:])

    def has_gap(self, start: int, finish: int) -> bool:
        """Whether values of a window may be missing: they have not come yet, or a hole that no history fills."""
        holes = self.store.fact(f"gaps {self.settings.address}", [])
        return not self.is_current or any(first < finish and last > start for first, last in holes)

    def _open_hole(self) -> None:
        """Remember, also for the time after a kill, from when on values may be missing."""
        self._from = self._last.copy()
        if (stored := self.store.fact(self.hole)) is None:
            self.store.set_fact(self.hole, self._from.tolist())
        else:
            self._from[: len(stored)] = np.array(stored, np.int64)[: self._from.size]
        self.is_current = False

    async def flush(self, closed_before: int) -> None:
        """Write what has come to the sample files; what a full disk does not take is kept, or left to the history."""
        rows = np.array(self._waiting, SAMPLE)
        self._waiting = []
        if rows.size:
            self.last_message = time.time()
        batches = [*self._unwritten, rows] if rows.size else self._unwritten
        self._unwritten = []
        for k, batch in enumerate(batches):
            try:
                self.counts["late"] += await asyncio.to_thread(self.samples.append, batch, closed_before)
            except OSError as error:
                self.failure = f"the samples cannot be written ({error.strerror or error})"
                self._unwritten = batches[k:]
                break
            np.maximum.at(self._last, batch["tag"], batch["stamp"])
        else:
            if self._must_close_hole:
                self.store.change("DELETE FROM fact WHERE name = ?", self.hole)
                self.is_current, self._must_close_hole = self._is_connected, False
        if sum(map(len, self._unwritten)) > MAX_WAITING:
            self._unwritten, self._lost_values = [], True
