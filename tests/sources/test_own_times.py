"""Signals that are not stored at the same times, in the forms that exports take, against the values written there."""

from __future__ import annotations

import io
from datetime import datetime, timedelta

import numpy as np
import pytest

from stiction.errors import RecordError
from stiction.sources.read import read

START = datetime(2026, 2, 1, 10)


def stamp(seconds: float) -> str:
    return (START + timedelta(seconds=seconds)).isoformat(" ")


def pairs(t, pv, op, late=0, header="Time,FIC-1.PV,Time,FIC-1.OP"):
    """A time column for each tag, as PI DataLink has it; OP begins `late` rows late and lacks each tenth value."""
    left = [f"{stamp(s)},{x}" for s, x in zip(t, pv, strict=True)]
    right = [f"{stamp(s)},{x}" for s, x in zip(t[late:], op[late:], strict=True) if s % 10 != 5]
    return "\n".join(
        [header, *(f"{a},{b}" for a, b in zip(left, right + [","] * (len(left) - len(right)), strict=True))]
    )


@pytest.mark.parametrize("late", [0, 20])
def test_each_time_column_is_that_of_the_signals_behind_it(signals, read_text, late):
    t, pv, op, _ = signals
    [record] = read_text(pairs(t, pv, op, late))
    assert (record.tag, record.dt, record.start, len(record)) == ("FIC-1", 1.0, START, len(t))
    np.testing.assert_array_equal(record.pv, pv)
    stands = np.where(t % 10 == 5, np.roll(op, 1), op)
    np.testing.assert_array_equal(record.op[late:], stands[late:])
    assert np.isnan(record.op[:late]).all()


def test_tags_over_time_and_value(signals, read_text):
    t, pv, op, _ = signals
    header = "FIC-1.PV,,FIC-1.OP,\nTimestamp,Value,Timestamp,Value"
    [record] = read_text(pairs(t, pv, op, header=header))
    assert (record.tag, len(record)) == ("FIC-1", len(t))
    np.testing.assert_array_equal(record.pv, pv)


@pytest.mark.parametrize("hours", [0, 2])
def test_time_columns_that_say_the_same_are_one(signals, table, read_text, hours):
    t, pv, op, _ = signals
    other = [stamp(s + 3600 * hours) for s in t]
    [record] = read_text(table("Time,PV,Local time,OP", [stamp(s) for s in t], pv, other, op))
    assert (record.start, record.provenance.held_samples) == (START, 0)
    np.testing.assert_array_equal(record.op, op)
    assert any("the first is used" in guess for guess in record.provenance.assumptions)


def test_a_row_for_each_stored_value_of_a_wide_table(signals, read_text):
    t, pv, op, _ = signals
    lines = [f"{stamp(s)}.000,{x},\n{stamp(s)}.400,,{y}" for s, x, y in zip(t, pv, op, strict=True)]
    [record] = read_text("\n".join(["Time,FIC-1.PV,FIC-1.OP", *lines]))
    assert (record.dt, len(record)) == (1.0, len(t))
    np.testing.assert_array_equal(record.pv, pv)
    np.testing.assert_array_equal(record.op[1:], op[:-1])


def test_an_op_that_is_stored_in_every_fifth_row(signals, read_text):
    t, pv, op, _ = signals
    lines = [f"{stamp(s)},{x},{y if s % 5 == 0 else ''}" for s, x, y in zip(t, pv, op, strict=True)]
    [record] = read_text("\n".join(["Time,PV,OP", *lines]))
    np.testing.assert_array_equal(record.op, op[(t // 5 * 5).astype(int)])
    assert record.provenance.held_samples == pytest.approx(0.8 * len(t), abs=1)


def test_a_long_gap_of_op_is_a_gap(signals, read_text):
    t, pv, op, _ = signals
    lines = [f"{stamp(s)},{x},{'' if 10 <= s < 90 else y}" for s, x, y in zip(t, pv, op, strict=True)]
    [record] = read_text("\n".join(["Time,PV,OP", *lines]))
    assert np.isnan(record.op).sum() == 80


def test_a_value_stands_over_moments_at_which_nothing_was_stored(read_text):
    lines = ["Tag,Time,Value"]
    for s in (0, 1, 2, 3, 7, 8, 9, 12, 13, 14, 15, 16):
        lines += [f"FIC-1.PV,{stamp(s)},{100 + s}", f"FIC-1.OP,{stamp(s)},{20 + s}"]
    [record] = read_text("\n".join(lines))
    assert record.op.tolist() == [20 + s for s in (0, 1, 2, 3, 3, 3, 3, 7, 8, 9, 9, 9, 12, 13, 14, 15, 16)]
    assert record.provenance.held_samples == 5


@pytest.mark.parametrize(
    "header", ["NAME,TS,VALUE,STATUS", "Point Parameter,Time Stamp,Value,State", "what,when,how much,how"]
)
def test_long_tables_by_other_names_and_by_what_they_hold(signals, read_text, header):
    t, pv, op, _ = signals
    lines = [header]
    for s, x, y in zip(t, pv, op, strict=True):
        lines += [f"FIC-1.PV,{stamp(s)},{x},Good", f"FIC-1.OP,{stamp(s)},{y},Good"]
    [record] = read_text("\n".join(lines))
    assert (record.tag, record.dt) == ("FIC-1", 1.0)
    np.testing.assert_array_equal(record.pv, pv)
    np.testing.assert_array_equal(record.op, op)


def test_a_long_table_with_date_and_time_of_day(signals, read_text):
    t, pv, op, _ = signals
    lines = ["Tag,Date,Time,Value"]
    for s, x, y in zip(t, pv, op, strict=True):
        lines += [f"FIC-1.{name},{stamp(864 * s).replace(' ', ',')},{value}" for name, value in (("PV", x), ("OP", y))]
    [record] = read_text("\n".join(lines))
    assert (record.dt, len(record)) == (864.0, len(t))
    np.testing.assert_array_equal(record.op, op)


def test_loops_under_one_another(signals, read_text):
    t, pv, op, sp = signals
    lines = ["Tag,Time,PV,SP,OP"]
    for s, x, y, z in zip(t, pv, op, sp, strict=True):
        lines += [f"FIC-1,{stamp(s)},{x},{z},{y}", f"LIC-2,{stamp(s)},{2 * x},{z},{y / 2}"]
    text = "\n".join(lines)
    flow, level = read_text(text)
    assert [(one.tag, one.loop_type, one.dt) for one in (flow, level)] == [
        ("FIC-1", "flow", 1.0),
        ("LIC-2", "level", 1.0),
    ]
    np.testing.assert_array_equal(flow.pv, pv)
    np.testing.assert_array_equal(level.pv, 2 * pv)
    assert [one.tag for one in read_text(text, tag="lic-2")] == ["LIC-2"]
    with pytest.raises(RecordError, match="has no loop 'X'; its loops are FIC-1, LIC-2"):
        read_text(text, tag="X")


def test_an_export_pasted_twice_is_no_faster_record(signals, table, read_text):
    t, pv, op, _ = signals
    text = table("Time,PV,OP", [stamp(s) for s in t], pv, op)
    [record] = read_text(text + text.partition("\n")[2])
    assert (record.dt, len(record)) == (1.0, len(t))
    np.testing.assert_array_equal(record.op, op)
    assert any("with the same time stamp as the next" in guess for guess in record.provenance.assumptions)


def test_an_hour_back_in_february_is_no_end_of_summer_time(signals, table, read_text):
    t, pv, op, _ = signals
    stamps = [stamp(30 * s) for s in t]
    text = table("Time,PV,OP", stamps, pv, op) + table("Time,PV,OP", stamps, pv, op).partition("\n")[2]
    [record] = read_text(text)
    assert not any("summer" in guess for guess in record.provenance.assumptions)
    assert len(record) == len(t)


def test_columns_named_by_the_user_in_a_long_table(signals, read_text):
    t, pv, op, _ = signals
    lines = ["Tag,when,Value"]
    for s, x, y in zip(t, pv, op, strict=True):
        lines += [f"flow,{stamp(s)},{x}", f"steam,{stamp(s)},{y}"]
    [record] = read_text("\n".join(lines), columns={"time": "when", "pv": "flow", "op": "steam"})
    np.testing.assert_array_equal(record.pv, pv)
    np.testing.assert_array_equal(record.op, op)


def _doubled(values):
    rows = [
        f"{role},2026-02-01 10:{k // 120:02}:{k // 2 % 60:02},{value}" for k in range(600) for role, value in values(k)
    ]
    return io.BytesIO("\n".join(["tag,time,value", *rows]).encode())


def test_series_of_two_loops_under_one_name_are_refused_and_not_spread_over_the_second():
    def values(k):
        return [("FIC1.PV", 150 - 70 * (k % 2) + k % 5), ("FIC1.OP", 50 + k % 7)]

    with pytest.raises(RecordError, match=r"FIC1\.PV has values of several levels at each time"):
        read(_doubled(values))


def test_two_samples_of_one_loop_at_each_stamp_are_spread():
    noise = np.random.default_rng(3).normal(size=1200)
    [record] = read(_doubled(lambda k: [("FIC1.PV", 50 + noise[k]), ("FIC1.OP", 50 + noise[-k])]))
    assert record.dt == 0.5
