"""Identification of stiction and process: milliseconds per loop."""

from __future__ import annotations

from bench import Row, Section, median_time

import stiction as st
from stiction.diagnosis.identification.grid import explore
from stiction.diagnosis.identification.piece import N_J, N_S
from stiction.diagnosis.identification.processes import dense_processes
from stiction.diagnosis.identification.signals import prepare

PERIOD = 162.0


def identification() -> Section:
    """A noisy stiction loop of 1 000 and of 2 000 samples: the dense search alone, and all of `st.identify`."""
    import numpy as np

    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    rows, found = [], ""
    for n in (1_000, 2_000):
        record = st.simulate(loop, 10.0, float(n), seed=1)
        signals = prepare(record, PERIOD)
        swing = float(np.ptp(signals.op))
        S, ratio = swing * np.arange(1, N_S + 1) / N_S, np.linspace(0.0, 1.0, N_J)
        processes = dense_processes(signals.scale, signals.op.size, record.integrating)
        dense = median_time(lambda g=(signals, S, ratio, processes): explore(*g, 1.0), repeats=5)
        whole = median_time(lambda record=record: st.identify(record, period=PERIOD), repeats=5)
        rows.append(Row(f"{n} samples, dense search", dense * 1e3, "ms"))
        rows.append(Row(f"{n} samples, st.identify", whole * 1e3, "ms"))
        found = st.identify(record, period=PERIOD)
    note = f"true S 3 %, J 1 %; found from {n} samples S {found.S:.2f} %, J {found.J:.2f} %"
    return Section("Identification of one loop", rows, (note,))
