"""The cycle of the loop identified, by itself, and how far is its limit of stability."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.errors import ParameterError
from stiction.models import FOPDT, PID, SOPDT, Integrating, Kano, Loop
from stiction.simulation.closed_loop import simulate

if TYPE_CHECKING:
    from stiction.diagnosis.identified import ControllerFit, Identification, ProcessFit
    from stiction.models import TransferFunction

__all__ = ["OwnCycle", "near", "own_cycle", "process_of", "ultimate"]

PERIODS, PER_PERIOD = 16, 60
"""Periods simulated, and samples of each at most."""
PUSH, PART = 0.7, 3.0
"""Load that the run begins with, over S [-], for one part in so many of a period [-]: a loop at rest would stay so."""
RESTS = 1e-3
"""Half the swing of OP over S below which the loop rests [-]."""
LEAST_FIT = 0.5
"""Share of the OP that the controller found must explain [-]."""


class OwnCycle(NamedTuple):
    """The cycle that valve, process and controller fall into by themselves."""

    period: float
    """Period [s]; NaN where there is none."""
    amplitude_op: float
    """Half peak to peak of OP [% of span]; 0 where it dies out, infinite where the loop runs away."""


def process_of(found: ProcessFit) -> TransferFunction:
    """The process found, as a model.

    Parameters
    ----------
    found : ProcessFit
        Gain, lags and dead time.

    Returns
    -------
    TransferFunction
        One lag, two lags, or an integrator with or without a lag, with dead time.
    """
    if found.integrating:
        return Integrating(found.gain, found.dead_time, found.time_constant)
    slow = found.time_constant - found.lag
    if found.lag > 1e-3 * slow:
        return SOPDT(found.gain, slow, found.lag, found.dead_time)
    return FOPDT(found.gain, max(slow, 1e-6), found.dead_time)


def own_cycle(found: Identification, controller: ControllerFit, period: float, dt: float) -> OwnCycle | None:
    """Let the loop identified run by itself from a load pulse.

    Parameters
    ----------
    found : Identification
        Valve and process.
    controller : ControllerFit
        The controller found.
    period : float
        Period of the record's oscillation, which sets the length of the run [s].
    dt : float
        Sampling period of the record [s].

    Returns
    -------
    OwnCycle or None
        Its cycle; None where the controller or the process is not known well enough to run it.
    """
    known = controller.explained > LEAST_FIT and controller.Ti > 0.0 and math.isfinite(controller.Kc)
    if not (known and period > 4.0 * dt):
        return None
    step = dt * max(round(period / dt / PER_PERIOD), 1)
    process = found.process
    gain = process.gain * controller.Kc * (step if process.integrating else 1.0)
    if gain <= 0.0:
        return OwnCycle(math.nan, math.inf)
    # In units of S, of the process gain and of the step: whether a loop at its limit rests or cycles must not hang on
    # how the units of a record round.
    times = {name: getattr(process, name) / step for name in ("time_constant", "dead_time", "lag")}
    times["dead_time"] += found.actuator_lag / step
    plain = replace(process, gain=1.0, **{name: _round(x) for name, x in times.items()})
    ratio = _round(min(found.J / found.S, 1.0)) if found.S > 0.0 else 0.0
    n = int(PERIODS * period / step)
    load = np.zeros(n)
    load[: max(int(period / (PART * step)), 2)] = PUSH
    try:
        loop = Loop(
            PID(_round(gain), _round(controller.Ti / step), op_limits=(-1e4, 1e4)),
            Kano(1.0, ratio),
            process_of(plain),
            dt=1.0,
        )
        op = simulate(loop, 0.0, float(n), load, op_start=50.0).op[n // 2 :]
    except ParameterError:
        return None
    if not np.isfinite(op).all():
        return OwnCycle(math.nan, math.inf)
    swing = 0.5 * float(np.ptp(op))
    wave = op - op.mean()
    rises = np.flatnonzero((wave[:-1] < 0.0) & (wave[1:] >= 0.0))
    if rises.size < 3 or swing < RESTS:
        return OwnCycle(math.nan, 0.0)
    return OwnCycle(float(np.median(np.diff(rises))) * step, swing * found.S)


def near(one: float, other: float) -> float:
    """How near two periods or amplitudes are.

    Parameters
    ----------
    one, other : float
        Two positive numbers of one unit.

    Returns
    -------
    float
        1 where they are equal, 0.36 where they are a factor of 1.4 apart, 0 where one is not positive or finite [-].

    Examples
    --------
    >>> near(60.0, 60.0), round(near(60.0, 84.0), 2), near(60.0, 0.0)
    (1.0, 0.36, 0.0)
    """
    if not (one > 0.0 and other > 0.0 and math.isfinite(one) and math.isfinite(other)):
        return 0.0
    return math.exp(-3.0 * abs(math.log(one / other)))


def _round(x: float) -> float:
    """Six digits of a number."""
    return float(f"{x:.6g}")


def ultimate(process: ProcessFit, controller: ControllerFit, dt: float) -> tuple[float, float] | None:
    """Gain margin [-] of the loop with a good valve, and the period at its limit of stability [s].

    Parameters
    ----------
    process : ProcessFit
        The process found behind a good valve.
    controller : ControllerFit
        The controller found.
    dt : float
        Sampling period [s]; holding the OP delays by half of it, computing it by as much.

    Returns
    -------
    tuple of float, or None
        None where the phase never reaches -180 degrees or the controller is not known.
    """
    if not (controller.explained > LEAST_FIT and controller.Ti > 0.0 and process.gain * controller.Kc > 0.0):
        return None
    omega = np.geomspace(1e-3, 1.0, 600) * np.pi / dt
    s = 1j * omega
    if process.integrating:
        slow, lag = 0.0, process.time_constant if math.isfinite(process.time_constant) else 0.0
    else:
        slow, lag = max(process.time_constant - process.lag, 0.0), process.lag
    lags = s * (1.0 + s * lag) if process.integrating else (1.0 + s * slow) * (1.0 + s * lag)
    gain = process.gain * controller.Kc
    integral = 1.0 / (s * controller.Ti) if math.isfinite(controller.Ti) else 0.0
    response = gain * (1.0 + integral) / lags * np.exp(-s * (process.dead_time + dt))
    phase = np.unwrap(np.angle(response))
    crossing = np.flatnonzero((phase[:-1] > -np.pi) & (phase[1:] <= -np.pi))
    if crossing.size == 0:
        return None
    # Where an integral acts on an integrating process the phase may begin below -180 degrees and rise above it first.
    k = int(crossing[-1]) if phase[0] < -np.pi else int(crossing[0])
    return float(1.0 / abs(response[k])), float(2.0 * np.pi / omega[k])
