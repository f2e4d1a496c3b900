"""Draw loops of the kinds that advice is about from the second simulator; for validation only."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from calibration.second_simulator import historian
from calibration.second_simulator.closed_loop import SUBSTEPS, Output, run_loop
from calibration.second_simulator.controllers import ISA_PID, VELOCITY_PI, Controller
from calibration.second_simulator.disturbances import background_load, wave_load
from calibration.second_simulator.processes import draw_process, ultimate_point
from calibration.second_simulator.sample import _discrete, _record, _reversals
from calibration.second_simulator.valve import ValveParameters, measure_ramp_loop

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from calibration.second_simulator.processes import Process
    from stiction.records import LoopRecord

__all__ = ["SECOND_KINDS", "SecondKind", "sample_kind"]

GOOD = (1.5, 6.0)
"""Least and largest gain margin of a well tuned loop [-]."""
CYCLES, SAMPLES = (8.0, 50.0), (1000, 5000)
"""Periods and samples of a record [-]."""
MAX_AT_LIMIT = 0.02
"""Largest share of the samples with OP at a limit where that is not the fault [-]."""
OPERATED = 0.35
"""Share of the loops whose set point an operator changes twice [-]."""
WHOLE = Output()
"""Nothing wrong between controller and valve."""
STATIC_OF_STUCK = 1e4
"""Static friction of a stuck stem [% of span]."""


class SecondKind(NamedTuple):
    """A record and all that is true of its loop."""

    record: LoopRecord
    """The record."""
    kind: str
    """One of `SECOND_KINDS`."""
    causes: tuple[str, ...]
    """All true causes that a record can show."""
    S: float
    """Deadband plus stickband [% of span]; infinite of a stuck stem."""
    J: float
    """Slip jump [% of span]."""
    storage: str
    """`raw`, or one of `historian.MODES`."""


@dataclass
class Draft:
    """A loop as it is drawn."""

    rng: np.random.Generator
    dt: float
    process: Process
    controller: Controller
    period: float
    """Ultimate period [s]."""
    valve: ValveParameters
    causes: tuple[str, ...] = ()
    n: int = 2000
    sp: NDArray[np.float64] | float = 0.0
    load: NDArray[np.float64] | float = 0.0
    noise: float = 0.05
    output: Output = WHOLE
    logged: str = "op"
    warm: int = 300
    may_limit: bool = False

    @property
    def total(self) -> int:
        """Executions, those before the record included."""
        return self.n + self.warm

    def wave(self, low: float, high: float) -> NDArray[np.float64]:
        """An outside wave of `low` to `high` ultimate periods, the record as long as it needs."""
        period = self.period / self.dt * _log_uniform(self.rng, low, high)
        period = float(np.clip(period, 12.0, 600.0))
        self.n = int(np.clip(period * _log_uniform(self.rng, *CYCLES), *SAMPLES))
        return wave_load(self.rng, self.total, period)

    def gain_at(self, period: float) -> float:
        """Gain of the process at a period [executions]."""
        return float(abs(self.process.response(np.array([2.0 * np.pi / (period * self.dt)]))[0]))

    def run(self) -> tuple[NDArray[np.float64], ...]:
        """OP, PV and stem of the whole run."""
        zero = np.zeros(self.total)
        Ad, Bd = _discrete(self.process, self.dt / SUBSTEPS)
        delay = max(round(self.process.dead_time / self.dt * SUBSTEPS), 0)
        noise = self.noise * np.random.default_rng(self.n).normal(size=self.total)
        return run_loop(
            tuple(self.controller), tuple(self.valve), Ad, Bd, self.process.C[0].copy(), delay, self.dt,
            zero + self.sp, zero + self.load, noise, 0.0, 0.0, tuple(self.output),
        )  # fmt: skip


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _draft(rng: np.random.Generator, margin: tuple[float, float] = GOOD) -> Draft | None:
    """A loop with a good valve and a gain margin in a range."""
    dt = float(rng.choice((1.0, 1.0, 2.0, 5.0)))
    process = draw_process(rng, dt)
    form = int(rng.choice((VELOCITY_PI, ISA_PID, 2), p=(0.4, 0.3, 0.3)))
    if process.kind == "integrating":
        Ti = float(rng.uniform(4.0, 12.0)) * (process.dead_time + 0.3 * process.time_constant)
    else:
        Ti = float(rng.uniform(0.5, 1.5)) * process.time_constant
    ultimate, period = ultimate_point(process, Ti, dt)
    if not np.isfinite(ultimate):
        return None
    gain = min(ultimate / _log_uniform(rng, *margin), 25.0)
    controller = Controller(form, gain, Ti, 0.05 * Ti if form == ISA_PID else 0.0, 8.0, 1.0, 1.0)
    valve = _valve(rng, float(rng.uniform(0.02, 0.3)), 0.0, dt)
    noise = _log_uniform(rng, 0.01, 0.3)
    return Draft(rng, dt, process, controller, period, valve, noise=min(noise, 1.0 / gain))


def _valve(rng: np.random.Generator, S: float, J: float, dt: float) -> ValveParameters:
    lag = min(_log_uniform(rng, 0.1, 2.0), dt)
    stribeck = _log_uniform(rng, 0.3, 3.0)
    return ValveParameters(
        0.5 * (S + J), 0.5 * (S - J), stribeck, float(rng.uniform(20.0, 50.0)), float(rng.uniform(0.7, 2.0)), lag
    )


def _background(one: Draft, size: float) -> NDArray[np.float64] | float:
    if one.rng.random() < 0.5:
        return 0.0
    return size * one.rng.random() * background_load(one.rng, one.total, one.period / one.dt)


def _outside(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng)
    if one is None:
        return None
    size, wave = _log_uniform(rng, 0.5, 8.0), one.wave(0.8, 15.0)
    one.causes, one.load = ("external",), size * wave + _background(one, 0.2 * size)
    return one


def _switching(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng)
    if one is None:
        return None
    one.n = int(_log_uniform(rng, *SAMPLES))
    hold = one.period / one.dt * _log_uniform(rng, 1.0, 10.0)
    series = np.cumsum(rng.random(one.total) < 1.0 / hold) % 3 - 1.0
    one.causes, one.load = ("external",), _log_uniform(rng, 0.5, 6.0) * series
    return one


def _set_point_series(one: Draft) -> NDArray[np.float64]:
    rng = one.rng
    if rng.random() < 0.5:
        series = one.wave(2.0, 15.0)
    else:
        one.n = int(_log_uniform(rng, *SAMPLES))
        series = background_load(rng, one.total, one.period / one.dt * float(rng.uniform(1.0, 5.0)))
    return series * _log_uniform(rng, 0.8, 8.0) * one.gain_at(3.0 * one.period / one.dt)


def _set_point(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng)
    if one is None:
        return None
    one.causes, one.sp = ("set_point",), _set_point_series(one)
    one.load = _background(one, 0.3)
    return one


def _near_limit(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng, (1.04, 1.25))
    if one is None:
        return None
    one.n = int(_log_uniform(rng, *SAMPLES))
    size = _log_uniform(rng, 0.1, 2.0)
    one.causes, one.load = ("tuning",), size * background_load(rng, one.total, one.period / one.dt * 0.3)
    return one


def _between_limits(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng, (0.5, 0.96))
    if one is None or one.controller.gain >= 25.0:
        return None
    low, high = (0.0, 100.0) if rng.random() < 0.5 else (float(rng.uniform(0.0, 30.0)), float(rng.uniform(60.0, 100.0)))
    one.n = int(_log_uniform(rng, *SAMPLES))
    one.output = Output(low, high, begin=low + (high - low) * float(rng.uniform(0.1, 0.9)))
    one.warm, one.may_limit, one.causes = int(20.0 * one.period / one.dt), True, ("tuning",)
    one.load = np.where(np.arange(one.total) < one.period / one.dt, 2.0, 0.0)
    op = one.run()[0][one.warm :]
    share = float(np.mean((op <= low + 0.01) | (op >= high - 0.01)))
    return one if 0.01 < share < 0.9 and np.ptp(op[-op.size // 2 :]) > 2.0 else None


def _rate_limit(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng, (1.2, 3.0))
    if one is None:
        return None
    one.n, one.causes = int(_log_uniform(rng, *SAMPLES)), ("rate_limit",)
    rate = _log_uniform(rng, 0.02, 1.5)
    one.output = Output(rate=rate)
    one.load = _log_uniform(rng, 3.0, 20.0) * np.where(np.arange(one.total) < 150, 1.0, 0.0)
    op = one.run()[0]
    late = op[-op.size // 3 :]
    fast = np.abs(np.diff(late)) > 0.999 * rate
    turns = np.count_nonzero(np.diff(np.sign(late - late.mean())))
    return one if fast.mean() > 0.4 and np.ptp(late) > max(10.0 * rate, 1.0) and turns >= 4 else None


def _stuck(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng)
    if one is None:
        return None
    one.valve = one.valve._replace(static=STATIC_OF_STUCK)
    wave = one.wave(1.0, 15.0) if rng.random() < 0.7 else background_load(rng, one.total, one.period / one.dt)
    one.load = wave - wave.mean()
    swing = float(np.ptp(one.run()[0][one.warm :]))
    one.load = one.load * _log_uniform(rng, 1.0, 20.0) / max(swing, 1e-9)
    return one


def _unmoved(rng: np.random.Generator, jump: float) -> Draft | None:
    one = _draft(rng)
    if one is None:
        return None
    one.n = int(_log_uniform(rng, *SAMPLES))
    one.noise = _log_uniform(rng, 0.03, 1.0) / one.controller.gain / 3.0
    one.valve = one.valve._replace(static=STATIC_OF_STUCK)
    op = one.run()[0]
    S = float(np.ptp(op)) * _log_uniform(rng, 1.3, 6.0)
    if not 0.5 < S < 15.0:
        return None
    one.valve, one.logged = _valve(rng, S, jump * S, one.dt), "unmoved"
    return one


def _quiet(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng)
    if one is not None:
        one.n = int(_log_uniform(rng, *SAMPLES))
        one.noise = _log_uniform(rng, 0.03, 1.0) / one.controller.gain / 3.0
    return one


def _random_load(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng)
    if one is not None:
        one.n = int(_log_uniform(rng, *SAMPLES))
        size = _log_uniform(rng, 0.3, 4.0)
        one.load = size * background_load(rng, one.total, one.period / one.dt * _log_uniform(rng, 0.3, 5.0))
    return one


def _sticky(rng: np.random.Generator, other: str, least_jump: float = 0.2) -> Draft | None:
    """A sticky valve alone, with an outside wave, or with a moving set point; `other` empty, external or set_point."""
    one = _draft(rng)
    if one is None:
        return None
    S = _log_uniform(rng, 1.0, 12.0)
    J = S * float(rng.uniform(least_jump, 0.95)) if least_jump else 0.0
    one.valve, one.causes = _valve(rng, S, J, one.dt), ("valve",)
    if other == "external":
        wave = one.wave(0.8, 15.0)
        one.load, one.causes = S * _log_uniform(rng, 0.4, 2.5) * wave, ("valve", "external")
    elif other == "set_point":
        series = _set_point_series(one)
        good = replace(one, valve=one.valve._replace(static=0.1, coulomb=0.1), sp=series)
        swing = float(np.ptp(good.run()[0][one.warm :]))
        one.sp, one.causes = series * S * _log_uniform(rng, 1.2, 4.0) / max(swing, 1e-9), ("valve", "set_point")
    else:
        one.n = int(_log_uniform(rng, *SAMPLES))
        one.load = np.where(np.arange(one.total) < 50, 0.7 * S, 0.0) + _background(one, 0.5 * S)
    stem = one.run()[2][one.warm :]
    return one if _reversals(stem) >= 6 else None


def _pulsed(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng)
    if one is None:
        return None
    one.n = int(_log_uniform(rng, *SAMPLES))
    one.output = Output(pulse=int(_log_uniform(rng, 10.0, 60.0)), begin=float(rng.uniform(20.0, 80.0)))
    op = one.run()[0][one.warm :]
    return one if np.ptp(op) < 60.0 else None


def _hunting(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng)
    if one is None:
        return None
    one.n = int(_log_uniform(rng, *SAMPLES))
    wave = wave_load(rng, one.total, _log_uniform(rng, 6.0, 80.0))
    one.causes, one.load = ("external",), _log_uniform(rng, 0.3, 4.0) * wave
    return one


def _dead_zone(rng: np.random.Generator) -> Draft | None:
    one = _draft(rng, (2.0, 7.0))
    if one is None:
        return None
    half = _log_uniform(rng, 0.5, 6.0)
    one.output, one.causes = Output(zone=half), ("dead_zone", "external")  # the load is a wave
    one.n = int(_log_uniform(rng, *SAMPLES))
    crossings = _log_uniform(rng, 6.0, 60.0)
    size = half * float(rng.uniform(1.2, 4.0))
    one.load = size * np.sin(np.pi * crossings * np.arange(one.total) / one.n)
    return one


def _coarse(rng: np.random.Generator) -> Draft | None:
    one = _random_load(rng)
    if one is not None:
        one.causes, one.logged = ("sensor",), str(rng.choice(("spikes", "coarse")))
    return one


SECOND_KINDS: dict[str, Callable[[np.random.Generator], Draft | None]] = {
    "outside sine": _outside,
    "outside switching": _switching,
    "set point": _set_point,
    "near limit": _near_limit,
    "between limits": _between_limits,
    "rate limit": _rate_limit,
    "stuck": _stuck,
    "unmoved": lambda rng: _unmoved(rng, float(rng.uniform(0.2, 0.95))),
    "sticky": lambda rng: _sticky(rng, ""),
    "sticky and load": lambda rng: _sticky(rng, "external"),
    "sticky and set point": lambda rng: _sticky(rng, "set_point"),
    "play unmoved": lambda rng: _unmoved(rng, 0.0),
    "quiet": _quiet,
    "random load": _random_load,
    "pulsed": _pulsed,
    "hunting": _hunting,
    "play": lambda rng: _sticky(rng, "", 0.0),
    "dead zone": _dead_zone,
    "sensor": _coarse,
}
"""Kind -> how it is drawn."""


def sample_kind(kind: str, seed: int) -> SecondKind:
    """Draw loops of a kind, one of `SECOND_KINDS`, from a seed until one shows it.

    Examples
    --------
    >>> sample_kind("set point", 3).causes
    ('set_point',)
    """
    number = list(SECOND_KINDS).index(kind)
    attempt = 0
    while True:
        rng = np.random.default_rng([56, seed, number, attempt])
        attempt += 1
        one = SECOND_KINDS[kind](rng)
        found = None if one is None else _recorded(rng, one, kind, seed)
        if found is not None:
            return found


def _recorded(rng: np.random.Generator, one: Draft, kind: str, seed: int) -> SecondKind | None:
    """The loop as it is stored; None where it runs away, rests, or comes to a limit that is not its fault."""
    if "set_point" not in one.causes and one.logged != "unmoved" and rng.random() < OPERATED:
        swing = float(np.ptp(one.run()[1][one.warm :]))
        places = rng.integers(one.warm, one.total, 2)
        one.sp = sum(float(rng.uniform(-0.5, 0.5)) * swing * (np.arange(one.total) >= place) for place in places)
    op, pv, stem = (x[one.warm :] for x in one.run())
    sp = (np.zeros(one.total) + one.sp)[one.warm :]
    limited = float(np.mean((op <= 0.01) | (op >= 99.99)))
    if not np.abs(pv).max() < 200.0 or not np.ptp(op) > 0.02 or (limited > MAX_AT_LIMIT and not one.may_limit):
        return None
    ramp = measure_ramp_loop(one.valve) if one.valve.static < STATIC_OF_STUCK else None
    S, J = (np.inf, 1.0) if ramp is None else (ramp.S, ramp.J)
    if one.logged == "unmoved" and np.ptp(stem) > 0.05:
        return None
    if one.logged == "spikes":
        pv = historian.add_spikes(rng, pv, 5.0 * float(pv.std()))
    if one.logged == "coarse":
        pv = historian.quantise(pv, float(rng.uniform(0.2, 0.5)) * float(np.ptp(pv)))
    mode = str(rng.choice(("quantised", "exception"))) if rng.random() < 0.2 and not one.may_limit else "raw"
    if mode == "quantised":
        op, pv = (historian.quantise(x, float(rng.choice((0.01, 0.05)))) for x in (op, pv))
    elif mode == "exception":
        op, pv = (historian.store_by_exception(x, 0.03 * float(x.std()), 60) for x in (op, pv))
    record = _record(rng, {"op": op, "pv": pv, "sp": sp}, seed, one.process, one.dt)
    return SecondKind(replace(record, tag=f"{kind}-{seed}"), kind, one.causes, S, J, mode)
