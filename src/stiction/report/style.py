"""Style of the figures: colours, lines and the plot template. Colour is never the only sign."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.report.downsample import downsample

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "ALERT",
    "BORDER_COLOR",
    "GRID",
    "MODEL",
    "MV",
    "OP",
    "PV",
    "SECONDARY_COLOR",
    "SP",
    "TEMPLATE",
    "TEXT_COLOR",
    "axis",
    "colorbar",
    "line_style",
    "markers",
    "plot",
    "thin_trace",
    "trace",
    "vertical_line",
]

PV = "#0072B2"
OP = "#D55E00"
MV = "#00735A"
SP = "#5A6270"
MODEL = "#1B1F24"
ALERT = "#B3261E"
TEXT_COLOR = "#22272E"
SECONDARY_COLOR = "#5A6270"
BORDER_COLOR = "#C9CFD6"
GRID = "#E9ECEF"

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', 'Liberation Sans', Arial, sans-serif"

_DASH = {PV: "solid", OP: "dash", MV: "dot", SP: "longdash", MODEL: "dashdot"}


def line_style(color: str, width: float = 1.5, **more: Any) -> dict[str, Any]:
    """Return the line style of a signal: its colour and the dash of that colour.

    Examples
    --------
    >>> line_style(OP)
    {'color': '#D55E00', 'dash': 'dash', 'width': 1.5}
    """
    return {"color": color, "dash": _DASH.get(color, "solid"), "width": width, **more}


def trace(x: Any, y: Any, name: str, style: dict[str, Any]) -> dict[str, Any]:
    """Return one series over another as a line.

    Examples
    --------
    >>> trace([0.0, 1.0], [2.0, 3.0], "OP", line_style(OP))["mode"]
    'lines'
    """
    return {"type": "scatter", "mode": "lines", "x": x, "y": y, "name": name, "line": style}


def thin_trace(x: NDArray[np.float64], y: NDArray[np.float64], name: str, style: dict[str, Any]) -> dict[str, Any]:
    """Return one series over another as a line, downsampled."""
    keep = downsample(y)
    return trace(x[keep], y[keep], name, style)


def markers(x: Any, y: Any, name: str, symbol: str, color: str = ALERT, size: int = 7) -> dict[str, Any]:
    """Return one series over another as markers."""
    marker = {"symbol": symbol, "size": size, "color": color}
    return {"type": "scatter", "mode": "markers", "x": x, "y": y, "name": name, "marker": marker}


def axis(title: str, **more: Any) -> dict[str, Any]:
    """Return an axis with a title."""
    return {"title": {"text": title}, **more}


def plot(data: list[dict[str, Any]], x: str, y: str, **layout: Any) -> dict[str, Any]:
    """Return a plot of series over one pair of axes with these titles; other parts of the layout by their name."""
    return {"data": data, "layout": {"xaxis": axis(x), "yaxis": axis(y), **layout}}


def vertical_line(x: float) -> dict[str, Any]:
    """Return a dotted vertical line at `x`, below the data."""
    style = {"color": SECONDARY_COLOR, "dash": "dot", "width": 1}
    return {"type": "line", "x0": x, "x1": x, "y0": 0, "y1": 1, "yref": "paper", "line": style, "layer": "below"}


def colorbar(title: str) -> dict[str, Any]:
    """Style of a thin colour bar."""
    font = {"size": 12, "color": TEXT_COLOR}
    return {"title": {"text": title, "side": "right", "font": font}, "thickness": 8, "outlinewidth": 0, "xpad": 6}


BELOW_BUTTONS = 46
"""Top margin of a figure whose legend or labels would reach under the plot's buttons [px]."""

_AXIS = {
    "automargin": True,
    "gridcolor": GRID,
    "hoverformat": ".4~g",
    "linecolor": BORDER_COLOR,
    "showline": True,
    "ticks": "outside",
    "ticklen": 4,
    "tickcolor": BORDER_COLOR,
    "tickfont": {"color": SECONDARY_COLOR},
    "title": {"standoff": 8, "font": {"size": 12, "color": TEXT_COLOR}},
    "zeroline": False,
}

TEMPLATE: dict[str, Any] = {
    "layout": {
        "font": {"family": FONT, "size": 12, "color": TEXT_COLOR},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "#FFFFFF",
        "margin": {"l": 58, "r": 14, "t": 14, "b": 44},
        "xaxis": _AXIS,
        "yaxis": _AXIS,
        "hovermode": "closest",
        "hoverlabel": {
            "bgcolor": "#FFFFFF",
            "bordercolor": BORDER_COLOR,
            "font": {"family": FONT, "size": 12, "color": TEXT_COLOR},
            "namelength": -1,
        },
        "modebar": {"bgcolor": "rgba(255,255,255,0.85)", "color": "#9AA3AD", "activecolor": TEXT_COLOR},
        "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.0, "yanchor": "bottom", "itemwidth": 36},
        "dragmode": "zoom",
    }
}
"""Merged under every figure's own layout by the page."""
