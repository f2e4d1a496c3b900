"""Loops of the kinds that advice is about, each with all its true causes.

In `population` the question is whether the valve sticks. Here it is what makes the loop swing: one or several of the
causes of `stiction.diagnosis.verdict`, or nothing that the record can show. All ranges were written down before a loop
was counted.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calibration.populations.causes import SCENARIOS, sample_any_loop
from calibration.populations.draw import record_scenario
from calibration.populations.faulty_loop import Faults
from calibration.populations.kind_plan import KindCase, Plan, record_plan
from calibration.populations.loads import drifting_wave, lagged_noise, lagged_steps, steps, wave
from calibration.populations.processes import gain_margin, log_uniform, scale_gain
from calibration.populations.split_range import draw_split_range
from calibration.populations.valves import sticky_valve
from stiction.models import Kano
from stiction.records.quality.quantisation import robust_range

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from stiction.models import Loop

__all__ = ["KINDS", "draw_kind", "kind_population"]

KIND = 13
"""Follows the seed and number of a loop, so that none is drawn like one of another population."""
CYCLES, SAMPLES = (4.0, 60.0), (900, 6000)
"""Periods and samples of a record [-]."""


def kind_population(n: int, seed: int = 0, kinds: tuple[str, ...] = ()) -> Iterator[KindCase]:
    """Draw `n` loops, their kinds taken in turn.

    Parameters
    ----------
    n : int
        Number of loops.
    seed : int
        Seed of everything that is random; each loop has its own.
    kinds : tuple of str
        Kinds to draw, out of `KINDS`; all by default.

    Yields
    ------
    KindCase
        One loop after the other.

    Examples
    --------
    >>> [case.causes for case in kind_population(2, seed=1, kinds=("outside sine", "stuck"))]
    [('external',), ()]
    """
    kinds = kinds or tuple(KINDS)
    for i in range(n):
        yield draw_kind(np.random.default_rng([seed, i, KIND]), kinds[i % len(kinds)], f"kind-{i:04d}")


def draw_kind(rng: np.random.Generator, kind: str, tag: str) -> KindCase:
    """Draw loops of a kind until one shows it."""
    while True:
        drawn = KINDS[kind](rng)
        if drawn is None:
            continue
        case = record_plan(rng, drawn, tag) if isinstance(drawn, Plan) else drawn
        if case is not None:
            return replace(case, kind=kind, record=replace(case.record, tag=tag, mv=None))


def _length(rng: np.random.Generator, period: float) -> int:
    """Samples of a record of an oscillation of `period` samples."""
    return int(np.clip(period * log_uniform(rng, *CYCLES), *SAMPLES))


def _outside_period(rng: np.random.Generator, loop: Loop) -> float:
    """A period from outside [samples]: any, or one that is some times that of the loop at its limit of stability."""
    found = gain_margin(loop) if rng.random() < 0.5 else None
    if found is None:
        return log_uniform(rng, 12.0, 1000.0)
    return float(np.clip(found[1] / loop.dt * log_uniform(rng, 0.7, 15.0), 10.0, 1000.0))


def _random_series(rng: np.random.Generator, n: int, lag: float) -> NDArray[np.float64]:
    """A load without a period, standard deviation 1: lagged noise, a wandering level, or steps behind a lag."""
    kind = rng.random()
    if kind < 0.5:
        return lagged_noise(rng, n, lag)
    series = lagged_noise(rng, n, 10.0 * lag) if kind < 0.75 else lagged_steps(rng, n, 20.0 * lag, lag)
    return (series - series.mean()) / max(float(series.std()), 1e-9)


def _background(rng: np.random.Generator, n: int, size: float) -> NDArray[np.float64] | float:
    """A random load beside the main cause, in one of two."""
    if rng.random() < 0.5:
        return 0.0
    return size * float(rng.random()) * _random_series(rng, n, log_uniform(rng, 2.0, 100.0))


def _gain_at(loop: Loop, period: float) -> float:
    """Gain of the process at a period [samples]."""
    return abs(complex(loop.process.at(2j * np.pi / (period * loop.dt))))


def _sine(rng: np.random.Generator, n: int, period: float) -> NDArray[np.float64]:
    shape = str(rng.choice(["sine", "triangle", "sawtooth", "square", "upstream"], p=[0.5, 0.1, 0.1, 0.1, 0.2]))
    return drifting_wave(rng, shape, n, period)


def _outside_sine(rng: np.random.Generator) -> Plan:
    loop = sample_any_loop(rng)
    period = _outside_period(rng, loop)
    n, size = _length(rng, period), log_uniform(rng, 0.5, 8.0)
    return Plan(loop, ("external",), n, load=size * _sine(rng, n, period) + _background(rng, n, 0.2 * size))


def _outside_switching(rng: np.random.Generator) -> Plan:
    loop = sample_any_loop(rng)
    hold = 0.5 * _outside_period(rng, loop)
    n, size = _length(rng, 2.0 * hold), log_uniform(rng, 0.5, 6.0)
    kind = rng.random()
    if kind < 0.4:
        series = wave(rng, "square", n, 2.0 * hold, jitter=float(rng.uniform(0.0, 0.03)))
    elif kind < 0.55:
        series = np.asarray(np.cumsum(rng.random(n) < 1.0 / hold) % 3 - 1.0, dtype=np.float64)
    elif kind < 0.7:
        series = np.where(np.cumsum(rng.random(n) < 1.0 / hold) % 2, 1.0, -1.0)
    else:
        series = steps(rng, n, hold)
    return Plan(loop, ("external",), n, load=size * series + _background(rng, n, 0.2 * size))


def _moving_set_point(rng: np.random.Generator, n: int, loop: Loop) -> NDArray[np.float64]:
    """A set point that cycles, wanders, steps, or follows a wild flow or a master, asking OP for some per cent."""
    period = log_uniform(rng, 20.0, 500.0)
    kind = rng.random()
    if kind < 0.4:
        series = _sine(rng, n, period)
    elif kind < 0.6:
        series = lagged_noise(rng, n, log_uniform(rng, 10.0, 100.0))
    elif kind < 0.8:
        series, period = steps(rng, n, log_uniform(rng, 50.0, 400.0)), 200.0
    else:
        series = _sine(rng, n, period) + 0.5 * lagged_noise(rng, n, log_uniform(rng, 3.0, 50.0))
    if rng.random() < 0.4:
        series = series + float(rng.uniform(0.02, 0.15)) * rng.normal(size=n)  # a master passes its own noise
    return series * log_uniform(rng, 0.8, 8.0) * max(_gain_at(loop, max(period, 60.0)), 1e-6)


def _set_point(rng: np.random.Generator) -> Plan:
    loop = sample_any_loop(rng)
    n = _length(rng, log_uniform(rng, 20.0, 300.0))
    return Plan(loop, ("set_point",), n, sp=_moving_set_point(rng, n, loop), load=_background(rng, n, 0.3))


def _tight_loop(rng: np.random.Generator, low: float, high: float) -> tuple[Loop, float] | None:
    """A loop with its gain so many times the limit of stability, and its period there [samples]."""
    loop = sample_any_loop(rng)
    found = gain_margin(loop)
    if found is None or not 6.0 <= found[1] / loop.dt <= 300.0:
        return None
    return scale_gain(loop, found[0] * log_uniform(rng, low, high)), found[1] / loop.dt


def _near_limit(rng: np.random.Generator) -> Plan | None:
    drawn = _tight_loop(rng, 0.8, 0.96)
    if drawn is None:
        return None
    loop, period = drawn
    n = _length(rng, period)
    load = log_uniform(rng, 0.1, 2.0) * lagged_noise(rng, n, log_uniform(rng, 0.5, 30.0))
    if rng.random() < 0.3:
        load = load * 0.2 + log_uniform(rng, 0.3, 3.0) * steps(rng, n, 8.0 * period)
    return Plan(loop, ("tuning",), n, load=load)


def _between_limits(rng: np.random.Generator) -> Plan | None:
    drawn = _tight_loop(rng, 1.04, 2.0)
    if drawn is None:
        return None
    loop, period = drawn
    span = (0.0, 100.0) if rng.random() < 0.5 else (float(rng.uniform(0.0, 30.0)), float(rng.uniform(60.0, 100.0)))
    controller = replace(loop.controller, op_limits=span, anti_windup=bool(rng.random() < 0.8))
    start = span[0] + (span[1] - span[0]) * float(rng.uniform(0.1, 0.9))
    burn = 0 if rng.random() < 0.3 else int(20 * period)
    n = _length(rng, period) + burn
    load = _background(rng, n, 1.0) + np.where(np.arange(n) < period, 2.0, 0.0)
    plan = Plan(
        replace(loop, controller=controller), ("tuning",), n, load=load, op_start=start, burn=burn, at_limit=True
    )
    op = plan.run()[1]
    late = op[op.size // 2 :]
    reached = (late <= span[0] + 0.01) | (late >= span[1] - 0.01)
    return plan if 0.01 < reached.mean() < 0.9 and np.ptp(late) > 2.0 else None


def _rate_limit(rng: np.random.Generator) -> Plan | None:
    loop = sample_any_loop(rng)
    n, kick = int(log_uniform(rng, *SAMPLES)), log_uniform(rng, 3.0, 20.0)
    rate = log_uniform(rng, 0.02, 1.5)
    burn = 300
    load = _background(rng, n + burn, 1.0) + kick * np.where(np.arange(n + burn) < 150, 1.0, 0.0)
    loop = scale_gain(loop, log_uniform(rng, 0.8, 1.6))
    plan = Plan(loop, ("rate_limit",), n + burn, Faults(rate=rate), load=load, burn=burn)
    op = plan.run()[1]
    late = op[-op.size // 3 :]
    fast = np.abs(np.diff(late)) > 0.999 * rate
    turns = np.count_nonzero(np.diff(np.sign(late - late.mean())))
    shows = fast.mean() > 0.4 and np.ptp(late) > 10.0 * rate and turns >= 4 and np.ptp(late) > 1.0
    return plan if shows else None


def _outside(rng: np.random.Generator, n: int, period: float) -> NDArray[np.float64]:
    """What moves a PV from outside: a wave, steps, or something that wanders; standard deviation about 1."""
    kind = rng.random()
    if kind < 0.6:
        return _sine(rng, n, period)
    return steps(rng, n, period) if kind < 0.8 else lagged_noise(rng, n, log_uniform(rng, 5.0, 100.0))


def _stuck(rng: np.random.Generator) -> Plan | None:
    loop = sample_any_loop(rng)
    period = _outside_period(rng, loop)
    n = _length(rng, period)
    series = _outside(rng, n, period)
    unit = _gain_at(loop, period)
    plan = Plan(loop, (), n, Faults(np.inf, 1.0), pv_load=unit * (series - series.mean()))
    swing = robust_range(plan.run()[1])
    size = log_uniform(rng, 0.5, 15.0) / max(swing, 1e-9)
    return replace(plan, pv_load=size * plan.pv_load, noise=log_uniform(rng, 0.02, 0.2) * size * unit)


def _quiet(rng: np.random.Generator, S: float, J: float) -> Plan:
    """A loop that hardly more than noise moves; J as a share of S."""
    loop = sample_any_loop(rng)
    n = int(log_uniform(rng, *SAMPLES))
    controller = loop.controller
    amplified = abs(controller.Kc) * (1.0 + (controller.N if controller.Td else 0.0))
    asked = log_uniform(rng, 0.03, 1.0)
    wander = 0.0 if rng.random() < 0.5 else asked * float(rng.uniform(0.0, 1.0)) * lagged_noise(rng, n, 30.0)
    faults, plan = Faults(S, J), Plan(loop, (), n, noise=asked / amplified)
    if S > 0.0:
        return replace(plan, faults=faults, pv_load=0.3 * _gain_at(loop, 60.0) * wander, logged="unmoved")
    return replace(plan, load=0.3 * wander)


def _unmoved(rng: np.random.Generator) -> Plan:
    return _quiet(rng, np.inf, float(rng.uniform(0.1, 1.0)))


def _play_unmoved(rng: np.random.Generator) -> Plan:
    return _quiet(rng, np.inf, 0.0)


def _quiet_good(rng: np.random.Generator) -> Plan:
    return _quiet(rng, 0.0, 0.0)


def _scenario(cause: str, causes: tuple[str, ...]) -> Callable[[np.random.Generator], KindCase | None]:
    """A loop of `population`."""

    def draw(rng: np.random.Generator) -> KindCase | None:
        plan = SCENARIOS[cause](rng)
        case = None if plan is None else record_scenario(plan, cause, rng, 0.2, "")
        if case is None:
            return None
        more = ("external",) if "and sine" in case.kind or "moved by a load" in case.kind else ()
        sp = case.record.sp
        if cause != "sensor" and sp is not None and float(np.ptp(sp)) > 0.5 * float(case.record.pv.std()):
            more = (*more, "set_point")
        S, J = (case.S, case.J) if case.S > 0.0 else (0.0, 0.0)
        return KindCase(case.record, cause, causes + more, S, J)

    return draw


def _sticky_loop(rng: np.random.Generator) -> tuple[Loop, Faults]:
    S = log_uniform(rng, 1.0, 10.0)
    return sample_any_loop(rng), Faults(S, S * float(rng.uniform(0.1, 1.0)))


def _turns_often(plan: Plan, least: int = 6) -> bool:
    """Whether the stem turns so often that its stiction can show."""
    moves = np.diff(plan.run()[2])
    direction = np.sign(moves[np.abs(moves) > 1e-9])
    return int(np.count_nonzero(np.diff(direction))) >= least


def _sticky_and_load(rng: np.random.Generator) -> Plan | None:
    loop, faults = _sticky_loop(rng)
    period = _outside_period(rng, loop)
    n = _length(rng, period)
    series = _outside_wave(rng, n, period)
    plan = Plan(loop, ("valve", "external"), n, faults, load=faults.S * log_uniform(rng, 0.4, 2.5) * series)
    return plan if _turns_often(plan) else None


def _outside_wave(rng: np.random.Generator, n: int, period: float) -> NDArray[np.float64]:
    return wave(rng, "square", n, period) if rng.random() < 0.2 else _sine(rng, n, period)


def _sticky_and_set_point(rng: np.random.Generator) -> Plan | None:
    loop, faults = _sticky_loop(rng)
    n = _length(rng, log_uniform(rng, 20.0, 300.0))
    sp = _moving_set_point(rng, n, loop)
    swing = robust_range(Plan(loop, (), n, sp=sp).run()[1])
    plan = Plan(
        loop, ("valve", "set_point"), n, faults, sp=sp * faults.S * log_uniform(rng, 1.0, 4.0) / max(swing, 1e-9)
    )
    return plan if _turns_often(plan) else None


def _tight_and(rng: np.random.Generator) -> Plan | None:
    """A gain near the limit of stability, and a sticky valve, an outside sine or a moving set point."""
    plan = _near_limit(rng)
    if plan is None:
        return None
    other = rng.random()
    if other < 0.4:
        period = _outside_period(rng, plan.loop)
        load = robust_range(plan.run()[1]) * log_uniform(rng, 0.2, 1.0) * _sine(rng, plan.n, period)
        return replace(plan, causes=("tuning", "external"), load=plan.load + load)
    if other < 0.6:
        sp = _moving_set_point(rng, plan.n, plan.loop)
        return replace(plan, causes=("tuning", "set_point"), sp=sp)
    S = log_uniform(rng, 1.0, 8.0)
    plan = replace(plan, causes=("tuning", "valve"), faults=Faults(S, S * float(rng.uniform(0.1, 1.0))))
    return plan if _turns_often(plan) else None


def _set_point_and_load(rng: np.random.Generator) -> Plan:
    plan = _set_point(rng)
    period = _outside_period(rng, plan.loop)
    load = robust_range(plan.run()[1]) * log_uniform(rng, 0.3, 1.0) * _sine(rng, plan.n, period)
    return replace(plan, causes=("set_point", "external"), load=plan.load + load)


def _random_load(rng: np.random.Generator) -> Plan | KindCase | None:
    """A loop that a load without a period moves."""
    if rng.random() < 0.5:
        return _scenario("none", ())(rng)
    loop = sample_any_loop(rng)
    n, found = int(log_uniform(rng, *SAMPLES)), gain_margin(loop)
    lag = log_uniform(rng, 2.0, 100.0) if found is None else found[1] / loop.dt * log_uniform(rng, 0.3, 5.0)
    return Plan(loop, (), n, load=log_uniform(rng, 0.3, 4.0) * _random_series(rng, n, max(lag, 1.0)))


def _pulsed(rng: np.random.Generator, logged: str) -> Plan | None:
    """A time-proportioned output; its cycle shows in the PV."""
    loop, pulse = sample_any_loop(rng), int(log_uniform(rng, 10.0, 60.0))
    n = int(log_uniform(rng, *SAMPLES))
    plan = Plan(
        loop, (), n, Faults(pulse=pulse), load=_background(rng, n, 2.0), op_start=float(rng.uniform(20.0, 80.0)),
        logged=logged, at_limit=logged == "pulses",
    )  # fmt: skip
    return plan if np.ptp(plan.run()[1]) < 60.0 else None


def _hunting(rng: np.random.Generator) -> Plan:
    """A positioner that makes the stem swing by itself: as a load at the process inlet."""
    loop, period = sample_any_loop(rng), log_uniform(rng, 6.0, 80.0)
    n = _length(rng, period)
    load = log_uniform(rng, 0.3, 4.0) * _sine(rng, n, period)
    return Plan(loop, ("external",), n, load=load + _background(rng, n, 0.3))


def _position_as_op(rng: np.random.Generator) -> Plan | None:
    plan = _sticky_and_load(rng)
    return None if plan is None else replace(plan, causes=(), logged="stem")


def _slow_slips(rng: np.random.Generator) -> KindCase | None:
    """A sticky valve that slips seldom in a record with much noise."""
    valve, S, J = sticky_valve(rng, 1.0, "Kano")
    assert isinstance(valve, Kano)
    loop = sample_any_loop(rng)
    n = int(log_uniform(rng, 2000.0, 12000.0))
    plan = Plan(loop, ("valve",), n, Faults(S, J), load=np.where(np.arange(n) < 50, 0.7 * S, 0.0))
    pv, op, stem = plan.run()
    if np.ptp(op[-n // 2 :]) < 0.7 * S or not _turns_often(plan, 8):
        return None
    turns = np.count_nonzero(np.diff(np.sign(np.diff(stem)[np.diff(stem) != 0.0])))
    if n / max(turns, 1) < 100.0:
        return None
    level = min(log_uniform(rng, 0.05, 0.3) * robust_range(pv), 0.15 * robust_range(op) / abs(loop.controller.Kc))
    return record_plan(rng, replace(plan, noise=level), "")


KINDS: dict[str, Callable[[np.random.Generator], Plan | KindCase | None]] = {
    "outside sine": _outside_sine,
    "outside switching": _outside_switching,
    "set point": _set_point,
    "near limit": _near_limit,
    "between limits": _between_limits,
    "rate limit": _rate_limit,
    "stuck": _stuck,
    "unmoved": _unmoved,
    "sticky": _scenario("stiction", ("valve",)),
    "sticky and load": _sticky_and_load,
    "sticky and set point": _sticky_and_set_point,
    "tight and another": _tight_and,
    "set point and load": _set_point_and_load,
    "play unmoved": _play_unmoved,
    "quiet": _quiet_good,
    "pulsed": lambda rng: _pulsed(rng, "op"),
    "pulses logged": lambda rng: _pulsed(rng, "pulses"),
    "hunting": _hunting,
    "position as OP": _position_as_op,
    "slow slips": _slow_slips,
    "play": _scenario("deadband", ("valve",)),
    "sensor": _scenario("sensor", ("sensor",)),
    "random load": _random_load,
    "dead zone": lambda rng: KindCase(draw_split_range(rng, "").record, "", ("dead_zone", "external")),
}
"""Kind -> how it is drawn."""
