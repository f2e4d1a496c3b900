"""Judge a closed window in a process of its own: records, audit, alarms; all is noted at once, or nothing."""

from __future__ import annotations

import json
import os
import shutil
import sys
import threading
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from stiction.errors import RecordError, StictionError
from stiction.fleet import audit
from stiction.fleet.audit_stages import EmptyRangeError
from stiction.watch.alarm_rules import update_alarms
from stiction.watch.read_configuration import read_configuration
from stiction.watch.samples import SampleFiles
from stiction.watch.store import WatchStore
from stiction.watch.window_records import write_window

if TYPE_CHECKING:
    from stiction.watch.configuration import WatchConfig

__all__ = ["SAMPLES_FOLDER", "judge_window", "main"]

SAMPLES_FOLDER = "samples"


def judge_window(config: WatchConfig, folder: Path, store: WatchStore, start: int, finish: int) -> None:
    """Judge one window, and note it as judged together with its alarms.

    Raises
    ------
    StictionError
        When no loop can be read, or the audit cannot be written.
    """
    samples = SampleFiles(folder / SAMPLES_FOLDER, config.window_s)
    written = write_window(folder, config.source, samples, store, start, finish)
    rows = []
    if written.loops:
        try:
            rows = audit(
                written.folder, folder / "audit", since=datetime.fromtimestamp(start / 1e6, UTC),
                until=datetime.fromtimestamp(finish / 1e6, UTC), workers=config.workers or None, prior=config.prior,
                connections=config.connections or None, retry=True,
            ).rows  # fmt: skip
        except EmptyRangeError:
            reason = "no source has samples of this window; older files are diagnosed by stiction audit."
            raise RecordError(reason) from None
    with store.transaction():
        about = {"loops": written.loops, "failures": written.failures, "doubles": written.doubles}
        is_new = store.change(
            "UPDATE window SET state = 'judged', judged = ?, body = json_patch(body, ?) "
            "WHERE start = ? AND state = 'closed'",
            time.time(), json.dumps(about), start,
        )  # fmt: skip
        if is_new:
            update_alarms(store, config, rows, finish / 1e6)
    samples.delete(start)
    _delete_old_parts(folder / "parts", config.keep_s, written.folder)


def _delete_old_parts(parts: Path, keep_s: float, newest: Path) -> None:
    """Delete the records of windows that began long ago; the newest are always kept."""
    for path in parts.iterdir():
        begin = datetime.strptime(path.name, "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC)
        if path != newest and begin.timestamp() < time.time() - keep_s:
            shutil.rmtree(path, ignore_errors=True)


def _end_with_parent(*, every_s: float = 0.5) -> None:
    """End this process when the watch was killed, so that the next one finds the audit free."""
    parent = os.getppid()

    def look() -> None:
        while os.getppid() == parent:
            time.sleep(every_s)
        os._exit(1)

    if os.name != "nt":  # there a parent keeps its number when it is gone
        threading.Thread(target=look, daemon=True).start()


def main(file: str, start: str, finish: str) -> int:
    """Judge one window of a configuration file; what went wrong is told on the error output."""
    _end_with_parent()
    path = Path(file)
    try:
        config = read_configuration(path)
        folder = config.folder_beside(path)
        store = WatchStore(folder)
        try:
            judge_window(config, folder, store, int(start), int(finish))
        finally:
            store.close()
    except StictionError as error:
        print(error, file=sys.stderr)  # noqa: T201 (a program)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
