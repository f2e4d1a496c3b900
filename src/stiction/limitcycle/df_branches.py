"""The describing function of a nonlinearity, divided at its jumps into smooth branches."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.limitcycle.continuous_form import continuous_form
from stiction.limitcycle.describing import describing_function
from stiction.limitcycle.describing.staircase import rest_level_offset, staircase_amplitudes, staircase_levels
from stiction.limitcycle.describing.valve_df import is_rate_dependent
from stiction.models import Choudhury

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["DFBranches", "branches_of_family", "family_names"]

_MAX_AMPLITUDE_JUMPS = 60
"""Largest amplitude of a staircase, in jumps [-]; N is then 1 to about 0.001."""
_DEFAULT_ONSET = 1.0
"""First amplitude of the search for a valve without known bands [% of span]."""
_MAX_AMPLITUDE_RATIO = 1e4
"""Largest amplitude of other valves over the amplitude at which they begin to move [-]."""


@dataclass(frozen=True)
class DFBranches:
    """N(A) of one family of rest levels, in branches."""

    name: str
    """"half", "integer", the offset, or empty for a nonlinearity with one describing function."""
    jumps: tuple[float, ...]
    """Amplitudes between the branches, the onset of motion first [% of span]."""
    largest: float
    """Largest amplitude searched [% of span]."""
    evaluate: Callable[..., Any]
    """N over arrays (amplitude, omega)."""
    levels: Callable[[float], tuple[float, ...]]
    """Rest levels at an amplitude [% of span]; empty where the stem has none."""
    lag: float
    """Distance between the turning points of stem and input [% of span]."""
    rate_dependent: bool
    """Whether N depends on the frequency."""

    def branches(self, points: int = 160) -> list[np.ndarray]:
        """Amplitudes along each branch, denser at its ends [% of span]."""
        edges = [*self.jumps, self.largest]
        out = []
        for k, (low, high) in enumerate(pairwise(edges)):
            enough = points if k < 6 else points // 4
            inner = low + (high - low) * 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, enough)))
            if high > 20.0 * low and high == self.largest:
                first = low if low > 0.0 else 1e-6 * high
                inner = first * (1.0 + np.geomspace(1e-9, high / first - 1.0, 4 * points))
            inner[0] = inner[0] * (1.0 + 1e-12) if inner[0] > 0.0 else inner[1] * 1e-3
            inner[-1] *= 1.0 - 1e-10
            out.append(inner)
        return out


def family_names(valve: Any) -> tuple[str | float, ...]:
    """Names of the families of a nonlinearity: two symmetric ones for a staircase, else one."""
    valve_form = None if hasattr(valve, "describing_function") else continuous_form(valve)
    return ("half", "integer") if valve_form is not None and valve_form.staircase else ("",)


def branches_of_family(valve: Any, name: str | float) -> DFBranches:
    """Return the branches of one family of a nonlinearity."""
    if hasattr(valve, "describing_function"):
        size = max((value for value in vars(valve).values()), default=1.0)
        jumps = valve.jumps(_MAX_AMPLITUDE_JUMPS * size)
        onset = () if jumps and _output_moves(valve, jumps[0]) is False else (0.0,)
        return DFBranches(
            "",
            (*onset, *jumps),
            _MAX_AMPLITUDE_RATIO * size,
            _memoryless_df(valve),
            lambda _: (),
            0.0,
            rate_dependent=False,
        )
    valve_form = continuous_form(valve)
    depends_on_rate = is_rate_dependent(valve)
    if valve_form is not None and valve_form.staircase:
        sb, lag, _ = valve_form
        offset = rest_level_offset(valve_form.jump, name)
        largest = _MAX_AMPLITUDE_JUMPS * valve_form.jump + sb
        jumps = staircase_amplitudes(sb, lag, offset, largest * (1.0 - 1e-6))
        label = name if isinstance(name, str) else f"{offset:g}"
        return DFBranches(
            label,
            tuple(jumps),
            largest,
            lambda a, _w: describing_function(valve, a, family=offset),
            lambda a: staircase_levels(sb, lag, offset, a),
            lag,
            rate_dependent=False,
        )
    if valve_form is not None:
        sb, lag, rate = valve_form
        onset = (sb + lag) / 2.0
        if rate == 0.0:
            # With S = 0 the stem moves at any amplitude, so the jump sets the scale.
            return DFBranches(
                "", (onset,), _MAX_AMPLITUDE_RATIO * (onset or sb), lambda a, _w: describing_function(valve, a),
                lambda a: (float(lag - a), float(a - lag)), lag, rate_dependent=False,
            )  # fmt: skip
        return DFBranches(
            "", (onset,), 200.0 * onset, lambda a, w: describing_function(valve, a, w),
            lambda a: (float(lag - a), float(a - lag)),
            lag, rate_dependent=True,
        )  # fmt: skip
    scale = (valve.S + valve.J) / 2.0 if isinstance(valve, Choudhury) else _DEFAULT_ONSET
    return DFBranches(
        "", (scale,), 20.0 * scale,
        lambda a, w: describing_function(valve, a, w if depends_on_rate else None, tolerance=2e-3),
        lambda _: (), 0.0, rate_dependent=depends_on_rate,
    )  # fmt: skip


def _memoryless_df(valve: Any) -> Callable[..., Any]:
    return lambda a, _w: valve.describing_function(np.asarray(a, dtype=float))


def _output_moves(valve: Any, amplitude: float) -> bool:
    return bool(valve.describing_function(np.array([0.5 * amplitude]))[0] != 0.0)
