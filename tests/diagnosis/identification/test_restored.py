"""What a historian left out of OP and PV comes back by the controller's law."""

from __future__ import annotations

from dataclasses import replace
from itertools import accumulate

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.strategies import booleans, floats, integers, sampled_from

from stiction.diagnosis.identification.lawful import moves_of
from stiction.diagnosis.identification.restored import restored
from stiction.records import LoopRecord
from stiction.records.quality.storage_rate import StoredMasks, find_stored_samples
from stiction.simulation.historian import exception_reported, swinging_door

N = 600
EVERY = np.ones(N, dtype=bool)


def by_law(seed, *, Kc=0.5, Ki=0.1, Kd=0.0, on_pv=False, moving=0.0, top=np.inf):
    """A PV that wanders about its set point, and the OP, up to a top, that a controller makes of it at every sample."""
    rng = np.random.default_rng(seed)
    sp = 50.0 + moving * np.repeat(rng.normal(size=N // 20), 20)
    pv = np.empty(N)
    pv[0] = y = 50.0
    for k, noise in enumerate(rng.normal(size=N - 1), 1):
        pv[k] = y = y + 0.1 * (sp[k] - y) + noise
    error = sp - pv
    change = np.diff(-pv if on_pv else error)
    moves = Kc * change + Ki * error[1:] + Kd * np.diff(change, prepend=0.0)
    op = np.array([40.0, *accumulate(moves, lambda u, move: min(u + move, top), initial=40.0)][1:])
    return LoopRecord("FIC-101", 1.0, op=op, pv=pv, sp=sp)


def held(record, name, every, first=0):
    k = np.arange(len(record))
    return replace(record, **{name: getattr(record, name)[np.maximum(k - (k - first) % every, 0)]})


def found_in(record):
    """The record restored, from what it shows itself."""
    return restored(record, find_stored_samples(record.op, record.pv))


@settings(max_examples=60, deadline=None)
@given(
    name=sampled_from(["op", "pv"]), every=integers(2, 10), first=integers(0, 9), seed=integers(0, 2**16),
    Kc=floats(0.05, 5.0), reset=floats(0.02, 0.8), sign=sampled_from([-1.0, 1.0]), on_pv=booleans(),
    moving=sampled_from([0.0, 3.0]),
)  # fmt: skip
def test_what_was_held_comes_back(name, every, first, seed, Kc, reset, sign, on_pv, moving):
    first %= every
    record = by_law(seed, Kc=sign * Kc, Ki=sign * Kc * reset, on_pv=on_pv, moving=moving)
    slow = held(record, name, every, first)
    found = found_in(slow)
    assert found is not None
    other = "pv" if name == "op" else "op"
    for one in (name, other):
        right, got = getattr(record, one), getattr(found.record, one)
        np.testing.assert_allclose(got[first:], right[first:], atol=1e-5 * np.ptp(right))
    np.testing.assert_array_equal(getattr(found.record, name)[first::every], getattr(record, name)[first::every])
    assert found.untold <= first / N


@settings(max_examples=40, deadline=None)
@given(
    how=sampled_from(["missing", "exception", "door"]), much=floats(0.2, 1.0), seed=integers(0, 2**16),
    reset=floats(0.05, 0.8),
)  # fmt: skip
def test_what_both_lack_comes_back_or_is_told_to_be_untold(how, much, seed, reset):
    record = by_law(seed, Kc=1.0, Ki=reset)
    if how == "missing":
        rng = np.random.default_rng(seed)
        op, pv = (np.where(rng.random(N) < 0.25 * much, np.nan, x) for x in (record.op, record.pv))
        slow = replace(record, op=op, pv=pv)
    else:
        slow = (swinging_door if how == "door" else exception_reported)(record, 0.05 * much)
    kept = find_stored_samples(slow.op, slow.pv)
    found = restored(slow, kept)
    if found is None:
        return
    for name in ("op", "pv"):
        right, got, was = (getattr(one, name) for one in (record, found.record, slow))
        as_it_was = (got == was) | (np.isnan(got) & np.isnan(was))
        off = np.abs(got - right)[~as_it_was] / np.std(np.diff(right))
        assert np.sum(off > 0.1) <= 0.01 * N


def test_a_quarter_of_both_missing_is_mostly_told():
    record = by_law(1)
    rng = np.random.default_rng(1)
    op, pv = (np.where(rng.random(N) < 0.25, np.nan, x) for x in (record.op, record.pv))
    found = found_in(replace(record, op=op, pv=pv))
    assert found is not None
    assert np.isnan(found.record.op).mean() < 0.02
    assert np.isnan(found.record.pv).mean() < 0.02
    assert found.untold == 0.0


@pytest.mark.parametrize("deviation", [0.02, 0.05])
def test_values_that_both_left_out_by_exception_come_back(deviation):
    record = by_law(2, Kc=0.2, Ki=0.15)
    slow = exception_reported(record, deviation)
    kept = find_stored_samples(slow.op, slow.pv)
    assert min(kept.op.mean(), kept.pv.mean()) < 0.98
    found = restored(slow, kept)
    assert found is not None
    for name in ("op", "pv"):
        off = np.abs(getattr(found.record, name) - getattr(record, name))
        was = np.abs(getattr(slow, name) - getattr(record, name))
        assert np.sqrt(np.mean(off**2)) < 0.5 * np.sqrt(np.mean(was**2))


@pytest.mark.parametrize("name", ["op", "pv"])
def test_what_a_swinging_door_left_out_of_one_comes_back(name):
    record = by_law(8, moving=3.0)
    slow = replace(record, **{name: getattr(swinging_door(record, 0.3), name)})
    kept = find_stored_samples(slow.op, slow.pv)
    assert getattr(kept, name).mean() < 1.0 / 3.0
    right = getattr(record, name)
    np.testing.assert_allclose(getattr(restored(slow, kept).record, name), right, atol=1e-5 * np.ptp(right))


def test_what_an_exception_left_out_of_the_pv_comes_back():
    record = by_law(9)
    slow = replace(record, pv=exception_reported(record, 0.5).pv)
    kept = find_stored_samples(slow.op, slow.pv)
    assert kept.pv.mean() < 0.5
    np.testing.assert_allclose(restored(slow, kept).record.pv, record.pv, atol=1e-5 * np.ptp(record.pv))
    at = np.flatnonzero(kept.pv)
    begin = int(at[:-1][np.diff(at) >= 4][0]) + 1
    begun, right = slow.window(begin, N), record.pv[begin:]
    since = int(
        np.flatnonzero(find_stored_samples(begun.op, begun.pv).pv)[1]
    )  # the first value is older than the record
    np.testing.assert_allclose(found_in(begun).record.pv[since:], right[since:], atol=1e-5 * np.ptp(right))


@pytest.mark.parametrize("name", ["op", "pv"])
def test_units_and_a_set_point_that_was_not_recorded_change_nothing(name):
    record = held(by_law(1), name, 5)
    right = getattr(found_in(record).record, name)
    for other in (
        replace(record, sp=None),
        replace(record, pv=7.0 * record.pv + 3.0, sp=7.0 * record.sp + 3.0, dt=0.01),
        replace(record, pv=1e-9 * record.pv, sp=1e-9 * record.sp),
        replace(record, op=100.0 - 0.2 * record.op),
    ):
        got = getattr(found_in(other).record, name)
        scale, shift = np.polyfit(getattr(record, name), getattr(other, name), 1)
        np.testing.assert_allclose(got, scale * right + shift, atol=1e-5 * np.ptp(got))


def test_a_derivative_part_is_told_by_a_pv_at_every_sample_only():
    record = by_law(2, Kd=0.8)
    np.testing.assert_allclose(found_in(held(record, "op", 4)).record.op, record.op, atol=1e-9)
    assert found_in(held(record, "pv", 4)) is None


@pytest.mark.parametrize("name", ["op", "pv"])
def test_rounding_leaves_about_as_much_as_it_rounds(name):
    record = by_law(3)
    slow = held(replace(record, op=np.round(record.op, 1), pv=np.round(record.pv, 1)), name, 5)
    off = getattr(found_in(slow).record, name) - getattr(record, name)
    assert np.std(off) < 0.15
    assert np.std(getattr(slow, name) - getattr(record, name)) > 0.5


@pytest.mark.parametrize("name", ["op", "pv"])
def test_a_stretch_without_the_law_stays_as_it_was_and_the_others_are_right(name):
    record = by_law(4)
    record = replace(record, op=record.op + 20.0 * (np.arange(N) >= 303))  # moved by hand within a stretch of five
    slow = held(record, name, 5)
    found = found_in(slow)
    assert found is not None
    right, got, was = (getattr(one, name) for one in (record, found.record, slow))
    near = (np.arange(N) >= 300) & (np.arange(N) < 306)
    np.testing.assert_allclose(got[~near], right[~near], atol=1e-5 * np.ptp(right))
    wrong = near & (np.abs(got - right) > 1e-3)
    np.testing.assert_array_equal(got[wrong], was[wrong])


@pytest.mark.parametrize("first", [0, 1, 200])
def test_an_op_ramped_by_hand_is_not_taken_for_one_on_lines(first):
    record, last = by_law(12), first + 50
    ramp = np.linspace(record.op[first] - 20.0, record.op[last], last - first + 1)
    by_hand = replace(record, op=np.concatenate([record.op[:first] - 20.0, ramp, record.op[last + 1 :]]))
    kept = find_stored_samples(by_hand.op, by_hand.pv)
    assert not kept.op[first + 1 : last].any()
    assert restored(by_hand, kept) is None
    fifth = np.arange(N) % 5 == 0
    both = restored(replace(by_hand, pv=held(record, "pv", 5).pv), StoredMasks(kept.op, fifth))
    if both is not None:
        assert np.sum(both.record.op[first : last + 1] != ramp) < 5


def test_an_op_at_its_limit_stays_there():
    free = by_law(5)
    rarely, often = (by_law(5, top=float(np.quantile(free.op, share))) for share in (0.98, 0.7))
    assert 3 <= np.sum(rarely.op == rarely.op.max()) < 0.02 * N < np.sum(often.op == often.op.max())
    found = found_in(held(rarely, "op", 2))
    assert found is not None
    assert found.record.op.max() <= rarely.op.max() + 0.1 * np.std(np.diff(rarely.op))
    assert found_in(held(often, "op", 2)) is None  # the limit is the finding


@pytest.mark.parametrize("name", ["op", "pv"])
def test_signals_that_no_law_joins_are_left(name):
    rng = np.random.default_rng(6)
    record = LoopRecord("FIC-101", 1.0, op=np.cumsum(rng.normal(size=N)), pv=np.cumsum(rng.normal(size=N)))
    assert found_in(held(record, name, 5)) is None
    assert found_in(replace(record, pv=exception_reported(record, 0.3).pv)) is None
    op, pv = (np.where(rng.random(N) < 0.1, np.nan, x) for x in (record.op, record.pv))
    assert found_in(replace(record, op=op, pv=pv)) is None
    short = held(by_law(7), name, 5).window(0, 90)
    assert found_in(short) is None


def test_a_record_without_moves_is_left():
    still = LoopRecord("FIC-101", 1.0, op=np.full(N, 50.0), pv=by_law(7).pv)
    assert restored(still, StoredMasks(EVERY, np.arange(N) % 3 > 0)) is None
    assert restored(replace(still, op=by_law(7).op, pv=still.op), StoredMasks(EVERY, np.arange(N) % 3 > 0)) is None


def acting(pv, every=1):
    """OP of a PI controller that looks at this PV every so-manyth sample and holds its OP."""
    error = 50.0 - pv[::every]
    op = 40.0 + 0.5 * (error - error[0]) + 0.1 * np.cumsum(error)
    return LoopRecord("FIC-101", 1.0, op=np.repeat(op, every)[: pv.size], pv=pv, sp=np.full(pv.size, 50.0))


def test_a_controller_that_holds_its_op_is_no_historian():
    record = acting(by_law(10).pv, every=5)
    assert find_stored_samples(record.op, record.pv).op.mean() == 0.2
    assert found_in(record) is None


def test_a_pv_that_the_controller_saw_held_stays_so():
    record = acting(held(by_law(11), "pv", 5).pv)
    assert find_stored_samples(record.op, record.pv).pv.mean() == 0.2
    assert found_in(record) is None
    assert found_in(replace(record, op=np.round(record.op, 2))) is None


@settings(max_examples=30, deadline=None)
@given(Kc=floats(0.1, 3.0), reset=floats(0.05, 0.8), Kd=sampled_from([0.0, 0.5]), seed=integers(0, 2**16))
def test_the_law_is_that_of_the_controller(Kc, reset, Kd, seed):
    Ki = Kc * reset
    record = by_law(seed, Kc=Kc, Ki=Ki, Kd=Kd)
    fifth = np.arange(N) % 5 == 0
    most = np.random.default_rng(seed).random(N) < 0.8
    ways = [StoredMasks(most, most), StoredMasks(fifth, EVERY), *([] if Kd else [StoredMasks(EVERY, fifth)])]
    for kept in ways:
        law = moves_of(record.op, record.pv - 50.0, record.sp - 50.0, kept, EVERY)
        assert law is not None
        np.testing.assert_allclose(law.past, (-Kc - Ki - Kd, Kc + 2.0 * Kd, -Kd), rtol=1e-5, atol=1e-6)
