"""Horizontal bars with names on the left and numbers at their ends."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import style

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["horizontal_bars", "wrap_label"]

LABEL_CHARACTERS = 30
"""Characters of a name in one line [-]."""


def horizontal_bars(names: Sequence[str], x: NDArray[np.float64], text: Sequence[str], title: str) -> dict[str, Any]:
    """Return the plot of one bar for each name, the first at the top; positive and negative bars differ in pattern.

    `names`: name of each bar. `x`, of shape (n_bars,): length of each bar, in the unit of `title`. `text`: number at
    the end of each bar. `title`: title of the axis.
    """
    low, high = min(float(np.nanmin(x)), 0.0), max(float(np.nanmax(x)), 0.0)
    room = 0.3 * max(high - low, 1e-9)  # for the numbers at the ends, also on a narrow screen
    positive = x >= 0.0
    bars = {
        "type": "bar", "orientation": "h", "x": x, "y": [wrap_label(name) for name in names], "text": list(text),
        "textposition": "outside", "cliponaxis": False, "hoverinfo": "none",
        "marker": {
            "color": [style.OP if one else style.PV for one in positive],
            "pattern": {"shape": ["" if one else "/" for one in positive], "size": 5, "fgcolor": "#FFFFFF"},
        },
    }  # fmt: skip
    layout = {
        "xaxis": {"title": {"text": title}, "range": [low - (room if low < 0.0 else 0.0), high + room],
                  "zeroline": True, "zerolinecolor": style.SECONDARY_COLOR},
        "yaxis": {"autorange": "reversed", "showgrid": False, "ticks": "", "fixedrange": True,
                  "tickfont": {"color": style.TEXT_COLOR, "size": 11}},
        "bargap": 0.35, "showlegend": False,
    }  # fmt: skip
    return {"data": [bars], "layout": layout}


def wrap_label(name: str) -> str:
    """Break a long name into lines.

    Examples
    --------
    >>> wrap_label("good valve"), wrap_label("sticky valve against a load that switches")
    ('good valve', 'sticky valve against a<br>load that switches')
    """
    if len(name) <= LABEL_CHARACTERS:
        return name
    import textwrap

    return "<br>".join(textwrap.wrap(name, math.ceil(len(name) / math.ceil(len(name) / LABEL_CHARACTERS)) + 4))
