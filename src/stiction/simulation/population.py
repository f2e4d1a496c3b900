"""Seeded populations of simulated loops whose truth is known: sticky ones, and ones that move for other reasons."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError
from stiction.models import FOPDT, PID, SOPDT, Ideal, Integrating, Kano, Loop
from stiction.simulation.closed_loop import simulate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stiction.models import TransferFunction, Valve
    from stiction.records.record import LoopRecord

__all__ = ["CAUSES", "Case", "population"]

CAUSES = ("stiction", "deadband", "tight tuning", "external disturbance", "sensor", "none")
"""What can be wrong with a loop of the population."""


@dataclass(frozen=True)
class Case:
    """A simulated record and what is true of its loop."""

    record: LoopRecord
    """What the plant would have recorded; the stem position is left out."""
    cause: str
    """One of `CAUSES`."""
    loop: Loop
    """The loop that made it."""
    cycles: float
    """Oscillation periods in the record [-]; NaN where the loop does not oscillate."""

    @property
    def sticky(self) -> bool:
        """Whether the valve sticks."""
        return self.cause == "stiction"


def population(n: int, causes: tuple[str, ...] = CAUSES, seed: int = 0, *, noise: float = 0.1) -> Iterator[Case]:
    """Draw `n` loops, their causes taken in turn.

    Parameters
    ----------
    n : int
        Number of loops.
    causes : tuple of str
        Causes to draw, out of `CAUSES`.
    seed : int
        Seed of everything that is random.
    noise : float
        Largest standard deviation of the measurement noise, as a share of the PV's swing [-].

    Yields
    ------
    Case
        One loop after the other.

    Raises
    ------
    ParameterError
        When a cause is unknown.

    Notes
    -----
    Processes are first order, second order or integrating with dead time; controllers PI, tuned by the SIMC
    rule and detuned by a factor of 0.5 to 2; records hold 8 to 40 periods of 15 to 150 samples.

    Examples
    --------
    >>> from stiction.simulation.population import population
    >>> [case.cause for case in population(2, ("stiction", "none"), seed=1)]
    ['stiction', 'none']
    """
    unknown = [cause for cause in causes if cause not in CAUSES]
    if unknown:
        raise ParameterError(f"cause {unknown[0]!r} is unknown; use {', '.join(CAUSES)}.")
    rng = np.random.default_rng(seed)
    for i in range(n):
        yield _case(causes[i % len(causes)], rng, noise, f"loop-{i:04d}")


def _case(cause: str, rng: np.random.Generator, noise: float, tag: str) -> Case:
    """Draw until a loop shows the behaviour asked for."""
    while True:
        case = _draw(cause, rng, noise, tag)
        if case is not None:
            return case


def _process(rng: np.random.Generator, kind: str) -> tuple[TransferFunction, PID, float]:
    """A process, its PI controller and its time scale [s], sampled at 1 s."""
    gain = float(np.exp(rng.uniform(np.log(0.2), np.log(5.0))))
    dead_time = float(rng.uniform(1.0, 12.0))
    if kind == "integrating":
        rate = gain / float(rng.uniform(20.0, 100.0))
        process = Integrating(rate, dead_time)
        closed = dead_time * float(rng.uniform(1.0, 3.0))
        return process, PID(1.0 / (rate * (closed + dead_time)), 4.0 * (closed + dead_time)), dead_time
    tau = float(np.exp(rng.uniform(np.log(2.0), np.log(40.0))))
    detune = float(np.exp(rng.uniform(np.log(0.5), np.log(2.0))))
    closed = max(dead_time, 0.3 * tau) * detune
    Ti = min(tau, 4.0 * (closed + dead_time))
    controller = PID(tau / (gain * (closed + dead_time)), Ti)
    if kind == "second order":
        second = tau * float(rng.uniform(0.1, 0.8))
        Ti = min(tau + second / 2.0, 4.0 * (closed + dead_time + second / 2.0))
        controller = PID((tau + second / 2.0) / (gain * (closed + dead_time + second / 2.0)), Ti)
        return SOPDT(gain, tau, second, dead_time), controller, tau
    return FOPDT(gain, tau, dead_time), controller, tau


def _draw(cause: str, rng: np.random.Generator, noise: float, tag: str) -> Case | None:
    kind = str(rng.choice(["first order", "second order", "integrating"]))
    process, controller, _ = _process(rng, kind)
    valve: Valve = Ideal()
    if cause == "stiction":
        S = float(rng.uniform(1.0, 10.0))
        valve = Kano(S, S * float(rng.uniform(0.2, 1.0)))
    elif cause == "deadband":
        process, controller, _ = _process(rng, "integrating")
        kind = "integrating"
        valve = Kano(float(rng.uniform(1.0, 10.0)), 0.0)
    elif cause == "tight tuning":
        found = _marginal(process, controller, rng)
        if found is None:
            return None
        controller = found
    if cause == "sensor":
        valve = Ideal()
    loop = Loop(replace(controller, op_limits=(0.0, 100.0)), valve, process, dt=1.0)
    period, swing = _settled(loop, rng) if valve.code or cause == "tight tuning" else (np.nan, np.nan)
    if (valve.code or cause == "tight tuning") and not (12.0 <= period <= 200.0 and swing > 1e-3):
        return None
    if not np.isfinite(period):
        period = float(rng.uniform(15.0, 150.0))
    n = int(min(max(period * rng.uniform(9.0, 30.0), 300.0), 6000.0))
    t = np.arange(n)
    disturbance = np.zeros(n)
    if cause == "external disturbance":
        phase = 2.0 * np.pi * t / period + rng.uniform(0.0, 6.0)
        shape = rng.choice(["sine", "triangle", "square"], p=[0.5, 0.25, 0.25])
        wave = {"sine": np.sin(phase), "triangle": 2.0 / np.pi * np.arcsin(np.sin(phase)), "square": _lag(np.sign(np.sin(phase)), 0.08 * period)}[str(shape)]  # fmt: skip  # noqa: E501
        disturbance = wave * float(rng.uniform(1.0, 5.0))
    elif cause == "sensor" or cause == "none":
        disturbance = _lag(rng.normal(0.0, 1.0, n), period / 4.0) * float(rng.uniform(2.0, 6.0))
    own = bool(valve.code) or cause == "tight tuning"
    if not own:
        record = simulate(loop, 50.0, n * loop.dt, disturbance, pv_start=50.0, op_start=50.0)
        assert record.pv is not None
        swing = float(np.percentile(record.pv, 99.0) - np.percentile(record.pv, 1.0))
    level = swing * noise * float(rng.uniform(0.0, 1.0))
    seed = int(rng.integers(2**31))
    if own:
        burn = int(rng.choice([0, 1])) * int(6 * period)
        kick = np.zeros(n + burn)
        kick[: max(int(period / 3.0), 5)] = 0.7 * (valve.S if isinstance(valve, Kano) else 3.0)
        loop = replace(loop, noise=level)
        record = simulate(loop, 50.0, (n + burn) * loop.dt, kick, seed, pv_start=50.0, op_start=50.0).window(
            burn, n + burn
        )
    else:
        loop = replace(loop, noise=level)
        record = simulate(loop, 50.0, n * loop.dt, disturbance, seed, pv_start=50.0, op_start=50.0)
    assert record.pv is not None
    pv = record.pv
    if cause == "sensor":
        step = swing * float(rng.uniform(0.15, 0.5))
        pv = np.round(pv / step) * step
    record = replace(record, tag=tag, pv=pv, mv=None, loop_type="level" if kind == "integrating" else "flow")
    return Case(record, cause, loop, n / period)


def _settled(loop: Loop, rng: np.random.Generator) -> tuple[float, float]:
    """Period [s] and PV swing of the limit cycle that a load pulse starts; NaN where there is none."""
    n = 6000
    kick = np.zeros(n)
    kick[: int(rng.integers(10, 60))] = 0.7 * (loop.valve.S if isinstance(loop.valve, Kano) else 3.0)
    record = simulate(loop, 50.0, float(n), kick, pv_start=50.0, op_start=50.0)
    assert record.pv is not None
    op, pv = record.op[n // 2 :], record.pv[n // 2 :]
    centred = op - op.mean()
    rises = np.flatnonzero((centred[:-1] < 0.0) & (centred[1:] >= 0.0))
    if rises.size < 4 or op.max() >= 99.0 or op.min() <= 1.0 or np.ptp(op) < 1e-3:
        return np.nan, np.nan
    return float(np.diff(rises).mean()), float(np.ptp(pv))


def _marginal(process: TransferFunction, controller: PID, rng: np.random.Generator) -> PID | None:
    """Raise the gain to just below the stability limit, so that a disturbance rings for the whole record."""
    omega = np.geomspace(1e-3, 3.0, 4000)
    num, den = controller.transfer_function()
    s = np.asarray(1j * omega, dtype=np.complex128)
    response = np.polyval(num, s) / np.polyval(den, s) * process.at(s)
    response = response * np.exp(-s * 0.5)
    phase = np.unwrap(np.angle(response))
    crossing = np.flatnonzero((phase[:-1] > -np.pi) & (phase[1:] <= -np.pi))
    if crossing.size == 0:
        return None
    margin = 1.0 / abs(response[crossing[0]])
    return replace(controller, Kc=controller.Kc * margin * float(rng.uniform(0.97, 0.995)))


def _lag(x: np.ndarray, samples: float) -> np.ndarray:
    """First-order lag over `samples` samples, by its recursion."""
    keep = float(np.exp(-1.0 / max(samples, 1e-9)))
    out = np.empty_like(x)
    y = x[0]
    for k in range(x.size):
        y = keep * y + (1.0 - keep) * x[k]
        out[k] = y
    return out
