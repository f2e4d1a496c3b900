"""Answers from the folder of an audit, made in a worker."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.apps.web.table_row import table_row
from stiction.errors import RecordError

if TYPE_CHECKING:
    from stiction.fleet import Audit, LoopRow

__all__ = [
    "audit_rows",
    "audit_sparks",
    "compare_with",
    "describe_groups",
    "load_audit",
    "tag_of_loop",
]

SPARKLINE_POINTS = 60
MAX_GROUP_TRENDS = 24
"""Members of a group that are drawn [-]."""


def load_audit(folder: str) -> Audit:
    """Open an audit, or give it as it was opened before if its results did not change since."""
    return _load(folder, result_version(folder))


@lru_cache(maxsize=4)
def _load(folder: str, version: int) -> Audit:
    del version
    from stiction.fleet import open_audit

    return open_audit(folder)


def audit_version(folder: str) -> int:
    """Time of the last change of results or notes [ms since 1970]."""
    return max(result_version(folder), _changed(Path(folder), ("labels.csv",)))


def result_version(folder: str) -> int:
    """Time of the last change of results [ms since 1970]."""
    return _changed(Path(folder), ("audit.toml", "ledger.sqlite", "ledger.sqlite-wal"))


def _changed(folder: Path, names: tuple[str, ...]) -> int:
    times = [path.stat().st_mtime_ns // 1_000_000 for name in names if (path := folder / name).is_file()]
    return max(times, default=0)


def tag_of_loop(folder: str, key: int) -> str:
    """Tag of a loop.

    Raises
    ------
    RecordError
        When the audit has no such loop.
    """
    for tag, (number, _) in load_audit(folder).signal_parts.items():
        if number == key:
            return tag
    raise RecordError("This loop is not in the audit. Open it from the table of loops.")


def audit_rows(folder: str, since: int) -> bytes:
    """Return rows and progress as JSON; no row when nothing changed after `since`."""
    from stiction.fleet.compare import confirmed_share

    version = audit_version(folder)
    audit = load_audit(folder)
    counts = audit.counts
    done = counts["loops"] - counts["screened"]
    answer: dict[str, Any] = {
        "version": version,
        "confirmed": confirmed_share(audit),
        "rows": [] if since == version else _rows(audit),
        "progress": {
            "total": counts["loops"], "done": done, "running": False, "per_second": None, "left_s": None,
            "started": audit.run["started"], "finished": audit.run["finished"],
        },
    }  # fmt: skip
    return json.dumps(answer, separators=(",", ":"), allow_nan=False).encode()


def _rows(audit: Audit) -> list[dict[str, Any]]:
    labels = audit.labels()
    rows = []
    for row in audit.rows:
        number, part = audit.signal_parts[row.tag]
        short = table_row(row) | {"key": number, "has_signals": bool(part)}
        if row.tag in labels:
            short["label"] = labels[row.tag].label
        rows.append(short)
    return rows


def audit_sparks(folder: str, keys: list[int]) -> dict[str, list[float | None]]:
    """Return small trends of some loops by their key: block means of OP."""
    from stiction.apps.web.trend_data import thin_values
    from stiction.fleet.signals import read_signals
    from stiction.report.figures.sparkline import recent_swing

    audit = load_audit(folder)
    parts = {number: part for number, part in audit.signal_parts.values() if number in set(keys) and part}
    means = read_signals(audit.signals_folder, parts)
    return {str(k): thin_values(recent_swing(one.op, one.clock.dt), SPARKLINE_POINTS) for k, one in means.items()}


def describe_groups(folder: str) -> bytes:
    """Return the groups with keys, verdicts, trends in phase order and spectra of their members, as JSON."""
    audit = load_audit(folder)
    rows = {row.tag: row for row in audit.rows}
    groups = [_describe_group(audit, rows, group) for group in audit.groups]
    return json.dumps({"groups": groups, "version": audit_version(folder)}, allow_nan=False).encode()


def _describe_group(audit: Audit, rows: dict[str, LoopRow], group: dict[str, Any]) -> dict[str, Any]:
    from stiction.apps.web.trend_data import to_list
    from stiction.report.group_picture import picture_group

    picture = picture_group(audit, group, MAX_GROUP_TRENDS)
    members = [
        {**one, "key": audit.signal_parts[one["tag"]][0], "since": picture.since.get(one["tag"], "")}
        | {name: rows[one["tag"]][name] for name in ("verdict", "status", "probability", "area")}
        for one in group["member_details"]
        if one["tag"] in rows
    ]
    lines = {name: {tag: [to_list(x), to_list(y)] for tag, (x, y) in getattr(picture, name).items()}
             for name in ("trends", "spectra")}  # fmt: skip
    names = ("number", "period_s", "roots", "leading_roots", "perhaps_also", "similar", "summary")
    return {**{name: group.get(name) for name in names}, "members": members, "shown_s": picture.shown_s, **lines}


def compare_with(folder: str, other: str) -> bytes:
    """Return what changed since another audit, as JSON."""
    from stiction.fleet.compare import compare_audits

    now, before = load_audit(folder), load_audit(other)
    rows = [
        row | {"key": now.signal_parts[row["tag"]][0] if row["tag"] in now.signal_parts else None}
        for row in compare_audits(now, before)
    ]
    runs = {"started": now.run["started"], "started_before": before.run["started"]}
    return json.dumps({"rows": rows, **runs}, allow_nan=False).encode()
