"""The page *Now* of a watch: state of the sources, delay, loops by finding, alarms, and what changed."""

from __future__ import annotations

import time
from collections import Counter
from datetime import datetime
from typing import TYPE_CHECKING, Any

from stiction.errors import StictionError
from stiction.fleet import open_audit
from stiction.report.labels import FINDINGS
from stiction.report.rendering import environment
from stiction.watch.alarm import read_alarms
from stiction.watch.alarm_actions import read_notes
from stiction.watch.digest import SECTIONS, make_digest
from stiction.watch.store import WatchStore

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["now_page"]

DAY_S = 86_400.0
SILENT_S = 60.0
"""Age of the newest note of the watch from which it counts as stopped [s]."""


def now_page(folder: Path) -> str:
    """Return the page of the watch in a folder as HTML; its style and script are those of the server.

    Raises
    ------
    RecordError
        When the folder holds no watch.
    """
    store = WatchStore(folder, read_only=True)
    try:
        now = time.time()
        status = store.fact("status", {})
        alarms = [(one, _moment(one.raised), read_notes(store, one.id)) for one in read_alarms(store, only_open=True)]
        changes = {
            name: {title: len(found) for key, title in SECTIONS.items() if (found := digest[key]) and key != "overdue"}
            for name, digest in (
                ("yesterday", make_digest(store, now - DAY_S, now)),
                ("last week", make_digest(store, now - 7 * DAY_S, now)),
            )
        }
        waiting = store.query("SELECT channel, COUNT(*) AS n, MAX(failure) AS failure FROM message WHERE sent IS NULL "
                              "GROUP BY channel")  # fmt: skip
        last = store.query("SELECT MAX(finish) AS finish FROM window WHERE state = 'judged'")[0]["finish"]
    finally:
        store.close()
    try:
        rows = open_audit(folder / "audit").rows
    except StictionError:  # no window was judged yet
        rows = []
    findings = Counter(FINDINGS.get(row.finding or "", row.status.replace("_", " ")) for row in rows)
    values: dict[str, Any] = {
        "folder": folder.name,
        "is_alive": now - status.get("time", 0.0) < SILENT_S,
        "noted": _moment(status.get("time")),
        "sources": status.get("sources", {}),
        "delay_s": status.get("delay_s", 0.0),
        "windows_waiting": status.get("windows_waiting", 0),
        "judging": status.get("judging", ""),
        "failure": status.get("failure", ""),
        "judged_until": _moment(last / 1e6 if last else None),
        "findings": findings.most_common(),
        "alarms": alarms,
        "changes": changes,
        "waiting": waiting,
    }
    return environment().get_template("now.html").render(**values)


def _moment(seconds: float | None) -> str:
    return f"{datetime.fromtimestamp(seconds):%Y-%m-%d %H:%M}" if seconds else "never"
