"""Loops whose valve goes in stairs, drawn by seed; their set point moves, which tells S from the dead time.

``python tests/diagnosis/identification/staircases.py MODEL LOOPS [pv|mv]`` counts how often intervals hold the truth.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

import stiction as st


def drawn(seed, model, samples=1000):
    """Valve, record without stem, the stem, and the period [s] of a loop; every third process integrates."""
    rng = np.random.default_rng(seed)
    integrating = seed % 3 == 2
    S, ratio = rng.uniform(2.0, 5.0), rng.uniform(0.2, 0.9)
    if integrating:
        process, controller, swing = st.Integrating(0.02, 4.0), st.PID(4.0, 40.0), 0.2 * S
    else:
        process, controller = st.FOPDT(2.0, rng.uniform(6.0, 15.0), rng.uniform(2.0, 8.0)), st.PID(0.25, 9.0)
        swing = 2.0 * S
    rate = float(rng.choice([0.0, rng.uniform(0.01, 0.05) * S]))
    valve = st.Stenman(S) if model == "stenman" else st.Srinivasan(0.5 * S * (1.0 + ratio), S * ratio, rate)
    n = samples + 400
    load = np.zeros(n)
    load[10:] = 1.2 * S
    sp = 10.0 + 0.3 * swing * np.repeat(rng.uniform(-1.0, 1.0, n // 35 + 1), 35)[:n]
    loop = st.Loop(controller, valve, process, dt=1.0, noise=0.02 * swing)
    run = st.simulate(loop, sp, float(n), load, seed=seed, op_start=50.0, pv_start=10.0).window(400, n)
    assert run.mv is not None
    return valve, replace(run, mv=None, integrating=integrating), run.mv, period_of(run.op)


def period_of(op):
    """Strongest period [samples] of those that fit ten times or more."""
    x = op - op.mean()
    power = np.abs(np.fft.rfft(x * np.hanning(x.size), 16384))
    power[: 10 * 16384 // op.size] = 0.0
    return 16384.0 / int(np.argmax(power))


def main(model, loops, signal="pv"):
    """Print coverage and the median error, as a share of S (of itself for r in %/s)."""
    held, apart = {}, {}
    for seed in range(int(loops)):
        valve, record, mv, period = drawn(seed, model, 2000)
        found = st.identify(replace(record, mv=mv if signal == "mv" else None), model, period=period)
        for name, value in found.parameters.items():
            truth = getattr(valve, name)
            low, high = found.parameter_intervals[name]
            held.setdefault(name, []).append(low - 1e-9 <= truth <= high + 1e-9)
            apart.setdefault(name, []).append(abs(value - truth) / (1.0 if name == "r" else found.S))
    for name, hits in held.items():
        print(f"{name}: interval holds {np.mean(hits):.3f}, median error {np.median(apart[name]):.4f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
