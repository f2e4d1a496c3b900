"""The controller from OP and error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification import fit_controller

from .loops import KNOWN, run_of


@pytest.mark.parametrize("moves", [0.0, 0.3])
@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("name", KNOWN)
def test_a_pi_is_found_exactly(name, noise, moves):
    # The controller acts on the noisy PV, so that noise does not bias the fit.
    known = KNOWN[name]
    found = fit_controller(run_of(known, noise, moves, samples=600))
    assert found.Kc == pytest.approx(known.loop.controller.Kc, rel=1e-6)
    assert found.Ti == pytest.approx(known.loop.controller.Ti, rel=1e-6)
    assert found.fit == pytest.approx(1.0, abs=1e-9)
    assert found.action == np.sign(known.gain)


@pytest.mark.parametrize("name", KNOWN)
def test_without_a_set_point_a_constant_one_is_found_too(name):
    known = KNOWN[name]
    found = fit_controller(replace(run_of(known, 0.02), sp=None))
    assert found.Kc == pytest.approx(known.loop.controller.Kc, rel=1e-6)
    assert found.Ti == pytest.approx(known.loop.controller.Ti, rel=1e-6)


def test_gaps_hardly_matter():
    run = run_of(KNOWN["first order"], 0.02)
    pv, op = run.pv.copy(), run.op.copy()
    pv[200:203], op[500:502] = np.nan, np.nan
    found = fit_controller(replace(run, pv=pv, op=op))
    assert found.Kc == pytest.approx(0.4, rel=0.1)
    assert found.Ti == pytest.approx(5.0, rel=0.1)
    assert found.action == 1.0


def test_an_op_that_nobody_controls_tells_no_action():
    rng = np.random.default_rng(5)
    record = st.LoopRecord("FC1", 1.0, op=50.0 + rng.normal(size=500), pv=rng.normal(size=500))
    found = fit_controller(record)
    assert found.fit < 0.1
    assert found.action == 0.0
