"""HTML page of ``stiction valve-test analyse``: verdict, trend with slips and steps marked, signature, readings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.apps.stroke_page import line_trace
from stiction.report import Block, Figure, Heading, SideBySide, Table, Text, labels, style, write_page
from stiction.valvetests import RampTest, StepTest
from stiction.valvetests.result import unit_of

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.valvetests import TestComparison, ValveTest

__all__ = ["write_valve_test_page"]


def write_valve_test_page(found: ValveTest, path: Path, changes: TestComparison | None = None) -> Path:
    """Write the page of one valve test."""
    rows = [[name, value.text(unit_of(name)), value.n or None] for name, value in found.quantities().items()]
    blocks: list[Block] = [
        Text(f"{found.verdict.capitalize()}. {found.reason}", kind="lead"),
        Table(["Quantity", f"Value ({found.brackets})", "Readings"], rows),
        Heading("The test"),
        _trend(found),
        Heading("The valve"),
    ]
    if isinstance(found, RampTest):
        blocks += [SideBySide([_signature(found), _over_travel(found)]), _ramps(found)]
    elif isinstance(found, StepTest):
        blocks += [_signature(found), _steps(found)]
    if found.unknown:
        blocks += [Heading("What this test cannot determine"), Text("\n\n".join(found.unknown))]
    if changes is not None:
        blocks += [Heading("Comparison with the earlier test"), Text(changes.summary())]
    blocks += [Heading("Where this comes from"), _origin(found)]
    return write_page(
        found.record.tag,
        blocks,
        path,
        subtitle=f"{found.kind.capitalize()}, {labels.format_duration(found.record.duration)}",
    )


def _stem(found: ValveTest) -> tuple[np.ndarray, str]:
    """Return the stem signal and its name."""
    if isinstance(found, RampTest):
        return found.position, "Valve position as read [% of span]"
    stem = found.record.mv if found.signal == "mv" else found.record.pv
    assert stem is not None
    return stem, "Valve position [% of span]" if found.signal == "mv" else "Flow [engineering units]"


def _trend(found: ValveTest) -> Figure:
    """Return OP and stem over time with every slip or step marked."""
    record = found.record
    name, unit = labels.time_unit(record.duration)
    stem, title = _stem(found)
    own_axis = {} if found.signal == "mv" or isinstance(found, RampTest) else {"yaxis": "y2"}
    data = [
        line_trace(record.time / unit, record.op, "OP (controller output)", style.line_style(style.OP)),
        {**line_trace(record.time / unit, stem, title.split(" [")[0], style.line_style(style.MV)), **own_axis},
    ]
    layout: dict[str, Any] = {"xaxis": {"title": {"text": f"Time [{name}]"}}, "yaxis": {"title": {"text": "% of span"}}}
    if own_axis:
        layout["yaxis2"] = {"overlaying": "y", "side": "right", "title": {"text": title}}
    if isinstance(found, RampTest):
        if np.isfinite(found.model).any():
            fitted = line_trace(record.time / unit, found.model, "Fitted valve", style.line_style(style.MODEL, 1.0))
            data.append(fitted)
        for kind, symbol in (("slip", "triangle-up"), ("stick", "square")):
            here = [event for event in found.events if event.kind == kind]
            data.append(_marks([e.time / unit for e in here], [e.position for e in here], kind, symbol))
        slips = sum(event.kind == "slip" for event in found.events)
        counted = f"{labels.count_noun(len(found.ramps), 'ramp')} and {labels.count_noun(slips, 'slip')}"
        caption = f"{counted}; triangles mark slips."
    else:
        assert isinstance(found, StepTest)
        for moved, symbol, called in ((True, "triangle-up", "response"), (False, "x", "no response")):
            here = [step for step in found.steps if step.responded is moved]
            data.append(_marks([s.time / unit for s in here], [s.op_after for s in here], called, symbol))
        still = sum(not step.responded for step in found.steps)
        caption = f"{labels.count_noun(len(found.steps), 'step')}, {still} of them without a response (crosses)."
    return Figure({"data": data, "layout": layout}, "OP and stem over time", caption, height=420)


def _signature(found: ValveTest) -> Figure:
    """Return the stem against OP."""
    stem, title = _stem(found)
    data = [line_trace(found.record.op, stem, "Test", style.line_style(style.MV))]
    if isinstance(found, RampTest) and np.isfinite(found.model).any():
        data.append(line_trace(found.record.op, found.model, "Fitted valve", style.line_style(style.MODEL, 1.0)))
    layout = {"xaxis": {"title": {"text": "OP (controller output) [% of span]"}}, "yaxis": {"title": {"text": title}}}
    caption = "The width of the loop is the deadband plus stickband; vertical pieces are slip jumps."
    return Figure({"data": data, "layout": layout}, "Valve signature", caption, height=400)


def _over_travel(found: RampTest) -> Figure:
    """Return stickband and slip jump over the travel, for opening and closing."""
    data: list[dict[str, Any]] = []
    for direction, symbol, way in ((1, "triangle-up", "opening"), (-1, "triangle-down", "closing")):
        bins = [b for b in found.travel if b.direction == direction and b.n]
        middle = [0.5 * (b.low + b.high) for b in bins]
        for name, color in (("sb", style.PV), ("sj", style.OP)):
            values = [getattr(b, name) for b in bins]
            spread = [np.nan_to_num(getattr(b, f"{name}_spread")) for b in bins]
            trace = _marks(middle, values, f"{name}, {way}", symbol, color)
            data.append({**trace, "error_y": {"type": "data", "array": spread, "thickness": 1}})
    layout = {
        "xaxis": {"title": {"text": "Valve position [% of span]"}},
        "yaxis": {"title": {"text": "% of span"}, "rangemode": "tozero"},
    }
    caption = "Stick band sb and slip jump sj in each stretch of the travel; the bar is the standard deviation."
    return Figure({"data": data, "layout": layout}, "sb and sj over the travel", caption, height=400)


def _ramps(found: RampTest) -> Table:
    rows = [[r.rate, r.op_start, r.op_end, r.behaviour, r.slips, r.sb, r.sj, r.reason] for r in found.ramps]
    columns = ["Rate [%/s]", "From [%]", "To [%]", "Behaviour", "Slips", "sb [%]", "sj [%]", "Why"]
    return Table(columns, rows, "Every ramp.", sortable=True)


def _steps(found: StepTest) -> Table:
    keys = ("dead_time", "t63", "t86", "t98", "overshoot")
    rows = [
        [step.time, step.op_before, step.op_after, "yes" if step.responded else "no", *(getattr(step, k) for k in keys)]
        for step in found.steps
    ]
    columns = [
        "Time [s]", "From [%]", "To [%]", "Response", "Dead time [s]", "T63 [s]", "T86 [s]", "T98 [s]", "Overshoot [%]",
    ]  # fmt: skip
    return Table(columns, rows, "Every step, in the words of ISA-75.25.01.", sortable=True)


def _origin(found: ValveTest) -> Table:
    record = found.record
    rows = [
        ["File", record.provenance.source],
        ["SHA-256", record.provenance.sha256],
        ["Read from", found.signal.upper()],
    ]
    return Table(
        ["What", "Value"], [*rows, *([name, str(value)] for name, value in found.settings.items() if value is not None)]
    )


def _marks(x: list[float], y: list[float], name: str, symbol: str, color: str = style.ALERT) -> dict[str, Any]:
    marker = {"symbol": symbol, "size": 7, "color": color}
    return {"type": "scatter", "mode": "markers", "x": x, "y": y, "name": name, "marker": marker}
