"""Processes and their controllers: drawn in samples of the controller, tuned by a rule, with a gain margin."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.models import FOPDT, PID, SOPDT, Ideal, Integrating, Loop, TransferFunction

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "KINDS", "draw_loop", "gain_at", "gain_margin", "log_uniform", "outside_period", "scale_gain", "with_gain_margin",
]  # fmt: skip

KINDS = {"flow": 0.25, "first order": 0.25, "second order": 0.2, "integrating": 0.3}
"""Kinds of process and how often they come."""
MARGIN = 1.7
"""Least gain margin of a loop that is not tight [-]."""


def draw_loop(rng: np.random.Generator, dt: float, kind: str | None = None) -> tuple[Loop, str] | None:
    """Draw a loop with a good valve and a gain margin of at least `MARGIN`, and the kind of its process.

    Rules are SIMC, lambda tuning and either of them detuned; level control comes tight or averaging. Controllers
    are PI, one in four PID, reverse or direct acting, with any set point weight. None where the loop drawn has no
    margin at all.
    """
    kind = str(rng.choice(list(KINDS), p=list(KINDS.values()))) if kind is None else kind
    gain = log_uniform(rng, 0.1, 10.0)
    lag2 = 0.0
    if kind == "integrating":
        dead_time, lag2 = (
            log_uniform(rng, 1.0, 12.0) * dt,
            float(rng.choice([0.0, 1.0])) * log_uniform(rng, 1.0, 10.0) * dt,
        )
        gain = gain / (rng.uniform(20.0, 100.0) * dt)
        process = Integrating(gain, dead_time, lag2)
        closed = (dead_time + lag2) * log_uniform(rng, 1.0, 5.0)
        Kc = 1.0 / (gain * (closed + dead_time))
        Ti = 4.0 * (closed + dead_time) * log_uniform(rng, 0.6, 2.0)
    else:
        tau, dead_time = log_uniform(rng, 1.0, 3.0), rng.uniform(0.2, 2.0)
        if kind != "flow":
            tau, dead_time = log_uniform(rng, 3.0, 40.0), log_uniform(rng, 1.0, 12.0)
        tau, dead_time = float(tau) * dt, float(dead_time) * dt
        process = FOPDT(gain, tau, dead_time)
        if kind == "second order":
            lag2 = tau * float(rng.uniform(0.1, 0.8))
            process = SOPDT(gain, tau, lag2, dead_time)
            if rng.random() < 0.3:
                zero = tau * float(rng.choice([rng.uniform(0.2, 0.8), rng.uniform(-0.5, -0.1)]))
                process = TransferFunction(np.array([gain * zero, gain]), process.den, dead_time)
        delay = dead_time + lag2 / 2.0
        simc = bool(rng.random() < 0.5)
        closed = (
            max(delay, 0.3 * tau) * log_uniform(rng, 0.5, 2.0) if simc else (tau + lag2) * log_uniform(rng, 0.7, 3.0)
        )
        Kc = (tau + lag2 / 2.0) / (gain * (closed + delay))
        Ti = min(tau + lag2 / 2.0, 4.0 * (closed + delay)) if simc else tau + lag2
        if rng.random() < 0.3:
            Kc, Ti = Kc * log_uniform(rng, 0.3, 1.0), Ti * log_uniform(rng, 0.5, 2.0)
    pid = bool(rng.random() < 0.25) and kind != "flow"
    controller = PID(
        Kc,
        Ti,
        Td=(lag2 or dead_time / 3.0) if pid else 0.0,
        N=8.0 if pid else np.inf,
        b=float(rng.choice([1.0, 0.0], p=[0.8, 0.2])),
        c=0.0,
        op_limits=(0.0, 100.0),
        integral=str(rng.choice(["backward", "forward"], p=[0.8, 0.2])),
    )
    found = with_gain_margin(rng, Loop(controller, Ideal(), process, dt))
    return None if found is None else (found[0], kind)


def with_gain_margin(rng: np.random.Generator, loop: Loop) -> tuple[Loop, float] | None:
    """The loop with a gain margin of at least `MARGIN`, three in ten mirrored, and its period at the limit [s].

    None where it has no margin at all.
    """
    found = gain_margin(loop)
    if found is None:
        return None
    loop = scale_gain(loop, min(1.0, found[0] / MARGIN))
    if rng.random() < 0.3:
        process = loop.process
        assert isinstance(process, TransferFunction)
        mirrored = TransferFunction(-process.num, process.den, process.dead_time)
        loop = replace(loop, process=mirrored, controller=replace(loop.controller, Kc=-loop.controller.Kc))
    return loop, found[1]


def scale_gain(loop: Loop, factor: float) -> Loop:
    """The loop with `factor` times the controller gain."""
    return replace(loop, controller=replace(loop.controller, Kc=factor * loop.controller.Kc))


def gain_margin(loop: Loop) -> tuple[float, float] | None:
    r"""Gain margin [-] of the sampled loop with a good valve, and the period of its oscillation there [s].

    .. math:: L(z) = C(z)\, z^{-n}\, c\,(zI - A)^{-1} (b_{new} + b_{old} z^{-1}), \quad z = e^{j\omega dt}

    The phase of L falls through an odd multiple of -180 degrees there, or L is negative at the highest frequency,
    where it is real; None where neither is so, or where the phase begins below -180 degrees.
    """
    found = loop.discrete
    omega = np.geomspace(1e-4, np.pi, 800)
    z = np.exp(np.asarray(1j * omega, dtype=np.complex128))
    back = np.asarray(1.0 / z, dtype=np.complex128)
    eye = np.eye(found.c.size)
    inputs = found.b_new[np.newaxis, :] + found.b_old[np.newaxis, :] * back[:, np.newaxis]
    states = np.linalg.solve(z[:, np.newaxis, np.newaxis] * eye - found.A, inputs[:, :, np.newaxis])[:, :, 0]
    response = _controller(loop, back) * back**found.delay * (states @ found.c)
    phase, size = np.unwrap(np.angle(response)) / np.pi, np.abs(response)
    odd = 2.0 * np.ceil((phase[:-1] - 1.0) / 2.0) - 1.0
    falls = np.flatnonzero((phase[:-1] > odd) & (phase[1:] <= odd))
    part = (phase[falls] - odd[falls]) / (phase[falls] - phase[falls + 1])
    sizes = size[falls] + part * (size[falls + 1] - size[falls])
    omegas = omega[falls] + part * (omega[falls + 1] - omega[falls])
    if response[-1].real < 0.0:
        sizes, omegas = np.append(sizes, size[-1]), np.append(omegas, np.pi)
    if sizes.size == 0 or phase[0] > 0.0:
        return None
    return float(1.0 / sizes.max()), float(2.0 * np.pi / omegas[np.argmax(sizes)]) * loop.dt


def _controller(loop: Loop, back: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Response of the sampled controller from error to OP; `back` is 1/z."""
    p = loop.controller.pack(loop.dt)
    late = back if p[8] else 1.0
    return p[0] + p[1] * late / (1.0 - back) + p[2] * (1.0 - back) / (1.0 - p[3] * back)


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between `low` and `high`, even in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def outside_period(rng: np.random.Generator, loop: Loop) -> float:
    """A period from outside [samples]: any, or one that is some times that of the loop at its limit of stability."""
    found = gain_margin(loop) if rng.random() < 0.5 else None
    if found is None:
        return log_uniform(rng, 12.0, 1000.0)
    return float(np.clip(found[1] / loop.dt * log_uniform(rng, 0.7, 15.0), 10.0, 1000.0))


def gain_at(loop: Loop, period: float) -> float:
    """Gain of the process at a period [samples]."""
    return abs(complex(loop.process.at(2j * np.pi / (period * loop.dt))))
