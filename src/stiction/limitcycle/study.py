"""The exact cycles of a loop: two periods of each, their basins, and their branches over a parameter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.limitcycle.basins import BasinMap, basin_map
from stiction.limitcycle.continuation import Bifurcation, bifurcation
from stiction.limitcycle.exact.packed_loop import pack_loop

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.limitcycle.result import LimitCycle
    from stiction.models import Loop

__all__ = ["SECONDS", "CycleStudy", "exact_cycles", "scan_values", "study_cycles"]

STARTS_PER_AXIS = 41
BIFURCATION_VALUES = 15
SECONDS = ("dead_time", "Ti", "Td")
"""Parameters that are times."""


@dataclass(frozen=True)
class CycleStudy:
    """The exact cycles of a loop, and what moves the loop between them."""

    cycles: tuple[LimitCycle, ...]
    """The exact cycles, each once, by amplitude."""
    periods: tuple[tuple[NDArray[Any], NDArray[Any]], ...]
    """Time [s], and (valve position, OP, PV) over two periods of each cycle."""
    op_start: NDArray[np.float64]
    """OP of the starts from rest [% of span], shape (n_starts,)."""
    pv_start: NDArray[np.float64]
    """PV of the starts from rest [PV units], shape (n_starts,)."""
    basins: BasinMap
    """The cycle in which each start ends; rows are `pv_start`."""
    diagram: Bifurcation
    """Branches of the cycles over one parameter."""


def study_cycles(
    loop: Loop, cycles: Sequence[LimitCycle], over: str = "gain", *, sp: float = 0.0, disturbance: float = 0.0
) -> CycleStudy | None:
    """Compute what is shown of the exact cycles of a loop.

    `cycles`: its cycles, as `predict_limit_cycles` gives them. `over`: parameter of the bifurcation diagram. `sp`,
    `disturbance`: set point [PV units] and load [% of span], as deviations from the point of rest. Returns None when
    the loop has no exact cycle.
    """
    exact = exact_cycles(cycles)
    if not exact:
        return None
    packed = pack_loop(loop, sp=sp, disturbance=disturbance)
    periods = []
    for cycle in exact:
        time = np.linspace(0.0, 2.0 * cycle.period, 601)
        *states, position = cycle.section
        periods.append((time, packed.run(np.array(states), position, grid=time)[1]))
    op = 2.0 * max(cycle.amplitude for cycle in exact) * np.linspace(-1.0, 1.0, STARTS_PER_AXIS)
    pv = 2.0 * max(cycle.amplitude_pv for cycle in exact) * np.linspace(-1.0, 1.0, STARTS_PER_AXIS)
    basins = basin_map(loop, op_start=op[None, :], pv_start=pv[:, None], disturbance=disturbance)
    diagram = bifurcation(loop, over, scan_values(loop, over, exact), searches=3)
    return CycleStudy(tuple(exact), tuple(periods), op, pv, basins, diagram)


def exact_cycles(cycles: Sequence[LimitCycle]) -> list[LimitCycle]:
    """Return the exact cycles, each once, by amplitude."""
    exact = [cycle.exact if cycle.exact is not None else cycle for cycle in cycles if cycle.kind == "cycle"]
    return sorted((cycle for cycle in exact if cycle.section), key=lambda cycle: cycle.amplitude)


def scan_values(loop: Loop, over: str, cycles: Sequence[LimitCycle]) -> NDArray[Any]:
    """Return the parameter values of a bifurcation diagram, near the present value; from 0 upwards if that is 0."""
    nominal = 1.0 if over == "gain" else _present_value(loop, over)
    if nominal:
        return nominal * np.linspace(0.4, 1.6, BIFURCATION_VALUES)
    if over == "load":
        return np.linspace(-1.0, 1.0, BIFURCATION_VALUES)
    # Nothing else may be negative. A time matters against the period, a band against what else the valve needs.
    if over in SECONDS:
        highest = 0.25 * max(cycle.period for cycle in cycles)
    else:
        highest = float(getattr(loop.valve, "S", 0.0)) or 1.0
    return np.linspace(0.0, highest, BIFURCATION_VALUES)


def _present_value(loop: Loop, over: str) -> float:
    for part in (loop.controller, loop.valve, loop.process):
        value = getattr(part, over, None)
        if isinstance(value, (int, float)) and value:
            return float(value)
    return 0.0
