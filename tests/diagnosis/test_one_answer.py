"""One loop has one answer: `identify` is `diagnose(...).identification`, whatever stands beside the judged part."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.compensation import work_order


def recorded_loop(number: int) -> st.LoopRecord:
    """Record number `number`: a good or sticky loop, some of it in manual, shut in, at a limit, or not recorded."""
    rng = np.random.default_rng(number)
    n = int(rng.choice([400, 900, 1500, 2500, 9000], p=[0.1, 0.3, 0.3, 0.25, 0.05]))
    S = float(rng.uniform(1.0, 6.0)) if rng.random() < 0.6 else 0.0
    valve = st.Kano(S, S * float(rng.uniform(0.0, 0.9))) if S else st.Ideal()
    gain = float(rng.uniform(0.8, 3.0))
    loop = st.Loop(
        st.PID(0.6 / gain, float(rng.uniform(8.0, 30.0))), valve, st.FOPDT(gain, 10.0, 8.0), dt=1.0,
        noise=float(rng.uniform(0.01, 0.2)),
    )  # fmt: skip
    load = float(rng.uniform(0.0, 2.0)) * np.sin(np.arange(n) * 2.0 * np.pi / float(rng.uniform(60.0, 300.0)))
    run = st.simulate(loop, 50.0, float(n), load, number, pv_start=50.0, op_start=50.0, loop_type="flow")
    op, pv, mv, auto = run.op.copy(), run.pv.copy(), run.mv + 0.1 * rng.normal(size=n), None
    first = int(rng.integers(n // 2))
    part = slice(first, min(n, first + int(rng.uniform(0.05, 0.9) * n)))
    spoil = rng.choice(["nothing", "gaps", "manual", "shut in", "limit", "short gaps"])
    if spoil == "gaps":
        op[part] = pv[part] = np.nan
    elif spoil == "short gaps":
        for start in rng.integers(0, n - 5, 8):
            pv[start : start + int(rng.integers(1, 8))] = np.nan
    elif spoil == "manual":
        op[part], auto = op[part.start], np.ones(n, dtype=bool)
        auto[part] = False
    elif spoil == "shut in":
        pv[part] = 0.1 * rng.normal(size=pv[part].size)
        op[part] += np.linspace(0.0, 30.0, op[part].size)
    elif spoil == "limit":
        op[part] = 100.0
    scale = float(rng.choice([1.0, 0.01, 16.0 / 100.0]))
    return st.LoopRecord(
        f"FIC-{number}", 1.0, op=scale * op, pv=pv, sp=run.sp if rng.random() < 0.7 else None,
        mv=mv if rng.random() < 0.3 else None, auto=auto, loop_type="flow",
    )  # fmt: skip


def test_a_given_period_and_other_models_take_the_window_that_stands_for_a_long_record():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(4.0, 2.0), st.FOPDT(2.0, 10.0, 8.0), dt=1.0, noise=0.1)
    load = np.convolve(np.random.default_rng(3).normal(0.0, 2.0, 10400), np.full(40, 0.1), "same")
    record = replace(st.simulate(loop, 10.0, 10400.0, load, 3, loop_type="flow"), mv=None)
    found = st.diagnose(record, methods=False)
    part, period = found.segment.record, found.segment.period
    assert len(found.windows) == 2
    assert len(part) < len(record)
    assert st.identify(record, period=period).S == st.identify(part, period=period).S
    assert st.compare_models(record).models == st.compare_models(part).models


def check_one_answer(record: st.LoopRecord) -> str:
    """Compare the surfaces of one record; return its loop state."""
    found = st.diagnose(record)
    state = found.loop_state
    if not state.in_control:
        with pytest.raises(st.RecordError, match=f"loop state is {state.state}"):
            st.identify(record)
        return state.state
    assert found.identification is not None
    np.testing.assert_equal(st.identify(record).to_dict(), found.identification.to_dict())
    segment = found.segment
    assert found.identification.mv.size == segment.op.size == found.quality.last - found.quality.first
    if found.verdict != "no_stiction" and record.op_in_percent:
        assert f"Usual OP (controller output): {np.median(segment.op):.0f} %." in work_order(found).to_text()
    return state.state


def test_identify_is_the_identification_of_diagnose():
    states = {check_one_answer(recorded_loop(number)) for number in range(16)}
    assert {"in_control", "manual", "shut_in", "saturated"} < states


@pytest.mark.slow
def test_identify_is_the_identification_of_diagnose_for_300_records():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        states = [check_one_answer(recorded_loop(number)) for number in range(300)]
    assert states.count("in_control") > 150


def test_what_diagnose_leaves_out_identify_leaves_out():
    """Shut in for the first 1 700 of 4 000 samples while OP winds up: S = 5 and J = 2 are those of the rest."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    kick = np.where(np.arange(4000) < 40, 2.0, 0.0)
    run = st.simulate(loop, 50.0, 4000.0, kick, 1, pv_start=50.0, op_start=50.0, loop_type="flow")
    rng = np.random.default_rng(0)
    shut = np.arange(4000) < 1700
    op, pv = np.where(shut, 50.0 + 0.02 * np.arange(4000), run.op), np.where(shut, 0.1 * rng.normal(size=4000), run.pv)
    record = replace(run, op=op, pv=pv, mv=None)
    found = st.identify(record)
    assert pytest.approx(5.0, rel=0.05) == found.S
    assert pytest.approx(2.0, rel=0.1) == found.J
    assert found.S == st.diagnose(record).identification.S


@pytest.mark.parametrize("n", [3000, 6000, 12_000])
def test_a_valve_that_slips_slowly_is_found_in_noise(n):
    """S = 4.58, J = 1.83, a slip in about 400 s beside noise that is white: no oscillation of five samples."""
    loop = st.Loop(st.PID(0.05, 15.0), st.Kano(4.58, 1.83), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=1.0)
    record = replace(st.simulate(loop, 150.0, float(n), seed=1, op_start=50.0, loop_type="flow"), mv=None)
    found = st.diagnose(record)
    assert not found.oscillation.period < 10.0
    assert found.probability > 0.9


@pytest.mark.parametrize("n", [3000, 12_000])
def test_a_good_valve_beside_the_same_noise_is_good(n):
    loop = st.Loop(st.PID(0.05, 15.0), st.Ideal(), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=1.0)
    for seed in range(3):
        record = replace(st.simulate(loop, 150.0, float(n), seed=seed, op_start=50.0, loop_type="flow"), mv=None)
        assert st.diagnose(record).probability < 0.3


def test_a_position_that_never_moves_is_no_error():
    """A valve that sticks fast, without noise, and a position that only moves in the part that is not compared."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(30.0, 10.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    stuck = st.simulate(loop, 10.0, 2000.0, 2.0 * np.sin(np.arange(2000) / 20.0))
    moving = st.simulate(replace(loop, valve=st.Kano(3.0, 1.0), noise=0.05), 10.0, 2000.0, seed=1)
    early = replace(moving, mv=np.where(np.arange(2000) < 50, 51.0, 50.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for record in (stuck, early):
            st.diagnose(record)
