"""The page of a valve test: verdict, trend with slips and steps marked, signature, readings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import labels, style
from stiction.report.blocks import Block, Figure, Heading, SideBySide, Table, Text
from stiction.valvetests import RampTest, StepTest
from stiction.valvetests.result import unit_of

if TYPE_CHECKING:
    from stiction.valvetests import TestComparison, ValveTest

__all__ = ["valve_test_blocks"]


def valve_test_blocks(test: ValveTest, changes: TestComparison | None = None) -> list[Block]:
    """Return what is shown of one valve test, with the changes since an earlier test."""
    rows = [[name, value.text(unit_of(name)), value.n or None] for name, value in test.quantities().items()]
    blocks: list[Block] = [
        Text(f"{test.verdict.capitalize()}. {test.reason}", kind="lead"),
        Table(["Quantity", f"Value ({test.brackets})", "Readings"], rows),
        Heading("The test"),
        _trend(test),
        Heading("The valve"),
    ]
    if isinstance(test, RampTest):
        blocks += [SideBySide([_signature(test), _over_travel(test)]), _ramps(test)]
    elif isinstance(test, StepTest):
        blocks += [_signature(test), _steps(test)]
    if test.unknown:
        blocks += [Heading("What this test cannot determine"), Text("\n\n".join(test.unknown))]
    if changes is not None:
        blocks += [Heading("Comparison with the earlier test"), Text(changes.summary())]
    return [*blocks, Heading("Where this comes from"), _origin(test)]


def _stem(test: ValveTest) -> tuple[np.ndarray, str]:
    """Return the stem signal and its name."""
    if isinstance(test, RampTest):
        return test.position, "Valve position as read [% of span]"
    stem = test.record.mv if test.signal == "mv" else test.record.pv
    assert stem is not None
    return stem, "Valve position [% of span]" if test.signal == "mv" else "Flow [engineering units]"


def _trend(test: ValveTest) -> Figure:
    """Return OP and stem over time with every slip or step marked."""
    record = test.record
    name, unit = labels.time_unit(record.duration)
    stem, title = _stem(test)
    own_axis = {} if test.signal == "mv" or isinstance(test, RampTest) else {"yaxis": "y2"}
    data = [
        style.thin_trace(record.time / unit, record.op, "OP (controller output)", style.line_style(style.OP)),
        {**style.thin_trace(record.time / unit, stem, title.split(" [")[0], style.line_style(style.MV)), **own_axis},
    ]
    right = {"yaxis2": style.axis(title, overlaying="y", side="right")} if own_axis else {}
    if isinstance(test, RampTest):
        if np.isfinite(test.model).any():
            fitted = style.thin_trace(
                record.time / unit, test.model, "Fitted valve", style.line_style(style.MODEL, 1.0)
            )
            data.append(fitted)
        for kind, symbol in (("slip", "triangle-up"), ("stick", "square")):
            here = [event for event in test.events if event.kind == kind]
            data.append(style.markers([e.time / unit for e in here], [e.position for e in here], kind, symbol))
        slips = sum(event.kind == "slip" for event in test.events)
        counted = f"{labels.count_noun(len(test.ramps), 'ramp')} and {labels.count_noun(slips, 'slip')}"
        caption = f"{counted}; triangles mark slips."
    else:
        assert isinstance(test, StepTest)
        for moved, symbol, called in ((True, "triangle-up", "response"), (False, "x", "no response")):
            here = [step for step in test.steps if step.responded is moved]
            data.append(style.markers([s.time / unit for s in here], [s.op_after for s in here], called, symbol))
        still = sum(not step.responded for step in test.steps)
        caption = f"{labels.count_noun(len(test.steps), 'step')}, {still} of them without a response (crosses)."
    plot = style.plot(data, f"Time [{name}]", "% of span", **right)
    return Figure(plot, "OP and stem over time", caption, height=420)


def _signature(test: ValveTest) -> Figure:
    """Return the stem against OP."""
    stem, title = _stem(test)
    data = [style.thin_trace(test.record.op, stem, "Test", style.line_style(style.MV))]
    if isinstance(test, RampTest) and np.isfinite(test.model).any():
        data.append(style.thin_trace(test.record.op, test.model, "Fitted valve", style.line_style(style.MODEL, 1.0)))
    caption = "The width of the loop is the deadband plus stickband; vertical pieces are slip jumps."
    return Figure(style.plot(data, "OP (controller output) [% of span]", title), "Valve signature", caption, height=400)


def _over_travel(test: RampTest) -> Figure:
    """Return stickband and slip jump over the travel, for opening and closing."""
    data: list[dict[str, Any]] = []
    for direction, symbol, way in ((1, "triangle-up", "opening"), (-1, "triangle-down", "closing")):
        bins = [b for b in test.travel if b.direction == direction and b.n]
        middle = [0.5 * (b.low + b.high) for b in bins]
        for name, color in (("sb", style.PV), ("sj", style.OP)):
            values = [getattr(b, name) for b in bins]
            spread = [np.nan_to_num(getattr(b, f"{name}_spread")) for b in bins]
            trace = style.markers(middle, values, f"{name}, {way}", symbol, color)
            data.append({**trace, "error_y": {"type": "data", "array": spread, "thickness": 1}})
    plot = style.plot(data, "Valve position [% of span]", "% of span")
    plot["layout"]["yaxis"]["rangemode"] = "tozero"
    caption = "Stick band sb and slip jump sj in each stretch of the travel; the bar is the standard deviation."
    return Figure(plot, "sb and sj over the travel", caption, height=400)


def _ramps(test: RampTest) -> Table:
    rows = [[r.rate, r.op_start, r.op_end, r.behaviour, r.slips, r.sb, r.sj, r.reason] for r in test.ramps]
    columns = ["Rate [%/s]", "From [%]", "To [%]", "Behaviour", "Slips", "sb [%]", "sj [%]", "Why"]
    return Table(columns, rows, "Every ramp.", sortable=True)


def _steps(test: StepTest) -> Table:
    keys = ("dead_time", "t63", "t86", "t98", "overshoot")
    rows = [
        [step.time, step.op_before, step.op_after, "yes" if step.responded else "no", *(getattr(step, k) for k in keys)]
        for step in test.steps
    ]
    columns = [
        "Time [s]", "From [%]", "To [%]", "Response", "Dead time [s]", "T63 [s]", "T86 [s]", "T98 [s]", "Overshoot [%]",
    ]  # fmt: skip
    return Table(columns, rows, "Every step, in the words of ISA-75.25.01.", sortable=True)


def _origin(test: ValveTest) -> Table:
    record = test.record
    rows = [
        ["File", record.provenance.source],
        ["SHA-256", record.provenance.sha256],
        ["Read from", test.signal.upper()],
    ]
    return Table(
        ["What", "Value"], [*rows, *([name, str(value)] for name, value in test.settings.items() if value is not None)]
    )
