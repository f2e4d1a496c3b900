"""Every valve against its slow twin, and against numbers worked by hand."""

# ruff: noqa: ARG005 (the twins of a table share one form)

from __future__ import annotations

import math
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs
from tests import naive
from tests.reference.valves import JUMP_ABOVE_S, STAIRS, STEPS
from tests.strategies import VALVES, inputs

import stiction as st

TWINS = {
    "Ideal": lambda v, op, dt: naive.ideal(op),
    "Stenman": lambda v, op, dt: naive.stenman(op, v.d),
    "Kano": lambda v, op, dt: naive.kano(op, v.S, v.J),
    "Choudhury": lambda v, op, dt: naive.choudhury(op, v.S, v.J),
    "He": lambda v, op, dt: naive.he(op, v.fs, v.fd),
    "HeWang": lambda v, op, dt: naive.he_wang(op, v.fs, v.fd, v.K),
    "Srinivasan": lambda v, op, dt: naive.srinivasan(op, v.sb, v.sj, v.r, dt),
}


@pytest.mark.parametrize("name", VALVES)
@settings(max_examples=60)
@given(data=hs.data(), op=inputs(), dt=hs.sampled_from([0.25, 1.0, 4.0]))
def test_kernel_is_its_twin(name, data, op, dt):
    valve = data.draw(VALVES[name])
    assert st.stroke(valve, op, dt).mv.tolist() == TWINS[name](valve, op, dt)


@pytest.mark.parametrize("K", [1.25, 1.5, 1.99])
def test_a_rebound_is_its_twin(K):
    op = np.cumsum(np.random.default_rng(5).normal(0.0, 1.0, 500)).tolist()
    assert st.stroke(st.HeWang(2.0, 0.75, K), op, 1.0).mv.tolist() == naive.he_wang(op, 2.0, 0.75, K)


@settings(max_examples=60)
@given(valve=VALVES["Srinivasan"], op=inputs())
def test_printed_equation_is_its_twin(valve, op):
    printed = st.Srinivasan(valve.sb, valve.sj, valve.r, as_printed=True)
    assert st.stroke(printed, op, 1.0).mv.tolist() == naive.srinivasan_printed(op, valve.sb, valve.sj, valve.r, 1.0)


@pytest.mark.parametrize("row", STEPS, ids=str)
def test_step_from_0_to_10(row):
    """Check N14."""
    mv = st.stroke(row.given["valve"], [0.0] + [10.0] * 50, dt=1.0).mv
    assert mv[0] == 0.0
    assert set(mv[1:].tolist()) == {row.expected}


@pytest.mark.parametrize("row", STAIRS, ids=str)
def test_held_steps_move_the_stem_of_models_that_follow(row):
    """Check N22a: J onwards, each time the first step beyond it; S backwards from the last stop."""
    case = row.given
    valve = st.Kano(case["S"], case["J"])
    levels = np.round(np.arange(0.0, case["top"] + 1e-9, case["step"]), 10)
    op = np.repeat(np.concatenate([[0.0], levels]), 3)
    mv = st.stroke(valve, op, 1.0, mv_start=case["start"]).mv
    moved = op[np.flatnonzero(np.diff(mv)) + 1]
    np.testing.assert_allclose(moved, row.expected, rtol=row.tolerance)


def test_a_stem_pushed_up_turns_after_S_less_the_step_beyond():
    """Check N22a: from the stop at 7.7 (seven moves up) the first reverse move comes at 4.6, one step beyond S."""
    up = np.round(np.arange(0.0, 7.75, 0.1), 10)
    down = up[-2::-1]
    op = np.repeat(np.concatenate([up, down]), 3)
    mv = st.stroke(st.Kano(3.0, 1.0), op, 1.0, mv_start=-1.0).mv
    backwards = op[np.flatnonzero(np.diff(mv) < 0.0) + 1]
    assert backwards[0] == pytest.approx(4.6)


@pytest.mark.parametrize("row", JUMP_ABOVE_S, ids=str)
def test_a_jump_above_S_overshoots(row):
    mv = st.stroke(row.given["valve"], [0.0, 1.0, 2.0, 2.5], dt=1.0).mv
    assert mv.tolist() == [0.0, 0.0, 0.0, row.expected]


def test_choudhury_beyond_J_above_S_is_another_valve_than_kano():
    op = 4.5 * np.sin(np.linspace(0.0, 8.0 * math.pi, 801))
    assert np.abs(st.stroke(st.Kano(3.0, 5.0), op, 1.0).mv - st.stroke(st.Choudhury(3.0, 5.0), op, 1.0).mv).max() > 0.5


def test_a_stem_that_starts_outside_its_band_jumps_to_its_lag():
    for valve in (st.Kano(3.0, 1.0), st.Choudhury(3.0, 1.0), st.He(2.0, 1.0), st.Srinivasan(2.0, 1.0, 0.0)):
        assert st.stroke(valve, [10.0, 10.0], 1.0, mv_start=0.0).mv.tolist() == [9.0, 9.0]


def test_tables_over_travel():
    """Bands that grow along the travel: each break-away asks for the band at the stem."""
    band, jump = st.Table([0.0, 100.0], [1.0, 5.0]), st.Table([0.0, 100.0], [0.5, 2.5])
    valve = st.Srinivasan(band, jump, r=math.inf)
    op = np.arange(0.0, 100.0, 0.125)
    mv = st.stroke(valve, op, 1.0).mv
    twin = naive.srinivasan(op.tolist(), lambda x, rate: 1.0 + 0.04 * x, lambda x, rate: 0.5 + 0.02 * x, math.inf, 1.0)
    np.testing.assert_allclose(mv, twin, atol=1e-9)
    jumps = np.diff(mv)[np.diff(mv) > 0.0]
    assert jumps[-1] > 3.0 * jumps[0]


def test_tables_over_rate():
    """A band of 2 at rest and of 1 at 10 %/s: the slow ramp breaks away later."""
    band = st.Table([50.0], [[2.0, 1.0]], rate=[0.0, 10.0])
    valve = st.Srinivasan(band, 0.5, r=0.0)
    for speed in (0.25, 5.0):
        op = np.arange(0.0, 20.0, speed / 4.0)
        twin = naive.srinivasan(op.tolist(), lambda x, rate: 2.0 - min(rate, 10.0) / 10.0, 0.5, 0.0, 0.25)
        np.testing.assert_allclose(st.stroke(valve, op, 0.25).mv, twin, atol=1e-12)
    slow = st.stroke(valve, np.arange(0.0, 5.0, 0.0625), 0.25)
    assert slow.op[np.flatnonzero(slow.mv > 0.0)[0]] == pytest.approx(2.0, abs=0.0626)


def test_a_table_of_one_value_is_a_number():
    rng = np.random.default_rng(1)
    op = np.cumsum(rng.normal(0.0, 0.5, 2000))
    flat = st.Srinivasan(st.Table([0.0, 50.0], [2.0, 2.0]), st.Table([10.0], [1.0]), r=0.3)
    assert np.array_equal(st.stroke(flat, op, 1.0).mv, st.stroke(st.Srinivasan(2.0, 1.0, 0.3), op, 1.0).mv)


@pytest.mark.parametrize("name", ["Stenman", "Kano", "Choudhury", "He", "HeWang", "Srinivasan", "Ideal"])
@settings(max_examples=25)
@given(data=hs.data(), op=inputs())
def test_end_stops_limit_the_input_and_the_stem(name, data, op):
    valve = data.draw(VALVES[name])
    op = [0.0, *op]
    stopped = st.stroke(replace(valve, travel=(-5.0, 5.0)), op, 1.0).mv
    free = st.stroke(valve, np.clip(op, -5.0, 5.0), 1.0).mv
    assert np.array_equal(stopped, np.clip(free, -5.0, 5.0))


def test_out_receives_the_position_and_is_checked():
    op = np.array([0.0, 3.0, 5.0])
    out = np.empty(3)
    assert st.stroke(st.Kano(3.0, 1.0), op, 1.0, out=out).mv is out
    assert out.tolist() == [0.0, 2.0, 4.0]
    with pytest.raises(st.ParameterError, match=r"out has shape \(2,\)"):
        st.stroke(st.Kano(3.0, 1.0), op, 1.0, out=np.empty(2))


def test_the_same_numbers_without_compiling():
    """The source run as plain Python gives the bits of the compiled kernels."""
    program = (
        "import numpy as np, stiction as st\n"
        "op = np.cumsum(np.random.default_rng(3).normal(0.0, 0.7, 300))\n"
        "for valve in (st.Kano(3.0, 1.0), st.Choudhury(3.0, 1.0), st.He(2.0, 1.0), st.Srinivasan(2.0, 1.0, 0.5),\n"
        "              st.Srinivasan(2.0, 1.0, 0.5, as_printed=True), st.Stenman(1.5)):\n"
        "    print(st.stroke(valve, op, 1.0).mv.tobytes().hex())\n"
        "loop = st.Loop(st.PID(0.2, 10.0, 1.0, N=8.0), st.Kano(3.0, 1.0), st.SOPDT(3.0, 10.0, 4.0, 2.5), dt=1.0)\n"
        "print(st.simulate(loop, sp=10.0, duration=300.0).pv.tobytes().hex())\n"
    )
    texts = [
        subprocess.run(
            [sys.executable, "-c", program], env=os.environ | extra, capture_output=True, text=True, check=True
        ).stdout
        for extra in ({"NUMBA_DISABLE_JIT": "1"}, {"NUMBA_DISABLE_JIT": "0"})
    ]
    assert len(texts[0]) > 10000
    assert texts[0] == texts[1]
