"""The loop around the models: operating point, hand, limits, loads, noise, and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest

import stiction as st

pytestmark = pytest.mark.quick


def loop(valve=None, controller=None, noise=0.0, process=None, dt=1.0):
    return st.Loop(
        st.PID(0.4, 10.0) if controller is None else controller,
        st.Ideal() if valve is None else valve,
        st.FOPDT(2.0, 8.0, 3.0) if process is None else process,
        dt,
        noise=noise,
    )


def test_a_loop_at_its_operating_point_stays_there():
    record = st.simulate(loop(st.Kano(3.0, 1.0)), 70.0, 200.0, pv_start=70.0, op_start=45.0)
    assert set(record.pv.tolist()) == {70.0}
    assert record.op == pytest.approx(45.0, abs=1e-12)
    assert set(record.mv.tolist()) == {45.0}


def test_operating_point_only_shifts_a_loop():
    sp = np.where(np.arange(300) < 150, 4.0, 1.0)
    here = st.simulate(loop(st.Kano(3.0, 1.0)), sp, 300.0)
    there = st.simulate(loop(st.Kano(3.0, 1.0)), sp + 64.0, 300.0, pv_start=64.0, op_start=32.0)
    np.testing.assert_allclose(there.pv - 64.0, here.pv, atol=1e-9)
    np.testing.assert_allclose(there.op - 32.0, here.op, atol=1e-9)


def test_a_stem_off_its_output_moves_only_beyond_its_band():
    near = st.simulate(loop(st.Kano(3.0, 1.0)), 70.0, 5.0, pv_start=70.0, op_start=45.0, mv_start=46.5)
    far = st.simulate(loop(st.Kano(3.0, 1.0)), 70.0, 5.0, pv_start=70.0, op_start=45.0, mv_start=48.0)
    assert near.mv[0] == 46.5
    assert far.mv[0] == pytest.approx(46.0)


def test_set_point_and_load_are_met_with_integral_action():
    sp = np.where(np.arange(600) < 300, 5.0, -2.0)
    load = np.where(np.arange(600) < 150, 0.0, 3.0)
    record = st.simulate(loop(), sp, 600.0, disturbance=load)
    assert record.pv[149] == pytest.approx(5.0, abs=0.02)
    assert record.pv[299] == pytest.approx(5.0, abs=0.02)
    assert record.pv[-1] == pytest.approx(-2.0, abs=0.001)
    assert record.op[299] == pytest.approx(5.0 / 2.0 - 3.0, abs=0.02)
    assert np.ptp(record.pv[150:200]) > 1.0


def test_a_load_moves_the_pv_after_the_dead_time():
    record = st.simulate(loop(), 0.0, 60.0, disturbance=np.where(np.arange(60) < 20, 0.0, 1.0))
    assert np.flatnonzero(record.pv)[0] == 20 + 3 + 1


def test_a_disturbance_of_the_pv_is_seen_at_once():
    record = st.simulate(loop(), 0.0, 60.0, pv_disturbance=np.where(np.arange(60) < 20, 0.0, 1.0))
    assert np.flatnonzero(record.pv)[0] == 20


def test_hand_and_back_is_bumpless():
    hand = np.full(400, np.nan)
    hand[150:250] = 7.0
    record = st.simulate(loop(), 5.0, 400.0, manual=hand)
    assert record.auto.tolist() == [True] * 150 + [False] * 100 + [True] * 150
    assert set(record.op[150:250].tolist()) == {7.0}
    assert record.pv[249] == pytest.approx(14.0, abs=0.1)
    error = 5.0 - record.pv[250]
    assert record.op[250] - 7.0 == pytest.approx(0.4 * (1.0 / 10.0) * error + 0.4 * (record.pv[249] - record.pv[250]))
    assert record.pv[-1] == pytest.approx(5.0, abs=0.05)


def test_the_hand_strokes_a_valve():
    ramp = st.simulate(loop(st.Kano(3.0, 1.0)), 0.0, 40.0, manual=np.arange(40) * 0.25)
    alone = st.stroke(st.Kano(3.0, 1.0), np.concatenate([[0.0], np.arange(40) * 0.25]), 1.0)
    assert np.array_equal(ramp.mv, alone.mv[1:])


def test_limits_of_the_output_and_recovery():
    def settle(anti_windup):
        controller = st.PID(0.4, 10.0, op_limits=(-5.0, 5.0), anti_windup=anti_windup)
        sp = np.where(np.arange(600) < 300, 20.0, 5.0)
        record = st.simulate(loop(controller=controller), sp, 600.0)
        assert record.op.max() == 5.0
        assert record.pv[299] == pytest.approx(10.0, abs=1e-6)
        away = np.flatnonzero(np.abs(record.pv[300:] - 5.0) > 0.2)
        return away[-1]

    assert settle(anti_windup=True) < 60 < 100 < settle(anti_windup=False)


def test_noise_is_seeded_and_white():
    noisy = loop(noise=0.5, controller=st.PID(1e-9, math.inf))
    one, two, other = (st.simulate(noisy, 0.0, 20_000.0, seed=seed).pv for seed in (1, 1, 2))
    assert np.array_equal(one, two)
    assert not np.array_equal(one, other)
    assert np.std(one) == pytest.approx(0.5, rel=0.02)
    assert abs(np.corrcoef(one[1:], one[:-1])[0, 1]) < 0.02
    assert not np.array_equal(st.simulate(noisy, 0.0, 50.0).pv, st.simulate(noisy, 0.0, 50.0).pv)


def test_tables_and_plain_valves_run_through_the_same_loop():
    """A table of one value takes the general way, a number the quick one: not a bit differs."""
    quick = st.Srinivasan(2.0, 1.0, 0.05)
    general = st.Srinivasan(st.Table([0.0], [2.0]), 1.0, 0.05)
    for process in (st.FOPDT(3.0, 10.0, 10.0), st.FOPDT(3.0, 10.0, 2.3)):
        one, two = (st.simulate(loop(valve, process=process), 10.0, 500.0) for valve in (quick, general))
        assert np.ptp(one.mv[-200:]) > 1.0
        for name in ("op", "pv", "mv"):
            assert np.array_equal(getattr(one, name), getattr(two, name)), name


def test_all_valves_cycle_or_settle_as_they_must():
    """S = J = 5 cycles whatever the model; the ideal valve does not."""
    for valve in (st.Kano(5.0, 5.0), st.Choudhury(5.0, 5.0), st.He(5.0, 0.0), st.Stenman(5.0), st.HeWang(5.0, 0.0)):
        assert np.ptp(st.simulate(loop(valve), 10.0, 1000.0).mv[-300:]) >= 5.0, valve
    assert np.ptp(st.simulate(loop(), 10.0, 1000.0).mv[-300:]) < 1e-6


REFUSED = [
    ({"duration": 0.0}, "duration = 0 s is not positive"),
    ({"duration": 0.2}, "duration = 0.2 s is shorter than one sample of 1 s"),
    ({"duration": 1e9}, r"duration = 1e\+09 s is 1e\+09 samples of 1 s \(limit 10,000,000\)"),
    ({"duration": 1e308}, r"duration = 1e\+308 s"),
    ({"sp": [1.0, 2.0]}, r"sp has shape \(2,\); give one number or 10"),
    ({"sp": "high"}, "sp must be a number or a series of numbers"),
    ({"sp": math.nan}, "sp has entries that are not finite"),
    ({"disturbance": np.zeros(9)}, r"disturbance has shape \(9,\)"),
    ({"pv_disturbance": math.inf}, "pv_disturbance has entries that are not finite"),
    ({"manual": np.zeros((2, 5))}, "manual has shape"),
    ({"manual": [math.inf] * 10}, "manual has entries that are not finite"),
    ({"manual": [math.nan] * 9 + [-math.inf]}, "manual has entries that are not finite"),
    ({"op_start": math.nan}, "op_start must be a finite number"),
    ({"loop_type": "heat"}, "loop_type 'heat' is unknown"),
]


@pytest.mark.parametrize(("options", "message"), REFUSED)
def test_what_cannot_be_simulated_gets_a_sentence(options, message):
    with pytest.raises(st.ParameterError, match=message):
        st.simulate(loop(), **({"sp": 1.0, "duration": 10.0} | options))


def test_strokes_that_cannot_be_run_get_a_sentence():
    with pytest.raises(st.ParameterError, match="valve is a str; give a valve model"):
        st.stroke("Kano", [0.0], 1.0)  # type: ignore[arg-type]
    with pytest.raises(st.ParameterError, match="dt = 0 s is not positive"):
        st.stroke(st.Ideal(), [0.0], 0.0)
    with pytest.raises(st.RecordError, match="op has 2 dimensions"):
        st.stroke(st.Ideal(), [[0.0]], 1.0)
    with pytest.raises(st.ParameterError, match="mv_start must be a finite number"):
        st.stroke(st.Ideal(), [0.0], 1.0, mv_start=math.nan)
    with pytest.raises(st.RecordError, match="op has 1 missing values"):
        st.stroke(st.Kano(3.0, 1.0), np.ma.masked_greater([1.0, 2.0, 999.0], 100.0), 1.0)
    assert st.stroke(st.Kano(3.0, 1.0), [], 1.0).mv.size == 0


def test_a_position_is_put_where_it_is_asked_for_and_the_input_is_kept():
    op = np.array([0.0, 2.0, 2.5, 3.0, 1.0, -0.5])
    apart, same, across = np.empty(6), op.copy(), np.concatenate([op, [0.0]])
    for given, out in ((op, apart), (same, same), (across[:6], across[1:])):
        record = st.stroke(st.Kano(3.0, 1.0), given, 1.0, out=out)
        assert record.mv is out
        assert out.tolist() == [0.0, 0.0, 1.5, 2.0, 2.0, 0.5]
        assert record.op.tolist() == op.tolist()


def test_a_place_that_cannot_be_written_to_is_refused():
    fixed = np.zeros(3)
    fixed.flags.writeable = False
    for out, message in ((fixed, "out is read-only"), ([0.0] * 3, "out is a list"), (np.zeros(2), r"shape \(2,\)")):
        with pytest.raises(st.ParameterError, match=message):
            st.stroke(st.Kano(3.0, 1.0), np.arange(3.0), 1.0, out=out)


def test_argument_that_is_not_a_loop_is_an_error():
    for other in ("loop", None, st.Ideal()):
        with pytest.raises(st.ParameterError, match=r"loop is of type .*; give a Loop"):
            st.simulate(other, 1.0, 10.0)
