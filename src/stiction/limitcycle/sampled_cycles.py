"""Limit cycles of the sampled loop, in which successive oscillations differ slightly."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from stiction.errors import ParameterError, require_finite, require_numbers, require_positive
from stiction.limitcycle.result import LimitCycle
from stiction.models.controllers.pid import pid_at_rest, pid_step
from stiction.models.dispatch import valve_at_rest, valve_step
from stiction.models.loop import require_loop
from stiction.models.model_properties import VALVE_PROPERTIES
from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from stiction.models import Loop

__all__ = ["sampled_limit_cycles"]


@kernel
def _run_sampled_loop(pid, model, p, process, sp, disturbance, start, signals):
    """Run the sampled loop from the values `start` of OP, PV and stem, and fill `signals` with them."""
    A, b_new, b_old, c, d, delay, direct = process
    op, pv, mv = signals
    n, order = op.shape[0], c.shape[0]
    controller = pid_at_rest(start[0], start[1], pid)
    valve = valve_at_rest(model, start[0], start[2], p)
    x, work = np.zeros(order), np.zeros(order)
    older = 0.0
    for k in range(n):
        y = start[1]
        for i in range(order):
            y += c[i] * x[i]
        if d != 0.0 and k >= direct:
            y += d * (mv[k - direct] - start[0] + disturbance)
        pv[k] = y
        controller = pid_step(sp, y, controller, math.nan, pid)
        op[k] = controller.op
        valve = valve_step(model, controller.op, valve, p)
        mv[k] = min(max(valve.position, p[0]), p[1])
        newer = mv[k - delay] - start[0] + disturbance if k >= delay else 0.0
        for i in range(order):
            total = b_new[i] * newer + b_old[i] * older
            for j in range(order):
                total += A[i, j] * x[j]
            work[i] = total
        x, work = work, x
        older = newer


@kernel
def _find_repeat(op, pv, mv, window, first, tolerance):
    """Smallest lag at which the last `window` samples of op, pv and mv repeat; 0 when they do not."""
    n = op.shape[0]
    for lag in range(2, n - window - first):
        worst = 0.0
        for k in range(n - window, n):
            worst = max(worst, abs(op[k] - op[k - lag]), abs(mv[k] - mv[k - lag]), abs(pv[k] - pv[k - lag]))
            if worst > tolerance:
                break
        if worst <= tolerance:
            return lag
    return 0


def sampled_limit_cycles(
    loop: Loop, *, sp: float = 0.0, disturbance: float = 0.0, op_start: ArrayLike | None = None, mv_start: float = 0.0,
    periods: float = 60.0, longest: float | None = None, tolerance: float = 1e-9,
) -> tuple[LimitCycle, ...]:  # fmt: skip
    """Limit cycles of the sampled loop, exactly as `simulate` runs it.

    Parameters
    ----------
    loop : Loop
        The loop, without its noise; any valve model.
    sp, disturbance : float
        Set point [PV units] and constant load [% of span].
    op_start : array_like, optional
        OP at the start of each trial [% of span]; by default from a half to eight times the valve's
        largest band.
    mv_start : float
        Stem position at the start [% of span].
    periods : float
        Oscillations to wait for the loop to settle [-].
    longest : float, optional
        Longest time after which a motion may repeat [s]; by default 20 oscillations.
    tolerance : float
        Largest difference between repeats, relative to the OP amplitude [-].

    Returns
    -------
    tuple of LimitCycle
        Motions by amplitude. `period` is the mean length of one oscillation, the amplitudes are medians, and
        `turns` is the number of oscillations after which the samples repeat. A sampled orbit takes a whole number
        of samples, so several oscillations of unequal length share one orbit, and most motions do not repeat
        within any practical time; `warning` says which. `stable` is True, because the simulation reached them.

    Raises
    ------
    ParameterError
        When a duration or `tolerance` is not positive, a set point, load or start is not finite, or the loop has a
        compensator.

    Notes
    -----
    Sampling delays every slip by up to dt, changes the period by a few per cent when the jump is fast compared with dt,
    and lets the rest levels of a staircase valve drift. As dt goes to 0 the motions tend to those of
    `exact_limit_cycles`.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.limitcycle import sampled_limit_cycles
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> round(sampled_limit_cycles(loop, sp=10.0, mv_start=3.0)[0].amplitude, 2)
    1.73
    """
    require_loop(loop)
    if loop.compensator is not None:
        raise ParameterError("the loop has a compensator; give the loop without it.")
    sp, disturbance = require_finite("sp", sp, "PV units"), require_finite("disturbance", disturbance, "% of span")
    mv_start, tolerance = require_finite("mv_start", mv_start, "% of span"), require_positive("tolerance", tolerance)
    periods = require_positive("periods", periods)
    longest = None if longest is None else require_positive("longest", longest, "s")
    cycles: list[LimitCycle] = []
    rest = sp / _static_gain(loop) - disturbance if _static_gain(loop) else 0.0
    levels = None if op_start is None else np.atleast_1d(require_numbers("op_start", op_start, "% of span"))
    starts = _default_starts(loop) if levels is None else levels - rest
    for size in starts:
        cycle = _find_orbit(loop, sp, disturbance, rest + float(size), mv_start, periods, longest, tolerance)
        if cycle is not None and not any(_is_same_cycle(cycle, known) for known in cycles):
            cycles.append(cycle)
    return tuple(sorted(cycles, key=lambda cycle: cycle.amplitude))


def _static_gain(loop: Loop) -> float:
    try:
        value = complex(loop.process.at(0.0)).real
    except (ZeroDivisionError, np.linalg.LinAlgError):
        return 0.0
    return value if math.isfinite(value) else 0.0


def _default_starts(loop: Loop) -> np.ndarray:
    facts = VALVE_PROPERTIES.get(type(loop.valve).__name__)
    names = [name for name, unit in facts.parameters.items() if unit == "% of span"] if facts else []
    sizes = [value for name in names if isinstance(value := getattr(loop.valve, name), float)]
    return np.array([0.5, 1.0, 1.5, 2.5, 4.0, 8.0]) * max(sizes, default=1.0)


def _find_orbit(loop, sp, disturbance, op0, mv0, periods, longest, tolerance) -> LimitCycle | None:
    """Run one start until it repeats; the run doubles until it has enough oscillations."""
    dt = loop.dt
    discrete = loop.process.discretise(dt)
    head = (loop.controller.pack(dt), loop.valve.code, loop.valve.pack(dt), discrete, float(sp), float(disturbance))
    start = np.array([op0, _static_gain(loop) * op0, mv0])
    n = 4096
    while True:
        op, pv, mv = np.empty((3, n))
        cast("Any", _run_sampled_loop)(*head, start, (op, pv, mv))
        ups = _upward_crossings(op)
        if ups.size > periods or n >= 1 << 21:
            break
        n *= 2
    if ups.size < 4 or not np.all(np.isfinite(op)) or np.ptp(op[n // 2 :]) == 0.0:
        return None
    turn = float(np.mean(np.diff(ups[ups.size // 2 :])))
    most = int((20.0 * turn) if longest is None else longest / dt)
    window = min(len(discrete.c) + discrete.delay + 8 + int(turn), n // 4)
    size = float(np.ptp(op[n // 2 :])) / 2.0
    lag = int(_find_repeat(op, pv, mv, window, max(n - window - most - 1, 0), tolerance * max(size, float(np.ptp(pv)))))
    swings = [slice(int(a), int(b) + 1) for a, b in pairwise(ups)][-200:]
    turns = max(round(lag / turn), 1)
    cut = slice(n - lag, n) if lag else slice(n - int(10 * turn) - 1, n)
    moves = mv[cut]
    rests = np.unique(np.round(moves[1:][np.diff(moves) == 0.0], 6))
    op, pv, mv = (x[n - (n // 2) :] for x in (op, pv, mv))
    height = [float(np.median([np.ptp(x[s]) for s in swings])) / 2.0 for x in (op, pv, mv)]
    spread = float(np.std(np.diff(ups)[-200:])) * dt
    note = (
        f"it repeats after {lag} samples, {turns} oscillations"
        if lag
        else f"it does not repeat within {most} samples; means over {len(swings)} oscillations"
    )
    return LimitCycle(
        "sampled", "cycle", "", height[0], lag * dt / turns if lag else turn * dt, height[1], height[2],
        tuple(float(x) for x in rests), stable=True, turns=turns if lag else 1,
        warning=f"As sampled at {dt:g} s: {note}, their periods within +-{spread:.2g} s (standard deviation).",
    )  # fmt: skip


def _upward_crossings(op) -> np.ndarray:
    tail = op[op.size // 2 :]
    middle = 0.5 * (tail.max() + tail.min())
    above = tail > middle
    return np.nonzero(above[1:] & ~above[:-1])[0]


def _is_same_cycle(cycle: LimitCycle, other: LimitCycle) -> bool:
    return (
        cycle.turns == other.turns
        and abs(cycle.period - other.period) < 5e-3 * cycle.period
        and abs(cycle.amplitude - other.amplitude) < 1e-2 * cycle.amplitude
    )
