"""Figures of the paper, from the data of `stiction.paper`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import labels, style
from stiction.report.blocks import Figure
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.paper.eq5 import Response
    from stiction.paper.eqs6to7 import Equations6and7
    from stiction.paper.fig2 import Panel
    from stiction.paper.fig5 import Figure5
    from stiction.paper.fig6 import Figure6
    from stiction.paper.fig7 import Figure7
    from stiction.paper.fig8 import Figure8
    from stiction.paper.lab_valve import LabRamp

__all__ = ["df_component", "fig2", "fig5", "fig6", "fig7", "fig8", "lab_ramp", "stem_response"]

_MODELS = {
    "three parameters, corrected (eq. 5)": style.line_style(style.MV, 3.5, dash="solid"),
    "two parameters": style.line_style(style.PV, 1.6, dash="dash"),
    "one parameter (eq. 4)": style.line_style(style.ALERT, 1.4, dash="longdash"),
    "three parameters, printed (eq. 5)": style.line_style(style.MODEL, 1.2, dash="dot"),
}
_FORMS = {
    "printed": style.line_style(style.ALERT, 1.6, dash="dot"),
    "roots repaired": style.line_style(style.OP, 1.6),
    "corrected": style.line_style(style.MV, 2.2, dash="solid"),
    "integer": style.line_style(style.PV, 1.6, dash="longdash"),
}
_NAMES = {
    "printed": "printed",
    "roots repaired": "printed, E3 mended",
    "corrected": "corrected",
    "integer": "levels 0, ±d",
}


def fig2(panel: Panel) -> Figure:
    """Return stem against pressure, one panel in one reading."""
    balance = panel.pressure / 3.0
    data = [
        _line(panel.pressure, balance, "A P / K", style.line_style(style.SP, 1.0)),
        _line(panel.pressure, panel.position, "Stem", style.line_style(style.MV, 2.0, dash="solid")),
    ]
    if panel.name == "2a":
        seen = "without friction the stem follows the balance of air and spring"
    elif panel.slips:
        seen = (
            f"first break at {panel.first_break:.2f} psi, then {panel.slips} slips of {panel.slip:.3g} in, "
            f"{panel.spacing:.3g} psi apart; at rest {100.0 * panel.at_rest:.0f} % of the time"
        )
    else:
        seen = f"one break at {panel.first_break:.2f} psi, then the stem follows, never below {panel.slowest:.3g} in/s"
    title = f"Fig. {panel.name}, reading {panel.reading}: slope {panel.slope:g} {panel.slope_unit}"
    return Figure(style.plot(data, "Pressure [psi]", "Stem position [in]"), title, f"Simulated: {seen}.", 300)


def lab_ramp(name: str, ramp: LabRamp) -> Figure:
    """Return OP and the stem by model on one ramp of the laboratory valve."""
    unit, seconds = labels.time_unit(float(ramp.time[-1]))
    time = ramp.time / seconds
    data = [_line(time, ramp.op, "OP", style.line_style(style.OP, 1.2))]
    data += [_line(time, ramp.position[model], model, form) for model, form in _MODELS.items()]
    behaviour = {"follow": "stick, jump, follow", "staircase": "stairs"}[ramp.paper]
    agree = [model for model, seen in ramp.behaviour.items() if seen == ramp.paper]
    caption = f"Simulated. The paper saw {behaviour}; so do: {', '.join(agree)}."
    layout = style.plot(data, f"Time [{unit}]", "OP and stem [% of span]")
    return Figure(layout, f"Fig. {name}: {ramp.rate:g} %/s", caption, 380)


def fig5(figure: Figure5) -> tuple[Figure, Figure]:
    """Return flow and OP over time, and stick band and jump over the travel."""
    minutes = figure.time / 60.0
    data = [
        {**_line(minutes, figure.pv["corrected"], "Flow (PV)", style.line_style(style.PV, 1.4, dash="solid"))},
        {**_line(minutes, figure.op, "OP", style.line_style(style.OP, 1.4)), "yaxis": "y2"},
        {
            **_line(minutes, figure.position["corrected"], "Stem (not measured)", style.line_style(style.MV, 1.4)),
            "yaxis": "y2",
        },
    ]
    first = Figure(
        _stacked(data, ["Flow [m³/h]", "OP, stem<br>[% of span]"], "Time [min]"),
        "Fig. 5: ramp of a flow loop",
        "Simulated: on a slow ramp the flow goes in stairs whose width and height vary over the travel.",
        420,
    )
    middle = [0.5 * (stretch.low + stretch.high) for stretch in figure.test.travel]
    marks = []
    for name, color, symbol in (("sb", style.OP, "circle"), ("sj", style.MV, "square")):
        truth = getattr(figure, name)
        marks.append(_line(figure.travel, truth, f"{name}, given", style.line_style(color, 1.4)))
        read = [getattr(stretch, name) for stretch in figure.test.travel]
        marker = {"symbol": symbol, "size": 8, "color": color}
        marks.append({**_line(middle, read, f"{name}, read from the flow", {}), "mode": "markers", "marker": marker})
    second = Figure(
        style.plot(marks, "Stem position [% of span]", "sb, sj [% of span]"),
        "Stick band and jump over the travel",
        "The ramp test reads both back from the noisy flow alone.",
        420,
    )
    return first, second


def stem_response(response: Response) -> Figure:
    """Return OP and the stem of eq. 5 as printed and repaired."""
    data = [_line(response.time, response.op, "OP", style.line_style(style.OP, 1.2))]
    data += [_line(response.time, response.position[form], f"Stem, {form}", _FORMS[form]) for form in response.position]
    layout = style.plot(data, "Time [s]", "OP and stem [% of span]")
    caption = (
        f"Printed and repaired differ by up to {labels.format_number(response.difference)} % of span; "
        f"the OP moves by up to {labels.format_number(response.increment)} % in a sample."
    )
    return Figure(layout, f"Eq. 5: {response.name}", caption, 320)


def df_component(equations: Equations6and7, part: str) -> Figure:
    """Return the real (eq. 6) or imaginary (eq. 7) part of N over A / d."""
    take = np.real if part == "real" else np.imag
    data = [_line(equations.ratio, take(n), _NAMES[form], _FORMS[form]) for form, n in equations.n.items()]
    for family, symbol in (("half", "circle-open"), ("integer", "diamond-open")):
        marker = {"symbol": symbol, "size": 8, "color": style.TEXT_COLOR}
        name = f"measured, {'levels ±d/2' if family == 'half' else 'levels 0, ±d'}"
        values = take(equations.numeric[family])
        data.append({**_line(equations.checked, values, name, {}), "mode": "markers", "marker": marker})
    if part == "real":
        title, seen = "Eq. 6: real part of N", "only the corrected form passes through what the valve itself does"
    else:
        title, seen = "Eq. 7: imaginary part of N", "eq. 7 is right as printed, for its family of rest levels"
    layout = style.plot(data, "A / d [-]", f"{part.capitalize()} part of N [-]")
    return Figure(layout, title, f"Circles and diamonds are measured on the valve: {seen}.", 400)


def fig6(figure: Figure6) -> Figure:
    """Return PV, OP and stem of the level loop."""
    return _loop(
        figure.record,
        "Fig. 6: a level loop with d = 5.1 %",
        "Simulated: the stem jumps by the stiction band whenever the controller has overcome it.",
    )


def fig7(figure: Figure7, *, printed: bool) -> Figure:
    """Return the Nyquist plot with -1/N(A), as printed or corrected."""
    data = [_line(figure.response.real, figure.response.imag, "L(jω)", style.line_style(style.PV, 1.8, dash="solid"))]
    for source in ("printed", "roots repaired") if printed else ("corrected",):
        for family in ("half", "integer"):
            mine = [curve for curve in figure.curves if (curve.source, curve.family) == (source, family)]
            if not mine:
                continue
            gap = complex(np.nan, np.nan)
            value = np.concatenate([np.append(curve.value, gap) for curve in mine])
            value = np.where(np.isfinite(value), value, gap)
            form = _FORMS["integer" if family == "integer" else source]
            name = _NAMES[source] if printed else {"half": "levels ±d/2", "integer": "levels 0, ±d"}[family]
            data.append(_line(np.real(value), np.imag(value), f"-1/N(A), {name}", form))
    for cycle in figure.printed if printed else figure.corrected:
        if cycle.method != "describing function":
            continue
        at = (
            np.interp(cycle.omega, figure.omega, figure.response.real),
            np.interp(cycle.omega, figure.omega, figure.response.imag),
        )
        symbol = "circle" if cycle.kind == "cycle" else "x"
        text = f"{cycle.period:.4g} s" if cycle.kind == "cycle" else ""
        marker = {"symbol": symbol, "size": 9, "color": style.TEXT_COLOR}
        place = {"mode": "markers+text", "text": [text], "textposition": "bottom right", "showlegend": False}
        data.append({**_line([at[0]], [at[1]], cycle.kind, {}), "marker": marker, **place})
    layout = style.plot(data, "Real part", "Imaginary part")
    layout["layout"]["xaxis"]["range"] = [-2.4, 0.2]
    layout["layout"]["yaxis"]["range"] = [-1.2, 0.1]
    if printed:
        title = "Fig. 7, as printed"
        seen = "with its roots mended the printed eq. 6 gives three crossings, of which C is off by a missing factor 2"
    else:
        title = "Fig. 7, corrected, both families"
        seen = "four stable cycles, two in each family of rest levels; the paper shows one family"
    return Figure(layout, title, f"Filled circles are stable cycles, crosses boundaries: {seen}.", 480)


def fig8(figure: Figure8) -> Figure:
    """Return PV, OP and stem of the example loop, with the pulse."""
    size, begin, length = figure.pulse
    pulse = {
        "type": "rect", "xref": "x", "yref": "paper", "x0": begin / 60.0, "x1": (begin + length) / 60.0, "y0": 0.0,
        "y1": 1.0, "fillcolor": style.BORDER_COLOR, "opacity": 0.6, "line": {"width": 0}, "layer": "below",
    }  # fmt: skip
    caption = (
        f"Simulated: a pulse of {size:g} % for {length:g} s at {begin:g} s (shaded) moves the loop from cycle A, two "
        "rest levels, to cycle C, four: the stem then sticks twice in the same direction."
    )
    return _loop(figure.record, "Fig. 8: from one limit cycle to another", caption, [pulse])


def _loop(record: Any, title: str, caption: str, shapes: Sequence[dict[str, Any]] = ()) -> Figure:
    time = record.time / 60.0
    data = [
        _line(time, record.sp, "Set point", style.line_style(style.SP, 1.2)),
        _line(time, record.pv, "Process output (PV)", style.line_style(style.PV, 1.5, dash="solid")),
        {
            **_line(time, record.op, "Controller output (OP)", style.line_style(style.OP, 1.5, dash="solid")),
            "yaxis": "y2",
        },
        {**_line(time, record.mv, "Stem", style.line_style(style.MV, 1.5, dash="solid")), "yaxis": "y3"},
    ]
    layout = _stacked(data, ["PV, SP", "OP<br>[% of span]", "Stem<br>[% of span]"], "Time [min]")
    layout["layout"]["shapes"] = list(shapes)
    return Figure(layout, title, caption, 520)


def _stacked(data: list[dict[str, Any]], names: Sequence[str], x: str) -> dict[str, Any]:
    """Panels one above the other on one time axis, from the top down."""
    n, gap = len(names), 0.06
    height = (1.0 - gap * (n - 1)) / n
    layout: dict[str, Any] = {"xaxis": {"title": {"text": x}, "anchor": "y" if n == 1 else f"y{n}"}}
    for k, name in enumerate(names):
        top = 1.0 - k * (height + gap)
        axis = "yaxis" if k == 0 else f"yaxis{k + 1}"
        layout[axis] = {"domain": [max(top - height, 0.0), top], "title": {"text": name}}
    return {"data": data, "layout": layout}


def _line(x: Any, y: Any, name: str, line: dict[str, Any]) -> dict[str, Any]:
    if len(x) > 2000:
        keep = downsample(y)
        x, y = x[keep], y[keep]
    return style.trace(x, y, name, {**line, "simplify": False})
