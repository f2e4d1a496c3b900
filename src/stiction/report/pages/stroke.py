"""The page of a stroked valve: trend and signature."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.report import labels, style
from stiction.report.blocks import Block, Figure, Table, Text

if TYPE_CHECKING:
    from stiction.records import LoopRecord

__all__ = ["stroke_blocks"]


def stroke_blocks(record: LoopRecord, *, valve: str, op: str) -> list[Block]:
    """Return OP and valve position over time and against each other."""
    duration, step = labels.format_duration(record.duration), labels.format_duration(record.dt)
    lead = f"The valve {valve}, driven for {duration} in steps of {step}."
    settings = Table(["Setting", "Value"], [["Valve", valve], ["OP", op], ["Source", record.provenance.source]])
    return [Text(lead, kind="lead"), _trend(record), _signature(record), settings]


def _trend(record: LoopRecord) -> Figure:
    name, unit = labels.time_unit(record.duration)
    data = [style.thin_trace(record.time / unit, record.op, "OP (controller output)", style.line_style(style.OP))]
    if record.mv is not None:
        data.append(style.thin_trace(record.time / unit, record.mv, "Valve position", style.line_style(style.MV)))
    caption = "Where the dotted line is flat, the stem rests while its input moves; where it steps, the stem slips."
    return Figure(style.plot(data, f"Time [{name}]", "% of span"), "OP and valve position over time", caption)


def _signature(record: LoopRecord) -> Figure:
    assert record.mv is not None
    low, high = float(record.op.min()), float(record.op.max())
    data = [
        style.thin_trace(record.op, record.mv, "Valve", style.line_style(style.MV)),
        style.trace([low, high], [low, high], "Ideal valve", style.line_style(style.SP, 1.0)),
    ]
    plot = style.plot(data, "OP (controller output) [% of span]", "Valve position [% of span]")
    caption = "The width of the loop is the deadband plus stickband S; vertical pieces are slip jumps J."
    return Figure(plot, "Valve signature", caption, height=420)
