"""HTML page of ``stiction stroke``: trend and signature of one valve."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.report import Figure, Table, Text, labels, style, write_page
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.records import LoopRecord

__all__ = ["line_trace", "trend", "valve_signature", "write_stroke_page"]


def write_stroke_page(record: LoopRecord, path: Path, *, valve: str, op: str) -> Path:
    """Write OP and valve position over time and against each other."""
    duration, step = labels.format_duration(record.duration), labels.format_duration(record.dt)
    lead = f"The valve {valve}, driven for {duration} in steps of {step}."
    settings = Table(["Setting", "Value"], [["Valve", valve], ["OP", op], ["Source", record.provenance.source]])
    return write_page("Valve stroke", [Text(lead, kind="lead"), trend(record), valve_signature(record), settings], path)


def trend(record: LoopRecord) -> Figure:
    """Return OP and valve position over time."""
    name, unit = labels.time_unit(record.duration)
    data = [line_trace(record.time / unit, record.op, "OP (controller output)", style.line_style(style.OP))]
    if record.mv is not None:
        data.append(line_trace(record.time / unit, record.mv, "Valve position", style.line_style(style.MV)))
    layout = {"xaxis": {"title": {"text": f"Time [{name}]"}}, "yaxis": {"title": {"text": "% of span"}}}
    caption = "Where the dotted line is flat, the stem rests while its input moves; where it steps, the stem slips."
    return Figure({"data": data, "layout": layout}, "OP and valve position over time", caption)


def valve_signature(record: LoopRecord) -> Figure:
    """Return the valve position against the OP."""
    assert record.mv is not None
    data = [line_trace(record.op, record.mv, "Valve", style.line_style(style.MV))]
    low, high = float(record.op.min()), float(record.op.max())
    data.append(line_trace([low, high], [low, high], "Ideal valve", style.line_style(style.SP, 1.0)))
    layout = {
        "xaxis": {"title": {"text": "OP (controller output) [% of span]"}},
        "yaxis": {"title": {"text": "Valve position [% of span]"}},
    }
    caption = "The width of the loop is the deadband plus stickband S; vertical pieces are slip jumps J."
    return Figure({"data": data, "layout": layout}, "Valve signature", caption, height=420)


def line_trace(x: Any, y: Any, name: str, line: dict[str, Any]) -> dict[str, Any]:
    """Return one series over another as a line, downsampled."""
    if len(x) > 2:
        keep = downsample(y)
        x, y = x[keep], y[keep]
    return style.trace(x, y, name, line)
