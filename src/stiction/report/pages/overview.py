"""Overview of several loops: one table, the worst first."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.report import labels
from stiction.report.blocks import Cell, StatusIcon, Table
from stiction.report.figures.sparkline import SPARK_HALF_RANGE, recent_swing, sparkline

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.verdict.diagnosis import Diagnosis

__all__ = ["loop_anchor", "overview", "sort_worst_first"]

_RANK = {"stiction": 0, "undecided": 1, "no_stiction": 2}
EMPTY_CELL = Cell("–", sort="")
"""A dash; it is sorted after all numbers, in both directions."""


def sort_worst_first(diagnoses: Sequence[Diagnosis]) -> list[Diagnosis]:
    """Sort: stiction, cannot tell, no stiction; stiction by probability times S, the others by probability."""

    def key(diagnosis: Diagnosis) -> tuple[int, float, float]:
        identification, p = diagnosis.identification, float(np.nan_to_num(diagnosis.probability))
        comparable = identification is not None and diagnosis.record.op_in_percent
        size = float(np.nan_to_num(identification.S)) if identification is not None and comparable else 0.0
        return (_RANK[diagnosis.verdict], -p * size if diagnosis.verdict == "stiction" else 0.0, -p)

    return sorted(diagnoses, key=key)


def loop_anchor(k: int) -> str:
    """Name of the k-th loop's part of the page."""
    return f"loop-{k + 1}"


def overview(diagnoses: Sequence[Diagnosis], failures: Sequence[tuple[str, str]] = ()) -> Table:
    """Return the table; each row links to the loop's part of the page. Loops that were not diagnosed come last."""
    names = labels.unique_loop_names([diagnosis.record for diagnosis in diagnoses])
    rows = [_row(k, *named) for k, named in enumerate(zip(names, diagnoses, strict=True))]
    rows += [_not_diagnosed(*failure) for failure in failures]
    percent = any(diagnosis.record.op_in_percent for diagnosis in diagnoses)
    S, OP = ("S [% of span]", "OP\u00a0± [%]") if percent else ("S", "OP\u00a0±")
    return Table(
        ["Loop", "Finding", "Probability", S, "Period", OP, "Data", "Trend of OP", "What to do"],
        rows,
        "Worst first, S with its 95 % interval.",
        sortable=True,
    )


def _row(k: int, name: str, diagnosis: Diagnosis) -> list[Cell]:
    record, identification, oscillation = diagnosis.record, diagnosis.identification, diagnosis.oscillation
    percent = record.op_in_percent
    unit = "" if percent else f"\u00a0{record.op_unit_short}"
    size = EMPTY_CELL
    if identification is not None and (text := labels.S_text(diagnosis)):
        size = Cell(text, sort=_finite(identification.S) if percent else "")
    finding = labels.finding_line(diagnosis)
    order = f"{_RANK[diagnosis.verdict]} {finding}"
    data, data_icon = _data_quality(diagnosis)
    scale = SPARK_HALF_RANGE if percent else None
    period = swing = probability = EMPTY_CELL
    if diagnosis.loop_state.in_control:
        probability = Cell(labels.format_probability(diagnosis.probability), sort=_finite(diagnosis.probability))
    if oscillation.oscillating:
        period = Cell(labels.format_duration(oscillation.period), sort=_finite(oscillation.period))
        swing = Cell(
            f"{labels.format_number(oscillation.amplitude_op)}{unit}",
            sort=_finite(oscillation.amplitude_op) if percent else "",
        )
    return [
        Cell(name, href=f"#{loop_anchor(k)}"),
        Cell(finding, sort=order, mark=labels.finding_icon(diagnosis)),
        probability,
        size,
        period,
        swing,
        Cell(data, mark=data_icon),
        Cell(sparkline(recent_swing(record.op, record.dt), "trend of OP", scale)),
        Cell(diagnosis.reason if diagnosis.loop_state.state == "bad_data" else diagnosis.action),
    ]


def _not_diagnosed(name: str, reason: str) -> list[Cell]:
    verdict = Cell("Not diagnosed", sort=f"{len(_RANK)}", mark="unknown")
    return [Cell(name), verdict, *6 * [EMPTY_CELL], Cell(reason)]


def _data_quality(diagnosis: Diagnosis) -> tuple[str, StatusIcon]:
    severities = {check.severity for check in diagnosis.quality.checks}
    if not diagnosis.quality.usable:
        return "rejected", "alert"
    return ("limited", "unknown") if "warn" in severities else ("good", "good")


def _finite(value: float) -> float | str:
    return float(value) if np.isfinite(value) else ""
