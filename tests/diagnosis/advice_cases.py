"""Loops whose advice was wrong in the field, each drawn anew from a seed: size, period, units, sampling, noise.

The simulation is written here, sample by sample, and shares no code with the package.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

import stiction as st


@dataclass
class Drawn:
    """A PI loop about a first-order process with dead time, its seed and what is wrong with it."""

    seed: int
    kind: str = "flow"
    n: int = 3000
    Kc: float = 0.25
    """Gain of the controller times that of the process [-]."""
    Ti: float = 8.0
    lag: float = 8.0
    dead: int = 3
    """Lag and dead time [samples]."""
    integrating: bool = False
    noise: float = 0.15
    """Standard deviation of the noise [% of span]."""
    load: np.ndarray | float = 0.0
    sp: np.ndarray | float = 0.0
    """Load at the inlet [% of OP] and set point [% of span], as deviations."""
    low: float = 0.0
    high: float = 100.0
    op0: float = 50.0
    rate: float = math.inf
    S: float = 0.0
    J: float = 0.0
    pulse: int = 0
    stuck_beside: np.ndarray | float = 0.0
    """What moves PV where the stem is stuck [% of span]; S is infinite then."""
    rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)
        self.gain = float(self.rng.uniform(0.7, 1.6))
        """PV over OP [% of span / %]."""
        self.span = float(self.rng.choice([10.0, 100.0, 300.0]))
        self.dt = float(self.rng.choice([0.5, 1.0, 2.0, 5.0]))

    def run(self) -> dict[str, np.ndarray]:
        """OP, PV, SP and stem, PV and SP in % of span about 50."""
        n, k_process = self.n, self.gain
        sp, load, beside = (np.zeros(n) + x for x in (self.sp, self.load, self.stuck_beside))
        noise = self.noise * np.random.default_rng([self.seed, 1]).normal(size=n)
        op, pv, stem, sent = (np.zeros(n) for _ in range(4))
        state, integral, place, last = 0.0, self.op0, self.op0, self.op0
        for k in range(n):
            pv[k] = state + beside[k] + noise[k]
            error = sp[k] - pv[k]
            wanted = integral + self.Kc / k_process * error
            out = min(max(min(max(wanted, self.low), self.high), last - self.rate), last + self.rate)
            integral += self.Kc / k_process / self.Ti * error
            if out != wanted:
                integral += 0.2 * (out - wanted)
            last = op[k] = out
            if abs(out - place) > 0.5 * (self.S + self.J):
                place = out - math.copysign(0.5 * (self.S - self.J), out - place)
            stem[k] = place if self.S > 0.0 else out
            sent[k] = stem[k] if not self.pulse else (100.0 if k % self.pulse < out / 100.0 * self.pulse else 0.0)
            arrived = (sent[k - self.dead] - self.op0 + load[k - self.dead]) if k >= self.dead else 0.0
            state += (k_process * arrived - (0.0 if self.integrating else state)) / self.lag
        return {"op": op, "pv": pv, "sp": sp, "mv": sent}

    def record(self, op: str = "op") -> st.LoopRecord:
        """The record in units of its own."""
        found = self.run()
        pv, sp = (self.span * (0.5 + x / 100.0) for x in (found["pv"], found["sp"]))
        return st.LoopRecord("LOOP-1", self.dt, op=found[op].round(3), pv=pv.round(6), sp=sp, loop_type=self.kind,
                             integrating=self.integrating)  # fmt: skip

    def sine(self, period: float, amplitude: float) -> np.ndarray:
        """A wave from outside."""
        return amplitude * np.sin(2.0 * np.pi * np.arange(self.n) / period + self.rng.uniform(0.0, 6.0))


def load_sine(seed, low=100.0, high=150.0, n=3000, **given):
    one = Drawn(seed, n=n, **given)
    one.load = one.sine(one.rng.uniform(low, high), one.rng.uniform(2.0, 6.0))
    return one.record()


def load_sine_400(seed):
    return load_sine(seed, 350.0, 450.0)


def load_sine_500(seed):
    return load_sine(seed, 450.0, 550.0, 3600, Kc=0.2)


def load_on_a_slow_loop(seed):
    one = Drawn(seed, kind="temperature", n=5000, lag=60.0, dead=8, Ti=60.0, Kc=0.8, noise=0.05)
    one.load = one.sine(one.rng.uniform(250.0, 350.0), one.rng.uniform(2.0, 5.0))
    return one.record()


def rate_limit(seed, low=0.18, high=0.3):
    """Dead time as long as the lag; after a kick the limit of the rate keeps OP swinging."""
    one = Drawn(seed, Kc=0.8, Ti=3.0, dead=8, noise=0.05)
    one.rate = float(one.rng.uniform(low, high))
    one.load = np.where(np.arange(one.n) < 200, 14.0, 0.0)
    return one.record()


def slower_rate_limit(seed):
    return rate_limit(seed, 0.12, 0.18)


def unstable(seed, low=1.07, high=1.2, op0=50.0, limits=(0.0, 100.0)):
    """A gain so many times that of the limit of stability, at which this loop simulated without limits neither grows
    nor dies out."""
    one = Drawn(seed, lag=8.0, Ti=8.0, dead=5, op0=op0, low=limits[0], high=limits[1])
    one.Kc = 2.25 * float(one.rng.uniform(low, high))
    one.load = np.where(np.arange(one.n) < 40, 4.0, 0.0)
    return one.record()


def very_unstable(seed):
    return unstable(seed, 1.8, 2.0)


def unstable_at_35(seed):
    return unstable(seed, 1.1, 1.9, op0=35.0)


def unstable_at_20(seed):
    return unstable(seed, 1.1, 1.9, op0=20.0)


def unstable_from_10_to_90(seed):
    return unstable(seed, 1.1, 1.9, limits=(10.0, 90.0))


def stuck(seed, low=150.0, high=210.0):
    one = Drawn(seed, Kc=0.3, n=3200, noise=0.1, S=math.inf)
    one.stuck_beside = one.sine(one.rng.uniform(low, high), one.rng.uniform(2.0, 4.0))
    return one.record()


def stuck_120(seed):
    return stuck(seed, 100.0, 140.0)


def stuck_600(seed):
    return stuck(seed, 500.0, 700.0)


def stuck_900(seed):
    return stuck(seed, 800.0, 1000.0)


def quiet_sticky(seed):
    """White noise in PV; OP moves less than the band, and the stem never."""
    return Drawn(seed, Kc=0.3, S=8.0, J=3.0).record()


def motor_valve(seed):
    """A motor valve with a dead band that OP never leaves."""
    return Drawn(seed, Kc=0.2, n=3600, S=2.0, noise=0.1).record()


def quiet_level(seed):
    one = Drawn(seed, kind="level", integrating=True, Kc=4.0, Ti=200.0, lag=300.0, S=6.0, J=2.0, noise=0.03)
    return one.record()


def quiet_pressure(seed):
    """Beside a flow loop, of which it sees the noise; the stem never moves."""
    return Drawn(seed, kind="pressure", n=4200, Kc=0.4, Ti=15.0, lag=15.0, S=6.0, J=2.0, noise=0.1).record()


def pair(seed):
    """Two good loops of which each valve moves the other's PV too, and a slow load on both."""
    pressure = Drawn(seed, kind="pressure", n=4200, Kc=0.4, Ti=15.0, lag=15.0, noise=0.1)
    flow = Drawn(seed + 1000, n=4200)
    load = pressure.sine(pressure.rng.uniform(800.0, 1000.0), pressure.rng.uniform(3.0, 6.0))
    for _ in range(4):  # each with what the other's OP did in the run before, which converges
        flow.load = 0.6 * load - 0.3 * (pressure.run()["op"] - 50.0)
        pressure.load = load - 0.3 * (flow.run()["op"] - 50.0)
    return pressure, flow


def pressure_of_a_pair(seed):
    return pair(seed)[0].record()


def flow_of_a_pair(seed):
    return pair(seed)[1].record()


def cascade(seed):
    """A good temperature loop with a load, whose OP is the set point of a good flow loop."""
    primary = Drawn(seed, kind="temperature", n=5400, lag=80.0, dead=6, Ti=80.0, Kc=1.2, noise=0.05)
    secondary = Drawn(seed + 1000, n=5400)
    load = primary.sine(primary.rng.uniform(250.0, 400.0), primary.rng.uniform(3.0, 6.0))
    primary.load = load
    for _ in range(5):  # the flow that the primary asked for in the run before, which converges
        asked = primary.run()["op"] - 50.0
        secondary.sp = asked
        primary.load = load + secondary.run()["pv"] - asked
    return primary, secondary


def primary_with_load(seed):
    return cascade(seed)[0].record()


def secondary_that_follows(seed):
    return cascade(seed)[1].record()


def white_noise(seed):
    one = Drawn(seed, Kc=0.2)
    return one.record()


def sine_set_point(seed):
    one = Drawn(seed)
    one.sp = one.sine(one.rng.uniform(200.0, 400.0), one.rng.uniform(3.0, 8.0))
    return one.record()


def ratio(seed):
    """The set point follows a wild flow, with its noise."""
    one = Drawn(seed, n=3600)
    wild = np.convolve(one.rng.normal(size=one.n + 60), np.hanning(60), mode="valid")[: one.n]
    one.sp = 5.0 * wild / wild.std() + 0.3 * one.rng.normal(size=one.n)
    return one.record()


def pulses(seed):
    one = Drawn(seed, kind="temperature", n=5000, lag=60.0, dead=4, Ti=60.0, Kc=0.8, noise=0.03)
    one.pulse = int(one.rng.integers(20, 50))
    one.op0 = float(one.rng.uniform(30.0, 60.0))
    return one


def time_proportioned(seed):
    return pulses(seed).record()


def pulses_logged(seed):
    return pulses(seed).record("mv")


def hunting(seed):
    one = Drawn(seed)
    one.load = one.sine(one.rng.uniform(15.0, 30.0), one.rng.uniform(1.5, 4.0))
    return one.record()


def position_as_op(seed):
    one = Drawn(seed, S=4.0, J=1.5)
    one.load = one.sine(one.rng.uniform(100.0, 250.0), one.rng.uniform(4.0, 7.0))
    return one.record("mv")


def sticky_secondary(seed):
    """The secondary of a cascade whose valve sticks."""
    one = Drawn(seed, n=5000, S=4.0, J=1.6)
    one.sp = one.sine(one.rng.uniform(150.0, 400.0), one.rng.uniform(5.0, 9.0)) + 0.1 * one.rng.normal(size=one.n)
    return one.record()
