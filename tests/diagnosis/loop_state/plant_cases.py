"""Loops in which the controller does not move the valve, with a PI controller and a first-order process.

Each case draws its own units, sizes, action, sampling, noise and rounding from a seed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import stiction as st


@dataclass
class PlantLoop:
    """One loop, written out sample by sample and apart from the package's own simulation."""

    rng: np.random.Generator
    n: int
    dt: float
    span: float
    gain: float
    Kc: float
    Ti: float
    tau: float
    noise: float
    loads: np.ndarray

    @classmethod
    def draw(cls, seed: int) -> PlantLoop:
        rng = np.random.default_rng(seed)
        n, dt = int(rng.integers(700, 2600)), float(rng.choice([1.0, 2.0, 5.0, 10.0]))
        span = float(10.0 ** rng.uniform(-0.5, 4.0))
        gain = span / 100.0 * rng.uniform(0.6, 2.0) * rng.choice([-1.0, 1.0])
        tau = dt * rng.uniform(2.0, 10.0)
        Kc, Ti = rng.uniform(0.2, 0.6) / gain, tau * rng.uniform(1.0, 2.5)
        smooth, loads = 1.0 - rng.uniform(0.01, 0.05), np.zeros(n)
        kicks = rng.normal(size=n)
        for k in range(1, n):
            loads[k] = smooth * loads[k - 1] + kicks[k]
        loads *= rng.uniform(0.005, 0.02) * span / loads.std()
        return cls(rng, n, dt, span, gain, Kc, Ti, tau, rng.uniform(0.0005, 0.003) * span, loads)

    def run(self, sp, *, op_start=50.0, stem_of=None, pv_of=None, process=None, limits=(0.0, 100.0)):
        """Simulate; `stem_of(k, op)` moves the valve, `process(k, stem)` is PV as it is, `pv_of(k, pv)` as measured."""
        sp = np.broadcast_to(np.asarray(sp, dtype=float), self.n)
        op, pv, out = np.empty(self.n), np.empty(self.n), 0.0
        integral, keep = op_start, np.exp(-self.dt / self.tau)
        level = sp[0] - 0.0
        for k in range(self.n):
            stem = op[k - 1] if k else op_start
            stem = stem if stem_of is None else stem_of(k, stem)
            out = keep * out + (1.0 - keep) * self.gain * (stem - op_start)
            true = level + out + self.loads[k] if process is None else process(k, stem)
            measured = true + self.noise * self.rng.normal()
            pv[k] = measured if pv_of is None else pv_of(k, measured)
            error = sp[k] - pv[k]
            integral = float(np.clip(integral + self.Kc * self.dt / self.Ti * error, *limits))
            op[k] = float(np.clip(integral + self.Kc * error, *limits))
        decimals = int(self.rng.integers(2, 4))
        return op.round(decimals), pv.round(max(0, 4 - int(np.log10(self.span)))), np.array(sp)

    def record(self, signals, loop_type="flow", *, with_sp=True):
        op, pv, sp = signals
        return st.LoopRecord("C1", self.dt, op=op, pv=pv, sp=sp if with_sp else None, loop_type=loop_type)


def healthy(seed):
    loop = PlantLoop.draw(seed)
    return loop, loop.run(1.5 * loop.span)


def stuck_in_service(seed):
    """The stem stops for good before the middle, and a load takes PV away from SP."""
    loop = PlantLoop.draw(seed)
    stop, stuck = int(loop.rng.uniform(0.1, 0.4) * loop.n), []
    side = loop.rng.choice([-1.0, 1.0])
    loop.loads[stop:] += side * loop.rng.uniform(0.04, 0.12) * loop.span

    def stem_of(k, op):
        if k == stop:
            stuck.append(op)
        return stuck[0] if stuck else op

    return loop, loop.run(1.5 * loop.span, stem_of=stem_of)


def stuck_from_start(seed):
    """The stem never moves, and SP is off what the loads leave."""
    loop = PlantLoop.draw(seed)
    loop.loads *= 0.3
    sp = 1.5 * loop.span + loop.rng.choice([-1.0, 1.0]) * loop.rng.uniform(0.02, 0.06) * loop.span
    stuck = loop.rng.uniform(35.0, 65.0)
    return loop, loop.run(sp, op_start=stuck, process=lambda k, _: 1.5 * loop.span + loop.loads[k])


def selected_out(seed):
    """Another controller, which cycles, holds PV about a value of its own."""
    loop = PlantLoop.draw(seed)
    period, size = loop.rng.uniform(30.0, 90.0), loop.rng.uniform(0.02, 0.1) * loop.span
    off = loop.rng.choice([-1.0, 1.0]) * loop.rng.uniform(0.3, 0.9) * size
    shape = loop.rng.choice([0.0, 0.3])

    def process(k, stem):
        phase = 2.0 * np.pi * k / period
        return 1.5 * loop.span + size * (np.sin(phase) + shape * np.sin(3.0 * phase) / 3.0) + 0.05 * loop.loads[k]

    return loop, loop.run(1.5 * loop.span + off, op_start=loop.rng.uniform(40.0, 60.0), process=process)


def frozen_transmitter(seed):
    """PV repeats one value from some moment on."""
    loop = PlantLoop.draw(seed)
    stop, value = int(loop.rng.uniform(0.1, 0.45) * loop.n), []

    def pv_of(k, pv):
        if k == stop:
            value.append(pv)
        return value[0] if value else pv

    return loop, loop.run(1.5 * loop.span, pv_of=pv_of)


def closed_block_valve(seed):
    """The flow falls to zero, with a small error of the transmitter or a cut-off at exactly zero."""
    loop = PlantLoop.draw(seed)
    stop, cut_off = int(loop.rng.uniform(0.1, 0.45) * loop.n), bool(loop.rng.integers(2))
    zero = loop.rng.uniform(-0.005, 0.005) * loop.span

    def pv_of(k, pv):
        if k < stop:
            return pv
        return 0.0 if cut_off else zero + 0.3 * loop.noise * loop.rng.normal()

    loop.gain, loop.Kc = abs(loop.gain), abs(loop.Kc)
    return loop, loop.run(1.5 * loop.span, pv_of=pv_of)


def vent(seed):
    """A vent that is shut most of the time and opens in bursts: normal service, the valve at its limit."""
    loop = PlantLoop.draw(seed)
    period, gain = loop.rng.uniform(60.0, 200.0), loop.span / 100.0
    phase = 2.0 * np.pi * np.arange(loop.n) / period
    loop.loads = loop.span * (0.12 * np.sin(phase) - loop.rng.uniform(0.06, 0.09))
    loop.gain, loop.Kc = -gain, -0.5 / gain
    return loop, loop.run(1.5 * loop.span, op_start=0.0)


def split_range_gap(seed):
    """Two good valves with a gap between them: no flow changes while OP crosses the middle."""
    loop = PlantLoop.draw(seed)
    gap = loop.rng.uniform(1.0, 4.0)
    middle = loop.rng.uniform(45.0, 55.0)

    def stem_of(k, op):
        return middle + np.sign(op - middle) * max(0.0, abs(op - middle) - gap / 2.0)

    return loop, loop.run(1.5 * loop.span, op_start=middle, stem_of=stem_of)
