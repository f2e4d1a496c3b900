"""A seeded population of loops: is every stable cycle that 50 random starts find in the list, to 1e-6 in period?

    python tests/limitcycle/population.py [loops] [starts]

First and second order, dead time, integrating; Stenman, Kano, He, Srinivasan. The misses are named.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import stiction as st
from stiction.limitcycle.exact.event_simulation import SETTLED
from stiction.limitcycle.exact.packed_loop import pack_loop
from stiction.limitcycle.exact.search import exact_limit_cycles
from stiction.limitcycle.linear import linear_part
from stiction.limitcycle.predict import is_stable_without_friction

SEED = 2008


def random_loop(rng):
    """A loop that is stable without friction."""
    while True:
        tau = 10.0 ** rng.uniform(0.3, 1.3)
        dead_time = rng.choice([0.0, rng.uniform(0.1, 1.0) * tau])
        kind = rng.choice(["first", "second", "integrating"])
        gain = 10.0 ** rng.uniform(-0.3, 0.5)
        if kind == "first":
            process = st.FOPDT(gain, tau, dead_time)
            controller = st.PID(rng.uniform(0.1, 0.9) / gain, tau * rng.uniform(0.4, 2.0))
        elif kind == "second":
            process = st.SOPDT(gain, tau, tau * rng.uniform(0.1, 0.9), dead_time)
            controller = st.PID(rng.uniform(0.2, 2.0) / gain, tau * rng.uniform(0.4, 2.0), tau * rng.choice([0, 0.1]))
        else:
            process = st.Integrating(gain / tau, dead_time)
            controller = st.PID(rng.uniform(0.2, 0.8) / gain, tau * rng.uniform(2.0, 6.0))
        band = 10.0 ** rng.uniform(-1.0, 0.7)
        share = rng.uniform(0.1, 0.9)
        valve = rng.choice([
            st.Stenman(band), st.Kano(band, band * rng.uniform(0.05, 1.2)), st.He(band, band * share),
            st.Srinivasan(band, band * share, band / tau * 10.0 ** rng.uniform(-2.0, 0.0)),
        ])  # fmt: skip
        loop = st.Loop(controller, valve, process, dt=tau / 100.0)
        try:
            if is_stable_without_friction(linear_part(loop)):
                return loop
        except st.ParameterError:
            continue


def found_by_simulation(loop, rng, starts):
    """(period, OP amplitude, top level, whether the stem followed) of each settled start, and the lattices used."""
    m = pack_loop(loop)
    valve, linear = m.valve, m.linear
    lattices = [valve.jump / 2.0, 0.0, float(rng.uniform(0.1, 0.4) * valve.jump)] if valve.jump else [0.0]
    ends = []
    for k in range(starts):
        offset = lattices[k % len(lattices)]
        level = offset + valve.jump * rng.integers(-4, 5) if valve.rate else valve.sb * rng.uniform(-4.0, 4.0)
        z = rng.normal(size=linear.order) * np.abs(linear.states_at(1.0 / float(loop.process.den[0] or 1.0))) * valve.sb
        op = level + valve.sb * rng.uniform(-0.9, 0.9)
        z[-1] += (op - linear.C @ z) / linear.C[-1]
        run, _ = m.run(z, level, most_turns=800, tolerance=1e-10, most_steps=300_000)
        if run.status != SETTLED:
            continue
        swing = run.swing[-run.turns :]
        period = float(run.time[-1] - run.time[-1 - run.turns]) / run.turns
        ends.append((period, (swing[:, 0].max() - swing[:, 1].min()) / 2.0, run.level[-run.turns :].max() + linear.rest,
                     bool(swing[:, 4].any())))  # fmt: skip
    return ends


def check(loop, rng, starts):
    """Number of settled starts and the ends that are missing from the list."""
    ends = found_by_simulation(loop, rng, starts)
    listed = list(exact_limit_cycles(loop))
    missing = []
    for period, amplitude, top, follows in ends:
        if not _listed(listed, period, amplitude):
            if not follows and pack_loop(loop).has_lattice:
                listed += exact_limit_cycles(loop, families=[top])
            if not _listed(listed, period, amplitude):
                missing.append((period, amplitude, top, follows))
    return len(ends), len(listed), missing


def _listed(cycles, period, amplitude):
    return any(
        abs(c.period / c.turns / period - 1.0) < 1e-6 and abs(c.amplitude / amplitude - 1.0) < 1e-5 for c in cycles
    )


def main(loops=200, starts=50, say=print):
    rng = np.random.default_rng(SEED)
    begin, complete, cycling = time.perf_counter(), 0, 0
    for k in range(loops):
        loop = random_loop(rng)
        ends, listed, missing = check(loop, rng, starts)
        complete += not missing
        cycling += ends > 0
        if missing:
            say(f"miss {k}: {loop.valve}, {loop.controller}, {loop.process.num} / {loop.process.den}, "
                f"{loop.process.dead_time:.3g} s; {listed} listed, missing {sorted(set(missing))[:3]}")  # fmt: skip
    say(f"{loops} loops, {cycling} with a cycle, {complete} complete ({100.0 * complete / loops:.1f} %), "
        f"{time.perf_counter() - begin:.0f} s")  # fmt: skip
    return complete / loops


if __name__ == "__main__":
    main(*(int(a) for a in sys.argv[1:]))
