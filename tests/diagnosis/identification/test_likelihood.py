"""The likelihood of a valve is that of a plain regression, and what is drawn from it holds on known loops."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import naive
import stiction as st
from calibration.populations.valves import physical_valve
from stiction.diagnosis.identification import closer
from stiction.diagnosis.identification.contest import UNSEEN, drift
from stiction.diagnosis.identification.likelihood import Trial, by_cycle, prediction_of, stem_of
from stiction.diagnosis.identification.signals import prepare
from stiction.simulation.historian import sampled

from .loops import KNOWN, run_of


def he_wang(op, fs, fd, K):
    """He and Wang's valve by its definition, He's with a K of 1: it rests again after every sample."""
    x, out = float(op[0]), []
    for u in op:
        if abs(u - x) > fs * (1.0 + 1e-9):
            x += K * float(u - x - np.copysign(fd, u - x))
        out.append(x)
    return np.array(out)


def behind(op, lag):
    """Air behind a first-order lag: each sample it goes on to what OP is held at."""
    if not lag:
        return op
    out = [op[0]]
    for u in op[1:]:
        out.append(u - (u - out[-1]) * math.exp(-1.0 / lag))
    return np.array(out)


def by_least_squares(prediction, mv):
    """Squares left by a regression of the PV on a constant, its past and sums of the stem's lags, shocks left out."""
    pv, begin, n = prediction.pv, prediction.begin, prediction.pv.size
    blocks = mv.reshape(n, prediction.width).mean(axis=1)
    columns = [np.ones(n - begin)] + [pv[begin - i : n - i] for i in range(1, prediction.order + 1)]
    op = prediction.op.reshape(n, prediction.width).mean(axis=1)
    op = (op - op.mean()) / op.std()
    columns += [op[begin - i : n - i] for i in range(1, prediction.op_order + 1)]
    for first, last in zip(prediction.edges[:-1], prediction.edges[1:], strict=True):
        columns.append(np.sum([blocks[begin - lag : n - lag] for lag in range(first, last)], axis=0))
    A, kept = np.stack(columns, axis=1), np.ones(n - begin, dtype=bool)
    kept[prediction.shocks - begin] = False
    weights, *_ = np.linalg.lstsq(A[kept], pv[begin:][kept], rcond=None)
    return kept * (pv[begin:] - A @ weights) ** 2


@settings(max_examples=12, deadline=None)
@given(
    name=some.sampled_from(sorted(KNOWN)),
    S=some.floats(0.3, 1.2),
    ratio=some.floats(0.0, 1.0),
    K=some.sampled_from([0.0, 1.0, 1.6]),
    lag=some.sampled_from([0.0, 0.7, 3.0]),
    shocks=some.sets(some.integers(0, 449), max_size=9),
)
def test_the_squares_left_are_those_of_a_regression(name, S, ratio, K, lag, shocks):
    known = KNOWN[name]
    record = replace(run_of(known, 0.05, samples=450), mv=None)
    prediction = prediction_of(prepare(record, known.period))
    rows = np.array(sorted(row for row in shocks if row >= prediction.begin), dtype=np.int64)
    prediction = prediction._replace(shocks=rows[rows < prediction.pv.size])
    S *= known.S
    valve = np.array([[S, ratio, K, 0.0, lag]])
    J, air = S * ratio, behind(record.op, lag)
    fs = (S + J) / 2.0
    mv = he_wang(air, fs, fs - J / K, K) if K else np.array(naive.kano(list(air), S, J))
    used = prediction.pv.size * prediction.width
    left = by_least_squares(prediction, mv[:used])
    halves = by_cycle(prediction, valve)[0]
    assert halves.sum() == pytest.approx(left.sum(), rel=1e-3)
    starts = np.concatenate([[prediction.begin], prediction.ends[:-1]])
    for half, first, last in zip(halves, starts, prediction.ends, strict=True):
        own = left[first - prediction.begin : last - prediction.begin].sum()
        assert half == pytest.approx(own, rel=2e-2, abs=1e-3 * left.sum())
    assert stem_of(prediction, Trial(*valve[0])) == pytest.approx(mv[:used])


def test_the_lag_of_an_actuator_is_found_and_does_not_pass_for_stiction():
    # Mass, spring and air of a published valve, whose converter and actuator take 3.571 s to follow OP (garcia2008).
    valve, S, J = physical_valve("nominal", 4.0, 2.0)
    loop = st.Loop(st.PID(0.4, 10.0), valve, st.FOPDT(1.5, 15.0, 4.0), dt=1.0, noise=0.05)
    sp = 50.0 + 8.0 * np.repeat(np.random.default_rng(1).uniform(-1.0, 1.0, 31), 60)[:1800]
    record = replace(st.simulate(loop, sp, 1800.0, seed=1, pv_start=50.0, op_start=50.0).window(100, 1800), mv=None)
    found = st.identify(record, period=100.0)
    assert found.actuator_lag == pytest.approx(3.571, rel=0.1)
    assert pytest.approx(S, rel=0.05) == found.S
    assert found.J_low <= J <= found.J_high
    assert f"behind a lag of {found.actuator_lag:.3g} s" in found.summary()
    assert found.to_dict()["actuator_lag"] == found.actuator_lag


def test_a_valve_without_one_has_no_lag():
    known = KNOWN["first order"]
    found = st.identify(replace(run_of(known, 0.05), mv=None), period=known.period)
    assert found.actuator_lag == 0.0
    assert "lag" not in found.summary()


def test_a_valve_that_rests_after_every_sample_is_found():
    loop = st.Loop(st.PID(0.4, 5.0), st.He(3.5, 1.5), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.15)
    run = st.simulate(loop, 50.0, 1450.0, 6.0 * (np.arange(1450) > 5), seed=3, pv_start=50.0, op_start=50.0)
    run = run.window(250, 1450)
    assert np.ptp(run.mv[-200:]) > 2.0
    found = st.identify(replace(run, mv=None, integrating=False), period=90.0)
    assert pytest.approx(5.0, rel=0.02) == found.S
    assert found.J_low <= 2.0 <= found.J_high
    assert np.corrcoef(found.mv[100:], run.mv[100:])[0, 1] > 0.97


def test_a_wave_from_outside_does_not_move_S():
    # As large as the valve's own swing: a simulation error takes the wave's way round the loop for the process's.
    known = KNOWN["first order"]
    n = 1250
    load = 1.2 * known.S * (np.arange(n) >= 10) + 0.3 * known.S * np.sin(2.0 * np.pi * np.arange(n) / 37.0)
    loop = replace(known.loop, noise=0.02 * known.swing)
    run = st.simulate(loop, 100.0, float(n), load, 1, pv_start=100.0, op_start=50.0).window(250, n)
    found = st.identify(replace(run, mv=None, integrating=False), period=known.period)
    assert pytest.approx(known.S, rel=0.03) == found.S
    assert found.S_low <= known.S <= found.S_high


def test_a_sticky_valve_beats_a_good_one_and_a_good_valve_does_not():
    known = KNOWN["first order"]
    sticky = st.identify(replace(run_of(known, 0.02), mv=None), period=known.period)
    assert sticky.over("good").beats > 3.0
    good = replace(known, loop=replace(known.loop, valve=st.Ideal()))
    rng = np.random.default_rng(4)
    run = st.simulate(replace(good.loop, noise=0.1), 100.0, 1000.0, np.cumsum(rng.normal(0.0, 0.3, 1000)), 2,
                      pv_start=100.0, op_start=50.0)  # fmt: skip
    found = st.identify(replace(run, mv=None, integrating=False), period=known.period)
    assert found.over("good").beats < 3.0
    assert found.S_low < 0.2 * np.ptp(run.op)


def test_the_drift_of_a_line_is_its_slope():
    hours = [0.5, 1.5, 2.5, 3.5, 4.5]
    slope, error = drift(hours, [3.0 + 0.2 * h for h in hours])
    assert (slope, error) == (pytest.approx(0.2), pytest.approx(0.0, abs=1e-9))
    assert all(np.isnan(drift(hours[:3], hours[:3])))


def test_the_drift_has_the_standard_error_of_a_regression():
    rng = np.random.default_rng(0)
    hours, S = np.arange(8.0), 4.0 + rng.normal(0.0, 0.1, 8)
    weights, covariance = np.polyfit(hours, S, 1, cov=True)
    assert drift(list(hours), list(S)) == (pytest.approx(weights[0]), pytest.approx(float(covariance[0, 0] ** 0.5)))


@pytest.mark.parametrize(("jitter", "close"), [(0.2, 0.03), (0.45, 0.1), (None, 0.15)])
def test_irregular_time_stamps_leave_the_truth_in_the_interval(tmp_path, jitter, close):
    # Stamps off by a share of the sampling period, or one to three samples apart at random.
    known = KNOWN["first order"]
    run = run_of(known, 0.02)
    rng = np.random.default_rng(0)
    kept = np.arange(len(run)) if jitter is not None else np.cumsum(rng.integers(1, 4, len(run)))
    kept = kept[kept < len(run)]
    seconds = kept + (rng.uniform(-jitter, jitter, kept.size) if jitter is not None else 0.0) + 10.0
    start = np.datetime64("2024-01-01T00:00:00")
    rows = [
        f"{start + np.timedelta64(round(1000.0 * at), 'ms')},{run.op[k]:.6f},{run.pv[k]:.6f},{run.sp[k]:.6f}"
        for at, k in zip(seconds, kept, strict=True)
    ]
    path = tmp_path / "irregular.csv"
    path.write_text("\n".join(["time,op,pv,sp", *rows]))
    found = st.identify(replace(st.read(path)[0], integrating=False), period=known.period)
    assert pytest.approx(known.S, rel=close) == found.S
    assert found.S_low <= known.S <= found.S_high


def test_S_of_a_slow_record_is_corrected_for_what_OP_does_between_its_samples(monkeypatch):
    # The band that trips at every second sample is 0.95 of S here, since noise trips the valve between them as well.
    # These controllers' samples between can be rebuilt (test_between); those of others, as with a derivative, cannot.
    monkeypatch.setattr(closer, "with_samples_between", lambda _: None)
    shares = []
    for name, seed in product(("reverse gain, every 5 s", "second order"), range(8)):
        known = KNOWN[name]
        run = sampled(run_of(known, 0.05, seed=seed, samples=2400), 2.0 * known.loop.dt)
        found = st.identify(replace(run, mv=None), period=known.period)
        assert "not recorded" in found.reason
        assert found.S_low <= known.S <= found.S_high
        assert UNSEEN.wide * found.S_low <= found.S * (1.0 + 1e-9)
        assert found.S_high >= UNSEEN.wide * found.S * (1.0 - 1e-9)
        shares.append(found.S / known.S)
    assert np.exp(np.log(shares).mean()) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(("S", "J"), [(1.5, 0.9), (1.6, 1.2)])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_band_that_is_small_beside_the_steps_of_the_set_point(S, J, seed):
    loop = st.Loop(st.PID(0.4, 12.0), st.Kano(S, J), st.FOPDT(1.0, 12.0, 3.0), dt=1.0, noise=0.05)
    steps = 30.0 + 35.0 * (np.arange(4000.0) // 800 % 2)
    record = st.simulate(loop, steps, 4000.0, seed=seed, pv_start=30.0, op_start=30.0, loop_type="flow")
    assert 0.05 * np.ptp(record.op) > S
    found = st.identify(replace(record, mv=None))
    assert pytest.approx(S, rel=0.02) == found.S
    assert pytest.approx(J, rel=0.05) == found.J
    assert found.over("good").likelier > 500.0
