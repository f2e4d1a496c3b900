"""Limit cycles: all of the paper's loop, crossings beside python-control on the same grid, a basin map."""

from __future__ import annotations

import control
import numpy as np
from bench import Row, Section, median_time

import stiction as st
from stiction.limitcycle import as_control_nonlinearity, basin_map, predict_limit_cycles
from stiction.limitcycle.linear import linear_part
from stiction.limitcycle.nyquist_crossings import find_crossings, refine_crossing

LOOP = st.Loop(st.PID.parallel(0.5, 1.0, 0.1), st.Stenman(0.5), st.TransferFunction([1.0], [5.0, 6.0, 1.0]), dt=0.01)
AMPLITUDES, FREQUENCIES = np.linspace(0.26, 0.74, 200), np.geomspace(0.05, 2.0, 2000)


def limitcycle() -> Section:
    """Warm times; python-control crosses the same 200 amplitudes with the same 2 000 frequencies."""
    every = median_time(lambda: predict_limit_cycles(LOOP))
    linear, valve = linear_part(LOOP), as_control_nonlinearity(LOOP.valve)
    system = control.tf([0.1, 0.5, 1.0], [5.0, 6.0, 1.0, 0.0])

    def ours():
        n = st.describing_function(LOOP.valve, AMPLITUDES)
        guesses = find_crossings([(AMPLITUDES, n)], FREQUENCIES, linear.at(1j * FREQUENCIES))
        return [
            refine_crossing(lambda a, _w: complex(st.describing_function(LOOP.valve, a)), linear, a, w, 0.26, 0.74)
            for _, a, w in guesses
        ]

    def theirs():
        return control.describing_function_response(system, valve, AMPLITUDES, FREQUENCIES).intersections

    (mine,), (other,) = ours(), theirs()
    assert mine is not None
    assert abs(mine[0] - other[0]) < 1e-4, "crossings differ"
    assert abs(mine[1] - other[1]) < 1e-4, "crossings differ"
    fast, slow = median_time(ours), median_time(theirs, repeats=3)
    grid = np.linspace(-2.0, 2.0, 100)
    starts = {"op_start": grid[:, None], "pv_start": 0.5 * grid[None, :], "mv_start": 0.25}
    basin = median_time(lambda: basin_map(LOOP, **starts), repeats=3)
    rows = [
        Row("all cycles of the paper's loop, with stability", 1e3 * every, "ms", "wanted", 100.0, 0.1 / every, 1.0),
        Row("200 x 2 000 crossings, polished", 1e3 * fast, "ms", "python-control", 1e3 * slow, slow / fast, 20.0),
        Row("basin map of 10 000 starts, two threads", basin, "s", "wanted", 10.0, 10.0 / basin, 1.0),
    ]
    return Section("Limit cycles", rows, ("both find the same crossing to 1e-4 first",))
