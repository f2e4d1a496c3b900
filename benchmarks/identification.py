"""Identification of stiction and process: milliseconds per loop."""

from __future__ import annotations

from bench import Row, Section, median_time

import stiction as st
from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.identify import identify_valve, search_record
from stiction.diagnosis.segment import judge_segment

PERIOD_S = 162.0
"""Period of the loop [s]; it is sampled every second."""


def identification() -> Section:
    """A noisy stiction loop of 1 000 and 2 000 samples: search of the valve alone, and with process and intervals."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    rows, notes = [], []
    for n in (1_000, 2_000):
        record = st.simulate(loop, 10.0, float(n), seed=1)
        op, pv, segment = record.op, record.pv, judge_segment(record, period=PERIOD_S)
        controller = fit_controller(segment)
        assert pv is not None
        search = median_time(lambda op=op, pv=pv: search_record(op, pv, PERIOD_S), repeats=5)
        whole = median_time(lambda segment=segment, c=controller: identify_valve(segment, c), repeats=5)
        rows.append(Row(f"{n} samples, search of the valve", search * 1e3, "ms"))
        rows.append(Row(f"{n} samples, with process and intervals", whole * 1e3, "ms"))
        found = identify_valve(segment, controller)
        notes.append(f"true S 3 %, J 1 %; found from {n} samples S {found.S:.2f} %, J {found.J:.2f} %")
    return Section("Identification of one loop", rows, tuple(notes))
