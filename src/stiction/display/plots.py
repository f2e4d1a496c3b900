"""Plots of results on matplotlib Axes: each function draws on those it gets, or on new ones, and returns them."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.display.finding_words import FINDINGS
from stiction.display.number_format import count_noun, format_probability

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["plot_group", "plot_identification", "plot_record", "plot_trial", "plot_verdict"]

TITLE_WIDTH = 36
"""Characters of a line of a title [-]."""
LABEL_WIDTH = 40
"""Characters of a line of the name of a bar [-]."""
COLOURS = {"op": "#0969da", "mv": "#bc4c00", "pv": "#1a7f37", "sp": "#6e7781"}
"""Signal -> its colour."""


def plot_record(record: Any, axes: Any = None) -> NDArray[np.object_]:
    """Draw PV with set point on the first Axes, OP with the valve position on the second; return both."""
    if axes is None:
        axes = _pyplot().subplots(2, 1, sharex=True, layout="constrained")[1]
    axes = np.asarray(axes, dtype=object)
    unit = record.provenance.pv_unit
    rows = (
        (axes[0], (("sp", "set point"), ("pv", "PV")), f"PV [{unit}]" if unit else "PV"),
        (axes[1], (("op", "OP (controller output)"), ("mv", "valve position")), f"OP [{record.op_unit}]"),
    )
    for ax, signals, label in rows:
        for name, text in signals:
            if (series := getattr(record, name)) is not None:
                ax.plot(record.time, series, color=COLOURS[name], linewidth=1.2, label=text)
        ax.set_ylabel(label)
        if ax.lines:
            ax.legend(loc="upper right", fontsize="small")
    _set_title(axes[0], record.tag)
    axes[1].set_xlabel("time [s]")
    return axes


def plot_verdict(diagnosis: Any, ax: Any = None) -> Any:
    """Draw what each feature adds to the log odds of stiction; return the Axes."""
    ax = _one_axes(ax)
    parts = list(diagnosis.contributions)[::-1]
    names = [fill(part.label, LABEL_WIDTH) for part in parts]
    values = [part.log_odds for part in parts]
    ax.barh(names, values, color=[COLOURS["mv"] if value > 0 else COLOURS["op"] for value in values])
    ax.axvline(0.0, color="0.5", linewidth=0.8)
    ax.tick_params(axis="y", labelsize="small")
    ax.set_xlabel("contribution to the log odds of stiction")
    probability = format_probability(diagnosis.probability)
    _set_title(ax, f"{diagnosis.record.tag}: {FINDINGS[diagnosis.finding]}, probability of stiction {probability}")
    return ax


def plot_identification(identification: Any, ax: Any = None) -> Any:
    """Draw S and J with their 95 % intervals; return the Axes."""
    ax = _one_axes(ax)
    for row, name in enumerate(("J", "S")):
        value, low, high = (getattr(identification, name + part) for part in ("", "_low", "_high"))
        ax.errorbar(value, row, xerr=[[max(value - low, 0.0)], [max(high - value, 0.0)]], fmt="o", capsize=5)
    ax.set_yticks([0, 1], ["J (slip jump)", "S (deadband plus stickband)"])
    ax.set_ylim(-0.6, 1.6)
    ax.set_xlim(left=0.0)
    ax.set_xlabel("size with 95 % interval [% of span]")
    return ax


def plot_group(group: Any, ax: Any = None) -> Any:
    """Draw the probability of each member to be the source of the oscillation; return the Axes."""
    ax = _one_axes(ax)
    roots = list(group.roots)[::-1]
    ax.barh([loop.tag for loop in roots], [loop.probability for loop in roots], color=COLOURS["op"])
    ax.set_xlim(0.0, 1.0)
    ax.set_xlabel("probability to be the source [-]")
    _set_title(ax, f"Group of {count_noun(len(group.members), 'loop')}, period {format_seconds(group.period)}")
    return ax


def plot_trial(trial: Any, ax: Any = None) -> Any:
    """Draw PV deviation over stem travel of each remedy; return the Axes."""
    ax = _one_axes(ax)
    for number, remedy in enumerate(trial.remedies, 1):
        chosen = remedy.name == trial.recommended
        x, y = remedy.behaviour.travel, remedy.behaviour.pv_std
        color = COLOURS["mv"] if chosen else COLOURS["op"]
        ax.plot(x, y, "o", markersize=10 if chosen else 6, color=color, label=f"{number} {remedy.name}")
        ax.annotate(str(number), (x, y), xytext=(6, 4), textcoords="offset points", fontsize="small")
    if trial.remedies:
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small", handlelength=0.8, frameon=False)
    ax.set_xlabel("stem travel [% of span per h]")
    ax.set_ylabel("standard deviation of PV")
    _set_title(ax, f"{trial.tag}: {trial.recommended or 'no advice'}")
    return ax


def _set_title(ax: Any, text: str) -> None:
    """Write a title on as many lines as it needs, so that the picture does not cut it."""
    ax.set_title(fill(text, TITLE_WIDTH), fontsize="medium")


def _one_axes(ax: Any) -> Any:
    """The Axes given, or new ones."""
    return _pyplot().subplots(layout="constrained")[1] if ax is None else ax


def _pyplot() -> Any:
    import matplotlib.pyplot as plt

    return plt
