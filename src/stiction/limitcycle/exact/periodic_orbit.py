"""One periodic orbit: a fixed point of the map from one rest at the top to the next, with its multipliers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.limitcycle.exact.event_simulation import SETTLED, STOPPED
from stiction.limitcycle.result import LimitCycle

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.limitcycle.exact.packed_loop import PackedLoop

__all__ = ["Orbit", "family_name", "limit_cycle", "refine_orbit", "rest_levels"]

_LEVEL_TOLERANCE = 1e-7
"""Distance of two rests, over sb, up to which they are on one level [-]."""
_STABILITY_TOLERANCE = 1e-6
"""Distance of the largest multiplier from the unit circle below which stability is unknown [-]."""


@dataclass(frozen=True)
class Orbit:
    """A fixed point of the return map."""

    states: NDArray[np.float64]
    """States of the linear part at the rest at the top, shape (n,)."""
    level: float
    """Stem position there [% of span]."""
    period: float
    """Period [s]."""
    turns: int
    """Oscillations in it."""
    multipliers: tuple[complex, ...]
    """Eigenvalues of the return map, largest first; empty when they are unknown."""
    stable: bool | None
    """Whether all of them lie inside the unit circle; None when the largest lies on it to within rounding."""


def _return_map(m: PackedLoop, w, turns: int, level: float | None):
    """The return map of w = (states, level) and its time; None when the motion has another form.

    The level is fixed when given, and tied to the states where the stem follows an OP without dead time.
    """
    n = m.linear.order
    tied = level is None and w.size == n
    x = float(m.linear.C @ w[:n]) - m.valve.lag if tied else float(w[n]) if level is None else level
    run, _ = m.run(w[:n], x, most_turns=turns + 1, tolerance=-1.0, most_steps=100_000)
    if run.status != STOPPED or run.time.size < turns + 1 or run.time[0] > 1e-2 * run.time[turns]:
        return None
    if m.linear.dead_time and run.swing[0, 6] <= m.linear.dead_time * (1.0 + 1e-9) + 1e-12:
        return None
    if level is not None and (run.swing[1:, 4].any() or abs(run.level[turns] - level) > 1e-9 * m.valve.sb):
        return None
    image = np.append(run.states[turns], run.level[turns])[: w.size]
    return image, float(run.time[turns] - run.time[0])


def refine_orbit(m: PackedLoop, states, level: float, turns: int = 1, *, fixed: bool) -> Orbit | None:
    """Newton's method on the return map from a first guess; None when it does not converge.

    Parameters
    ----------
    m : PackedLoop
        The loop.
    states : ndarray, shape (n,)
        Guess of the states where the stem comes to rest at the top.
    level : float
        Stem position there [% of span].
    turns : int
        Oscillations after which the motion is to repeat.
    fixed : bool
        Keep the level: a staircase conserves it, and each level has its own orbit.
    """
    tied = not fixed and m.linear.dead_time == 0.0
    w = np.array(states, dtype=float) if fixed or tied else np.append(states, level)
    fixed_level = level if fixed else None
    size = np.maximum(np.abs(w), 1e-3 * np.max(np.abs(w), initial=1e-12))
    if w.size > len(states):
        size[-1] = max(abs(level), m.valve.sb)
    here = _return_map(m, w, turns, fixed_level)
    miss = math.inf
    for _ in range(30):
        if here is None:
            return None
        gap = (here[0] - w) / size
        miss = float(np.max(np.abs(gap)))
        if miss < 1e-13:
            break
        slope = _return_map_derivative(m, w, size, turns, fixed_level)
        if slope is None:
            return None
        step = np.linalg.lstsq(slope - np.eye(w.size), -gap, rcond=1e-12)[0]
        share, best = 1.0, None
        while share > 1e-3:
            trial = w + share * step * size
            there = _return_map(m, trial, turns, fixed_level)
            if there is not None and (np.max(np.abs((there[0] - trial) / size)) < miss or miss < 1e-9):
                best = trial, there
                break
            share /= 2.0
        if best is None:
            break
        moved = float(np.max(np.abs((best[0] - w) / size)))
        w, here = best
        if moved < 1e-13:
            break
    if here is None or miss > 1e-9:
        return None
    slope = _return_map_derivative(m, w, size, turns, fixed_level)
    if slope is None:
        return None
    values = sorted(np.linalg.eigvals(slope), key=abs, reverse=True)
    largest = abs(values[0]) if values else 0.0
    stable = None if abs(largest - 1.0) < _STABILITY_TOLERANCE else bool(largest < 1.0)
    multipliers = tuple(complex(v) for i, v in enumerate(values) if i == 0 or abs(v) > 1e-7)
    n = m.linear.order
    if tied:
        level = float(m.linear.C @ w) - m.valve.lag
    elif not fixed:
        level = float(w[n])
    return Orbit(np.asarray(w[:n], dtype=np.float64), level, here[1], turns, multipliers, stable)


def _return_map_derivative(m: PackedLoop, w, size, turns: int, fixed_level: float | None):
    """Derivative of the return map in units of `size`, by central differences, one-sided at a corner."""
    out = np.empty((w.size, w.size))
    for i in range(w.size):
        for h in (1e-5, 1e-7):
            shift = np.zeros(w.size)
            shift[i] = h * size[i]
            above, below = _return_map(m, w + shift, turns, fixed_level), _return_map(m, w - shift, turns, fixed_level)
            if above is not None and below is not None:
                out[:, i] = (above[0] - below[0]) / (2.0 * h * size)
                break
        else:
            return None
    return out


def limit_cycle(m: PackedLoop, orbit: Orbit) -> LimitCycle:
    """Describe an orbit: amplitudes, rest levels, family."""
    run, _ = m.run(
        orbit.states, orbit.level, most_turns=2 * orbit.turns + 3, tolerance=-1.0, n_events=4096, most_steps=400_000
    )
    if run.status not in (SETTLED, STOPPED) or run.time.size < 2 * orbit.turns + 2:
        raise RuntimeError("an orbit that was found cannot be followed")  # pragma: no cover
    swing = run.swing[orbit.turns + 1 : 2 * orbit.turns + 1]
    first = run.time[orbit.turns]
    inside = (run.events[:, 0] > first + 1e-9 * orbit.period) & (
        run.events[:, 0] <= first + orbit.period * (1.0 + 1e-9)
    )
    levels = rest_levels(m, run.events[inside, 1])
    offset = float(orbit.level % m.valve.jump) if not swing[:, 4].any() and m.valve.jump > 0.0 else None
    family = family_name(offset, m.valve.jump)
    if family in ("integer", "half"):
        offset = 0.0 if family == "integer" else m.valve.jump / 2.0
    return LimitCycle(
        "continuous", "cycle", family, float(swing[:, 0].max() - swing[:, 1].min()) / 2.0, orbit.period,
        amplitude_pv=float(swing[:, 2].max() - swing[:, 3].min()) / 2.0, amplitude_mv=(levels[-1] - levels[0]) / 2.0,
        levels=tuple(x + m.linear.rest for x in levels), stable=orbit.stable, multipliers=orbit.multipliers,
        offset=offset, turns=orbit.turns,
        section=(*(float(s) for s in orbit.states), orbit.level),
    )  # fmt: skip


def rest_levels(m: PackedLoop, heights) -> list[float]:
    """The levels among the heights of single rests, ascending, in deviations [% of span]."""
    heights = np.sort(heights)
    return [float(x) for i, x in enumerate(heights) if i == 0 or x - heights[i - 1] > _LEVEL_TOLERANCE * m.valve.sb]


def family_name(offset: float | None, jump: float) -> str:
    """Name of a family of rest levels by its offset: "integer", "half", the offset, or empty for none."""
    if offset is None:
        return ""
    if min(offset, jump - offset) < 1e-9 * jump:
        return "integer"
    return "half" if abs(offset - jump / 2.0) < 1e-9 * jump else f"{offset:.4g}"
