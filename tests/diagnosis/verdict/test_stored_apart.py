"""OP and PV that were not stored in step, or not at one rate, and a loop that was shut down."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification import fit_controller
from stiction.diagnosis.identification.in_step import is_late, with_pv_earlier
from stiction.records import LoopRecord, analysis_window, assess
from stiction.records.limits import shut


@cache
def run(name):
    valve = {"sticky": st.Kano(5.0, 3.0), "resting": st.He(3.5, 1.5), "good": st.Ideal()}[name]
    k = np.arange(3000)
    load = 3.0 * np.sin(2.0 * np.pi * k / 60.0) if name == "good" else np.where(k < 20, 6.0, 0.0)
    loop = st.Loop(st.PID(0.4, 8.0), valve, st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    record = st.simulate(loop, 70.0, 3000.0, load, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow")
    return replace(record, mv=None)


def late(record):
    return replace(record, pv=np.concatenate([record.pv[:1], record.pv[:-1]]))


@pytest.mark.parametrize("name", ["sticky", "resting"])
def test_a_pv_that_is_a_sample_late_hides_no_valve(name):
    right, found = st.diagnose(run(name)), st.diagnose(late(run(name)))
    assert right.probability > 0.99
    assert (found.verdict, found.probability) == ("stiction", 0.9)
    assert pytest.approx(right.identification.S, rel=0.02) == found.identification.S
    assert "PV was stored a sample late" in found.reason
    assert "sample late" not in right.reason


def test_a_good_valve_stays_good():
    found = st.diagnose(late(run("good")))
    assert found.verdict == "no_stiction"
    assert found.probability == 0.1


def test_what_is_taken_earlier_is_the_pv_alone():
    record = run("sticky")
    mended = with_pv_earlier(late(record))
    assert len(mended) == len(record) - 1
    np.testing.assert_array_equal(mended.pv, record.pv[:-1])
    np.testing.assert_array_equal(mended.op, record.op[:-1])
    assert [is_late(fit_controller(one)) for one in (record, late(record), mended)] == [False, True, False]


@pytest.mark.parametrize("name", ["op", "pv"])
@pytest.mark.parametrize("every", [2, 10])
def test_two_rates_are_seen_and_nothing_is_sure(name, every):
    record = run("resting")
    x = getattr(record, name)
    slower = replace(record, **{name: np.repeat(x[::every], every)[: x.size]})
    [gate] = [gate for gate in assess(slower).gates if gate.name == "one rate"]
    assert (gate.severity, gate.value) == ("lowers", every)
    assert gate.why.startswith(f"{name.upper()} is stored every {every} samples")
    assert 0.1 <= st.diagnose(slower).probability <= 0.9
    assert all(gate.severity == "ok" for gate in assess(record).gates if gate.name == "one rate")


def test_an_op_of_another_loop_tells_nothing_surely():
    rng = np.random.default_rng(0)
    other = 50.0 + np.cumsum(rng.normal(size=3000)) * 0.3
    found = st.diagnose(replace(run("good"), op=other, sp=None))
    assert found.controller.left > 0.3
    assert 0.1 <= found.probability <= 0.9


def test_a_shut_down_is_left_out():
    record, down = run("sticky"), np.arange(3000) >= 2500
    rng = np.random.default_rng(0)
    op = np.where(down, 0.0, record.op)
    pv = np.where(down, 2.0 + 0.1 * rng.normal(size=3000), record.pv)
    found = st.diagnose(replace(record, op=op, pv=pv))
    assert analysis_window(replace(record, op=op, pv=pv)) == (0, 2500)
    assert found.verdict == "stiction"
    assert pytest.approx(5.0, rel=0.03) == found.identification.S


def test_a_loop_that_comes_to_its_limit_again_and_again_is_not_shut_down():
    op = np.clip(50.0 + 80.0 * np.sin(2.0 * np.pi * np.arange(3000) / 300.0), 0.0, 100.0)
    assert not shut(LoopRecord("FIC-101", 1.0, op=op, pv=op + 1.0)).any()
