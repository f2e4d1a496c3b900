"""The valve alone: steps per second of each model, beside the same model in C."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from bench import Row, Section, in_turn, median_time
from twin import twin

import stiction as st
from stiction.simulation.drivers import stroke_one

N = 1_000_000
DT = 1.0
MODELS = [
    ("Kano", st.Kano(3.0, 1.0), "kano", (3.0, 1.0)),
    ("Srinivasan", st.Srinivasan(2.0, 1.0, 0.1), "srinivasan", (2.0, 1.0, 0.1)),
    ("He", st.He(2.0, 1.0), "he", (2.0, 1.0)),
    ("Stenman", st.Stenman(2.0), "stenman", (2.0, 0.0)),
]


def valves() -> Section:
    """Random walk of a million samples through each model, outputs preallocated on both sides."""
    op = np.cumsum(np.random.default_rng(0).normal(0.0, 0.3, N))
    ours, theirs, second = np.empty(N), np.empty(N), np.empty(N)
    rows = []
    with ThreadPoolExecutor(2) as pool:
        for name, valve, twin_name, arguments in MODELS:
            code, p = valve.code, valve.pack(DT)
            in_c = getattr(twin(), f"stroke_{twin_name}")

            def kernel(out=ours, code=code, p=p):
                stroke_one(code, p, op, op[0], out)

            def c_twin(out=theirs, in_c=in_c, arguments=arguments):
                in_c(N, op, *arguments, -np.inf, np.inf, out)

            def two(task, outs):
                for done in [pool.submit(task, out) for out in outs]:
                    done.result()

            kernel()
            c_twin()
            assert np.array_equal(ours, theirs), f"{name}: kernel and C twin differ"
            speed, c_speed = (N / seconds for seconds in in_turn(kernel, c_twin))
            rows.append(Row(f"{name}, one core", speed, "steps/s", "C twin", c_speed, speed / c_speed, 0.8))
            both = 2 * N / median_time(lambda: two(kernel, (ours, second)))
            c_both = 2 * N / median_time(lambda: two(c_twin, (theirs, second)))
            rows.append(Row(f"{name}, two threads", both, "steps/s", "C twin", c_both, both / c_both))
    return Section("Valve alone", rows, ("kernel and C twin give the same bits",))
