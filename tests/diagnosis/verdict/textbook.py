"""Loops as a textbook has them, simulated here by plain recursions with nothing of ours, and what is told of them.

The tables of the verdict were found on `calibration.populations`. These loops are another hand's: lambda tuning, valves
by their definitions, steps of the set point, loads that wander; few shapes, and less noise.

Run as a script: python tests/diagnosis/verdict/textbook.py --loops 600 --seed 2 --jobs 2
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

import stiction as st

CAUSES = ("stiction", "stiction", "deadband", "tight tuning", "external disturbance", "none")
"""Causes as they are drawn: every third loop has a valve that sticks."""
BEFORE = 600
"""Samples before the record."""


class Textbook(NamedTuple):
    """One loop: its record, and what is true of it."""

    record: st.LoopRecord
    cause: str
    valve: str
    S: float
    J: float
    every: int
    """Samples of the controller to one of the record."""
    integrating: bool


class Stem:
    """A valve by its definition: He's, Stenman's, Kano's, Kano's without a jump for play, or a good one."""

    def __init__(self, kind: str, S: float, J: float) -> None:
        self.kind, self.stick, self.slide = kind, (S + J) / 2.0, (S - J) / 2.0
        self.x = self.before = self.way = 0.0

    def __call__(self, u: float) -> float:
        if self.kind == "good":
            return u
        if self.kind in ("He", "Stenman"):
            if abs(u - self.x) > self.stick:
                self.x = u - math.copysign(self.slide, u - self.x)
            return self.x
        if (u - self.before) * self.way <= 0.0:
            self.way = 0.0
        if self.way == 0.0 and abs(u - self.x) > self.stick:
            self.way = math.copysign(1.0, u - self.x)
        if self.way != 0.0:
            self.x = u - self.way * self.slide
        self.before = u
        return self.x


class Plant(NamedTuple):
    """Gain, two lags and dead time, in samples; `integrating` takes the place of the first lag."""

    gain: float
    lag: float
    second: float
    late: int
    integrating: bool

    def gain_margin(self, Kc: float, Ti: float) -> float:
        """By the frequency response, the hold of a sample taken as half a sample of dead time."""
        w = np.geomspace(1e-4 / self.lag, 0.99 * np.pi, 4000)
        first = 1j * w * self.lag + (0.0 if self.integrating else 1.0)
        loop = self.gain * np.exp(-1j * w * (self.late - 0.5)) / (first * (1j * w * self.second + 1.0))
        loop = loop * Kc * (1.0 + 1.0 / (1j * w * Ti))
        phase = np.unwrap(np.angle(loop))
        crossing = np.flatnonzero((phase[:-1] > -np.pi) & (phase[1:] <= -np.pi))
        return 1.0 / abs(loop[crossing[-1]]) if crossing.size else math.inf


def _drawn(rng: np.random.Generator) -> tuple[Plant, float, float]:
    """A plant and its lambda tuning, Kc and Ti [samples]."""
    lag, integrating = 10.0 ** rng.uniform(0.7, 1.8), bool(rng.random() < 0.25)
    late, second = max(1, round(lag * rng.uniform(0.05, 1.0))), lag * rng.uniform(0.0, 0.5)
    gain = 10.0 ** rng.uniform(-0.5, 0.7) * rng.choice([1.0, 1.0, -1.0])
    delay = late + second + 1.0
    closed = rng.uniform(1.0, 3.5) * max(delay, 0.0 if integrating else 0.2 * lag)
    if integrating:
        Kc, Ti = (2.0 * closed + delay) * lag / (gain * (closed + delay) ** 2), 2.0 * closed + delay
    else:
        Kc, Ti = (lag + second / 2.0) / (gain * (closed + delay)), min(lag + second / 2.0, 4.0 * (closed + delay))
    return Plant(float(gain), float(lag), float(second), late, integrating), float(Kc), float(Ti)


def _run(plant: Plant, Kc: float, Ti: float, stem: Stem, sp, wave, load, noise):
    """OP and PV of the loop about 0."""
    n = sp.size
    op, pv, mv = np.zeros((3, n))
    keep = 1.0 if plant.integrating else math.exp(-1.0 / plant.lag)
    give = plant.gain / plant.lag if plant.integrating else plant.gain * (1.0 - keep)
    slow = math.exp(-1.0 / plant.second) if plant.second > 0.05 else 0.0
    first = second = part = 0.0
    for k in range(1, n):
        first = keep * first + give * ((mv[k - plant.late] if k >= plant.late else 0.0) + load[k])
        second = slow * second + (1.0 - slow) * first
        pv[k] = second + wave[k] + noise[k]
        error = sp[k] - pv[k]
        part += Kc / Ti * error
        op[k] = Kc * error + part
        mv[k] = stem(op[k])
    return op, pv


def drawn(seed: int, i: int) -> Textbook:
    """Loop `i` of a seed; drawn again until it shows its cause and keeps OP within its range."""
    rng = np.random.default_rng([seed, i])
    cause = CAUSES[i % len(CAUSES)]
    while True:
        plant, Kc, Ti = _drawn(rng)
        margin = plant.gain_margin(Kc, Ti)
        if margin < 1.8 or (cause == "deadband" and not plant.integrating):
            continue
        if cause == "tight tuning":
            Kc *= margin * rng.uniform(0.93, 0.99)
        n = BEFORE + int(rng.integers(1000, 4000))
        S = float(rng.uniform(1.0, 8.0))
        J = S * float(rng.uniform(0.15, 1.0)) if cause == "stiction" else 0.0
        kind = str(rng.choice(["He", "Stenman", "Kano"])) if cause == "stiction" else "good"
        kind, J = ("play", 0.0) if cause == "deadband" else (kind, S if kind == "Stenman" else J)
        size = S if cause in ("stiction", "deadband") else 3.0
        sp, wave = np.zeros((2, n))
        sp[int(rng.integers(50, 200)) :] = size * abs(plant.gain)
        if cause == "external disturbance":
            wave = (
                abs(plant.gain) * rng.uniform(1.0, 5.0) * np.sin(2.0 * np.pi * np.arange(n) / rng.uniform(15.0, 120.0))
            )
        wander = float(rng.choice([0.0, 0.01, 0.03])) if cause not in ("none", "tight tuning") else 0.1
        load = np.cumsum(rng.normal(0.0, wander, n)) * (0.1 if plant.integrating else 1.0)
        noise = float(rng.choice([0.0, 0.005, 0.02, 0.05])) * size * abs(plant.gain) * rng.normal(size=n)
        with np.errstate(over="ignore", invalid="ignore"):  # one without bounds is drawn again
            op, pv = _run(plant, Kc, Ti, Stem(kind, S, J), sp, wave, load, noise)
        op, pv, sp = op[BEFORE:] + 50.0, pv[BEFORE:], sp[BEFORE:]
        inside = np.isfinite(op).all() and op.min() > 0.0 and op.max() < 100.0 and np.ptp(op) > 0.3
        if not inside or (cause in ("stiction", "deadband") and np.ptp(op[-op.size // 3 :]) < 1.05 * S):
            continue
        every = int(rng.choice([1, 1, 1, 2, 5]))
        record = st.LoopRecord(f"X{i}", float(every), op=op[::every], pv=pv[::every], sp=sp[::every])
        if len(record) > 300:
            return Textbook(record, cause, kind, S, J, every, plant.integrating)


class Told(NamedTuple):
    """What is told of one loop."""

    loop: Textbook
    found: st.Diagnosis


def _told(task: tuple[int, int]) -> Told:
    loop = drawn(*task)
    return Told(loop, st.diagnose(loop.record))


def counted(rows: list[Told]) -> dict[str, float]:
    """How sticky loops come out: share told, share of S within 10 %, share of intervals that hold it."""
    valves = [(row.found.identification, row.loop.S) for row in rows]
    return {
        "loops": len(rows),
        "told": float(np.mean([row.found.verdict == "stiction" for row in rows])),
        "S within 10 %": float(np.mean([abs(valve.S / S - 1.0) < 0.1 for valve, S in valves])),
        "interval holds S": float(np.mean([valve.S_low <= S <= valve.S_high for valve, S in valves])),
    }


def judged(rows: list[Told]) -> list[Told]:
    """The sticky loops that are not refused."""
    return [row for row in rows if row.loop.cause == "stiction" and row.found.identification is not None]


def alarms(rows: list[Told]) -> int:
    """Loops whose valve does not stick, called sticky with a probability above 0.9."""
    return sum(row.found.probability > 0.9 for row in rows if row.loop.cause != "stiction")


def table(rows: list[Told]) -> str:
    """Causes told, the sticky ones by valve and by how they were recorded, and confident errors."""
    out = []
    for cause in dict.fromkeys(CAUSES):
        own = Counter(row.found.cause for row in rows if row.loop.cause == cause)
        out.append(f"{cause:22}{own.total():4}  {', '.join(f'{name} {n}' for name, n in own.most_common())}")
    sticky = judged(rows)
    groups = {"all sticky": sticky}
    for row in sticky:
        groups.setdefault(row.loop.valve, []).append(row)
        groups.setdefault(f"every {row.loop.every}", []).append(row)
    out += [
        f"{name:12}" + ", ".join(f"{what} {value:.3g}" for what, value in counted(groups[name]).items())
        for name in sorted(groups)
    ]
    missed = sum(row.found.probability < 0.1 for row in sticky)
    return "\n".join([*out, f"sticky below 0.1: {missed}; others above 0.9: {alarms(rows)}"])


def run(loops: int, seed: int, jobs: int) -> list[Told]:
    """Diagnose so many loops of a seed."""
    with get_context("fork").Pool(jobs) as pool:
        return pool.map(_told, [(seed, i) for i in range(loops)], chunksize=4)


def main() -> None:
    ask = argparse.ArgumentParser(description="Diagnose loops as a textbook has them.")
    ask.add_argument("--loops", type=int, default=600)
    ask.add_argument("--seed", type=int, default=2)
    ask.add_argument("--jobs", type=int, default=2)
    given = ask.parse_args()
    print(table(run(given.loops, given.seed, given.jobs)))


if __name__ == "__main__":
    main()
