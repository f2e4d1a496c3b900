"""One step of retuning for a loop that is known from one record only.

Signals of a limit cycle determine the product of process gain and slip jump, hardly the two apart, so that the best
setting for an identified loop is that of one of many loops that explain the record equally well. One step that helps
nearly all of them is found on known loops instead: more proportional action at the same integral action. The present
setting is known far better than the process, so the step is taken from it, and the loop is recorded again before the
next one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.compensation.repair import stiction_of
from stiction.compensation.replace_parts import replace_parts
from stiction.compensation.retune import (
    Retuning,
    TradeOff,
    describing_function_margin,
    load_response,
    maximum_sensitivity,
    without_limits,
)
from stiction.limitcycle import predict_limit_cycles
from stiction.models import Kano
from stiction.simulation import simulate

if TYPE_CHECKING:
    from stiction.models import PID, Loop

__all__ = ["retune_step"]

KC_STEP, TI_STEP = 1.4, 1.5
"""Factors on Kc and Ti [-]. On 31 simulated loops with S of 2 to 6 %, noise and loads, the PV deviation falls in 29,
and by 5 % on average (see `tests/compensation/test_retune_step.py`)."""
MAX_MS, MAX_MS_RISE = 2.0, 1.5
"""Maximum sensitivity up to which the step is taken [-], and by which factor on the present one if that is larger [-]:
the process gain of a twin may be wrong by half."""
MAX_WORSENING = 0.1
"""Share by which the PV deviation may rise in the simulations before the step counts as no help [-]."""
JUMP_RATIOS = (0.1, 0.3, 0.5, 0.7, 0.9)
"""J / S of the simulated valves [-], as the identified one is uncertain."""
PERIODS, LOADS_OVER_S = 40, (0.23, -0.41, 0.08, -0.13, 0.37, -0.29, 0.47, -0.05)
"""Present periods that are simulated, and the constant loads in them / S [-]."""


def retune_step(loop: Loop, period: float) -> Retuning:
    """Find whether a step to more proportional action helps, for a loop identified from a record.

    `loop`: the loop's twin, with a valve that has S and J. `period`: period of its oscillation [s]. Returns the setting
    after the step, or the present one where the step goes beyond the limits. `improvement` is that of simulations with
    noise and loads, a mean over valves with different slip jumps.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.compensation.retune_step import retune_step
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(1.5, 10.0, 8.0), dt=1.0, noise=0.05)
    >>> found = retune_step(loop, 140.0)
    >>> round(found.controller.Kc, 2), found.controller.Ti
    (0.28, 15.0)
    """
    now = loop.controller
    step = replace(now, Kc=KC_STEP * now.Kc, Ti=TI_STEP * now.Ti)
    noisy = replace_parts(loop, compensator=None)
    quiet = replace_parts(noisy, noise=0.0)
    if now.Ti < loop.dt:
        return _no_step(quiet, now, "the controller has no proportional action that could be raised")
    Ms_now, Ms = maximum_sensitivity(quiet, now), maximum_sensitivity(quiet, step)
    if not Ms_now < np.inf > Ms:
        return _no_step(quiet, now, "the identified loop is unstable with a good valve")
    iae = load_response(quiet, step, period) / load_response(quiet, now, period)
    (now_std, now_travel), (std, travel) = (_deviations(noisy, pid, period) for pid in (now, step))
    change = float(np.mean(std / now_std)) - 1.0
    allowed = Ms <= max(MAX_MS, MAX_MS_RISE * Ms_now)
    curve = (
        TradeOff(now.Kc, now.Ti, float(now_std.mean()), now_travel, 1.0, Ms_now, True),
        TradeOff(step.Kc, step.Ti, float(std.mean()), travel, iae, Ms, allowed),
    )
    setting = f"Kc = {step.Kc:.3g} and Ti = {step.Ti:.3g} s"
    if not allowed:
        why = f"with {setting} the maximum sensitivity would rise from {Ms_now:.2g} to {Ms:.2g}"
        return replace(_no_step(quiet, now, why), curve=curve)
    if change > MAX_WORSENING:
        why = f"{setting} raise the PV deviation by {100.0 * change:.0f} % in simulations"
        return replace(_no_step(quiet, now, why), curve=curve)
    reason = (
        f"A limit cycle remains. A step to more proportional action, {setting}, changes the PV deviation by "
        f"{100.0 * change:+.0f} % in simulations with noise, loads and slip jumps from {JUMP_RATIOS[0]:g} to "
        f"{JUMP_RATIOS[-1]:g} of S; record the loop again before the next step."
    )
    return replace(_no_step(quiet, step, ""), improvement=-change, curve=curve, reason=reason)


def _no_step(quiet: Loop, controller: PID, why: str) -> Retuning:
    """The result with a setting, and why it is the present one."""
    loop = replace_parts(quiet, controller=controller)
    cycles = predict_limit_cycles(loop, exact=False)
    stable = sum(1 for cycle in cycles if cycle.kind == "cycle" and cycle.stable is not False)
    reason = f"Retuning does not help: {why}."
    return Retuning(controller, True, describing_function_margin(loop), stable, 0.0, (), reason)


def _deviations(loop: Loop, pid: PID, period: float) -> tuple[np.ndarray, float]:
    """PV deviation for each of `JUMP_RATIOS` [PV units], and the mean stem travel [% of span per h]."""
    stiction = stiction_of(loop.valve)
    assert stiction is not None
    S, n = stiction[0] or stiction[1], max(round(PERIODS * period / loop.dt), 400)
    load = S * np.repeat(LOADS_OVER_S, -(-n // len(LOADS_OVER_S)))[:n]
    load[: max(round(period / 3.0 / loop.dt), 3)] += 0.7 * S
    deviations, travels = [], []
    for ratio in JUMP_RATIOS:
        tried = replace_parts(loop, controller=without_limits(pid), valve=Kano(S, ratio * S))
        run = simulate(tried, 0.0, n * loop.dt, load, 1)
        assert run.pv is not None
        assert run.mv is not None
        deviations.append(float(run.pv[n // 8 :].std()))
        travels.append(float(np.abs(np.diff(run.mv)).sum()) * 3600.0 / (n * loop.dt))
    return np.array(deviations), float(np.mean(travels))
