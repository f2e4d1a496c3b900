"""Continuation of limit cycles over a parameter: where cycles appear, change stability and disappear."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.json_form import Result
from stiction.errors import ParameterError, StictionError, require_count, require_numbers
from stiction.limitcycle.describing.staircase import require_families, rest_level_offset
from stiction.limitcycle.exact.packed_loop import PackedLoop, pack_loop
from stiction.limitcycle.exact.periodic_orbit import limit_cycle, refine_orbit
from stiction.limitcycle.exact.search import is_same_cycle, search_from_starts
from stiction.models.loop import require_loop

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

    from stiction.limitcycle.result import LimitCycle
    from stiction.models import Loop

__all__ = ["Bifurcation", "Branch", "bifurcation"]

_MAX_HALVINGS = 7
"""Halvings of a parameter step before a cycle counts as gone [-]; born and dies are exact to 1/128 of a step."""


@dataclass(frozen=True)
class Branch:
    """One limit cycle over a range of the parameter."""

    _json_keys = ("family", "values", "period as period_s", "amplitude", "stable", "born", "dies")

    family: str
    """Rest levels of a staircase: "half", "integer" or an offset; else empty."""
    values: NDArray[np.float64]
    """Values of the parameter, ascending, shape (n,)."""
    cycles: tuple[LimitCycle, ...]
    """The cycle at each value."""
    born: float | None
    """Value below which the cycle does not exist, None when the range begins first."""
    dies: float | None
    """Value above which it does not exist, None when the range ends first."""

    @property
    def period(self) -> NDArray[np.float64]:
        """Periods [s], shape (n,)."""
        return np.array([cycle.period for cycle in self.cycles])

    @property
    def stable(self) -> list[bool | None]:
        """Stability of each cycle; None where it could not be decided."""
        return [cycle.stable for cycle in self.cycles]

    @property
    def amplitude(self) -> NDArray[np.float64]:
        """Half peak to peak of the OP [% of span], shape (n,)."""
        return np.array([cycle.amplitude for cycle in self.cycles])


@dataclass(frozen=True)
class Bifurcation(Result):
    """All branches of limit cycles over one parameter."""

    parameter: str
    """Name of the parameter."""
    values: NDArray[np.float64]
    """Values of the parameter, shape (n,)."""
    branches: tuple[Branch, ...]
    """The branches, by family and amplitude."""

    def summary(self) -> str:
        """One line per branch."""
        n = len(self.branches)
        lines = [f"{n} {'branch' if n == 1 else 'branches'} of limit cycles over {self.parameter}."]
        for b in self.branches:
            born = f"{b.values[0]:.4g} (range begins)" if b.born is None else f"born at {b.born:.4g}"
            dies = f"{b.values[-1]:.4g} (range ends)" if b.dies is None else f"dies at {b.dies:.4g}"
            lines.append(
                f"  {b.family or 'cycle'}: {born}, {dies}; period {b.period[0]:.4g} to {b.period[-1]:.4g} s, "
                f"OP amplitude {b.amplitude[0]:.4g} to {b.amplitude[-1]:.4g} %."
            )
        return "\n".join(lines)


def bifurcation(
    loop: Loop,
    parameter: str,
    values: ArrayLike,
    *,
    families: Iterable[str | float] = ("half", "integer"),
    searches: int = 5,
) -> Bifurcation:
    """Continue every limit cycle of a loop over one parameter.

    Parameters
    ----------
    loop : Loop
        The loop.
    parameter : str
        "gain" (a factor on the controller's gain), "disturbance" (the load) [% of span], "dead_time" [s], a parameter
        of the controller ("Kc", "Ti", "Td") or of the valve ("d", "S", "J", "fs", "fd", "sb", "sj", "r").
    values : array_like, shape (n,)
        Values of the parameter [its unit].
    families : iterable of str or float
        Families of a staircase valve, by name or by a rest level [% of span]. Over the load the rest levels
        are constant and the point of rest moves between them; over other parameters a family stays symmetric.
    searches : int
        Number of values with a new search for cycles [-]; between them cycles are continued.

    Returns
    -------
    Bifurcation
        The branches, with the values at which cycles are born and die.

    Raises
    ------
    ParameterError
        When the loop has no such parameter, a family is unknown, or the valve has no stiction at one of the values.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.limitcycle import bifurcation
    >>> loop = st.Loop(st.PID.parallel(0.5, 1.0, 0.1), st.Stenman(0.5), st.TransferFunction([1], [5, 6, 1]), dt=0.01)
    >>> diagram = bifurcation(loop, "d", [0.25, 0.5], families=["half"])
    >>> [branch.amplitude.round(3).tolist() for branch in diagram.branches]
    [[0.285, 0.571], [0.469, 0.939]]
    """
    require_loop(loop)
    grid = np.unique(require_numbers("values", values))
    if grid.size == 0:
        raise ParameterError("values is empty; give at least one number.")
    searches, family_list = require_count("searches", searches), require_families(families)
    _set_parameter(loop, parameter, float(grid[0]))
    branches: list[Branch] = []
    lattice = pack_loop(*_set_parameter(loop, parameter, float(grid[0]))[:1]).valve.staircase
    for family in family_list if lattice else ("",):
        mine: list[Branch] = []
        for index in np.unique(np.linspace(0, grid.size - 1, min(searches, grid.size)).astype(int)):
            value = float(grid[index])
            here, m, offset = _pack_at(loop, parameter, value, family)
            for cycle in search_from_starts(m, here, offset):
                if cycle.section and not _is_known(mine, value, cycle):
                    mine.append(_continue_cycle(loop, parameter, grid, int(index), family, cycle))
        branches += sorted(mine, key=lambda b: float(b.amplitude.mean()))
    return Bifurcation(parameter, grid, tuple(branches))


def _set_parameter(loop: Loop, parameter: str, value: float) -> tuple[Loop, float]:
    """The loop with the parameter at a value, and the load."""
    if parameter == "disturbance":
        return loop, value
    if parameter == "gain":
        return replace(loop, controller=replace(loop.controller, Kc=loop.controller.Kc * value)), 0.0
    if parameter == "dead_time":
        return replace(loop, process=replace(loop.process, dead_time=value)), 0.0
    for part in ("valve", "controller"):
        if parameter in getattr(getattr(loop, part), "__dataclass_fields__", {}):
            return replace(loop, **{part: replace(getattr(loop, part), **{parameter: value})}), 0.0  # type: ignore[arg-type]
    raise ParameterError(
        f"parameter = {parameter!r} is not a parameter of this loop; use 'gain', 'disturbance', 'dead_time', or a "
        "parameter of "
        f"its controller or of its {type(loop.valve).__name__} valve."
    )


def _pack_at(loop: Loop, parameter: str, value: float, family: str | float) -> tuple[Loop, PackedLoop, float | None]:
    here, disturbance = _set_parameter(loop, parameter, value)
    m = pack_loop(here, disturbance=disturbance)
    if not m.valve.staircase:
        return here, m, None
    offset = rest_level_offset(m.valve.jump, family)
    absolute = parameter == "disturbance" or not isinstance(family, str)
    return here, m, (offset - m.linear.rest) % m.valve.jump if absolute else offset


def _continue_cycle(loop: Loop, parameter: str, grid, index: int, family, cycle: LimitCycle) -> Branch:
    """Continue one cycle to both ends of the grid."""
    up, dies = _continue_one_way(loop, parameter, grid[index:], family, cycle)
    down, born = _continue_one_way(loop, parameter, grid[: index + 1][::-1], family, cycle)
    cycles = (*down[::-1], cycle, *up)
    first = index - len(down)
    return Branch(cycle.family, grid[first : first + len(cycles)], cycles, born, dies)


def _continue_one_way(
    loop: Loop, parameter: str, values, family, cycle: LimitCycle
) -> tuple[list[LimitCycle], float | None]:
    """Cycles at values[1:] as far as they exist, and the value at which they end."""
    out: list[LimitCycle] = []
    for here, there in pairwise(values):
        reached, now = float(here), cycle
        step = float(there - here)
        for _ in range(200):
            target = reached + step
            if (target - there) * (there - here) > 0.0:
                target = float(there)
            continued = _cycle_at_next_value(loop, parameter, reached, target, family, now)
            if continued is not None:
                reached, now = target, continued
                if reached == there:
                    break
            elif abs(step) < abs(there - here) * 0.5**_MAX_HALVINGS:
                return out, reached
            else:
                step /= 2.0
        else:
            return out, reached
        out.append(now)
        cycle = now
    return out, None


def _cycle_at_next_value(
    loop: Loop, parameter: str, here: float, there: float, family, cycle: LimitCycle
) -> LimitCycle | None:
    """The cycle at a neighbouring value; None when it does not exist there."""
    try:
        _, before, old = _pack_at(loop, parameter, here, family)
        _, m, new = _pack_at(loop, parameter, there, family)
    except StictionError:
        return None
    *states, level = cycle.section
    size = m.valve.sb / before.valve.sb
    if new is not None and old is not None:
        step = round((level - old) / before.valve.jump)
        shift = round((old - new) / m.valve.jump)
        guesses = [new + (step + k) * m.valve.jump for k in dict.fromkeys((shift, 0, 1, -1))]
    else:
        guesses = [level * size]
    for guess in sorted(guesses, key=lambda x: abs(x - level * size)):
        orbit = refine_orbit(m, np.array(states) * size, guess, cycle.turns, fixed=new is not None)
        if orbit is not None:
            reached_cycle = limit_cycle(m, orbit)
            if len(reached_cycle.levels) == len(cycle.levels):
                return reached_cycle
    return None


def _is_known(branches: list[Branch], value: float, cycle: LimitCycle) -> bool:
    return any(
        is_same_cycle(cycle, known, 1e-4)
        for branch in branches
        for at, known in zip(branch.values, branch.cycles, strict=True)
        if at == value
    )
