"""Figures of limit cycles; all numbers come from `stiction.limitcycle`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.limitcycle import basin_map, bifurcation
from stiction.limitcycle.df_branches import branches_of_family, family_names
from stiction.limitcycle.exact.packed_loop import pack_loop
from stiction.limitcycle.linear import linear_part
from stiction.limitcycle.nyquist_crossings import frequency_grid
from stiction.report import Figure, labels, style

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.limitcycle import LimitCycle
    from stiction.limitcycle.linear import LinearPart
    from stiction.models import Loop

__all__ = [
    "basin_plot",
    "bifurcation_plot",
    "exact_cycles",
    "nyquist_plot",
    "phase_portrait",
    "simulate_two_periods",
    "time_plot",
]

COLORS = (style.PV, style.OP, style.MV, style.ALERT, "#7A4FA3", style.SP, "#8A6D00", style.MODEL)
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
STARTS_PER_AXIS = 41
BIFURCATION_VALUES = 15
UNITS = {
    "dead_time": "s", "Kc": "% of span per PV unit", "Ti": "s", "Td": "s", "r": "% of span / s",
    **dict.fromkeys(("disturbance", "d", "S", "J", "fs", "fd", "sb", "sj"), "% of span"),
}  # fmt: skip
"""Parameter -> its unit."""
_KINDS = (("stable cycle", "circle"), ("unstable cycle", "circle-open"), ("boundary", "x"))


def exact_cycles(found: Sequence[LimitCycle]) -> list[LimitCycle]:
    """Return the exact cycles, each once, by amplitude."""
    exact = [cycle.exact if cycle.exact is not None else cycle for cycle in found if cycle.kind == "cycle"]
    return sorted((cycle for cycle in exact if cycle.section), key=lambda cycle: cycle.amplitude)


def nyquist_plot(loop: Loop, found: Sequence[LimitCycle], *, sp: float, disturbance: float) -> Figure:
    """Return L(j omega) with -1/N(A) of each family, the crossings marked by kind."""
    linear = linear_part(loop, sp=sp, disturbance=disturbance)
    predicted = [cycle for cycle in found if cycle.method == "describing function"] or list(found)
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
    for kind, symbol in _KINDS:
        here = [cycle for cycle in predicted if _kind(cycle) == kind]
        if here:
            marker = {"symbol": symbol, "size": 10, "color": style.TEXT_COLOR}
            at = linear.at(1j * np.array([cycle.omega for cycle in here]))
            data.append({**_curve(at, kind, {}), "mode": "markers", "marker": marker})
    shown = linear.at(1j * np.array(rates))
    far, deep = float(np.abs(shown.real).max()), float(np.abs(shown.imag).max())
    far, deep = max(far, 0.3 * deep), max(deep, 0.3 * far)
    layout = {
        "xaxis": {"title": {"text": "Real part"}, "range": [-1.4 * far, 0.3 * far]},
        "yaxis": {"title": {"text": "Imaginary part"}, "range": [-1.5 * deep, 0.4 * deep]},
    }
    caption = (
        "Where the curves cross, the loop can cycle: filled circles stable, open ones unstable, crosses boundaries."
    )
    return Figure({"data": data, "layout": layout}, "Nyquist plot", caption, height=460)


def simulate_two_periods(
    loop: Loop, cycle: LimitCycle, *, sp: float, disturbance: float
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return time [s] and (valve position, OP, PV) over two periods of an exact cycle."""
    time = np.linspace(0.0, 2.0 * cycle.period, 601)
    *states, position = cycle.section
    _, signals = pack_loop(loop, sp=sp, disturbance=disturbance).run(np.array(states), position, grid=time)
    return time, signals


def time_plot(exact: Sequence[LimitCycle], runs: Sequence[tuple[NDArray[Any], NDArray[Any]]]) -> Figure:
    """Return OP and valve position of each cycle over two periods."""
    data: list[dict[str, Any]] = []
    for k, (cycle, (time, signals)) in enumerate(zip(exact, runs, strict=True)):
        color = COLORS[k % len(COLORS)]
        for signal, dash, what in ((1, "solid", "OP"), (0, "dot", "valve position")):
            line = {"color": color, "dash": dash, "width": 1.5}
            data.append(style.trace(time, signals[signal], f"{_name(cycle)}: {what}", line))
    layout = {"xaxis": {"title": {"text": "Time [s]"}}, "yaxis": {"title": {"text": "Deviation [% of span]"}}}
    caption = "Two periods of each exact cycle; the dotted line is the valve position."
    return Figure({"data": data, "layout": layout}, "Cycles over time", caption, height=420)


def phase_portrait(exact: Sequence[LimitCycle], runs: Sequence[tuple[NDArray[Any], NDArray[Any]]]) -> Figure:
    """Return PV against OP of each cycle; unstable cycles have thin lines."""
    data: list[dict[str, Any]] = []
    for k, (cycle, (_, signals)) in enumerate(zip(exact, runs, strict=True)):
        line = {
            "color": COLORS[k % len(COLORS)],
            "dash": DASHES[k % len(DASHES)],
            "width": 2.0 if cycle.stable else 1.0,
        }
        data.append(style.trace(signals[1], signals[2], _name(cycle), line))
    layout = {
        "xaxis": {"title": {"text": "OP, deviation [% of span]"}},
        "yaxis": {"title": {"text": "PV, deviation [PV units]"}},
    }
    caption = "PV against OP of every exact cycle; stable ones are drawn thick."
    return Figure({"data": data, "layout": layout}, "Phase portrait", caption, height=420)


def basin_plot(loop: Loop, exact: Sequence[LimitCycle], *, disturbance: float) -> Figure:
    """Return the map of the final cycle over the OP and PV of the start at rest."""
    op = 2.0 * max(cycle.amplitude for cycle in exact) * np.linspace(-1.0, 1.0, STARTS_PER_AXIS)
    pv = 2.0 * max(cycle.amplitude_pv for cycle in exact) * np.linspace(-1.0, 1.0, STARTS_PER_AXIS)
    found = basin_map(loop, op_start=op[None, :], pv_start=pv[:, None], disturbance=disturbance)
    others = {-1: "come to rest", -2: "did not settle", -3: "run away"}
    names = others | {a.label: a.name for a in found.attractors}
    there = sorted(int(label) for label in np.unique(found.label))
    shown = np.searchsorted(np.array(there), found.label).astype(float)
    steps = len(there)
    scale = [[edge / steps, COLORS[k % len(COLORS)]] for k in range(steps) for edge in (k, k + 1)]
    bar = {**style.colorbar("Ends in"), "tickvals": list(range(steps)), "ticktext": [names[label] for label in there]}
    heat = {
        "type": "heatmap", "x": op, "y": pv, "z": shown, "zmin": -0.5, "zmax": steps - 0.5, "colorscale": scale,
        "colorbar": bar, "opacity": 0.75,
    }  # fmt: skip
    layout = {
        "xaxis": {"title": {"text": "OP at the start, deviation [% of span]"}},
        "yaxis": {"title": {"text": "PV at the start, deviation [PV units]"}},
    }
    told = {a.label: f"end in {a.name}" for a in found.attractors} | others
    counts = {label: float(np.mean(found.label == label)) for label in told}
    shares = [
        f"{labels.format_number(100.0 * counts[label], '%', 2)} {said}" for label, said in told.items() if counts[label]
    ]
    caption = f"{found.label.size} starts from rest with the stem at 0: {'; '.join(shares)}."
    return Figure({"data": [heat], "layout": layout}, "Basins", caption, height=420)


def bifurcation_plot(loop: Loop, over: str, cycles: Sequence[LimitCycle]) -> Figure:
    """Return the amplitude of every cycle over one parameter, near the loop that has `cycles`."""
    values = _scan_values(loop, over, cycles)
    diagram = bifurcation(loop, over, values, searches=3)
    data: list[dict[str, Any]] = []
    for k, branch in enumerate(diagram.branches):
        stable = [cycle.stable for cycle in branch.cycles]
        line = {"color": COLORS[k % len(COLORS)], "dash": "solid" if all(stable) else "dot", "width": 1.8}
        data.append(style.trace(branch.values, branch.amplitude, branch.family or f"cycle {k + 1}", line))
    layout = {
        "xaxis": {"title": {"text": f"{over} [{UNITS.get(over, '-')}]"}},
        "yaxis": {"title": {"text": "OP amplitude [% of span]"}},
    }
    ends = sum((b.born is not None) + (b.dies is not None) for b in diagram.branches)
    caption = (
        f"{labels.count_noun(len(diagram.branches), 'branch', 'branches')} over {over}, {ends} of the "
        "ends are where cycles appear or disappear; dotted branches are partly unstable."
    )
    return Figure({"data": data, "layout": layout}, "Bifurcation diagram", caption, height=420)


def _scan_values(loop: Loop, over: str, cycles: Sequence[LimitCycle]) -> NDArray[Any]:
    """Return the parameter values of the diagram, near the present value; from 0 upwards if that is 0."""
    nominal = _present_value(loop, over)
    if nominal:
        return nominal * np.linspace(0.4, 1.6, BIFURCATION_VALUES)
    if over == "load":
        return np.linspace(-1.0, 1.0, BIFURCATION_VALUES)
    # Nothing else may be negative. A time matters against the period, a band against what else the valve needs.
    if UNITS.get(over) == "s":
        highest = 0.25 * max(cycle.period for cycle in cycles)
    else:
        highest = float(getattr(loop.valve, "S", 0.0)) or 1.0
    return np.linspace(0.0, highest, BIFURCATION_VALUES)


def _present_value(loop: Loop, over: str) -> float:
    if over == "gain":
        return 1.0
    for part in (loop.controller, loop.valve, loop.process):
        value = getattr(part, over, None)
        if isinstance(value, (int, float)) and value:
            return float(value)
    return 0.0


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
