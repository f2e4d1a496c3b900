"""The page of one loop of an audit: the audit's diagnosis again, with raw samples of the source where it is there."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.apps.web.audit_files import load_audit, tag_of_loop
from stiction.apps.web.diagnose_loop import OPTIONS_FILE, loop_content, write_content
from stiction.errors import StictionError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from stiction.fleet import Audit, LoopRow
    from stiction.records import LoopRecord

__all__ = ["prepare_audit_loop", "write_audit_record"]


def prepare_audit_loop(folder: str, key: int, target: str) -> None:
    """Write content and signals of the page of a loop.

    Parameters
    ----------
    folder : str
        Folder of the audit.
    key : int
        Number of the loop.
    target : str
        Folder for `content.json` and `signals.npz`.
    """
    audit = load_audit(folder)
    tag = tag_of_loop(folder, key)
    row = audit.row(tag)
    place = Path(target)
    place.mkdir(parents=True, exist_ok=True)
    try:
        record = audit.read(tag)
    except (StictionError, OSError) as error:
        reason = error.text(where=error.file_name) if isinstance(error, StictionError) else error.strerror
        content = _content_of_row(row)
        _write_means(audit, tag, place, f"because {row.source} cannot be read: {reason}")
    else:
        note = "raw samples of the source" + _change_note(audit, tag, row, record)
        content = _diagnose(audit, row, record)
        _write_signals(record, content.pop("arrays"), place, note)
    write_content(content, place)


def write_audit_record(folder: str, key: int, path: str) -> None:
    """Write the record of a loop as a Parquet file, and the options of its diagnosis as `OPTIONS_FILE`.

    Raises
    ------
    RecordError
        When the source cannot be read any more.
    """
    place = Path(path)
    if place.is_file():
        return
    audit = load_audit(folder)
    record = audit.read(tag_of_loop(folder, key))
    place.parent.mkdir(parents=True, exist_ok=True)
    options = {name: audit.run[name] for name in ("prior", "costs", "smallest_S")}
    place.with_name(OPTIONS_FILE).write_text(json.dumps(options), encoding="utf-8")
    record.to_parquet(place)


def _diagnose(audit: Audit, row: LoopRow, record: LoopRecord) -> dict[str, Any]:
    """Diagnose the record as the audit did; where its row says something else, the row counts."""
    from stiction.report.loop_view import LoopView

    if record.pv is None:
        return _content_of_row(row) | {"arrays": {}}
    diagnosis = audit.diagnose(record)
    content = loop_content(diagnosis)
    if row.status != "screened" and diagnosis.verdict != row.verdict:
        content |= {name: part for name, part in _content_of_row(row).items() if name in ("verdict", "headline")}
        content["headline"]["confidence"] = (
            "The source now gives another verdict than at the time of the audit; run the audit again"
        )
    view = LoopView(diagnosis)
    return content | {"arrays": {"model": view.model, "position": view.valve_position}}


def _content_of_row(row: LoopRow) -> dict[str, Any]:
    """What the page shows when there is only the row of the audit."""
    from stiction.diagnosis.loop_state import HEADLINES
    from stiction.report import labels
    from stiction.report.blocks import Definitions, Headline
    from stiction.report.plain_blocks import blocks_to_plain

    state, chance, line = row.loop_state or "in_control", row.text("probability"), labels.VERDICT_LINES[row.verdict]
    unit = "%" if row.op_unit == "% of span" else ""
    if state != "in_control":
        line = f"{HEADLINES[state]}: {line[0].lower()}{line[1:]}"
    elif row.verdict == "stiction" and row.S is not None:
        line += f": S = {row.text('S')} {unit}, J = {row.text('J')} {unit}".rstrip()
    facts = [(name, text) for name, text in (("Status", row.status), ("Period", row.text("period_s"))) if text]
    sure, icon = f"Probability of stiction {chance}" if chance else "", labels.VERDICT_ICONS[row.verdict]
    times = [("From", [labels.format_time(row.start)]), ("To", [labels.format_time(row.end)])]
    blocks = [
        Headline(row.tag, row.verdict, icon, line, sure, row.reason, row.action, facts),
        Definitions([("Source", [row.source]), *times, ("Data warnings", list(row.data_warnings))]),
    ]
    [headline, origin] = blocks_to_plain(blocks)
    return {
        "diagnosis": None, "tag": row.tag, "verdict": row.verdict, "headline": headline, "trends": [],
        "sections": [{"title": "Origin", "blocks": [origin]}], "stretches": [],
    }  # fmt: skip


def _change_note(audit: Audit, tag: str, row: LoopRow, record: LoopRecord) -> str:
    """Say when the source was changed after the audit."""
    started = audit.run["started"]
    times = [Path(name).stat().st_mtime for name in audit.source_of(tag).part.names if Path(name).is_file()]
    is_newer = started and times and max(times) > datetime.fromisoformat(started).timestamp()
    if is_newer or (row.samples is not None and row.samples != len(record)):
        return f" ({row.source} was changed after the audit; run the audit again)"
    return ""


def _write_signals(record: LoopRecord, arrays: dict[str, NDArray[np.float64]], place: Path, note: str) -> None:
    from stiction.apps.web.trend_data import save_signals

    save_signals(place / "signals.npz", record, arrays, note)


def _write_means(audit: Audit, tag: str, place: Path, why: str) -> None:
    """Write the block means as signals, and why; only the distance of the PV from the set point is known."""
    import numpy as np

    from stiction.apps.web.trend_data import save_signals
    from stiction.records import LoopRecord, Provenance

    means = audit.signals(tag)
    if means is None:
        nothing = np.full(2, np.nan)
        record = LoopRecord(tag, 1.0, op=nothing, pv=nothing)
        note = f"no signals are stored, {why}"
    else:
        note = f"block means of the audit, {why}"
        n = max(means.error.size, means.op.size)
        op, pv = (_whole(x, n) for x in (means.op, -means.error))
        record = LoopRecord(tag, means.clock.dt, op, pv, start=means.clock.start)
    record = replace(record, provenance=Provenance(pv_unit="PV less SP"))
    save_signals(place / "signals.npz", record, None, note)


def _whole(x: NDArray[np.float32], n: int) -> NDArray[np.float64]:
    """Block means of a signal; NaN where it is missing or does not move."""
    import numpy as np

    return x.astype(np.float64) if x.size == n else np.full(n, np.nan)
