"""Diagnosis of one loop in a worker: its row of the table, and what its page shows."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.apps.web.table_row import table_row

if TYPE_CHECKING:
    from stiction.diagnosis import Diagnosis
    from stiction.records import LoopRecord

__all__ = ["OPTIONS_FILE", "diagnose_file", "diagnose_loop", "loop_content"]

OPTIONS_FILE = "options.json"
"""Prior and costs of the audit that a record belongs to; without it those of `stiction.diagnose` hold."""
SPARKLINE_POINTS = 60
"""Points of a trend in a cell of the table [-]."""
PVOP_POINTS = 1500
"""Points of the plot of PV over OP [-]."""
PVOP_PERIODS = 3
"""Periods that this plot shows; they are the last ones [-]."""


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

    Parameters
    ----------
    record_path : str
        File that holds one record.
    folder : str
        Folder for `content.json` and `signals.npz`.

    Returns
    -------
    dict
        The row of the table of loops.
    """
    from stiction.apps.web.trend_data import save_signals, thin_values
    from stiction.fleet import LoopRow
    from stiction.records.atomic_write import write_atomically
    from stiction.report.loop_view import LoopView

    diagnosis = diagnose_file(record_path)
    view = LoopView(diagnosis)
    note = "raw samples of the source"
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    save_signals(target / "signals.npz", diagnosis.record, {"model": view.model, "position": view.valve_position}, note)
    write_atomically(json.dumps(loop_content(diagnosis), allow_nan=False), target / "content.json")
    record = diagnosis.record
    trend = thin_values(record.op if record.pv is None else record.pv, SPARKLINE_POINTS)
    return table_row(LoopRow(record.tag).with_diagnosis(diagnosis)) | {"spark": trend}


def _finite(value: float) -> float | None:
    return float(f"{value:.4g}") if math.isfinite(value) else None


def loop_content(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return what the page of a loop shows apart from its trends, ready for JSON."""
    from stiction.diagnosis.loop_state import HEADLINES, describe_action, describe_state
    from stiction.report import labels
    from stiction.report.figures.contributions import feature_table
    from stiction.report.identification_text import describe_controller, describe_identification

    record, found, unit = diagnosis.record, diagnosis.identification, diagnosis.record.op_unit_short
    state = diagnosis.loop_state
    identified = [list(row) for row in describe_identification(found, unit)] if found is not None else []
    if diagnosis.controller is not None:
        identified.insert(0, ["Controller", describe_controller(diagnosis.controller, unit)])
    names = feature_table(diagnosis) if diagnosis.contributions else []
    return {
        "diagnosis": diagnosis.to_dict(),
        "tag": record.tag,
        "verdict": diagnosis.verdict,
        "verdict_label": labels.VERDICTS[diagnosis.verdict],
        "headline": labels.headline(diagnosis),
        "confidence": labels.confidence_text(diagnosis),
        "reason": diagnosis.reason,
        "action": diagnosis.action,
        "state": {
            "name": state.state,
            "title": HEADLINES[state.state],
            "why": describe_state(state, record.start, record.provenance.pv_unit),
            "action": describe_action(state),
            "stretches": [{"state": one.state, "from": one.start_s, "to": one.end_s} for one in state.stretches],
        },
        "facts": _facts(diagnosis),
        "identified": identified,
        "contributions": [
            {"label": row[0], "formula": row[1], "value": row[2], "log_odds": one.log_odds}
            for row, one in zip(names, diagnosis.contributions, strict=False)
        ],
        "contributions_sentence": _contributions_sentence(diagnosis),
        "evidence": [
            {
                "method": labels.method_label(row.method),
                "index": _finite(row.index),
                "threshold": _finite(row.threshold),
                "vote": row.vote,
                "vote_label": labels.VERDICTS[row.vote],
                "valid": row.valid,
                "why": row.why,
                "source": labels.citation(row.source),
            }
            for row in diagnosis.evidence
        ],
        "checks": _checks(diagnosis),
        "origin": _origin(record),
        "pvop": _pv_over_op(diagnosis),
        "units": {"pv": record.provenance.pv_unit or "engineering units", "op": record.op_unit},
    }


def _facts(diagnosis: Diagnosis) -> list[list[str]]:
    from stiction.report import labels

    record, oscillation = diagnosis.record, diagnosis.oscillation
    facts = [["Samples", f"{len(record)}, one every {labels.format_duration(record.dt)}"]]
    if oscillation.oscillating:
        facts += [
            ["Period", labels.format_duration(oscillation.period)],
            ["PV amplitude", labels.format_number(oscillation.amplitude_pv, record.provenance.pv_unit)],
            ["OP amplitude", labels.format_number(oscillation.amplitude_op, record.op_unit)],
            ["Cycles", labels.format_number(oscillation.cycles)],
        ]
    else:
        facts.append(["Oscillation", "none found"])
    if diagnosis.loop_state.in_control:
        facts.append([f"Main {labels.cause_title(diagnosis)}", labels.cause_label(diagnosis)])
    return facts


def _contributions_sentence(diagnosis: Diagnosis) -> str:
    from stiction.report import labels

    if not diagnosis.contributions:
        return ""
    return (
        "A bar to the right is evidence for stiction, a bar to the left evidence against it. With a prior of "
        f"{labels.format_probability(diagnosis.prior)} and the average of all loops "
        f"({diagnosis.average_log_odds:+.2f}) they give a probability of stiction of "
        f"{labels.format_probability(diagnosis.probability)}."
    )


def _checks(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    order = {"reject": 0, "warn": 1, "ok": 2}
    checks = sorted(diagnosis.quality.checks, key=lambda check: order.get(check.severity, 0))
    return [{"name": one.name, "severity": one.severity, "why": one.why} for one in checks]


def _origin(record: LoopRecord) -> list[list[str]]:
    from stiction.report import labels

    origin = record.provenance
    rows = [
        ["Source", Path(origin.source).name],
        ["Columns", ", ".join(f"{name.upper()} = {column}" for name, column in origin.columns.items())],
        ["Start", f"{record.start:%Y-%m-%d %H:%M:%S %Z}".strip() if record.start else ""],
        ["Length", f"{labels.format_duration(record.duration)}, {record.missing_percent:.2g} % missing"],
        ["Loop type", record.loop_type],
        ["Assumed", " ".join(origin.assumptions)],
    ]
    return [row for row in rows if row[1]]


def _pv_over_op(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """PV over OP of the last periods, with the stiction band of the identified valve around the middle of OP."""
    import numpy as np

    from stiction.apps.web.trend_data import to_list

    record, oscillation, found = diagnosis.record, diagnosis.oscillation, diagnosis.identification
    if record.pv is None:
        return None
    period = oscillation.period if oscillation.oscillating else record.duration
    samples = min(len(record), max(40, int(PVOP_PERIODS * period / record.dt) + 1))
    last = diagnosis.quality.last if diagnosis.loop_state.in_control and diagnosis.quality.last > 0 else len(record)
    part = slice(max(0, last - samples), last)
    step = max(1, samples // PVOP_POINTS)
    op, pv = record.op[part][::step], record.pv[part][::step]
    good = np.isfinite(op) & np.isfinite(pv)
    if good.sum() < 2:
        return None
    sized = found is not None and diagnosis.verdict != "no_stiction" and np.isfinite(found.S)
    middle = float((np.min(op[good]) + np.max(op[good])) / 2.0)
    return {
        "op": to_list(op),
        "pv": to_list(pv),
        "band": [middle - found.S / 2.0, middle + found.S / 2.0] if sized and found is not None else None,
        "S": _finite(found.S) if sized and found is not None else None,
        "J": _finite(found.J) if sized and found is not None else None,
        "periods": PVOP_PERIODS if oscillation.oscillating else None,
    }
