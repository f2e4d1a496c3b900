"""All limit cycles of a loop in continuous time: from predictions, from starts of every size, and by symmetry."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.limitcycle.describing import describing_function
from stiction.limitcycle.describing.staircase import require_families, rest_level_offset
from stiction.limitcycle.exact.event_simulation import DIVERGED, REST, SETTLED
from stiction.limitcycle.exact.packed_loop import PackedLoop, pack_loop
from stiction.limitcycle.exact.periodic_orbit import Orbit, family_name, limit_cycle, refine_orbit, rest_levels
from stiction.limitcycle.harmonic_balance_search import harmonic_balance
from stiction.limitcycle.result import LimitCycle

if TYPE_CHECKING:
    from collections.abc import Iterable

    from stiction.models import Loop

__all__ = ["exact_limit_cycles", "is_same_cycle", "search_from_starts", "solve_packed"]

_START_AMPLITUDES = (0.7, 1.05, 1.5, 2.2, 3.3, 5.0, 9.0, 20.0)
"""OP amplitudes of the starts, over sb [-]."""
_START_PHASES = (-math.pi, -2.6, -2.1)
"""Phases of L at the frequencies of the starts [rad]: -1/N of a stem that lags has half a turn to a quarter."""
_QUICK_TURNS = 24
"""Turns of a first, short run, enough for most starts that end in a known cycle [-]."""
_QUICK_STEPS = 60_000
"""Steps of that run [-]."""


def exact_limit_cycles(
    loop: Loop,
    *,
    sp: float = 0.0,
    disturbance: float = 0.0,
    families: Iterable[str | float] | None = None,
) -> tuple[LimitCycle, ...]:
    """All limit cycles of a loop, solved exactly in continuous time, with their stability.

    Parameters
    ----------
    loop : Loop
        The loop; its `dt`, output limits, end stops and noise have no effect.
    sp : float
        Set point [PV units].
    disturbance : float
        Constant load at the process inlet [% of span].
    families : iterable of str or float, optional
        For a stem that only rests and jumps (Stenman, He, Srinivasan when slow, and any valve with which each slip
        reverses the OP immediately): "half" and "integer" are the two families symmetric about the point of rest, a
        number is the absolute position of one rest level [% of span]. By default both symmetric ones.

    Returns
    -------
    tuple of LimitCycle
        By family and amplitude.

    Raises
    ------
    ParameterError
        When the valve has no continuous-time form or no stiction, the controller and process are improper or
        make an algebraic loop, the loop has no point of rest, it has a compensator, or a family is unknown.

    Notes
    -----
    A staircase valve moves by exactly one jump at a time, so the offset of its rest levels against the load is constant
    and there is a family of cycles over it. In a sampled simulation every jump overshoots a little, so that the levels
    drift; the drift is slower for a shorter dt.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID.parallel(0.5, 1.0, 0.1), st.Stenman(0.5), st.TransferFunction([1], [5, 6, 1]), dt=0.01)
    >>> [(c.family, round(c.period, 2)) for c in st.exact_limit_cycles(loop)]
    [('half', 21.12), ('half', 16.24), ('integer', 17.6), ('integer', 15.66)]
    """
    chosen = None if families is None else require_families(families)
    return solve_packed(pack_loop(loop, sp=sp, disturbance=disturbance), loop, chosen)


def solve_packed(
    m: PackedLoop,
    loop: Loop,
    families: Iterable[str | float] | None = None,
    guesses: Iterable[LimitCycle] | None = None,
) -> tuple[LimitCycle, ...]:
    """`exact_limit_cycles` of a packed loop, from the predictions `guesses` or new ones."""
    cycles: list[LimitCycle] = []
    predictions = None if guesses is None else list(guesses)
    if not m.valve.staircase:
        cycles += [cycle for cycle in search_from_starts(m, loop, None, predictions) if cycle.offset is None]
    if not m.has_lattice:
        return tuple(cycles)
    for family in ("half", "integer") if families is None else families:
        offset = rest_level_offset(m.valve.jump, family, m.linear.rest)
        name = family if isinstance(family, str) else f"{offset:g}"
        mine = None if predictions is None else [guess for guess in predictions if guess.family in ("", name)]
        cycles += [cycle for cycle in search_from_starts(m, loop, offset, mine) if cycle.offset is not None]
    return tuple(cycles)


def search_from_starts(
    m: PackedLoop, loop: Loop, offset: float | None, guesses: Iterable[LimitCycle] | None = None
) -> tuple[LimitCycle, ...]:
    """All cycles on one lattice offset [% of span] from the point of rest, or of a valve without a lattice (None)."""
    cycles: list[LimitCycle] = []
    family = "half" if offset is None else offset
    if guesses is None:
        guesses = harmonic_balance(m.linear, loop.valve, None if offset is None else (offset,))
    for guess in guesses:
        if guess.kind == "cycle":
            states, level = _from_prediction(m, loop, guess, family)
            _settle_and_refine(m, states, level, offset, cycles, refine_first=True)
    for states, level in _starts(m, offset):
        _settle_and_refine(m, states, level, offset, cycles)
    if offset is None or min(2.0 * offset % m.valve.jump, -2.0 * offset % m.valve.jump) < 1e-9 * m.valve.jump:
        for cycle in cycles:
            if cycle.stable is not False and cycle.section:
                *states, level = cycle.section
                _settle_and_refine(m, -np.array(states), -level, offset, cycles, up=-1.0)
    if offset is not None:
        cycles = [
            cycle
            for cycle in cycles
            if cycle.offset is None or _offset_distance(cycle.offset, offset, m.valve.jump) < 1e-6
        ]
    return tuple(sorted(cycles, key=lambda cycle: (cycle.amplitude, cycle.period)))


def _offset_distance(offset: float, other: float, jump: float) -> float:
    """Distance of two offsets on the circle of the lattice, as a share of the jump [-]."""
    return min((offset - other) % jump, (other - offset) % jump) / jump


def is_same_cycle(cycle: LimitCycle, other: LimitCycle, tolerance: float = 1e-6) -> bool:
    """Whether two exact cycles are the same motion."""
    return (
        abs(cycle.period / cycle.turns - other.period / other.turns) <= tolerance * cycle.period / cycle.turns
        and abs(cycle.amplitude - other.amplitude) <= tolerance * cycle.amplitude
        and abs(cycle.levels[-1] - other.levels[-1]) <= tolerance * cycle.amplitude
    )


def _settle_and_refine(
    m: PackedLoop, states, level: float, offset, cycles, *, refine_first: bool = False, up: float = 1.0
) -> None:
    """Run the loop from a start until it settles, refine the cycle, and add it when it is new."""
    fixed = offset is not None
    look = m if not fixed or math.isinf(m.valve.rate) else m.without_following()
    if refine_first:
        orbit = refine_orbit(m, states, level, fixed=fixed)
        if orbit is not None:
            _add_if_new(cycles, m, orbit)
            return
    run, _ = look.run(states, level, most_turns=_QUICK_TURNS, tolerance=1e-6, up=up, most_steps=_QUICK_STEPS)
    if run.time.size < 2 or run.status in (REST, DIVERGED):
        return
    if run.status != SETTLED and run.time.size < _QUICK_TURNS:
        return
    if offset is None and m.has_lattice and not run.swing[-2:, 4].any():
        return
    orbit = None
    if run.status == SETTLED and _ends_in_known_cycle(cycles, m, run):
        return
    if run.status == SETTLED:
        orbit = _refine_run(m, run, fixed)
    if orbit is None:
        run, _ = look.run(states, level, most_turns=600, tolerance=1e-10, up=up, most_steps=400_000, n_events=8192)
        if run.status != SETTLED:
            return
        orbit = _refine_run(m, run, fixed)
    if orbit is not None:
        _add_if_new(cycles, m, orbit)
        return
    if look is not m:
        return
    k = run.turns
    settled = Orbit(run.states[-1], float(run.level[-1]), float(run.time[-1] - run.time[-1 - k]), k, (), True)
    cycle = _cycle_from_run(m, settled, run)
    if not any(is_same_cycle(cycle, known) for known in cycles):
        cycles.append(cycle)


def _ends_in_known_cycle(cycles: list[LimitCycle], m: PackedLoop, run) -> bool:
    """Whether a run that settled to 1e-6 ended in a cycle already in the list."""
    period = run.time[-1] - run.time[-1 - run.turns]
    height = (run.swing[-run.turns :, 0].max() - run.swing[-run.turns :, 1].min()) / 2.0
    return any(
        known.turns == run.turns
        and abs(known.period - period) <= 1e-4 * period
        and abs(known.amplitude - height) <= 1e-4 * height
        and abs(known.levels[-1] - m.linear.rest - run.level[-run.turns :].max()) <= 1e-4 * m.valve.sb
        for known in cycles
    )


def _refine_run(m: PackedLoop, run, fixed: bool) -> Orbit | None:
    level = float(run.level[-1])
    is_fixed = fixed or not run.swing[-run.turns :, 4].any()
    if run.swing[-1, 6] <= m.linear.dead_time:
        return None
    return refine_orbit(m, run.states[-1], level, run.turns, fixed=is_fixed)


def _cycle_from_run(m: PackedLoop, orbit: Orbit, run) -> LimitCycle:
    """A cycle from a settled run only: its turn is shorter than the dead time, so the return map needs the past."""
    k = orbit.turns
    swing = run.swing[-k:]
    recent = run.events[run.events[:, 0] > run.time[-1] - orbit.period * (1.0 + 1e-9), 1]
    levels = rest_levels(m, recent if recent.size else run.level[-k:])
    offset = float(orbit.level % m.valve.jump) if m.valve.jump > 0.0 and not swing[:, 4].any() else None
    return LimitCycle(
        "continuous", "cycle", family_name(offset, m.valve.jump), float(swing[:, 0].max() - swing[:, 1].min()) / 2.0,
        orbit.period, float(swing[:, 2].max() - swing[:, 3].min()) / 2.0, (levels[-1] - levels[0]) / 2.0,
        tuple(x + m.linear.rest for x in levels), stable=True, offset=offset, turns=k,
        warning="Found by simulation: the stem turns within the dead time, so there are no multipliers.",
    )  # fmt: skip


def _add_if_new(cycles: list[LimitCycle], m: PackedLoop, orbit: Orbit) -> None:
    """Add an orbit when it is new; period and level are compared first, which is faster."""
    near = 1e-6 * max(m.valve.sb, abs(orbit.level))
    for known in cycles:
        if (
            known.turns == orbit.turns
            and abs(known.period - orbit.period) <= 1e-6 * orbit.period
            and known.section
            and abs(known.section[-1] - orbit.level) <= near
        ):
            return
    cycle = limit_cycle(m, orbit)
    if not any(is_same_cycle(cycle, known) for known in cycles):
        cycles.append(cycle)


def _from_prediction(m: PackedLoop, loop: Loop, guess: LimitCycle, family) -> tuple[np.ndarray, float]:
    """States and level at the rest at the top, from the describing function."""
    w = guess.omega
    n = complex(describing_function(loop.valve, guess.amplitude, w, family=family))
    top = guess.levels[-1] - m.linear.rest if guess.levels else guess.amplitude_mv
    before = math.acos(min(max((top + m.valve.lag) / guess.amplitude, -1.0), 1.0)) if m.valve.staircase else 0.0
    phasor = m.linear.states_at(w) * n * guess.amplitude
    return np.real(phasor * np.exp(-1j * before)), top


def _starts(m: PackedLoop, offset: float | None):
    """Starts of many sizes, as if the stem had moved in a sine at a few frequencies."""
    linear = m.linear
    marks = np.abs(np.append(linear.poles, 1.0 / linear.dead_time if linear.dead_time else 0.0))
    marks = marks[marks > 1e-9 * max(float(marks.max(initial=0.0)), 1e-300)]
    if marks.size == 0:
        marks = np.ones(1)
    grid = np.geomspace(1e-2 * marks.min(), 1e2 * marks.max(), 600)
    phase = np.unwrap(np.angle(linear.at(1j * grid)))
    phase -= 2.0 * math.pi * round(float(phase[0] + math.pi / 2.0) / (2.0 * math.pi))
    speeds = []
    for wanted in _START_PHASES:
        past = np.nonzero(phase <= wanted)[0]
        speeds.append(grid[past[0]] if past.size else marks.min())
    jump = m.valve.jump
    for w in dict.fromkeys(float(s) for s in speeds):
        gain = complex(linear.at(1j * w))
        if gain == 0.0:
            continue
        unit = linear.states_at(w) * (-1.0 / gain) * np.exp(-1j * w * linear.dead_time)
        for size in _START_AMPLITUDES:
            a = size * m.valve.sb
            level = a - m.valve.lag
            if offset is not None:
                level = offset + jump * math.floor((level - offset) / jump + 0.5)
                before = min(max((level + m.valve.lag) / a, -1.0), 1.0)
                yield np.real(unit * a * np.exp(-1j * math.acos(before))), level
            else:
                yield np.real(unit * a), level
