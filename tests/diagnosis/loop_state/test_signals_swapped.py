"""The PID equation that tells OP from PV, in records that say nothing of the controller."""

from __future__ import annotations

import numpy as np

import stiction as st
from stiction.diagnosis.loop_state.signals_swapped import are_signals_swapped, fit_pi_equation

OP, PV = np.cumsum(np.random.default_rng(0).normal(size=(2, 800)), axis=1)


def test_a_set_point_that_follows_pv_gives_no_gain():
    with np.errstate(all="raise"):
        fit = fit_pi_equation(OP, PV, PV)
    assert fit is not None
    assert fit.gain == 0.0


def test_a_record_whose_set_point_follows_pv_can_be_diagnosed():
    found = st.diagnose(st.LoopRecord("FIC-1", 1.0, op=50.0 + OP, pv=PV, sp=PV))
    assert found.loop_state.state != "signals_swapped"


def test_a_set_point_that_follows_a_column_does_not_make_the_columns_look_swapped():
    op = 50.0 - 0.4 * (PV + np.cumsum(PV) / 20.0)
    for sp in (PV, op):
        assert are_signals_swapped(op, PV, sp) is None
        assert are_signals_swapped(PV, op, sp) is not None
