"""The record itself: what it keeps, what a cut of it says of itself, and when two are the same."""

from __future__ import annotations

import dataclasses
import pickle
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import stiction as st
from stiction.errors import RecordError
from stiction.records import LoopRecord, Provenance, assess_quality, summarise
from stiction.records.conditioned import condition

pytestmark = pytest.mark.quick

N = 2000
NOON = datetime(2026, 3, 2, 12, 0, tzinfo=UTC)
SIGNALS = ("op", "pv", "sp", "mv", "valve_signal", "auto")


def loop(**changes):
    k = np.arange(float(N))
    signals = {"op": 50 + 5 * np.sin(k / 9), "pv": 200 + 3 * np.cos(k / 9), "sp": np.full(N, 200.0)}
    signals |= {"mv": signals["op"] + 1.0, "valve_signal": signals["op"] - 1.0, "auto": k > 5}
    return LoopRecord(**{"tag": "FIC-1", "dt": 2.5, "loop_type": "flow", "start": NOON, **signals, **changes})


@given(some.integers(-N - 9, N + 9), some.integers(-N - 9, N + 9))
def test_a_cut_is_the_slice_with_its_own_time(first, last):
    whole = loop()
    part = whole.window(first, last)
    for name in SIGNALS:
        kept = getattr(part, name)
        assert np.array_equal(kept if kept is not None else [], getattr(whole, name)[first:last])
    if len(part):
        place = range(N)[first:last][0]
        assert part.start == NOON + timedelta(seconds=2.5 * place)
        assert part.time[0] + (part.start - NOON).total_seconds() == whole.time[place]


def test_cuts_of_cuts_are_cuts():
    whole = loop(provenance=Provenance(held_samples=N // 2))
    assert whole.window(300, 1500).window(100, 500) == whole.window(400, 800)
    assert whole.window(0, N) == whole
    assert loop(start=None).window(7, 90).start is None


def test_a_cut_counts_its_own_missing_samples():
    whole = loop()
    op, pv = whole.op.copy(), whole.pv.copy()
    op[100:110] = np.nan
    pv[105:120] = np.nan
    whole = replace(whole, op=op, pv=pv, provenance=Provenance(missing_samples=20, rows=N))
    parts = [whole.window(*span) for span in ((0, 100), (0, 115), (108, 1000), (120, N))]
    assert [part.provenance.missing_samples for part in parts] == [0, 15, 12, 0]
    percents = [line.record.missing_percent for line in summarise(parts).loops]
    assert percents == pytest.approx([0, 1500 / 115, 1200 / 892, 0])
    assert replace(whole, pv=None).window(108, 1000).provenance.missing_samples == 2
    assert condition(replace(whole, auto=None)).part.provenance.missing_samples == 20


def test_a_cut_takes_its_part_of_what_was_made_up():
    """400 of 2000 samples are a fifth of any part, not eight in nine of 450."""
    whole = loop(provenance=Provenance(held_samples=400, rows=N, clock_jumps=3))
    for part in (whole, whole.window(0, 450), whole.window(450, 900).window(0, 100)):
        [check] = [check for check in assess_quality(part).checks if check.name == "resampled"]
        assert (check.severity, check.value) == ("ok", pytest.approx(20.0))
        assert part.provenance.clock_jumps == 3
    assert whole.window(5, 5).provenance.held_samples == 0


@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(LoopRecord)])
def test_records_that_differ_in_one_field_differ(name):
    other = {
        "tag": "FIC-2", "dt": 2.6, "loop_type": "level", "integrating": True, "start": NOON + timedelta(seconds=1),
        "provenance": Provenance("a.csv"), "auto": np.zeros(N, dtype=bool), "other_readings": (loop(),),
    }  # fmt: skip
    changed = other[name] if name in other else np.append(getattr(loop(), name)[1:], 7.0)
    assert replace(loop(), **{name: changed}) != loop()
    if name in ("pv", "sp", "mv", "valve_signal", "auto", "start"):
        without = replace(loop(), **{name: None})
        assert without != loop()
        assert loop() != without
        assert without == replace(loop(), **{name: None})


def test_equal_records_are_equal_in_every_way():
    gap = np.where(np.arange(N) == 50, np.nan, loop().pv)
    one, two = loop(pv=gap), loop(pv=gap.copy())
    assert one == two
    assert hash(one) == hash(two)
    assert one in [loop(), two]
    assert len({one, two, loop(), loop(tag="FIC-2")}) == 3
    assert pickle.loads(pickle.dumps(one)) == one
    assert one != "FIC-1"


def test_a_long_run_is_not_held_twice_and_what_was_given_is_not_changed():
    op, pv = np.arange(5.0), np.array([1.0, np.inf, 1e300, -1e300, 5.0])
    record = LoopRecord("FIC-1", 1.0, op=op, pv=pv)
    assert record.op is op
    assert np.isnan(record.pv).tolist() == [False, True, True, True, False]
    assert np.isfinite(pv).tolist() == [True, False, True, True, True]


def test_a_mode_is_known_or_left_out():
    with pytest.raises(RecordError, match=r"auto has 1 missing values; .* leave auto out"):
        LoopRecord("FIC-1", 1.0, op=[1.0, 2.0, 3.0], auto=[1.0, np.nan, 0.0])
    assert LoopRecord("FIC-1", 1.0, op=[1.0, 2.0], auto=[1, 0]).auto.tolist() == [True, False]


@pytest.mark.parametrize("name", ["sp", "mv", "valve_signal"])
@pytest.mark.parametrize("nothing", [np.nan, np.inf])
def test_a_signal_without_a_value_was_not_recorded(name, nothing):
    assert getattr(loop(**{name: np.full(N, nothing)}), name) is None
    some_values = np.where(np.arange(N) < 10, 200.0, np.nan)
    record = loop(**{name: some_values})
    assert np.array_equal(getattr(record, name), some_values, equal_nan=True)
    assert getattr(record.window(10, N), name) is None
    assert loop(pv=np.full(N, np.nan)).pv is not None


def test_a_set_point_without_a_value_is_none_to_every_function():
    plant = st.Loop(st.PID(0.4, 5.0), st.Kano(5.0, 3.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    run = st.simulate(plant, 70.0, 900.0, 6.0, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow")
    without = replace(run, mv=None, sp=None)
    empty = replace(without, sp=np.full(len(run), np.nan))
    assert empty == without
    assert st.identify(empty).S == st.identify(without).S


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.finfo(float).max, -1.1e100])
def test_no_measurement_is_that_large(value):
    record = LoopRecord("FIC-1", 1.0, op=[1.0, value, 3.0], pv=[1.0, 2.0, 9e99])
    assert np.isnan(record.op).tolist() == [False, True, False]
    assert record.pv[2] == 9e99


@pytest.mark.parametrize("values", [[1.0, 2.0, 999.0], [1, 2, 999]])
def test_what_a_mask_hides_is_missing(values):
    hidden = np.ma.masked_greater(values, 100)
    record = LoopRecord("FIC-1", 1.0, op=hidden, pv=hidden)
    for signal in (record.op, record.pv):
        assert np.array_equal(signal, [1.0, 2.0, np.nan], equal_nan=True)
    assert hidden.data.tolist() == values


@pytest.mark.parametrize("values", [np.array([1.0 + 2.0j, 2.0]), [1.0 + 2.0j, 2.0], [10**400, 1]])
def test_what_is_no_real_number_is_refused(values):
    with pytest.raises(RecordError, match="op is not a series of numbers"):
        LoopRecord("FIC-1", 1.0, op=values)


@pytest.mark.parametrize(("dt", "message"), [(10**400, "beyond"), (np.complex128(1 + 1j), "must be a number in s")])
def test_a_period_that_is_no_number_of_that_size_is_refused(dt, message):
    with pytest.raises(st.ParameterError, match=f"dt .*{message}"):
        LoopRecord("FIC-1", dt, op=[1.0])


def test_concentration_is_accepted_and_stored_as_analyser():
    assert loop(loop_type="concentration") == loop(loop_type="analyser")
    assert loop(loop_type="concentration").loop_type == "analyser"
    with pytest.raises(st.ParameterError, match=r"loop_type 'quality' is unknown.*flow, level"):
        loop(loop_type="quality")
