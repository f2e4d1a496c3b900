"""What is held of OP or PV is told by the other one and the controller's law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.strategies import booleans, floats, integers, sampled_from

from stiction.diagnosis.identification.restored import restored
from stiction.records import LoopRecord
from stiction.records.one_rate import slower_of, unevenly_stored
from stiction.simulation.historian import exception_reported, swinging_door

N = 600
FIFTH = np.arange(0, N, 5)


def by_law(seed, *, Kc=0.5, Ki=0.1, Kd=0.0, on_pv=False, moving=0.0):
    """A PV that wanders about its set point, and the OP that a controller makes of it, sample by sample."""
    rng = np.random.default_rng(seed)
    sp = 50.0 + moving * np.repeat(rng.normal(size=N // 20), 20)
    pv = np.empty(N)
    pv[0] = y = 50.0
    for k, noise in enumerate(rng.normal(size=N - 1), 1):
        pv[k] = y = y + 0.1 * (sp[k] - y) + noise
    error = sp - pv
    change = np.diff(-pv if on_pv else error)
    moves = Kc * change + Ki * error[1:] + Kd * np.diff(change, prepend=0.0)
    op = 40.0 + np.concatenate([[0.0], np.cumsum(moves)])
    return LoopRecord("FIC-101", 1.0, op=op, pv=pv, sp=sp)


def held(record, name, every, first=0):
    k = np.arange(len(record))
    return replace(record, **{name: getattr(record, name)[np.maximum(k - (k - first) % every, 0)]})


def slower(record):
    found = slower_of(record.op, record.pv)
    assert found is not None
    return found.name, found.at(len(record))


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
    found = restored(slow, *slower(slow))
    assert found is not None
    right, got = getattr(record, name), getattr(found, name)
    assert np.isnan(got[:first]).all()
    np.testing.assert_allclose(got[first:], right[first:], atol=1e-5 * np.ptp(right))
    np.testing.assert_array_equal(got[first::every], right[first::every])
    other = "pv" if name == "op" else "op"
    assert getattr(found, other) is getattr(slow, other)


@pytest.mark.parametrize("name", ["op", "pv"])
def test_units_and_a_set_point_that_was_not_recorded_change_nothing(name):
    record = held(by_law(1), name, 5)
    right = getattr(restored(record, name.upper(), FIFTH), name)
    for other in (
        replace(record, sp=None),
        replace(record, pv=7.0 * record.pv + 3.0, sp=7.0 * record.sp + 3.0, dt=0.01),
        replace(record, op=100.0 - 0.2 * record.op),
    ):
        got = getattr(restored(other, name.upper(), FIFTH), name)
        scale, shift = np.polyfit(getattr(record, name), getattr(other, name), 1)
        np.testing.assert_allclose(got, scale * right + shift, atol=1e-5 * np.ptp(got))


def test_a_derivative_part_is_told_by_a_pv_at_every_sample_only():
    record = by_law(2, Kd=0.8)
    slow = held(record, "op", 4)
    np.testing.assert_allclose(restored(slow, "OP", np.arange(0, N, 4)).op, record.op, atol=1e-9)
    assert restored(held(record, "pv", 4), "PV", np.arange(0, N, 4)) is None


@pytest.mark.parametrize("name", ["op", "pv"])
def test_rounding_leaves_about_as_much_as_it_rounds(name):
    record = by_law(3)
    slow = held(replace(record, op=np.round(record.op, 1), pv=np.round(record.pv, 1)), name, 5)
    off = getattr(restored(slow, name.upper(), FIFTH), name) - getattr(record, name)
    assert np.std(off) < 0.15
    assert np.std(getattr(slow, name) - getattr(record, name)) > 0.5


@pytest.mark.parametrize("name", ["op", "pv"])
def test_a_stretch_without_the_law_is_missing_and_the_others_are_right(name):
    record = by_law(4)
    op = record.op + 20.0 * (np.arange(N) >= 303)  # moved by hand within a stretch of five
    other = "op" if name == "pv" else "pv"
    signals = {"op": op, "pv": record.pv.copy()}
    signals[other][101] = np.nan
    auto = np.ones(N, dtype=bool)
    auto[411:418] = False
    found = getattr(restored(held(replace(record, **signals, auto=auto), name, 5), name.upper(), FIFTH), name)
    lost = [101, 102, 103, 104, 301, 302, 303, 304, 411, 412, 413, 414, 416, 417, 418, 419]
    assert np.flatnonzero(np.isnan(found)).tolist() == sorted({*range(101, 105), *lost})
    told = np.isfinite(found)
    np.testing.assert_allclose(found[told], signals[name][told], atol=1e-5)


def test_an_op_at_its_limit_stays_there():
    record = by_law(5)
    op = record.op.copy()
    top = op.max() + 1.0
    op[200:240] = top
    op[240:] += top - op[240]
    op = np.minimum(op, top)
    found = restored(held(replace(record, op=op), "op", 5), "OP", FIFTH)
    np.testing.assert_array_equal(found.op[200:236], top)


@pytest.mark.parametrize("name", ["op", "pv"])
def test_signals_that_no_law_joins_are_left(name):
    rng = np.random.default_rng(6)
    record = LoopRecord("FIC-101", 1.0, op=np.cumsum(rng.normal(size=N)), pv=np.cumsum(rng.normal(size=N)))
    assert restored(held(record, name, 5), name.upper(), FIFTH) is None
    short = by_law(7).window(0, 140)
    assert restored(held(short, name, 5), name.upper(), FIFTH[:20]) is None


@pytest.mark.parametrize("name", ["op", "pv"])
def test_what_a_swinging_door_left_out_comes_back(name):
    record = by_law(8, moving=3.0)
    slow = replace(record, **{name: getattr(swinging_door(record, 0.3), name)})
    told = unevenly_stored(slow.op, slow.pv)
    assert told is not None
    assert told[0] == name.upper()
    assert told[1].size < N / 3
    right = getattr(record, name)
    np.testing.assert_allclose(getattr(restored(slow, *told), name), right, atol=1e-5 * np.ptp(right))


def test_what_an_exception_left_out_of_the_pv_comes_back():
    record = by_law(9)
    slow = replace(record, pv=exception_reported(record, 0.5).pv)
    told = unevenly_stored(slow.op, slow.pv)
    assert told is not None
    assert told[1].size < N / 2
    np.testing.assert_allclose(restored(slow, *told).pv, record.pv, atol=1e-5 * np.ptp(record.pv))
    begin = int(told[1][:-1][np.diff(told[1]) >= 4][0]) + 1
    begun = slow.window(begin, N)
    name, at = unevenly_stored(begun.op, begun.pv)
    found = restored(begun, name, at)
    assert np.isnan(found.pv[1 : at[1]]).all()  # the first value is older than the record
    np.testing.assert_allclose(found.pv[at[1] :], record.pv[begin + at[1] :], atol=1e-5 * np.ptp(record.pv))


def acting(pv, every=1):
    """OP of a PI controller that looks at this PV every so-manyth sample and holds its OP."""
    error = 50.0 - pv[::every]
    op = 40.0 + 0.5 * (error - error[0]) + 0.1 * np.cumsum(error)
    return LoopRecord("FIC-101", 1.0, op=np.repeat(op, every)[: pv.size], pv=pv, sp=np.full(pv.size, 50.0))


def test_a_controller_that_holds_its_op_is_no_historian():
    record = acting(by_law(10).pv, every=5)
    assert slower(record)[0] == "OP"
    assert restored(record, *slower(record)) is None


def test_a_pv_that_the_controller_saw_held_stays_so():
    record = acting(held(by_law(11), "pv", 5).pv)
    assert restored(record, *slower(record)) is None
    rounded = replace(record, op=np.round(record.op, 2))
    assert restored(rounded, *slower(rounded)) is None
