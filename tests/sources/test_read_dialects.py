"""Header and tag dialects, against columns written by hand."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.errors import ParameterError, RecordError
from stiction.sources import read
from stiction.sources.roles.column_names import parse_column_name, unit_in_name

HEADERS = {
    "suffixes": ("Time,FIC-101.PV,FIC-101.OP,FIC-101.SP", "FIC-101"),
    "lower case": ("time,fic-101.pv,fic-101.op,fic-101.sp", "fic-101"),
    "DeltaV": ("Time,FIC-101/PID1/PV.CV,FIC-101/PID1/OUT.CV,FIC-101/PID1/SP.CV", "FIC-101"),
    "CENTUM": ("Time,FIC101.PV,FIC101.MV,FIC101.SV", "FIC101"),
    "I/A": ("Time,12-FC-135A.MEAS,12-FC-135A.OUT,12-FC-135A.SPT", "12-FC-135A"),
    "underscores": ("Timestamp,FIC_101_PV,FIC_101_CO,FIC_101_SP", "FIC_101"),
    "blanks": ("Date Time,FIC-101 PV,FIC-101 Output,FIC-101 Setpoint", "FIC-101"),
    "server path": (r"Time,\\srv\FIC-101.PV,\\srv\FIC-101.OP,\\srv\FIC-101.SP", "FIC-101"),
    "signal first": ("Time,PV_FIC101,OP_FIC101,SP_FIC101", "FIC101"),
    "units in brackets": ("Time [s],FIC-101.PV [t/h],FIC-101.OP (%),FIC-101.SP [t/h]", "FIC-101"),
    "quotes": ('"Time","FIC-101.PV","FIC-101.OP","FIC-101.SP"', "FIC-101"),
    "plain": ("time_s,PV,CO,SP", "stream"),
    "words": ("Time,Process variable,Controller output,Set point", "stream"),
    "German": ("Zeit,Istwert,Stellgröße,Sollwert", "stream"),
    "French": ("Horodatage,Mesure,Sortie,Consigne", "stream"),
    "French behind a tag": ("Heure,FIC-101 Mesure,FIC-101 Sortie,FIC-101 Consigne", "FIC-101"),
    "PCS 7 APL": ("Zeit,FIC-101/PV#Value,FIC-101/MV#Value,FIC-101/SP#Value", "FIC-101"),
    "800xA": ('Time,"FIC-101,Value","FIC-101,Out","FIC-101,WSP"', "FIC-101"),
    "Rockwell PID": ("Date,FIC101.PV,FIC101.CV,FIC101.SP", "FIC101"),
    "words with underscores": ("Time,FC101_PROCESS_VALUE,FC101_CONTROLLER_OUTPUT,FC101_SETPOINT", "FC101"),
    "German behind a tag": ("Zeit,FIC101 Istwert,FIC101 Stellwert,FIC101 Sollwert", "FIC101"),
    "Experion": ("Time,FIC101.DACA.PV,FIC101.PIDA.OP,FIC101.PIDA.SP", "FIC101"),
    "DeltaV, fields": ("Time,FIC101/PV.F_CV,FIC101/OUT.F_CV,FIC101/SP.F_CV", "FIC101"),
    "PCS 7 APL, outputs": ("Zeit,FIC101.PV_Out,FIC101.MV,FIC101.SP", "FIC101"),
    "Spanish": ("Fecha,FIC101 Variable de proceso,FIC101 Salida,FIC101 Consigna", "FIC101"),
    "Italian": ("Time,FIC101 Misura,FIC101 Uscita,FIC101 Setpoint", "FIC101"),
    "Portuguese": ("Time,FIC101 Variável de processo,FIC101 Saída,FIC101 Setpoint", "FIC101"),
    "Swedish": ("Time,FIC101 Ärvärde,FIC101 Styrsignal,FIC101 Börvärde", "FIC101"),
    "Finnish": ("Time,FIC101 Mittaus,FIC101 Ohjaus,FIC101 Asetusarvo", "FIC101"),
    "Actual": ("Time,Actual,Output %,Setpoint", "stream"),
    "German, of a compact controller": ("Zeit,Istwert,Stellgrad %,Sollwert", "stream"),
}


@pytest.mark.parametrize("dialect", HEADERS)
def test_header_dialects(dialect, signals, table, read_text):
    header, tag = HEADERS[dialect]
    t, pv, op, sp = signals
    [record] = read_text(table(header, t, pv, op, sp))
    assert record.tag == tag
    assert record.dt == 1.0
    np.testing.assert_array_equal(record.pv, pv)
    np.testing.assert_array_equal(record.op, op)
    np.testing.assert_array_equal(record.sp, sp)
    assert record.mv is None


@pytest.mark.parametrize(
    ("tag", "loop_type"),
    [
        ("FIC-101", "flow"),
        ("2111LIC23001", "level"),
        ("2111FIC40102C", "flow"),
        ("RHT342-FIC11502", "flow"),
        ("12-PC-135A", "pressure"),
        ("PDIC7", "pressure"),
        ("TRC_4", "temperature"),
        ("2411AIC90201", "analyser"),
        ("CHEM1", "other"),
        ("PAP2", "other"),
        ("boiler", "other"),
    ],
)
def test_loop_type_from_the_first_letter(tag, loop_type, signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table(f"time_s,{tag}.PV,{tag}.OP", t, pv, op))
    assert (record.tag, record.loop_type) == (tag, loop_type)


def test_mv_is_the_position_beside_an_op(signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table("time_s,PV,OP,MV,FLOW", t, pv, op, op - 1.0, pv * 2))
    np.testing.assert_array_equal(record.mv, op - 1.0)
    assert set(record.provenance.columns) == {"pv", "op", "mv"}


@pytest.mark.parametrize("header", ["Time,FIC101.X,FIC101.Y,FIC101.W", "Time,FIC101.Actual,FIC101.Mode,FIC101.SP"])
def test_what_may_be_another_signal_is_asked_for(header, signals, table, read_text):
    t, pv, op, sp = signals
    with pytest.raises(RecordError, match="assign the columns with"):
        read_text(table(header, t, pv, op, sp))


def test_the_controller_block_keeps_its_own_pv(signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table("Time,FIC1.DACA.PV,FIC1.PIDA.PV,FIC1.PIDA.OP", t, pv + 1.0, pv, op))
    assert record.tag == "FIC1"
    np.testing.assert_array_equal(record.pv, pv)


def test_a_position_in_the_place_of_the_pv_is_reported(signals, table, read_text):
    # ABB calls the measured value MV.
    t, pv, op, sp = signals
    [record] = read_text(table("Time,FIC101.MV,FIC101.OUT,FIC101.SP", t, pv, op, sp))
    assert any("measured value" in guess and "'pv': 'FIC101.MV'" in guess for guess in record.provenance.assumptions)


def test_mv_alone_is_the_output_and_said_so(signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table("time_s,PV,MV", t, pv, op))
    np.testing.assert_array_equal(record.op, op)
    assert any("MV" in guess and "controller output" in guess for guess in record.provenance.assumptions)


def test_a_word_of_several_meanings_counts_where_there_is_no_plainer_one(signals, table, read_text):
    t, pv, op, sp = signals
    [record] = read_text(table("Time,FIC-1.PV,FIC-1.CV,FIC-1.OP,FIC-1.WSP,FIC-1.SP", t, pv, sp, op, pv, sp))
    np.testing.assert_array_equal(record.op, op)
    np.testing.assert_array_equal(record.sp, sp)
    # The controlled variable of others is no output: beside MV, and where there is no PV.
    [record] = read_text(table("Time,FIC-1.PV,FIC-1.CV,FIC-1.MV", t, pv, sp, op))
    np.testing.assert_array_equal(record.op, op)
    with pytest.raises(RecordError, match="no loop with OP and PV"):
        read_text(table("Time,FIC-1.CV,FIC-1.MV,FIC-1.SP", t, pv, op, sp))
    [record] = read_text(table("Time,FIC-1.PV,FIC-1.CV", t, pv, op))
    assert any("FIC-1.CV is taken as the controller output" in guess for guess in record.provenance.assumptions)


def test_a_measured_value_taken_for_the_position_is_named_in_the_refusal(signals, table, read_text):
    t, pv, op, _ = signals
    text = table("Time,FIC-1:MV [bar],FIC-1:OUT", t, pv, op)
    [record] = read_text(text)
    with pytest.raises(
        RecordError, match=r"no PV; .*FIC-1:MV \[bar\] was taken as the valve position; if it is the PV"
    ):
        st.diagnose(record)
    [record] = read_text(text, columns={"pv": "FIC-1:MV [bar]"})
    np.testing.assert_array_equal(record.pv, pv)


@pytest.mark.parametrize(
    ("unit", "low", "in_doubt"), [("", 4.5, True), ("", 2.0, False), ("", 30.0, False), (" [%]", 4.5, False)]
)
def test_an_op_that_may_be_in_milliamperes_is_left_as_it_is(unit, low, in_doubt, signals, table, read_text):
    t, pv, op, _ = signals
    op = np.round(low + 5.0 * (op - op.min()) / np.ptp(op), 3)
    [record] = read_text(table(f"Time,FIC-1.PV,FIC-1.OP{unit}", t, pv, op))
    np.testing.assert_array_equal(record.op, op)
    assert any("4 to 20 if it is in mA" in note for note in record.provenance.assumptions) is in_doubt
    assert record.op_in_percent is not in_doubt


def test_wide_file_with_many_loops(signals, table, read_text):
    t, pv, op, _ = signals
    header = "Time,FIC-1.PV,FIC-1.OP,LIC-2.PV,LIC-2.OP,TI-3.PV"
    text = table(header, t, pv, op, pv + 1, op + 1, pv + 2)
    records = read_text(text)
    assert [(r.tag, r.loop_type, r.integrating) for r in records] == [
        ("FIC-1", "flow", False),
        ("LIC-2", "level", True),
    ]
    np.testing.assert_array_equal(records[1].op, op + 1)
    assert any("TI-3" in guess for guess in records[0].provenance.assumptions)
    [one] = read_text(text, tag="lic-2")
    np.testing.assert_array_equal(one.pv, pv + 1)
    with pytest.raises(RecordError, match=r"no loop 'XIC'.*FIC-1, LIC-2"):
        read_text(text, tag="XIC")


def test_two_blocks_of_one_module_stay_apart(signals, table, read_text):
    t, pv, op, _ = signals
    header = "Time,FIC-1/PID1/PV.CV,FIC-1/PID1/OUT.CV,FIC-1/PID2/PV.CV,FIC-1/PID2/OUT.CV"
    records = read_text(table(header, t, pv, op, pv, op))
    assert [record.tag for record in records] == ["FIC-1/PID1", "FIC-1/PID2"]


def test_three_header_rows(signals, table, read_text):
    t, pv, op, _ = signals
    header = ["Time,FIC-1.PV,FIC-1.OP", "min,t/h,%", "Local,Feed flow,Feed valve"]
    [record] = read_text(table(header, t, pv, op))
    assert (record.tag, record.dt) == ("FIC-1", 60.0)
    np.testing.assert_array_equal(record.op, op)


def test_tag_above_signal(signals, table, read_text):
    t, pv, op, _ = signals
    records = read_text(table([",FIC-1,,LIC-2,", "Time,PV,OP,PV,OP"], t, pv, op, pv + 1, op + 1))
    assert [record.tag for record in records] == ["FIC-1", "LIC-2"]
    np.testing.assert_array_equal(records[1].pv, pv + 1)


def test_title_lines_above_the_header(signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table(["Trend export", "Unit 21", "", "time_s,PV,OP"], t, pv, op))
    np.testing.assert_array_equal(record.pv, pv)
    assert any("2 lines above" in guess for guess in record.provenance.assumptions)


def test_commented_header(signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table("# time_s,PV,OP", t, pv, op))
    np.testing.assert_array_equal(record.op, op)


def test_named_columns(signals, table, read_text):
    t, pv, op, sp = signals
    text = table("clock,a,b,c", t, pv, op, sp)
    [record] = read_text(text, columns={"pv": "A", "op": 2}, tag="FIC-9")
    assert (record.tag, record.loop_type, record.sp) == ("FIC-9", "flow", None)
    np.testing.assert_array_equal(record.pv, pv)
    np.testing.assert_array_equal(record.op, op)
    with pytest.raises(RecordError, match="no column 'x' for PV; its columns are a, b, c"):
        read_text(text, columns={"pv": "x", "op": "b"})
    with pytest.raises(RecordError, match=r"no column 9 for OP.*0 to 3"):
        read_text(text, columns={"pv": "a", "op": 9})
    with pytest.raises(ParameterError, match="'valve' is not a signal"):
        read_text(text, columns={"pv": "a", "valve": "b"})


def test_no_header_needs_named_columns(signals, table, read_text):
    t, pv, op, _ = signals
    text = "\n".join(table("", t, pv, op).splitlines()[1:])
    with pytest.raises(RecordError, match=r"line 1: there is no header.*columns="):
        read_text(text)
    [record] = read_text(text, columns={"time": 0, "pv": 1, "op": 2})
    np.testing.assert_array_equal(record.op, op)
    [record] = read_text(text, columns={"pv": 1, "op": 2}, dt=5.0)
    assert record.dt == 5.0


def test_status_texts_are_counted(signals, table, read_text):
    t, pv, op, _ = signals
    cells = [str(x) for x in pv]
    cells[3] = cells[4] = "Bad Input"
    cells[10] = "I/O Timeout"
    cells[20] = ""
    [record] = read_text(table("time_s,PV,OP", t, cells, op))
    assert np.flatnonzero(np.isnan(record.pv)).tolist() == [3, 4, 10, 20]
    assert record.provenance.bad_values == {"Bad Input": 2, "I/O Timeout": 1}
    assert record.provenance.missing_samples == 4


@pytest.mark.parametrize(
    ("header", "good", "flag"),
    [("BAD", "0", "1"), ("bad", "", "1"), ("Quality", "192", "24"), ("Quality", "Good", "Questionable")],
)
def test_flagged_rows_are_missing(header, good, flag, signals, table, read_text):
    t, pv, op, _ = signals
    cells = [good] * len(t)
    cells[5] = cells[6] = flag
    [record] = read_text(table(f"time_s,PV,OP,{header}", t, pv, op, cells))
    assert np.flatnonzero(np.isnan(record.op)).tolist() == [5, 6]
    assert record.provenance.missing_samples == 2


@pytest.mark.parametrize(("on", "off"), [("AUTO", "MAN"), ("AUT", "IMAN"), ("CAS", "OOS"), ("A", "M"), ("1", "0")])
def test_mode(on, off, signals, table, read_text):
    t, pv, op, _ = signals
    cells = [on] * 60 + [off] * 30 + [""] * 10 + [on] * 20
    [record] = read_text(table("time_s,FIC-1.PV,FIC-1.OP,FIC-1.MODE", t, pv, op, cells))
    np.testing.assert_array_equal(record.auto, [True] * 60 + [False] * 40 + [True] * 20)


def test_unknown_mode_is_left_out_and_said_so(signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table("time_s,PV,OP,MODE", t, pv, op, ["17"] * len(t)))
    assert record.auto is None
    assert any("mode" in guess for guess in record.provenance.assumptions)


def test_op_scale_is_converted_only_where_the_data_show_it(signals, table, read_text):
    t, pv, op, _ = signals
    text = table("time_s,PV,OP", t, pv, op / 100)
    for options in ({}, {"op_range": (0, 1)}):
        [record] = read_text(text, **options)
        np.testing.assert_allclose(record.op, op, rtol=1e-14)
        assert any("fraction" in guess for guess in record.provenance.assumptions) == (not options)
    [record] = read_text(table("time_s,PV,OP", t, pv, op / 2000))  # a valve all but shut, or a fraction
    np.testing.assert_array_equal(record.op, op / 2000)
    assert any("fraction" in guess and "op_range" in guess for guess in record.provenance.assumptions)


def test_op_in_fraction_by_its_unit_is_converted(signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table("time_s,PV,OP [0-1]", t, pv, op / 100))
    np.testing.assert_allclose(record.op, op, rtol=1e-14)


@pytest.mark.parametrize(
    ("header", "unit"),
    [("time_s,PV_bar,OP_mA", "bar"), ("time_s,PV degC,OP mA", "degC"), ('time_s,"pv_m3/h","op_ma"', "m3/h")],
)
def test_a_unit_may_stand_behind_its_signal_without_brackets(header, unit, signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table(header, t, pv, 4 + 0.16 * op))
    np.testing.assert_allclose(record.op, op, rtol=1e-12)
    np.testing.assert_array_equal(record.pv, pv)
    assert record.provenance.pv_unit == unit


@pytest.mark.parametrize(("name", "found"), [("FC1.MA", ("FC1", "MA")), ("FC1_MA", ("FC1", "MA")), ("MA", ("", "MA"))])
def test_a_mode_is_no_unit(name, found):
    assert parse_column_name(name) == found
    assert unit_in_name(name) == ""


def test_a_gas_is_no_controller_output():
    assert parse_column_name("CO_ppm") is None
    assert parse_column_name("Stack CO %") is None


@pytest.mark.parametrize(
    ("header", "tag", "kind"),
    [
        ("time_s,TIC-7.PV degC,TIC-7.OP mA", "TIC-7", "temperature"),
        ("time_s,TIC-7_PV_degC,TIC-7_OP_mA", "TIC-7", "temperature"),
        ("time_s,Oven temperature PV degC,Oven temperature OP mA", "Oven temperature", "temperature"),
        ("time_s,Oven PV degC,Oven OP mA", "Oven", "other"),
    ],
)
def test_a_unit_may_stand_behind_a_loop_and_its_signal(header, tag, kind, signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table(header, t, pv, 4 + 0.16 * op))
    assert (record.tag, record.loop_type, record.provenance.pv_unit) == (tag, kind, "degC")
    np.testing.assert_allclose(record.op, op, rtol=1e-12)


def test_op_in_milliamperes_by_its_unit_is_converted_and_said(signals, table, read_text):
    t, pv, op, _ = signals
    text = table("time_s,PV,OP [mA]", t, pv, 4 + 0.16 * op)
    [record] = read_text(text)
    np.testing.assert_allclose(record.op, op, rtol=1e-12)
    assert any("4 mA are taken as 0 %" in guess for guess in record.provenance.assumptions)
    np.testing.assert_allclose(read_text(text, op_range=(4, 20))[0].op, op, rtol=1e-12)
    # 0 to 20 mA, or an OP in % under a wrong unit, is left alone.
    [record] = read_text(table("time_s,PV,OP [mA]", t, pv, op))
    np.testing.assert_array_equal(record.op, op)
    assert any("unlike a signal of 4 to 20 mA" in guess for guess in record.provenance.assumptions)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "latin-1"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_encodings(encoding, end, signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table("time_s,TIC-1.PV [°C],TIC-1.OP", t, pv, op, end=end), encoding)
    assert record.loop_type == "temperature"
    np.testing.assert_array_equal(record.pv, pv)


def test_reading_a_path_names_loop_and_digest(tmp_path, signals, table):
    import hashlib

    t, pv, op, _ = signals
    path = tmp_path / "2111FIC10201_week.csv"
    path.write_text(table("time_s,PV,OP", t, pv, op))
    [record] = read(path)
    assert (record.tag, record.loop_type, record.provenance.rows) == ("2111FIC10201_week", "flow", len(t))
    assert record.provenance.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert record.provenance.source == str(path)


@pytest.mark.parametrize(
    ("name", "kind"),
    [("fit", "other"), ("act", "other"), ("lit", "other"), ("pct_1", "pressure"), ("LIC-33_june", "level")],
)
def test_a_word_for_a_file_is_no_tag(tmp_path, name, kind, signals, table):
    t, pv, op, _ = signals
    path = tmp_path / f"{name}.csv"
    path.write_text(table("time_s,PV,OP", t, pv, op))
    [record] = read(path)
    assert (record.tag, record.loop_type) == (name, kind)
    assert any("file name" in guess for guess in record.provenance.assumptions) == (kind != "other")
    [record] = read(path, loop_type="flow")
    assert record.loop_type == "flow"
    assert not any("file name" in guess for guess in record.provenance.assumptions)


def test_a_number_does_not_depend_on_the_cells_beside_it(signals, table, read_text):
    t, pv, op, _ = signals
    odd = [f"{x:.6f}" for x in pv]
    odd[7] = "1_2"
    [record] = read_text(table("time_s,PV,OP", t, odd, op))
    assert np.isnan(record.pv[7])
    odd[9] = "Bad"
    [record] = read_text(table("time_s,PV,OP", t, odd, op))
    assert np.isnan(record.pv[[7, 9]]).all()
    assert record.provenance.bad_values == {"1_2": 1, "Bad": 1}
