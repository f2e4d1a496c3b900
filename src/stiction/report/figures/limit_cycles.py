"""Figures of limit cycles; all numbers come from `stiction.limitcycle`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.limitcycle.df_branches import branches_of_family, family_names
from stiction.limitcycle.linear import linear_part
from stiction.limitcycle.nyquist_crossings import frequency_grid
from stiction.limitcycle.study import SECONDS
from stiction.report import labels, style
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.limitcycle import LimitCycle
    from stiction.limitcycle.linear import LinearPart
    from stiction.limitcycle.study import CycleStudy
    from stiction.models import Loop

__all__ = ["basin_plot", "bifurcation_plot", "nyquist_plot", "phase_portrait", "time_plot"]

COLORS = (style.PV, style.OP, style.MV, style.ALERT, "#7A4FA3", style.SP, "#8A6D00", style.MODEL)
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
UNITS = {
    "Kc": "% of span per PV unit", "r": "% of span / s", **dict.fromkeys(SECONDS, "s"),
    **dict.fromkeys(("disturbance", "d", "S", "J", "fs", "fd", "sb", "sj"), "% of span"),
}  # fmt: skip
"""Parameter -> its unit."""
_KINDS = {"stable cycle": "circle", "unstable cycle": "circle-open", "boundary": "x"}


def nyquist_plot(loop: Loop, cycles: Sequence[LimitCycle], *, sp: float = 0.0, disturbance: float = 0.0) -> Figure:
    """Return L(j omega) with -1/N(A) of each family, the crossings marked by kind."""
    linear = linear_part(loop, sp=sp, disturbance=disturbance)
    predicted = [cycle for cycle in cycles if cycle.method == "describing function"] or list(cycles)
    rates = [cycle.omega for cycle in predicted] or [_frequency_at_180(linear)]
    omega = np.geomspace(min(rates) / 20.0, max(rates) * 20.0, 1200)
    data = [_curve(linear.at(1j * omega), "L(jω)", style.line_style(style.PV, 1.8))]
    for k, name in enumerate(family_names(loop.valve)):
        family = branches_of_family(loop.valve, name)
        inverse = np.concatenate(
            [np.append(_negative_inverse(family, a, rates[0]), np.nan) for a in family.branches(80)[:6]]
        )
        rated = f" at {labels.format_number(rates[0])} rad/s" if family.rate_dependent else ""
        line = {"color": COLORS[1 + k], "dash": DASHES[1 + k], "width": 1.4}
        data.append(_curve(inverse, f"-1/N(A){f', family {name}' if name else ''}{rated}", line))
    for kind, symbol in _KINDS.items():
        here = linear.at(1j * np.array([cycle.omega for cycle in predicted if _kind(cycle) == kind]))
        if here.size:
            data.append(style.markers(here.real, here.imag, kind, symbol, style.TEXT_COLOR, 10))
    shown = linear.at(1j * np.array(rates))
    far, deep = float(np.abs(shown.real).max()), float(np.abs(shown.imag).max())
    far, deep = max(far, 0.3 * deep), max(deep, 0.3 * far)
    plot = style.plot(data, "Real part", "Imaginary part")
    plot["layout"]["xaxis"]["range"] = [-1.4 * far, 0.3 * far]
    plot["layout"]["yaxis"]["range"] = [-1.5 * deep, 0.4 * deep]
    caption = (
        "Where the curves cross, the loop can cycle: filled circles stable, open ones unstable, crosses boundaries."
    )
    return Figure(plot, "Nyquist plot", caption, height=460)


def time_plot(study: CycleStudy) -> Figure:
    """Return OP and valve position of each cycle over two periods."""
    data: list[dict[str, Any]] = []
    for k, (cycle, (time, (position, op, _))) in enumerate(zip(study.cycles, study.periods, strict=True)):
        color = COLORS[k % len(COLORS)]
        for signal, dash, name in ((op, "solid", "OP"), (position, "dot", "valve position")):
            line = {"color": color, "dash": dash, "width": 1.5}
            data.append(style.trace(time, signal, f"{_name(cycle)}: {name}", line))
    caption = "Two periods of each exact cycle; the dotted line is the valve position."
    return Figure(style.plot(data, "Time [s]", "Deviation [% of span]"), "Cycles over time", caption, height=420)


def phase_portrait(study: CycleStudy) -> Figure:
    """Return PV against OP of each cycle; unstable cycles have thin lines."""
    data: list[dict[str, Any]] = []
    for k, (cycle, (_, (_, op, pv))) in enumerate(zip(study.cycles, study.periods, strict=True)):
        color, dash = COLORS[k % len(COLORS)], DASHES[k % len(DASHES)]
        line = {"color": color, "dash": dash, "width": 2.0 if cycle.stable else 1.0}
        data.append(style.trace(op, pv, _name(cycle), line))
    plot = style.plot(data, "OP, deviation [% of span]", "PV, deviation [PV units]")
    caption = "PV against OP of every exact cycle; stable ones are drawn thick."
    return Figure(plot, "Phase portrait", caption, height=420)


def basin_plot(study: CycleStudy) -> Figure:
    """Return the map of the final cycle over the OP and PV of the start at rest."""
    basins = study.basins
    others = {-1: "come to rest", -2: "did not settle", -3: "run away"}
    names = others | {a.label: a.name for a in basins.attractors}
    there = sorted(int(label) for label in np.unique(basins.label))
    steps = len(there)
    heat = {
        "type": "heatmap", "x": study.op_start, "y": study.pv_start,
        "z": np.searchsorted(np.array(there), basins.label).astype(float),
        "zmin": -0.5, "zmax": steps - 0.5, "opacity": 0.75,
        "colorscale": [[edge / steps, COLORS[k % len(COLORS)]] for k in range(steps) for edge in (k, k + 1)],
        "colorbar": {
            **style.colorbar("Ends in"), "tickvals": list(range(steps)), "ticktext": [names[one] for one in there],
        },
    }  # fmt: skip
    ends = {a.label: f"end in {a.name}" for a in basins.attractors} | others
    counts = {label: float(np.mean(basins.label == label)) for label in ends}
    shares = [f"{labels.format_number(100.0 * share, '%', 2)} {ends[one]}" for one, share in counts.items() if share]
    caption = f"{basins.label.size} starts from rest with the stem at 0: {'; '.join(shares)}."
    plot = style.plot([heat], "OP at the start, deviation [% of span]", "PV at the start, deviation [PV units]")
    return Figure(plot, "Basins", caption, height=420)


def bifurcation_plot(study: CycleStudy, over: str) -> Figure:
    """Return the amplitude of every cycle over one parameter."""
    branches = study.diagram.branches
    data: list[dict[str, Any]] = []
    for k, branch in enumerate(branches):
        stable = all(cycle.stable for cycle in branch.cycles)
        line = {"color": COLORS[k % len(COLORS)], "dash": "solid" if stable else "dot", "width": 1.8}
        data.append(style.trace(branch.values, branch.amplitude, branch.family or f"cycle {k + 1}", line))
    ends = sum((branch.born is not None) + (branch.dies is not None) for branch in branches)
    caption = (
        f"{labels.count_noun(len(branches), 'branch', 'branches')} over {over}, {ends} of the "
        "ends are where cycles appear or disappear; dotted branches are partly unstable."
    )
    plot = style.plot(data, f"{over} [{UNITS.get(over, '-')}]", "OP amplitude [% of span]")
    return Figure(plot, "Bifurcation diagram", caption, height=420)


def _frequency_at_180(linear: LinearPart) -> float:
    """Return the frequency at which the phase of L is closest to -180 degrees [rad/s], for a loop without a cycle."""
    omega = frequency_grid(linear, 1.0)
    if not omega.size:
        return 1.0
    return float(omega[np.argmin(np.abs(np.unwrap(np.angle(linear.at(1j * omega))) + np.pi))])


def _negative_inverse(family: Any, amplitude: NDArray[Any], omega: float) -> NDArray[Any]:
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = -1.0 / family.evaluate(amplitude, omega)
    return np.where(np.isfinite(inverse), inverse, np.nan)


def _kind(cycle: LimitCycle) -> str:
    return "boundary" if cycle.kind == "boundary" else "stable cycle" if cycle.stable else "unstable cycle"


def _name(cycle: LimitCycle) -> str:
    family = f"{cycle.family}, " if cycle.family else ""
    return f"{family}{labels.format_number(cycle.period, significant=4)} s, {'stable' if cycle.stable else 'unstable'}"


def _curve(z: NDArray[Any], name: str, line: dict[str, Any]) -> dict[str, Any]:
    return style.trace(np.real(z), np.imag(z), name, line)
