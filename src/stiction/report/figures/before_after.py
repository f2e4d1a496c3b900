"""PV, or OP and valve position, without action, with the remedy and with a good valve."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.compensation.remedies import NO_ACTION, REPAIR
from stiction.report import labels, style
from stiction.report.blocks import Figure
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from stiction.compensation import CompensationTrial

__all__ = ["before_after"]

PANEL_GAP = 0.07
"""Distance between panels, as a share of the height of the figure [-]."""
PERIODS_BEFORE_STEP = 5.0
"""Periods shown before the first step [-]."""


def before_after(trial: CompensationTrial) -> tuple[Figure, Figure] | None:
    """Return the trends of the PV and those of OP and valve position; None where no remedy was tried."""
    if not trial.trends or trial.twin is None:
        return None
    names = [tried.name for tried in reversed(trial.remedies) if tried.name in trial.trends]
    names.sort(key=lambda name: (name != NO_ACTION, name == REPAIR))
    runs = {name: trial.trends[name] for name in names}
    steps = _step_times(next(iter(runs.values())))
    text = "Simulated, one run of each with the same noise and load"
    if steps:
        text += "; a step of the set point, then one of the load, at the vertical lines"
    pv = _stacked_panels(runs, {"sp": "SP (set point)", "pv": "PV (process variable)"}, "PV", steps, trial)
    op = _stacked_panels(runs, {"op": "OP (controller output)", "mv": "Valve position"}, "% of span", steps, trial)
    return (
        Figure(pv, "PV before and after", f"{text}. All panels have the same scale; drag to zoom.", height=500),
        Figure(
            op,
            "OP and valve position before and after",
            "The same runs. Additional movement of the valve position is additional wear.",
            height=500,
        ),
    )


def _step_times(run: Mapping[str, NDArray[np.float64]]) -> tuple[float, ...]:
    """Times of the steps of set point and load [s]: the second is halfway between the first and the end."""
    moved = np.flatnonzero(np.diff(run["sp"]))
    if not moved.size:
        return ()
    first, n = int(moved[0]) + 1, len(run["sp"])
    return float(run["time"][first]), float(run["time"][first + (n - first) // 2])


def _stacked_panels(
    runs: Mapping[str, Mapping[str, NDArray[np.float64]]],
    signals: Mapping[str, str],
    unit: str,
    steps: tuple[float, ...],
    trial: CompensationTrial,
) -> dict[str, Any]:
    """One panel for each run, on one time axis and with one scale."""
    assert trial.twin is not None
    first = next(iter(runs.values()))
    start, end = float(first["time"][0]), float(first["time"][-1])
    name, size = labels.time_unit(end - start)
    left = max(steps[0] - PERIODS_BEFORE_STEP * trial.twin.simulated.period, start) if steps else start
    shown = [(run[signal][run["time"] >= left]) for run in runs.values() for signal in signals if signal in run]
    low, high = min(float(x.min()) for x in shown), max(float(x.max()) for x in shown)
    room = 0.06 * (high - low or 1.0)
    height = (1.0 - PANEL_GAP * (len(runs) - 1)) / len(runs)
    colors = {"sp": style.SP, "pv": style.PV, "op": style.OP, "mv": style.MV}
    data, notes = [], []
    layout: dict[str, Any] = {"hovermode": "x"}
    for k, (remedy, run) in enumerate(runs.items()):
        axis = "" if k == 0 else str(k + 1)
        top = 1.0 - k * (height + PANEL_GAP)
        layout[f"yaxis{axis}"] = {"domain": [max(top - height, 0.0), top], "range": [low - room, high + room]}
        for signal, called in signals.items():
            if signal not in run:
                continue
            keep = downsample(run[signal])
            drawn = style.line_style(colors[signal], 1.2 if signal == "sp" else 1.5)
            data.append({
                "type": "scatter", "mode": "lines", "x": (run["time"][keep] - start) / size, "y": run[signal][keep],
                "name": called, "line": drawn | ({"shape": "hv"} if signal in ("sp", "mv") else {}),
                "yaxis": f"y{axis}", "legendgroup": signal, "showlegend": k == 0,
            })  # fmt: skip
        notes.append({
            "text": f"<b>{remedy}</b>", "x": 0.0, "xref": "paper", "xanchor": "left", "y": top, "yref": "paper",
            "yanchor": "bottom", "showarrow": False, "font": {"size": 12}, "borderpad": 1,
        })  # fmt: skip
    layout["yaxis2" if len(runs) > 2 else "yaxis"]["title"] = {"text": unit}
    layout["xaxis"] = {
        "title": {"text": f"Time [{name}]"},
        "anchor": f"y{'' if len(runs) == 1 else len(runs)}",
        "range": [(left - start) / size, (end - start) / size],
    }
    layout["shapes"] = [style.vertical_line((time - start) / size) for time in steps]
    layout |= {"annotations": notes, "legend": {"y": 1.06}, "margin": {"t": style.BELOW_BUTTONS}}
    return {"data": data, "layout": layout}
