"""The cycle that the loop found makes by itself, against that of the loop that made the record."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification import fit_controller, identify
from stiction.diagnosis.identified import ProcessFit
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.verdict.own_cycle import own_cycle, process_of

LEVEL = st.PID(1.2, 60.0)


@pytest.mark.parametrize(
    ("process", "controller", "kind"),
    [
        (st.Integrating(0.02, 3.0, 12.0), LEVEL, "level"),
        (st.Integrating(0.02, 12.0), LEVEL, "level"),
        (st.FOPDT(1.5, 20.0, 6.0), st.PID(0.4, 12.0), "flow"),
    ],
)
def test_the_loop_found_cycles_as_the_one_recorded(process, controller, kind):
    load = np.where(np.arange(4000) < 40, 6.0, 0.0)
    loop = st.Loop(controller, st.Kano(4.0, 2.0), process, dt=1.0, noise=0.005)
    record = st.simulate(loop, 50.0, 4000.0, load, seed=1, pv_start=50.0, op_start=50.0, tag="C1", loop_type=kind)
    period = find_oscillation(record).period
    found = own_cycle(identify(record, period=period), fit_controller(record), period, record.dt)
    assert found is not None
    assert found.period == pytest.approx(period, rel=0.1)
    assert found.amplitude_op == pytest.approx(0.5 * float(np.ptp(record.op[2000:])), rel=0.25)


@pytest.mark.parametrize(
    ("told", "true"),
    [
        (ProcessFit(0.02, 12.0, 3.0, integrating=True), st.Integrating(0.02, 3.0, 12.0)),
        (ProcessFit(0.02, 0.0, 3.0, integrating=True), st.Integrating(0.02, 3.0)),
        (ProcessFit(2.0, 30.0, 3.0, integrating=False, lag=10.0), st.SOPDT(2.0, 20.0, 10.0, 3.0)),
        (ProcessFit(2.0, 30.0, 3.0, integrating=False), st.FOPDT(2.0, 30.0, 3.0)),
    ],
)
def test_the_process_told_is_the_one_found(told, true):
    at = 1j * np.geomspace(0.001, 1.0, 20)
    np.testing.assert_allclose(process_of(told).at(at), true.at(at), rtol=1e-12)
