"""Other controller settings: the remaining oscillation against the loss of control performance."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from stiction.report import style
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.compensation import Retuning, TradeOff

__all__ = ["retuning"]

MAX_PLOTTED_IAE = 12.0
"""Largest IAE of a load step, relative to the present settings, that is drawn [-]."""


def retuning(retuned: Retuning) -> Figure | None:
    """Return the PV deviation of the remaining cycle over the IAE of a load step, a point for each setting; or None."""
    drawn = [
        setting for setting in retuned.curve if math.isfinite(setting.load_iae) and setting.load_iae <= MAX_PLOTTED_IAE
    ]
    if not drawn:
        return None
    pid = retuned.controller
    chosen = [setting for setting in drawn if setting.Kc == pid.Kc and setting.Ti == pid.Ti]
    data: list[dict[str, Any]] = [
        _point_trace(
            [setting for setting in drawn if not setting.allowed],
            "beyond the limits",
            style.SECONDARY_COLOR,
            "circle-open",
            7,
        ),
        _point_trace([setting for setting in drawn if setting.allowed], "within the limits", style.PV, "circle", 8),
        _point_trace(chosen, "the slowest with good control", style.OP, "diamond", 12),
    ]
    layout = {
        "xaxis": {"type": "log", "title": {"text": "IAE of a load step, relative to the present"}},
        "yaxis": {"rangemode": "tozero", "title": {"text": "PV std of the remaining cycle"}},
        "shapes": [style.vertical_line(1)],
    }
    ticks = [t for t in (0.2, 0.5, 1, 2, 5, 10) if t <= MAX_PLOTTED_IAE]
    layout["xaxis"] |= {"tickvals": ticks, "ticktext": [f"{t:g}" for t in ticks]}
    lost = len(retuned.curve) - len(drawn)
    caption = (
        "Each point is a setting of Kc and Ti (hover to read it). Lower: a smaller oscillation; further right: a "
        "slower response to a load with a good valve. The dotted line marks the present setting."
        + (f" {lost} settings beyond {MAX_PLOTTED_IAE:g} times the IAE are not drawn." if lost else "")
    )
    return Figure({"data": data, "layout": layout}, "Oscillation and load response by retuning", caption, height=380)


def _point_trace(some: Sequence[TradeOff], name: str, color: str, symbol: str, size: int) -> dict[str, Any]:
    return {
        "type": "scatter", "mode": "markers", "name": name, "x": [setting.load_iae for setting in some],
        "y": [setting.pv_std for setting in some], "marker": {"color": color, "symbol": symbol, "size": size},
        "text": [f"Kc {setting.Kc:.3g}, Ti {setting.Ti:.3g} s, Ms {setting.Ms:.3g}" for setting in some],
        "hovertemplate": "%{text}<br>PV std %{y:.3~g}<br>IAE × %{x:.3~g}<extra></extra>",
    }  # fmt: skip
