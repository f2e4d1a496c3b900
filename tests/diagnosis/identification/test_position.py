"""The valve behind a recorded position, against the strokes of the valve pages and SciPy's lag."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.signal import lfilter

import stiction as st
from stiction.diagnosis.identification.position import noise_of, watch
from stiction.diagnosis.identification.watched import watched, work_space

N = 1500


def wandering(seed, n=N):
    """An OP that goes up and down by some per cent, with noise."""
    rng = np.random.default_rng(seed)
    turns = np.cumsum(rng.uniform(0.5, 1.5, n)) / 12.0
    return 50.0 + 4.0 * np.sin(turns) + 0.1 * rng.normal(size=n)


def left(op, y, *, S, J, slope=1.0, offset=0.0, decay=0.0, late=0, stops=0.0):
    """Mean square that one valve leaves, after what it began with is forgotten."""
    return float(all_left(op, y, [[S, J / S, slope, offset, 0.0, late, stops]], [decay])[0])


def all_left(op, y, rows, decay, *, cap=np.inf, loose=0.0, begin=None, least=np.inf):
    """Mean squares that some valves leave."""
    out, known = np.empty(len(rows)), np.concatenate([[0], np.cumsum(~np.isnan(y))])
    watched(
        op, y, known, 0.0, np.array(rows), np.array(decay), cap, loose, begin or op.size // 3,
        np.atleast_1d(np.array(least, dtype=float)), out, *work_space(op.size),
    )  # fmt: skip
    return out


@settings(deadline=None, max_examples=40)
@given(
    S=some.floats(0.5, 6.0), share=some.floats(0.0, 1.0), seed=some.integers(0, 99),
    slope=some.sampled_from([1.0, 0.16, -1.0]), lag=some.floats(0.0, 4.0), late=some.integers(0, 3),
)  # fmt: skip
def test_the_valve_that_stroked_a_position_leaves_nothing_of_it(S, share, seed, slope, lag, late):
    op = wandering(seed, 600)
    stem = st.stroke(st.Kano(S, share * S), op, dt=1.0, mv_start=op[0]).mv
    decay = float(np.exp(-1.0 / lag)) if lag > 0.0 else 0.0
    seen = lfilter([1.0 - decay], [1.0, -decay], stem, zi=[decay * stem[0]])[0]
    y = 4.0 + slope * np.concatenate([np.full(late, seen[0]), seen[: seen.size - late]])
    assert left(op, y, S=S, J=share * S, slope=slope, offset=4.0, decay=decay, late=late) < 1e-20


@pytest.mark.parametrize("valve", [st.Stenman(3.0), st.He(3.0, 1.0)])
def test_a_stem_that_rests_after_every_sample_is_tried_too(valve):
    op = wandering(3)
    stem = st.stroke(valve, op, dt=1.0, mv_start=op[0]).mv
    S, J = (3.0, 3.0) if isinstance(valve, st.Stenman) else (4.0, 2.0)
    assert left(op, stem, S=S, J=J, stops=1.0) < 1e-20
    assert left(op, stem, S=S, J=J) > 1e-3
    found = watch(op, stem + 0.1 * np.random.default_rng(0).normal(size=N), 0.0).stiction
    assert pytest.approx(S, rel=0.03) == found.S
    assert pytest.approx(J, rel=0.08) == found.J


@pytest.mark.parametrize(("slope", "offset"), [(0.16, 4.0), (0.01, 0.0), (-1.0, 100.0), (1.0, -3.0)])
def test_unit_and_offset_of_the_position_do_not_matter(slope, offset):
    op = wandering(1)
    stem = st.stroke(st.Kano(3.0, 1.0), op, dt=1.0).mv + 0.2 * np.random.default_rng(1).normal(size=N)
    plain, scaled = watch(op, stem, 0.0), watch(op, offset + slope * stem, 0.0)
    for kind in ("good", "deadband", "stiction"):
        one, other = getattr(plain, kind), getattr(scaled, kind)
        assert (other.S, other.J, other.left) == pytest.approx((one.S, one.J, one.left), rel=0.02, abs=0.01)
    assert pytest.approx(3.0, rel=0.03) == plain.stiction.S


@pytest.mark.parametrize("spoil", ["NaN", "coarse", "late", "lag"])
def test_S_and_J_of_a_position_that_is_not_perfect(spoil):
    op, rng = wandering(2), np.random.default_rng(2)
    y = st.stroke(st.Kano(4.0, 2.0), op, dt=1.0).mv + 0.15 * rng.normal(size=N)
    y = {
        "NaN": np.where(rng.random(N) < 0.2, np.nan, y),
        "coarse": np.round(y),
        "late": np.concatenate([y[:2], y[:-2]]),
        "lag": lfilter([0.4], [1.0, -0.6], y, zi=[0.6 * y[0]])[0],
    }[spoil]
    seen = watch(op, y, 1.0 if spoil == "coarse" else 0.0)
    assert pytest.approx(4.0, rel=0.04) == seen.stiction.S
    assert pytest.approx(2.0, rel=0.15) == seen.stiction.J
    assert seen.stiction.left < 0.5 * seen.good.left


def looped(seed):
    """OP and position of a sticky valve in its loop, and its S and J: He's in odd loops, Kano's in even ones."""
    rng = np.random.default_rng(seed)
    fs, ratio, gain, lag, dead_time = rng.uniform((1.0, 0.15, 0.6, 4.0, 2.0), (3.5, 0.85, 2.5, 30.0, 10.0))
    S, J = fs * (1.0 + ratio), fs * (1.0 - ratio)
    valve = st.He(fs, ratio * fs) if seed % 2 else st.Kano(S, J)
    controller = st.PID(0.5 * lag / (gain * (dead_time + 0.5 * lag)), max(lag, 8.0))
    t = np.arange(1500.0)
    load = rng.uniform(0.0, 2.0) * np.sin(2.0 * t / rng.uniform(150.0, 400.0)) + rng.uniform(0.0, 3.0) * (t > 200.0)
    loop = st.Loop(controller, valve, st.FOPDT(gain, lag, dead_time), dt=1.0, noise=0.08 * gain)
    record = st.simulate(loop, 310.0, 1500.0, load, seed=seed, pv_start=310.0, op_start=61.0)
    return record.op, record.mv + (0.005, 0.05, 0.2)[seed % 3] * rng.normal(size=1500), S, J


def test_valves_in_their_loops_are_found_whether_their_stems_rest_or_go_on():
    errors = []
    for seed in range(36):
        op, y, S, J = looped(seed)
        found = watch(op, y, 0.0).stiction
        errors.append((abs(found.S / S - 1.0), abs(found.J / J - 1.0)))
    within = (np.array(errors) < (0.05, 0.1)).sum(axis=0)
    assert (within >= (30, 30)).all(), within


def test_a_stem_that_goes_in_few_stairs_is_found_in_a_long_record():
    """Its slips are a needle: a valve that is off by a tenth of J makes each of them at another time."""
    t = np.arange(6000.0)
    load = 1.5 * np.sin(t / 100.0) + 3.0 * (t > 200.0)
    loop = st.Loop(st.PID(0.5, 20.0), st.He(2.6, 1.2), st.FOPDT(1.7, 18.0, 6.0), dt=1.0, noise=0.12)
    record = st.simulate(loop, 310.0, 6000.0, load, seed=1, pv_start=310.0, op_start=61.0)
    seen = watch(record.op, record.mv + 0.02 * np.random.default_rng(0).normal(size=6000), 0.0)
    assert pytest.approx(3.8, rel=0.02) == seen.stiction.S
    assert pytest.approx(1.4, rel=0.02) == seen.stiction.J
    assert seen.stiction.left < 0.3 * seen.deadband.left


def test_a_good_valve_is_explained_best_by_a_good_one():
    op = wandering(4)
    y = lfilter([0.5], [1.0, -0.5], op, zi=[0.5 * op[0]])[0] + 0.2 * np.random.default_rng(4).normal(size=N)
    seen = watch(op, 4.0 + 0.16 * y, 0.0)
    assert seen.good.left < min(seen.deadband.left, seen.stiction.left)
    assert seen.good.lag == pytest.approx(1.0 / np.log(2.0), abs=0.2)
    assert seen.noise == pytest.approx(0.2, rel=0.25)


def test_noise_is_that_of_a_stem_at_rest_and_not_of_what_was_held():
    rng = np.random.default_rng(0)
    y = np.where(np.arange(4000) % 40 < 20, 40.0, 43.0) + 0.3 * rng.normal(size=4000)
    assert noise_of(y, 0.0) == pytest.approx(0.3, rel=0.1)
    assert noise_of(np.repeat(y[::2], 2), 0.0) == pytest.approx(0.3, rel=0.15)
    rounded = np.round(y / 0.5) * 0.5
    assert noise_of(rounded, 0.5) == pytest.approx(np.hypot(0.3, 0.5 / 6.0**0.5), rel=0.25)
