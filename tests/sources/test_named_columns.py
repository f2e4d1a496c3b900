"""Columns that the user names beside those that are guessed, units in a row of their own, and flags of one signal."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.errors import RecordError
from stiction.records import assess_quality


@pytest.fixture(scope="module")
def double(signals, table):
    """A loop with two controller outputs, the first half of it in automatic."""
    t, pv, op, sp = signals
    mode = ["AUTO" if k < len(t) / 2 else "MAN" for k in range(len(t))]
    return table("time_s,FIC-1.PV,FIC-1.SP,FIC-1.OP,FIC-1.MODE,FIC-1.OUT", t, pv, sp, op, mode, op + 7.0)


def test_one_column_named_leaves_the_others_guessed(signals, double, read_text):
    _, pv, op, sp = signals
    with pytest.raises(RecordError, match=r"'FIC-1.OP' and 'FIC-1.OUT' are both the OP"):
        read_text(double)
    [record] = read_text(double, columns={"op": "FIC-1.OUT"})
    assert (record.tag, record.loop_type) == ("FIC-1", "flow")
    np.testing.assert_array_equal(record.op, op + 7.0)
    np.testing.assert_array_equal(record.pv, pv)
    np.testing.assert_array_equal(record.sp, sp)
    assert record.auto.tolist() == [True] * (len(op) // 2) + [False] * (len(op) - len(op) // 2)


def test_a_time_column_named_leaves_all_loops(signals, table, read_text):
    t, pv, op, _ = signals
    text = table("when,FIC-1.PV,FIC-1.OP,LIC-2.PV,LIC-2.OP", t, pv, op, pv, op)
    assert [one.tag for one in read_text(text, columns={"time": "when"})] == ["FIC-1", "LIC-2"]
    assert [one.tag for one in read_text(text, columns={"time": "when", "op": "LIC-2.OP"})] == ["LIC-2"]


def test_names_that_say_nothing_join_the_only_loop(signals, table, read_text):
    t, pv, op, sp = signals
    [record] = read_text(table("time_s,Flow,Set point,Steam", t, pv, sp, op), columns={"pv": "Flow", "op": "Steam"})
    np.testing.assert_array_equal(record.sp, sp)


def test_columns_of_two_loops_make_one_of_their_own(signals, table, read_text):
    t, pv, op, sp = signals
    text = table("time_s,FIC-1.PV,FIC-1.SP,FIC-1.OP,LIC-2.PV,LIC-2.OP", t, pv, sp, op, 2 * pv, op)
    [record] = read_text(text, columns={"pv": "LIC-2.PV", "op": "FIC-1.OP"})
    assert record.sp is None
    np.testing.assert_array_equal(record.pv, 2 * pv)
    assert record.provenance.unused_columns == ("FIC-1.PV", "FIC-1.SP", "LIC-2.OP")


def test_columns_of_one_loop_and_the_tag_of_another_are_refused(signals, table, read_text):
    t, pv, op, _ = signals
    text = table("time_s,FIC-1.PV,FIC-1.OP,LIC-2.PV,LIC-2.OP", t, pv, op, 2 * pv, op)
    [record] = read_text(text, columns={"op": "FIC-1.OP"}, tag="fic-1")
    assert record.provenance.unused_columns == ("LIC-2.PV", "LIC-2.OP")
    says = r"columns assigns columns of the loop FIC-1, but tag asks for the loop LIC-2; leave one of them out"
    with pytest.raises(RecordError, match=says):
        read_text(text, columns={"op": "FIC-1.OP"}, tag="LIC-2")
    with pytest.raises(RecordError, match="has no loop 'X'; its loops are FIC-1, LIC-2"):
        read_text(text, columns={"time": "time_s"}, tag="X")


def test_a_source_without_op_says_so(signals, table, read_text):
    t, pv, op, _ = signals
    with pytest.raises(RecordError, match=r"no loop with OP and PV .* the controller output OP is missing: export it"):
        read_text(table("time_s,FIC-1.SP,FIC-1.PV", t, op, pv))


def test_mv_beside_a_valve_position_is_the_output(signals, table, read_text):
    t, pv, op, sp = signals
    [record] = read_text(table("time_s,PV,SV,MV,Valve position", t, pv, sp, op, op - 1.0))
    np.testing.assert_array_equal(record.op, op)
    np.testing.assert_array_equal(record.mv, op - 1.0)
    assert any("taken as the controller output" in guess for guess in record.provenance.assumptions)


@pytest.mark.parametrize("units", [",t/h,t/h,mA", "dd.mm.yyyy hh:mm:ss,t/h,t/h,mA", "s,t/h,t/h,MA"])
def test_milliamperes_in_a_row_of_units(signals, table, read_text, units):
    t, pv, op, sp = signals
    [record] = read_text(table(["Time,FIC-1.PV,FIC-1.SP,FIC-1.OP", units], t, pv, sp, 4.0 + 0.16 * op))
    np.testing.assert_allclose(record.op, op, atol=1e-9)
    assert record.provenance.pv_unit == "t/h"


@pytest.mark.parametrize(
    "header",
    [
        "time_s,FIC-1.PV,FIC-1.PV Quality,FIC-1.OP,FIC-1.OP Quality",
        "time_s,FIC-1.PV,FIC-1.PV.Status,FIC-1.OP,FIC-1.OP.Status",
        "time_s,FIC-1.PV.Value,FIC-1.PV.Quality,FIC-1.OP.Value,FIC-1.OP.Quality",
        "time_s,FIC-1.PV,Quality,FIC-1.OP,Quality",
        "time_s,PV,Status,OP,Status",
    ],
)
@pytest.mark.parametrize("codes", [("Good", "Bad"), ("192", "0"), ("0xC0", "0x18"), ("OK", "Invalid")])
def test_the_quality_of_one_signal_is_that_signals(signals, table, read_text, header, codes):
    t, pv, op, _ = signals
    bad = np.arange(len(t)) % 20 == 3
    quality = [codes[k] for k in bad.astype(int)]
    [record] = read_text(table(header, t, np.where(bad, 0.0, pv), quality, op, [codes[0]] * len(t)))
    np.testing.assert_array_equal(record.pv, np.where(bad, np.nan, pv))
    np.testing.assert_array_equal(record.op, op)
    assert f"{bad.sum()} values of {header.split(',')[1]}, flagged as bad" in " ".join(record.provenance.assumptions)


@pytest.mark.parametrize(("good", "bad"), [("128", "64"), ("0", "2150694912"), ("100", "0"), ("VALID", "INVALID")])
def test_good_in_other_codes(signals, table, read_text, good, bad):
    t, pv, op, _ = signals
    [record] = read_text(table("time_s,PV,OP,Quality", t, pv, op, [bad if k == 5 else good for k in range(len(t))]))
    assert np.flatnonzero(np.isnan(record.pv)).tolist() == [5]
    is_told = any(f"{good} is good, {bad} is not" in note for note in record.provenance.assumptions)
    assert is_told == good.isdigit()


def test_a_status_that_is_no_quality_is_not_used(signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table("time_s,PV,OP,Status", t, pv, op, ["RUN" if k % 2 else "STOP" for k in range(len(t))]))
    assert np.isfinite(record.op).all()
    assert any("is not known as good or bad" in guess for guess in record.provenance.assumptions)


def test_nothing_but_bad_rows(signals, table, read_text):
    t, pv, op, _ = signals
    with pytest.raises(RecordError, match=r"all values of OP are flagged as bad"):
        read_text(table("time_s,PV,OP,Quality", t, pv, op, ["Bad"] * len(t)))


def test_a_column_of_a_control_block_is_named_by_its_whole_name(signals, table, read_text):
    t, pv, op, _ = signals
    names = "FIC101/PID1/PV.CV,FIC101/PID1/OUT.CV,FIC102/PID1/PV.CV,FIC102/PID1/OUT.CV"
    [record] = read_text(table(f"time_s,{names}", t, pv, op, pv, op), columns={"op": "FIC102/PID1/OUT.CV"})
    assert (record.tag, record.loop_type) == ("FIC102", "flow")
    np.testing.assert_array_equal(record.op, op)


@pytest.mark.parametrize("unit", ["V", "mm", "t/h"])
def test_an_op_in_another_unit_than_percent_is_reported(unit, signals, table, read_text):
    t, pv, op, _ = signals
    text = table(f"time_s,FIC-1.PV [t/h],FIC-1.OP [{unit}]", t, pv, 3.0 + 0.12 * op)
    [record] = read_text(text)
    assert any(f"OP is given in {unit}: it is not converted" in guess for guess in record.provenance.assumptions)
    assert (record.op_unit, record.provenance.op_unit) == (unit, unit)
    [gate] = [gate for gate in assess_quality(record).checks if gate.name == "op scale"]
    assert (
        gate.severity,
        f"in {unit} (according to its header): S and J are in its unit, not in % of span" in gate.why,
    ) == ("warn", True)
    [record] = read_text(text, op_range=(3.0, 15.0))
    assert record.op_unit == "% of span"
    assert not any("OP is given in" in guess for guess in record.provenance.assumptions)
    np.testing.assert_allclose(record.op, op, atol=1e-3)


def test_an_op_in_milliamperes_below_four_is_no_percentage(signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table("time_s,FIC-1.PV,FIC-1.OP [mA]", t, pv, 0.05 * op))
    assert record.op_unit == "mA"
    [record] = read_text(table("time_s,FIC-1.PV,FIC-1.OP [mA]", t, pv, 4.0 + 0.16 * op))
    assert record.op_unit == "% of span"


@pytest.mark.parametrize(("unit", "low", "high"), [("bar", 0.2, 1.0), ("psi", 3.0, 15.0), ("kPa", 20.0, 100.0)])
def test_an_op_in_a_pneumatic_signal_is_converted(unit, low, high, signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table(f"time_s,FIC-1.PV [t/h],FIC-1.OP [{unit}]", t, pv, low + (high - low) / 100.0 * op))
    np.testing.assert_allclose(record.op, op, rtol=1e-9)
    [note] = [note for note in record.provenance.assumptions if note.startswith("OP is given in")]
    assert f"{low:g} {unit} are taken as 0 % and {high:g} {unit} as 100 %" in note
