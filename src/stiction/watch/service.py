"""Run a watch: collect, close windows, have them judged, send messages, and end within seconds when asked."""

from __future__ import annotations

import asyncio
import json
import logging
import signal
import sys
import time
from contextlib import contextmanager, suppress
from datetime import datetime
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError, StictionError
from stiction.fleet.folder import lock_folder
from stiction.watch.channels import send_due_messages
from stiction.watch.collector import Collector
from stiction.watch.digest import add_due_digest
from stiction.watch.judge import SAMPLES_FOLDER
from stiction.watch.read_configuration import read_configuration
from stiction.watch.samples import SampleFiles, window_name
from stiction.watch.store import WatchStore
from stiction.watch.systemd import notify_systemd, watchdog_interval

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from stiction.watch.configuration import WatchConfig

__all__ = ["Watch", "lock_watch"]

FLUSH_S = 1.0
"""Time between two writes of samples [s]."""
GRACE_S = 5.0
"""Time after its end for which a window takes samples that are late [s]."""
STATUS_S = 5.0
"""Time between two notes of the state [s]."""
END_S = 8.0
"""Time for ending [s]."""
MAX_TRIES = 3
"""Times that a window is tried to be judged [-]."""
LOCK_FILE = "watch.lock"


@contextmanager
def lock_watch(folder: Path) -> Iterator[None]:
    """Keep a second watch out of a folder.

    Raises
    ------
    RecordError
        When another watch is at work in it, or it cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / SAMPLES_FOLDER).mkdir(exist_ok=True)
        (folder / "parts").mkdir(exist_ok=True)
    except OSError as error:
        raise RecordError(f"cannot be written to ({error.strerror}); give another folder.", where=folder) from None
    remedy = "stop it first, or give another folder"
    with lock_folder(folder, LOCK_FILE, "a watch is running in this folder", remedy):
        yield


class Watch:
    """A watch over the plant of one configuration file."""

    def __init__(self, file: Path, *, report: Callable[[str], None] | None = None) -> None:
        self.file = file
        self.config: WatchConfig = read_configuration(file)
        self.folder = self.config.folder_beside(file)
        self.report = report or logging.getLogger(__name__).info
        self.collectors: list[Collector] = []
        self.judging = ""
        self.judge_failure = ""
        self._judge: asyncio.subprocess.Process | None = None
        self._stop, self._reload = asyncio.Event(), asyncio.Event()

    async def run(self) -> None:
        """Watch until SIGTERM or SIGINT; SIGHUP reads the configuration again."""
        loop = asyncio.get_running_loop()
        for name, event in (("SIGTERM", self._stop), ("SIGINT", self._stop), ("SIGHUP", self._reload)):
            if hasattr(signal, name):
                with suppress(NotImplementedError, RuntimeError):
                    loop.add_signal_handler(getattr(signal, name), event.set)
        with lock_watch(self.folder):
            self._open()
            try:
                while not self._stop.is_set():
                    self._reload.clear()
                    await self._run_tasks()
                    if self._reload.is_set() and not self._stop.is_set():
                        self._read_again()
            finally:
                notify_systemd("STOPPING=1")
                self.store.close()

    def stop(self) -> None:
        """End `run` as SIGTERM does."""
        self._stop.set()

    async def run_once(self) -> bool:
        """One round: read what is new, judge the windows that ended, send what is due. Whether all servers answered."""
        with lock_watch(self.folder):
            self._open()
            try:
                for one in self.collectors:
                    try:
                        await one.read_once()
                    except StictionError as error:
                        one.failure = str(error)
                        self.report(str(error))
                    await one.flush(self._next_window())
                self._close_windows(is_last=True)
                while rows := self.store.windows_to_judge():
                    await self._judge_window(rows[0])
                add_due_digest(self.store, self.config, datetime.now())
                await send_due_messages(self.store, self.config)
                self._note_status()
            finally:
                self.store.close()
        return all(one.is_current for one in self.collectors)

    def _open(self) -> None:
        self.store = WatchStore(self.folder)
        self.samples = SampleFiles(self.folder / SAMPLES_FOLDER, self.config.window_s)
        self._check_window_length()
        self.samples.mend()
        for row in self.store.query("SELECT start FROM window WHERE state = 'judged'"):
            self.samples.delete(row["start"])
        if self.store.fact("begin") is None:
            length = self._length
            live = any(one.is_live for one in self.config.source)
            begin = time.time_ns() // 1000
            self.store.set_fact("begin", begin if live else begin // length * length - length)
        begin = max(self.store.fact("begin"), self.store.last_window_end())
        self.collectors = [Collector(one, self.samples, self.store, begin) for one in self.config.source if one.is_live]

    def _check_window_length(self) -> None:
        """Refuse another length of windows while samples of an open window wait."""
        known = self.store.fact("window", self.config.window_s)
        if known != self.config.window_s and self.samples.windows():
            raise RecordError(
                f"window = {self.config.window!r} differs from that of the samples that are waiting ({known:g} s); "
                "change it back, let the open window end, or give another folder.",
                where=self.file,
            )
        self.store.set_fact("window", self.config.window_s)

    @property
    def _length(self) -> int:
        return round(1e6 * self.config.window_s)

    def _next_window(self) -> int:
        """Start of the first window that is open [microseconds since 1970]."""
        end = self.store.last_window_end()
        return end or self.store.fact("begin") // self._length * self._length

    def _read_again(self) -> None:
        """Take a changed configuration, if it is sound; its folder cannot change."""
        try:
            config = read_configuration(self.file)
            if config.folder_beside(self.file) != self.folder:
                raise RecordError("folder cannot be changed while the watch runs; restart it.", where=self.file)
            before, self.config = self.config, config
            try:
                self._check_window_length()
            except StictionError:
                self.config = before
                raise
        except StictionError as error:
            self.report(f"The configuration was not changed: {error}")
            return
        self.samples.length_s = config.window_s
        begin = max(self.store.fact("begin"), self.store.last_window_end())
        self.collectors = [Collector(one, self.samples, self.store, begin) for one in config.source if one.is_live]
        self.report("The configuration was read again.")

    async def _run_tasks(self) -> None:
        """All tasks, until the watch ends or is to read its configuration again."""
        parts: list[Any] = [one.run() for one in self.collectors]
        parts += [self._repeat(FLUSH_S, self._flush), self._judge_windows(), self._repeat(2.0, self._send)]
        parts += [self._repeat(min(STATUS_S, watchdog_interval() or STATUS_S), self._status)]
        if self.config.metrics.port:
            from stiction.watch.metrics import serve_metrics

            parts.append(serve_metrics(self.config.metrics, self.folder))
        tasks = [asyncio.ensure_future(part) for part in parts]
        waiting = [asyncio.ensure_future(event.wait()) for event in (self._stop, self._reload)]
        notify_systemd("READY=1")
        try:
            done, _ = await asyncio.wait([*tasks, *waiting], return_when=asyncio.FIRST_COMPLETED)
            for one in done:
                if one in tasks:
                    one.result()
        finally:
            for one in (*tasks, *waiting):
                one.cancel()
            with suppress(TimeoutError):
                async with asyncio.timeout(END_S):
                    await asyncio.gather(*tasks, *waiting, return_exceptions=True)
            await self._flush()
            self._note_status()

    async def _repeat(self, every_s: float, work: Callable[[], Any]) -> None:
        while True:
            await work()
            await asyncio.sleep(every_s)

    async def _flush(self) -> None:
        for one in self.collectors:
            await one.flush(self._next_window())
        self._close_windows()

    def _close_windows(self, *, is_last: bool = False) -> None:
        """Close the windows that ended, when all of their samples have come or were waited for long enough."""
        while True:
            start = self._next_window()
            finish = start + self._length
            if not all(self._has_ended(finish / 1e6, is_last=is_last)):
                return
            gaps = [one.settings.address for one in self.collectors if one.has_gap(start, finish)]
            self.store.close_window(start, finish, {"sources with a gap": gaps})
            missing = f"; values are missing of {', '.join(gaps)}" if gaps else ""
            self.report(f"Window {window_name(start)} is closed{missing}.")

    def _has_ended(self, finish: float, *, is_last: bool) -> Iterator[bool]:
        """Of each source, whether nothing more of a window is waited for."""
        for one in self.collectors:
            grace = 0.0 if is_last else GRACE_S + 2.0 * one.settings.publishing_s
            is_complete = one.is_current and one.now > finish + grace
            yield is_complete or time.time() > finish + self.config.wait_s
        for source in self.config.source:
            if not source.is_live:
                yield time.time() > finish + source.delay_s

    async def _judge_windows(self) -> None:
        """Have closed windows judged, one after the other."""
        while True:
            if rows := self.store.windows_to_judge():
                await self._judge_window(rows[0])
            else:
                await asyncio.sleep(0.5)

    async def _judge_window(self, row: dict[str, Any]) -> None:
        """Have one window judged in a process of its own, so that collecting is not disturbed."""
        self.judging = window_name(row["start"])
        arguments = ["-m", "stiction.watch.judge", str(self.file), str(row["start"]), str(row["finish"])]
        self._judge = await asyncio.create_subprocess_exec(
            sys.executable, *arguments, stdin=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE
        )
        try:
            _, said = await self._judge.communicate()
        except asyncio.CancelledError:
            with suppress(ProcessLookupError):
                self._judge.kill()
            await self._judge.wait()
            raise
        finally:
            self.judging = ""
        if self._judge.returncode == 0:
            self.judge_failure = ""
            self.report(f"Window {window_name(row['start'])} is judged.")
            return
        lines = said.decode("utf-8", "replace").strip().splitlines() or [f"exit code {self._judge.returncode}"]
        self.judge_failure = lines[-1][:500]
        self.report(f"Window {window_name(row['start'])} could not be judged: {self.judge_failure}")
        state = "failed" if row["tries"] + 1 >= MAX_TRIES else "closed"
        body = json.dumps(json.loads(row["body"]) | {"failure": self.judge_failure})
        self.store.change(
            "UPDATE window SET tries = tries + 1, state = ?, body = ? WHERE start = ?", state, body, row["start"]
        )
        await asyncio.sleep(1.0)

    async def _send(self) -> None:
        add_due_digest(self.store, self.config, datetime.now())
        await send_due_messages(self.store, self.config)

    async def _status(self) -> None:
        self._note_status()
        notify_systemd("WATCHDOG=1")

    def _note_status(self) -> None:
        """Note the state of sources and windows for pages and metrics."""
        sources = {
            one.settings.address: {
                "connected": one.is_current, "failure": one.failure, "warning": one.warning, "tags": len(one.nodes),
                "refused": dict(list((one.refused | one.missing).items())[:20]), **one.counts,
                "last_message": one.last_message,
            }
            for one in self.collectors
        }  # fmt: skip
        waiting = self.store.windows_to_judge()
        delay = max((time.time() - row["finish"] / 1e6 for row in waiting), default=0.0)
        status = {"time": time.time(), "sources": sources, "judging": self.judging, "failure": self.judge_failure}
        status |= {"windows_waiting": len(waiting), "delay_s": delay}
        with suppress(Exception):  # a full disk; the next note tells it
            self.store.set_fact("status", status)
