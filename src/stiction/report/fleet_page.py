"""The pages of an audit: one for all loops, and one for a loop, as HTML files that open offline."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from typing import TYPE_CHECKING, Any

from stiction.atomic_write import write_atomically
from stiction.display.finding_words import finding_level
from stiction.fleet.compare import confirmed_share, has_finding
from stiction.report.fleet_figures import group_spectra, group_trends, treemap
from stiction.report.group_picture import picture_group
from stiction.report.labels import signal_words
from stiction.report.page import _asset, _sha256
from stiction.report.rendering import environment

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from stiction.fleet import Audit, LoopRow

__all__ = ["loop_page_path", "write_audit_page", "write_loop_page"]


def write_audit_page(
    audit: Audit, path: Path | None = None, *, changes: Sequence[dict[str, Any]] | None = None
) -> Path:
    """Write the page of an audit: counts, areas, groups, all loops in a table, and the state of the data.

    Parameters
    ----------
    audit : Audit
        The audit.
    path : Path, optional
        File to write; `index.html` in the folder of the audit when not given.
    changes : sequence of dict, optional
        What `compare_audits` gives.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    RecordError
        When it cannot be written.
    """
    from markupsafe import Markup

    from stiction import __version__

    labels = audit.labels()
    script = _asset("fleet.js")
    page = (
        environment()
        .get_template("fleet.html")
        .render(
            audit=audit,
            counts=audit.counts,
            areas=_areas(audit),
            treemap=Markup(treemap([(one["name"], one["loops"], one["findings"]) for one in _areas(audit)]).markup),
            groups=[_draw_group(audit, group) for group in audit.groups],
            data=Markup(_table_json(audit, labels)),
            receipt=_data_problems(audit),
            changes=changes,
            worklist=(audit.folder / "worklist" / "index.html").is_file(),
            confirmed=confirmed_share(audit),
            style=Markup(_asset("page.css") + _asset("fleet.css")),
            script=Markup(script),
            script_hash=_sha256(script),
            version=__version__,
        )
    )
    return write_atomically(page, path or audit.folder / "index.html")


def write_loop_page(audit: Audit, tag: str) -> Path:
    """Diagnose one loop again and write its page.

    Parameters
    ----------
    audit : Audit
        The audit.
    tag : str
        Tag of the loop.

    Returns
    -------
    Path
        The file, in the folder `loops` of the audit.

    Raises
    ------
    ParameterError
        When the audit has no such loop.
    RecordError
        When its source is gone, or the file cannot be written.
    """
    from stiction.report.report import write_report

    row, path = audit.row(tag), loop_page_path(audit, tag)
    path.parent.mkdir(exist_ok=True)
    settings = {"audit": str(audit.folder), "priority": row.priority, "severity": row.severity}
    return write_report([audit.diagnose(audit.read(tag))], path, title=tag, settings=settings)


def loop_page_path(audit: Audit, tag: str) -> Path:
    """File of the page of a loop; its name is the number of the loop, never the tag."""
    return audit.folder / "loops" / f"{audit.signal_parts[tag][0]}.html"


def _areas(audit: Audit) -> list[dict[str, Any]]:
    """Loops, loops with a finding, and the share of healthy ones, by area."""
    by_area: dict[str, list[LoopRow]] = defaultdict(list)
    for row in audit.rows:
        by_area[row.area].append(row)
    areas = []
    for name, rows in sorted(by_area.items()):
        judged = [row for row in rows if row.status == "diagnosed"]
        findings = sum(has_finding(row) for row in rows)
        healthy = sum(not has_finding(row) and row.verdict == "no_stiction" for row in judged)
        share = healthy / len(judged) if judged else None
        areas.append({"name": name, "loops": len(rows), "judged": len(judged), "findings": findings, "healthy": share})
    return sorted(areas, key=lambda one: (-one["findings"], -one["loops"], one["name"]))


def _draw_group(audit: Audit, group: dict[str, Any]) -> dict[str, Any]:
    """Card of a group: its text, trends and spectra."""
    from markupsafe import Markup

    picture = picture_group(audit, group)
    return group | {
        "trends": Markup(group_trends(picture).markup),
        "spectra": Markup(group_spectra(picture, group["period_s"]).markup),
        "left_out": picture.left_out,
        "since": picture.since,
    }


COLUMNS = (
    *("tag", "area", "finding_text", "next_step", "S", "period_s", "priority", "priority_reason"),
    *("finding", "status", "verdict", "probability", "loop_state", "oscillation_cause", "group", "followers", "reason"),
    *("severity", "confidence", "importance", "reversals_per_day", "valve_travel_per_day", "saturated_share"),
    *("manual_share", "variability"),
)
"""Columns of the table and of the details of a loop."""
NUMBERS = ("probability", "S", "period_s", "severity", "priority", "importance", "confidence", *COLUMNS[-5:])
"""Columns that are sorted as numbers and shown as text."""


def _table_json(audit: Audit, labels: dict[str, Any]) -> str:
    """Rows of the table as JSON that can stand in a page."""
    pages = {path.stem for path in (audit.folder / "loops").glob("*.html")}
    rows = []
    for row in audit.rows:
        label = labels.get(row.tag)
        number = str(audit.signal_parts[row.tag][0])
        values = [None if name == "S" and not row.text(name) else row[name] for name in COLUMNS]
        texts = {name: row.text(name) for name in NUMBERS} | {"level": finding_level(row.finding)}
        rows.append(
            [*values, f"{label.label}: {label.note}" if label else "", number if number in pages else "", texts]
        )
    in_percent = all(row.op_unit == "% of span" for row in audit.rows)
    table = {"columns": [*COLUMNS, "label", "page"], "rows": rows, "S_title": "S [%]" if in_percent else "S"}
    text = json.dumps(table, separators=(",", ":"), allow_nan=False)
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _data_problems(audit: Audit) -> list[dict[str, Any]]:
    """Return the loops by problem with their data."""
    tags: dict[str, list[str]] = defaultdict(list)
    for row in audit.rows:
        if row.failed:
            tags[f"not read or not diagnosed ({row.status})"].append(row.tag)
        elif row.loop_state not in (None, "in_control"):
            tags[f"state: {signal_words(row.loop_state)}"].append(row.tag)
        for name in row.data_warnings:
            tags[f"data check: {signal_words(name)}"].append(row.tag)
    counts = Counter({name: len(found) for name, found in tags.items()})
    lines = [{"name": name, "count": count, "tags": tags[name][:200]} for name, count in counts.most_common()]
    missing = {
        "tags of the map that the source does not have": audit.missing_tags["map_tags"],
        "tags of the connections that are not loops": audit.missing_tags["connection_tags"],
    }
    found = [{"name": k, "what": "tag", "count": len(v), "tags": v[:200]} for k, v in missing.items() if v]
    return found + [{"what": "loop", **line} for line in lines]
