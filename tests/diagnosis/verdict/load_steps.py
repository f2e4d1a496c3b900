"""Verdicts on loops whose load wanders, and steps once: what one step hides.

The loops are simulated without anything of stiction.simulation: second order, PI, a stem by the balance of forces, or a
good valve; each is drawn with the step and without it.

Run as a script: python tests/diagnosis/verdict/load_steps.py --loops 50 --seed 100 --jobs 2
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from unittest.mock import patch

import numpy as np
from population import each  # a page beside this script

import stiction as st
from stiction.diagnosis.identification.likelihood import NONE

SAMPLES = 4000


def drawn(seed: int, *, sticky: bool, steps: bool) -> st.LoopRecord:
    """Draw a loop whose load is noise behind a lag of 500 samples, and that steps by S to 2 S where it `steps`."""
    rng = np.random.default_rng(seed)
    S = rng.uniform(1.5, 6.0)
    J = S * rng.uniform(0.2, 0.7)
    T1 = rng.uniform(6.0, 25.0)
    T2 = T1 * rng.uniform(0.1, 0.6)
    delay, K = int(rng.integers(1, 8)), rng.uniform(0.5, 2.0)
    closed = rng.uniform(1.0, 3.0) * (delay + 0.5 * T1)
    Kc, Ti = (T1 + T2) / (K * (closed + delay)), T1 + T2
    noise, wander = rng.uniform(0.02, 0.15) * K, rng.uniform(0.02, 0.1)
    at, step = int(rng.integers(SAMPLES // 4, 3 * SAMPLES // 4)), rng.uniform(1.0, 2.0) * S
    x1 = x2 = total = load = stem = 0.0
    late, (op, pv) = [0.0] * delay, np.empty((2, SAMPLES))
    for k in range(SAMPLES):
        load += wander * rng.normal() - 0.002 * load
        pv[k] = x2 + noise * rng.normal()
        total -= Kc * pv[k] / Ti
        op[k] = total - Kc * pv[k]
        if not sticky:
            stem = op[k]
        elif abs(op[k] - stem) > 0.5 * (S + J):
            stem = op[k] - math.copysign(0.5 * (S - J), op[k] - stem)
        late.append(stem)
        x1 += (K * (late.pop(0) + load + step * (steps and k > at)) - x1) / T1
        x2 += (x1 - x2) / T2
    return st.LoopRecord(f"N{seed}", 1.0, op=op + 50.0, pv=pv + 100.0, sp=np.full(SAMPLES, 100.0))


def told(task: tuple[int, bool, bool]) -> str:
    seed, sticky, steps = task
    return st.diagnose(drawn(seed, sticky=sticky, steps=steps)).verdict


def main() -> None:
    ask = argparse.ArgumentParser(description="Diagnose loops whose load steps, and the same without the step.")
    ask.add_argument("--loops", type=int, default=50, help="sticky loops, and as many good ones")
    ask.add_argument("--seed", type=int, default=100, help="seed of the first")
    ask.add_argument("--jobs", type=int, default=1, help="processes")
    ask.add_argument("--predict-all", action="store_true", help="leave no sample out of the likelihood")
    given = ask.parse_args()
    if given.predict_all:
        patch("stiction.diagnosis.identification.closer.shocks_of", lambda *_: NONE).start()
    for sticky in (True, False):
        for steps in (True, False):
            tasks = [(given.seed + i, sticky, steps) for i in range(given.loops)]
            counts = Counter(each(told, tasks, given.jobs, len(tasks)))
            said = ", ".join(f"{verdict} {n}" for verdict, n in counts.most_common())
            print(f"{'sticky' if sticky else 'good':7}{'load steps' if steps else 'no step':11} {said}")


if __name__ == "__main__":
    main()
