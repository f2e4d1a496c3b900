"""The remedies compared: PV deviation, stem travel and sensitivity."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from stiction.compensation.remedies import NO_ACTION
from stiction.report import style
from stiction.report.blocks import Figure
from stiction.report.figures.label_placement import PLOT_SIZE_PX, place_labels

if TYPE_CHECKING:
    from stiction.compensation import CompensationTrial, RemedyTrial

__all__ = ["remedy_sensitivity", "remedy_tradeoff"]

MIN_PLOTTED_TRAVEL = 0.02
"""Stem travel relative to no action, below which a remedy is drawn at the edge [-]."""
LABEL_SPACE_PERCENT = 14.0
"""Space below zero, for names [% of the PV deviation without action]."""


def remedy_tradeoff(trial: CompensationTrial) -> Figure | None:
    """Return PV deviation against stem travel, each remedy named; None where none was tried."""
    if not trial.remedies:
        return None
    now = trial[NO_ACTION].behaviour
    points = [
        (
            math.log10(max(tried.behaviour.travel / max(now.travel, 1e-300), MIN_PLOTTED_TRAVEL)),
            100.0 * tried.behaviour.pv_std / max(now.pv_std, 1e-300),
        )
        for tried in trial.remedies
    ]
    low, high = math.log10(MIN_PLOTTED_TRAVEL) - 0.1, max(max(x for x, _ in points) + 0.35, 0.6)
    top = max(112.0, 1.1 * max(y for _, y in points))
    at = [
        (
            (x - low) / (high - low) * PLOT_SIZE_PX[0],
            (y + LABEL_SPACE_PERCENT) / (top + LABEL_SPACE_PERCENT) * PLOT_SIZE_PX[1],
        )
        for x, y in points
    ]
    names = [f"<b>{tried.name}</b>" if tried.name == trial.recommended else tried.name for tried in trial.remedies]
    texts = place_labels(names, at)
    data = []
    for tried, (x, y), (text, place) in zip(trial.remedies, points, texts, strict=True):
        color, symbol = _marker_style(tried, trial)
        data.append({
            "type": "scatter", "mode": "markers+text", "x": [10.0**x], "y": [y], "name": tried.name,
            "text": [text], "textposition": place, "showlegend": False, "cliponaxis": False,
            "textfont": {"size": 11, "color": style.TEXT_COLOR},
            "marker": {"color": color, "symbol": symbol, "size": 9},
            "hovertemplate": f"{tried.name}<br>PV std %{{y:.3~g}} %<br>travel × %{{x:.3~g}}<extra></extra>",
        })  # fmt: skip
    ticks = [t for t in (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200) if low <= math.log10(t) <= high]
    data.sort(key=lambda trace: trace["name"] == trial.recommended)
    layout = {
        "xaxis": {
            "type": "log", "range": [low, high], "title": {"text": "Stem travel, relative to no action"},
            "tickvals": ticks, "ticktext": [f"≤ {t:g}" if t == MIN_PLOTTED_TRAVEL else f"{t:g}" for t in ticks],
        },
        "yaxis": {"range": [-LABEL_SPACE_PERCENT, top], "title": {"text": "PV std [% of no action]"}},
        "shapes": [
            _reference_line(x0=1, x1=1, y0=0, y1=1, yref="paper"),
            _reference_line(x0=0, x1=1, y0=100, y1=100, xref="paper"),
        ],
    }  # fmt: skip
    caption = (
        "Left of and below the dotted lines a remedy gives a smaller PV deviation with less wear; the square is the "
        "good valve, the diamond the remedy recommended until the repair. For offsets and steps see the table."
    )
    return Figure({"data": data, "layout": layout}, "PV deviation against stem travel", caption, height=420)


def remedy_sensitivity(trial: CompensationTrial) -> Figure | None:
    """Return the PV deviation of each remedy as identified, for its worst seed, and with S and J off by 30 %."""
    if not trial.remedies:
        return None
    ranked = [tried for tried in reversed(trial.remedies) if tried.name != NO_ACTION]
    names = [f"<b>{tried.name}</b>" if tried.name == trial.recommended else tried.name for tried in ranked]
    plain = [100.0 * (1.0 - tried.improvement) for tried in ranked]
    seed = [100.0 * (1.0 - tried.improvement_low) for tried in ranked]
    worst = [100.0 * tried.worst for tried in ranked]
    spans = [(min(three), max(three)) for three in zip(plain, seed, worst, strict=True)]
    data: list[dict[str, Any]] = [
        {
            "type": "scatter", "mode": "lines", "x": [x for low, high in spans for x in (low, high, None)],
            "y": [name for name in names for _ in range(3)], "line": {"color": style.BORDER_COLOR, "width": 3},
            "hoverinfo": "skip", "showlegend": False,
        }
    ]  # fmt: skip
    for called, x, color, symbol in (
        ("as identified", plain, style.PV, "circle"),
        ("the worst run in 20", seed, style.SECONDARY_COLOR, "line-ns-open"),
        ("S and J wrong by 30 %, worst case", worst, style.OP, "diamond-open"),
    ):
        marker = {"color": color, "symbol": symbol, "size": 9, "line": {"width": 2, "color": color}}
        data.append({"type": "scatter", "mode": "markers", "x": x, "y": names, "name": called, "marker": marker})
    layout = {
        "xaxis": {"title": {"text": "PV std [% of no action]"}, "rangemode": "tozero"},
        "yaxis": {"showgrid": False, "ticks": ""},
        "hovermode": "closest",
        "shapes": [_reference_line(x0=100, x1=100, y0=0, y1=1, yref="paper")],
    }
    caption = (
        "Each remedy was designed for the identified S and J, then simulated with S and J 30 % larger and "
        "smaller. Right of the dotted line the PV deviation is larger than without action on the same valve."
    )
    return Figure({"data": data, "layout": layout}, "Sensitivity to S and J", caption, height=120 + 30 * len(ranked))


def _marker_style(tried: RemedyTrial, trial: CompensationTrial) -> tuple[str, str]:
    if tried.name == trial.recommended:
        return style.OP, "diamond"
    if not tried.at_hand:
        return style.MV, "square"
    return (style.TEXT_COLOR, "x") if tried.name == NO_ACTION else (style.PV, "circle")


def _reference_line(**ends: Any) -> dict[str, Any]:
    return {
        "type": "line",
        "layer": "below",
        "line": {"color": style.SECONDARY_COLOR, "width": 1, "dash": "dot"},
        **ends,
    }
