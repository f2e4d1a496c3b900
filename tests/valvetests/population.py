"""Simulated tests of physical valves with known friction: what `analyse_ramp` is judged by.

Truth comes from the forces, not from the code under test: sb = 100 Fs / (A dP), sj = 100 (Fs - Fc) / (A dP) for an
overdamped stem, and r from the stability of sliding, b > (Fs - Fc)(2 v / vs^2) exp(-(v / vs)^2) (science 1.4).
Run as a script for a larger population: python tests/valvetests/population.py 20
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

import stiction as st

if TYPE_CHECKING:
    from stiction.valvetests import RampTest

SPRING, STROKE = 207e3, 0.029
RATES = (2.0, 1.3, 0.75, 0.5)
"""Multiples of r; the first two are followed."""


def _valve(sb: float, coulomb: float, viscous: float, stribeck_velocity: float, **more) -> st.PhysicalValve:
    span = SPRING * STROKE
    return st.PhysicalValve(
        mass=1.6,
        spring_rate=SPRING,
        viscous=viscous,
        coulomb=coulomb / 100 * span,
        static=sb / 100 * span,
        stribeck_velocity=stribeck_velocity,
        area=0.0445,
        stroke=STROKE,
        hold="linear",
        **more,
    )


@cache
def valves() -> dict[str, st.PhysicalValve]:
    table1 = ("3 lbm", "300 lbf/in", "3.5 lbf*s/in", "320 lbf", "384 lbf", "0.01 in/s", "100 in**2", "6 in")
    return {
        "table 1": st.PhysicalValve(*table1, hold="linear"),
        "light": _valve(3.0, 2.0, 4000.0, 4e-6),
        "heavy": _valve(12.0, 9.5, 6000.0, 1e-5, pressure_range=(4e4, 1.8e5), preload=1780.0),
        "graphite": _valve(15.28, 10.8, 8000.0, 2e-5),
        "air to close": _valve(5.0, 3.6, 5000.0, 8e-6, air_to_open=False),
    }


@dataclass(frozen=True)
class Truth:
    sb: float
    sj: float
    r: float


def truth(valve: st.PhysicalValve) -> Truth:
    per_newton = 100.0 / valve.force_span
    vs, drop = valve.stribeck_velocity, valve.static - valve.coulomb
    low, high = vs / math.sqrt(2.0), 20.0 * vs
    for _ in range(60):
        middle = 0.5 * (low + high)
        unstable = drop * 2.0 * middle / vs**2 * math.exp(-((middle / vs) ** 2)) > valve.viscous
        low, high = (middle, high) if unstable else (low, middle)
    return Truth(per_newton * valve.static, per_newton * drop, 100.0 * low / valve.stroke / valve.gain)


@cache
def clean(name: str) -> st.LoopRecord:
    valve = valves()[name]
    known = truth(valve)
    S = 2.0 * known.sb - known.sj
    low = 10.0 if known.sb > 10.0 else 30.0
    high = 90.0 if known.sb > 10.0 else low + max(3.0 * S, S + 8.0 * known.sj)
    plan = st.plan_ramp_test(low, high, rates=[factor * known.r for factor in RATES], wait=30.0)
    return st.stroke(valve, plan.op, plan.dt)


def seen_by_position(name: str, seed: int) -> st.LoopRecord:
    """Noise of 0.1 % of span, then rounded to 0.1 %."""
    record = clean(name)
    noisy = record.mv + 0.1 * np.random.default_rng(seed).standard_normal(len(record))
    return replace(record, mv=np.round(noisy / 0.1) * 0.1)


def seen_by_flow(name: str, seed: int) -> st.LoopRecord:
    """A flow in m3/h behind a first-order sensor of 2 s, with noise of 0.5 % of span."""
    record = clean(name)
    keep = math.exp(-record.dt / 2.0)
    seen = record.mv.copy()
    for k in range(1, seen.size):
        seen[k] = keep * seen[k - 1] + (1.0 - keep) * record.mv[k]
    noisy = seen + 0.5 * np.random.default_rng(seed).standard_normal(seen.size)
    return replace(record, mv=None, pv=10.0 + 2.5 * noisy)


def right_ramps(test: RampTest, known: Truth) -> tuple[int, int]:
    """(ramps called right, ramps)."""
    right = sum(ramp.behaviour == ("follow" if abs(ramp.rate) > known.r else "staircase") for ramp in test.ramps)
    return right, len(RATES) * 2


def main(seeds: int) -> None:
    for label, record in (("position", seen_by_position), ("flow", seen_by_flow)):
        right = total = inside = runs = 0
        worst_sb = worst_sj = 0.0
        for name, valve in valves().items():
            known = truth(valve)
            for seed in range(seeds):
                test = st.analyse_ramp(record(name, seed))
                worst_sb = max(worst_sb, abs(test.sb.value / known.sb - 1.0))
                worst_sj = max(worst_sj, abs(test.sj.value / known.sj - 1.0))
                inside += test.r_low < known.r <= test.r_high
                a, b = right_ramps(test, known)
                right, total, runs = right + a, total + b, runs + 1
        print(
            f"{label}: {right}/{total} ramps right, r bracketed in {inside}/{runs}, "
            f"largest error of sb {worst_sb:.1%}, of sj {worst_sj:.1%}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
