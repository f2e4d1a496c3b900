"""Loops whose valve and process are known, and what a plant would have recorded of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import stiction as st
from stiction.diagnosis.segment import judge_segment
from stiction.records.gaps import forward_fill, interpolate_gaps, missing_mask


@dataclass(frozen=True)
class Known:
    loop: st.Loop
    integrating: bool
    gain: float
    time_constant: float
    dead_time: float
    period: float
    """Of the limit cycle [s], by counting; `test_periods_are_as_stated` counts again."""
    samples: int = 1000

    @property
    def S(self):
        return self.loop.valve.S

    @property
    def J(self):
        return self.loop.valve.J

    @property
    def swing(self):
        """PV that an OP of S moves, within a fifth or so of the limit cycle's [PV units]."""
        return abs(self.gain) * self.S * (10.0 if self.integrating else 1.0)


def _known(controller, valve, process, dt, integrating, *numbers):
    return Known(st.Loop(controller, valve, process, dt), integrating, *numbers)


KNOWN = {
    "first order": _known(
        st.PID(0.4, 5.0), st.Kano(5.0, 2.0), st.FOPDT(1.2, 8.0, 3.0), 1.0, False, 1.2, 8.0, 3.0, 105.0
    ),
    "reverse gain, every 5 s": _known(
        st.PID(-0.4, 60.0), st.Kano(2.0, 1.6), st.FOPDT(-4.0, 70.0, 22.0), 5.0, False, -4.0, 70.0, 22.0, 215.0
    ),
    "second order": _known(
        st.PID(0.8, 20.0), st.Kano(4.0, 3.0), st.SOPDT(1.5, 12.0, 8.0, 4.0), 1.0, False, 1.5, 20.0, 4.0, 82.0
    ),
    "integrating": _known(
        st.PID(4.0, 40.0), st.Kano(3.0, 1.5), st.Integrating(0.02, 4.0), 1.0, True, 0.02, 0.0, 4.0, 89.5
    ),
}


def run_of(known, noise=0.0, set_point=0.0, seed=0, samples=None):
    """The loop some periods after a load change; noise and moves of the set point as shares of `swing`.

    The noise is in the loop: the controller hands it on to the OP.
    """
    loop, n = replace(known.loop, noise=noise * known.swing), samples or known.samples
    before = n // 4
    load = np.zeros(n + before)
    load[10:] = 1.2 * known.S
    moves = np.random.default_rng(seed).uniform(-1.0, 1.0, (n + before) // 35 + 1)
    sp = 100.0 + set_point * known.swing * np.repeat(moves, 35)[: n + before]
    run = st.simulate(loop, sp, (n + before) * loop.dt, load, seed, pv_start=100.0, op_start=50.0, tag="FC1")
    return replace(run.window(before, n + before), integrating=known.integrating)


def whole_segment(record):
    """The whole record as a judged segment, with the parts that a diagnosis leaves out."""
    judged = judge_segment(record)
    missing = missing_mask(record.op, record.pv)
    sp = None if record.sp is None else forward_fill(record.sp, fill_start=True)
    part = replace(record, op=interpolate_gaps(record.op), pv=interpolate_gaps(record.pv), sp=sp)
    return replace(judged, signals=replace(judged.signals, part=part, missing=missing))
