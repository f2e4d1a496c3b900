"""Diagnosis of one loop in a worker: its row of the table, and what its page shows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.apps.web.table_row import table_row

if TYPE_CHECKING:
    from stiction.diagnosis import Diagnosis

__all__ = ["OPTIONS_FILE", "diagnose_file", "diagnose_loop", "loop_content", "write_content"]

OPTIONS_FILE = "options.json"
"""Prior and costs of the audit that a record belongs to; without it those of `stiction.diagnose` hold."""
SPARKLINE_POINTS = 60
"""Points of a trend in a cell of the table [-]."""


def diagnose_file(record_path: str) -> Diagnosis:
    """Diagnose the record in a Parquet file with the prior and the costs in `OPTIONS_FILE` of the same folder."""
    import stiction as st
    from stiction.diagnosis.verdict.decision import Costs

    [record] = st.read(record_path)
    path = Path(record_path).with_name(OPTIONS_FILE)
    options = json.loads(path.read_bytes()) if path.is_file() else {}
    if "costs" in options:
        options["costs"] = Costs(*options["costs"])
    return st.diagnose(record, **options)


def diagnose_loop(record_path: str, folder: str) -> dict[str, Any]:
    """Diagnose the loop of a Parquet file of records and write what its page shows.

    `record_path`: file that holds one record. `folder`: folder for `content.json` and `signals.npz`. Returns the row of
    the table of loops.
    """
    from stiction.apps.web.trend_data import save_signals, thin_values
    from stiction.fleet import LoopRow
    from stiction.report.figures.sparkline import recent_swing
    from stiction.report.loop_view import LoopView

    diagnosis = diagnose_file(record_path)
    view = LoopView(diagnosis)
    note = "raw samples of the source"
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    save_signals(target / "signals.npz", diagnosis.record, {"model": view.model, "position": view.valve_position}, note)
    write_content(loop_content(diagnosis), target)
    record = diagnosis.record
    trend = thin_values(recent_swing(record.op, record.dt), SPARKLINE_POINTS)
    return table_row(LoopRow(record.tag).with_diagnosis(diagnosis)) | {"spark": trend}


def loop_content(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return what the page of a loop shows apart from its trends."""
    from stiction.report.blocks import Figure
    from stiction.report.loop_view import LoopView
    from stiction.report.pages.loop import loop_headline, loop_sections
    from stiction.report.plain_blocks import blocks_to_plain
    from stiction.report.visible_reasons import find_rests

    record, sections = diagnosis.record, loop_sections(diagnosis)
    trends = [block for block in sections.pop("Trends", ()) if not isinstance(block, Figure)]
    [headline, *trends] = blocks_to_plain([loop_headline(diagnosis), *trends])
    return {
        "diagnosis": diagnosis.to_dict(),
        "tag": record.tag,
        "verdict": diagnosis.verdict,
        "headline": headline,
        "trends": trends,
        "sections": [{"title": title, "blocks": blocks_to_plain(blocks)} for title, blocks in sections.items()],
        "stretches": [
            {"state": stretch.state, "from": stretch.start_s, "to": stretch.end_s}
            for stretch in diagnosis.loop_state.stretches
        ]
        + [
            {"state": "valve at rest while OP moves", "from": first * record.dt, "to": last * record.dt}
            for first, last in find_rests(LoopView(diagnosis))
        ],
    }


def write_content(content: dict[str, Any], folder: Path) -> None:
    """Write what `loop_content` returns as `content.json`."""
    from stiction.apps.web.trend_data import to_list
    from stiction.atomic_write import write_atomically

    write_atomically(json.dumps(content, allow_nan=False, default=to_list), folder / "content.json")
