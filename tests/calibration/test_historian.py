"""Each effect of a historian against its definition, written out sample by sample."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from hypothesis.extra.numpy import arrays

from calibration import historian
from calibration.historian import EFFECTS, INTERVAL_EFFECTS, apply_effect
from stiction.errors import ParameterError, RecordError
from stiction.records import LoopRecord

N = 600
SERIES = arrays(np.float64, some.integers(2, 60), elements=some.floats(-100.0, 100.0, width=32))


def walk(seed=0, n=N):
    """A record of lively signals."""
    rng = np.random.default_rng(seed)
    op, pv = 50.0 + np.cumsum(rng.normal(0.0, 0.3, n)), 20.0 + np.cumsum(rng.normal(0.0, 1.0, n))
    return LoopRecord("FC1", 2.0, op=op, pv=pv, sp=np.full(n, 20.0), mv=op.copy())


def only(op):
    return LoopRecord("FC1", 1.0, op=op)


@given(SERIES, some.floats(0.0, 3.0))
def test_exception_holds_the_last_value_that_left_the_band(op, deviation):
    band, last, expected = deviation * op.std(), op[0], []
    for value in op:
        last = value if abs(value - last) > band else last
        expected.append(last)
    np.testing.assert_array_equal(historian.report_by_exception(only(op), deviation).op, expected)


@given(SERIES, some.floats(0.0, 3.0))
def test_the_swinging_door_is_off_by_less_than_twice_its_deviation(op, deviation):
    found = historian.compress_by_swinging_door(only(op), deviation).op
    assert np.abs(found - op).max() <= 2.0 * deviation * op.std() * (1.0 + 1e-9) + 1e-9
    assert (found[0], found[-1]) == (op[0], pytest.approx(op[-1]))


def test_the_swinging_door_keeps_the_corners_of_a_triangle():
    op = 50.0 + np.abs(np.arange(200) % 40 - 20.0)
    found = historian.compress_by_swinging_door(only(op), 0.01).op
    np.testing.assert_allclose(found, op, atol=0.02 * op.std())
    assert np.sum(np.abs(np.diff(found, 2)) > 1e-9) < 25


@pytest.mark.parametrize("every", [1, 3, 7])
def test_slower_records_are_the_samples_and_the_means(every):
    record = walk()
    slow, mean = historian.sample_slower(record, 2.0 * every), historian.average_intervals(record, 2.0 * every)
    assert slow.dt == mean.dt == 2.0 * every
    np.testing.assert_array_equal(slow.pv, record.pv[::every])
    expected = [sum(record.pv[k : k + every]) / every for k in range(0, N - every + 1, every)]
    np.testing.assert_allclose(mean.pv, expected, rtol=1e-12)
    line = historian.interpolate_samples(record, 2.0 * every)
    np.testing.assert_array_equal(line.op[::every], record.op[::every])
    if every == 3:
        assert line.op[4] == pytest.approx((2.0 * record.op[3] + record.op[6]) / 3.0)


def test_an_interval_that_is_no_whole_number_of_samples_takes_the_last_value():
    found = historian.sample_slower(only(np.arange(10.0)), 2.5).op
    np.testing.assert_array_equal(found, [0.0, 2.0, 5.0, 7.0])


@given(share=some.floats(0.0, 1.0), seed=some.integers(0, 1000), count=some.integers(1, 5))
@settings(max_examples=30)
def test_gaps_and_held_stretches_take_their_share(share, seed, count):
    record = walk()
    lost = np.isnan(historian.add_gaps(record, share, seed, count=count).pv)
    assert lost.sum() == round(share * N)
    assert np.sum(np.diff(np.concatenate([[0], lost, [0]])) == 1) <= count
    held = historian.freeze_signals(record, share, seed, count=count)
    assert np.all(np.isin(held.op, record.op))
    assert abs(np.sum(np.diff(held.op) == 0.0) - round(share * N)) <= count


def test_single_samples_are_lost_at_random():
    found = historian.drop_samples(walk(n=20_000), 0.1, seed=3)
    assert np.isnan(found.op).mean() == pytest.approx(0.1, abs=0.01)
    assert np.mean(np.isnan(found.op) & np.isnan(found.pv)) == pytest.approx(0.01, abs=0.004)


def test_a_replay_repeats_an_earlier_stretch_of_both_signals():
    record = walk()
    found = historian.replay_segment(record, 0.2, seed=5)
    (where,) = np.nonzero(found.op != record.op)
    assert where.size == 120
    (first,) = np.nonzero(record.op == found.op[where[0]])[0]
    assert first + 120 <= where[0]
    np.testing.assert_array_equal(found.pv[where], record.pv[first : first + 120])


def test_a_clock_jump_leaves_the_rest_in_order_and_is_counted():
    found = historian.add_clock_jumps(only(np.arange(1000.0)), 3, seed=2)
    assert found.provenance.clock_jumps == 3
    assert np.all(np.diff(found.op) > 0.0)
    assert 850 <= len(found) < 1000


@pytest.mark.parametrize("record_mode", [True, False])
def test_in_manual_op_rests_and_pv_goes_on(record_mode):
    record = walk()
    found = historian.add_manual_period(record, 0.4, seed=1, record_mode=record_mode)
    still = np.flatnonzero(np.diff(found.op) == 0.0)
    assert still.size == 239
    assert np.all(np.diff(still) == 1)
    assert np.ptp(found.pv[still]) > 0.0
    assert (found.auto is not None) == record_mode
    if record_mode:
        assert np.flatnonzero(~found.auto)[0] == still[0]


def test_a_stretch_in_manual_of_no_sample_leaves_the_record():
    record = LoopRecord("FC1", 1.0, op=np.arange(10.0), pv=np.arange(10.0))
    assert all(historian.add_manual_period(record, 0.02, seed, record_mode=True) is record for seed in range(40))


def test_limits_steps_and_units():
    record = walk()
    assert np.mean(historian.clip_op(record, 0.3).op == historian.clip_op(record, 0.3).op.max()) == pytest.approx(0.3)
    found = historian.quantise_signals(record, op=0.5, pv=2.0)
    np.testing.assert_allclose(found.op % 0.5, 0.0, atol=1e-9)
    assert np.abs(found.pv - record.pv).max() <= 1.0
    other = historian.change_units(record, op=(0.16, 4.0), pv=(1.8, 32.0))
    np.testing.assert_allclose(other.mv, 4.0 + 0.16 * record.mv)
    np.testing.assert_allclose(other.sp, 68.0)


@pytest.mark.parametrize("effect", EFFECTS)
def test_every_effect_by_its_name(effect):
    record = walk()
    before = record.op.copy(), record.pv.copy()
    for strength in (0.0, 0.4, 1.0):
        found, again = (apply_effect(record, effect, strength, 9) for _ in range(2))
        np.testing.assert_array_equal(found.pv, again.pv)
        assert found.pv.size == found.op.size == found.sp.size == len(found)
    np.testing.assert_array_equal(record.op, before[0])
    np.testing.assert_array_equal(record.pv, before[1])
    worst = apply_effect(record, effect, 1.0, 9)
    assert not (np.array_equal(worst.op, record.op) and np.array_equal(worst.pv, record.pv))
    if effect in INTERVAL_EFFECTS:
        np.testing.assert_array_equal(apply_effect(record, effect, 0.0).op, record.op)


def test_nonsense_is_refused():
    record = walk()
    with pytest.raises(ParameterError, match="'rust' is unknown"):
        apply_effect(record, "rust", 0.5)
    with pytest.raises(ParameterError, match="outside 0 to 1"):
        apply_effect(record, "gaps", 1.5)
    with pytest.raises(ParameterError, match="shorter than the record's 2 s"):
        historian.sample_slower(record, 1.0)
    with pytest.raises(ParameterError, match=r"outside 0 to 0\.5"):
        historian.replay_segment(record, 0.7)


@pytest.mark.parametrize(
    "change", ["sample_slower", "average_intervals", "report_by_exception", "add_gaps", "freeze_signals", "clip_op"]
)
def test_no_record_raises(change):
    for other in ("a.csv", None):
        with pytest.raises(RecordError, match="record"):
            getattr(historian, change)(other, 0.5)


@pytest.mark.parametrize("change", ["add_gaps", "drop_samples", "freeze_signals", "add_manual_period"])
def test_seed_below_0_raises(change):
    with pytest.raises(ParameterError, match="seed = -1 is negative"):
        getattr(historian, change)(walk(), 0.1, seed=-1)
