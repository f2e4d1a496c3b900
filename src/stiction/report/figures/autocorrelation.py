"""Autocorrelation of the control error with the detected period."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.oscillation.rhythm import MOST_REGULAR
from stiction.report import labels, style
from stiction.report.blocks import Figure
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from stiction.report.loop_view import LoopView

__all__ = ["autocorrelation"]

PERIODS = 8
"""Periods of lag shown."""


def autocorrelation(view: LoopView) -> Figure | None:
    """Return the autocorrelation over the lag; None when there is none."""
    oscillation, dt = view.diagnosis.oscillation, view.diagnosis.record.dt
    known = bool(np.isfinite(oscillation.period)) and oscillation.period > 0.0
    acf = oscillation.acf[: int(PERIODS * oscillation.period / dt) + 2] if known else oscillation.acf
    if acf.size < 2:
        return None
    name, size = labels.time_unit(acf.size * dt)
    lag = np.arange(acf.size) * dt / size
    drawn = downsample(acf)
    data = [style.trace(lag[drawn], acf[drawn], "acf", style.line_style(style.PV))]
    marks = oscillation.period * np.arange(1, PERIODS + 1) / size if known else np.empty(0)
    layout = {
        "xaxis": {"title": {"text": f"Lag [{name}]"}, "range": [0.0, float(lag[-1])]},
        "yaxis": {"title": {"text": "Autocorrelation [-]"}, "zeroline": True, "zerolinecolor": style.BORDER_COLOR},
        "shapes": [style.vertical_line(float(x)) for x in marks if x <= lag[-1]],
        "showlegend": False,
        "margin": {"t": style.BELOW_BUTTONS},
    }
    if known:
        regular = labels.format_number(oscillation.regularity) + (
            " or more" if oscillation.regularity >= MOST_REGULAR else ""
        )
        caption = (
            f"Dotted lines mark multiples of the period, {labels.format_duration(oscillation.period)};"
            f" regularity {regular} (above 1 is regular)."
        )
    else:
        caption = "No period was found: the autocorrelation has no regular peaks."
    return Figure({"data": data, "layout": layout}, "Autocorrelation of the control error", caption, height=300)
