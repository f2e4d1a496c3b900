"""Exports as plants produce them: one sticky loop in each form, with neighbours (other codes, names, units, places)."""

from __future__ import annotations

import io
from datetime import datetime, timedelta
from functools import cache

import numpy as np
import pytest

import stiction as st

N = 700
DT = 2.0
START = datetime(2026, 11, 21, 14, 3, 5)
BAD_ROWS = np.r_[100:115, 400:404]


@pytest.fixture(scope="session")
def loop() -> st.LoopRecord:
    """The sticky loop, S = 6 % and J = 2.5 % of span, rounded as it is written."""
    made = st.simulate(
        st.Loop(st.PID(0.2, 10.0), st.Kano(S=6.0, J=2.5), st.FOPDT(3.0, 10.0, 10.0), dt=DT, noise=0.05),
        sp=150.0, duration=N * DT, seed=3, pv_start=148.0, op_start=50.0,
    )  # fmt: skip
    signals = {"op": np.round(made.op, 3), "pv": np.round(made.pv, 3), "sp": made.sp}
    return st.LoopRecord("FIC4101", DT, loop_type="flow", start=START, **signals)


def stamps(step: float = DT, form: str = "%Y-%m-%d %H:%M:%S", n: int = N) -> list[str]:
    return [(START + timedelta(seconds=k * step)).strftime(form) for k in range(n)]


def csv_text(header: str, *columns, delimiter: str = ",") -> str:
    rows = zip(*([x if isinstance(x, str) else f"{x:.10g}" for x in column] for column in columns), strict=True)
    return "\n".join([*header.split("\n"), *(delimiter.join(row) for row in rows)]) + "\n"


def read_one(text: str, **options) -> st.LoopRecord:
    [record] = st.read(io.BytesIO(text.encode()), **options)
    return record


def check_signals(record, loop, bad_rows=(), step=DT, **tolerance):
    """The record holds the loop, and nothing in the bad rows."""
    good = ~np.isin(np.arange(N), bad_rows)
    assert (record.dt, len(record)) == (step, N)
    for name in ("op", "pv", "sp"):
        wanted, found = getattr(loop, name), getattr(record, name)
        if found is not None:
            np.testing.assert_allclose(found, np.where(good, wanted, np.nan), **{"rtol": 1e-9, **tolerance})


@cache
def diagnosed(signals: bytes, dt: float, loop_type: str | None) -> st.Diagnosis:
    op, pv, sp = np.frombuffer(signals).reshape(3, -1)
    return st.diagnose(st.LoopRecord("", dt, op, pv, None if np.isnan(sp).all() else sp, loop_type=loop_type))


def check_verdict(record):
    """Many files give the same signals, which are diagnosed once."""
    sp = np.full(len(record), np.nan) if record.sp is None else record.sp
    found = diagnosed(np.array([record.op, record.pv, sp]).tobytes(), record.dt, record.loop_type)
    assert found.verdict == "stiction"
    assert found.probability >= 0.8


def spoil(x, value, rows=BAD_ROWS):
    spoiled = np.array(x, dtype=float)
    spoiled[rows] = value
    return spoiled


@pytest.mark.parametrize("code", [-9999.0, -9999.99, 32767.0, -32768.0, 9999.0, -1e30, -999.25, 65535.0])
def test_a_number_that_stands_for_a_bad_value_counts_in_all_signals(code, loop):
    text = csv_text(
        "Time,FIC4101.PV,FIC4101.SP,FIC4101.OP", stamps(), *(spoil(x, code) for x in (loop.pv, loop.sp, loop.op))
    )
    record = read_one(text)
    check_signals(record, loop, BAD_ROWS)
    assert sum(record.provenance.bad_values.values()) == 3 * len(BAD_ROWS)
    check_verdict(record)


@pytest.mark.parametrize(
    ("heading", "good", "bad"),
    [
        ("Confidence", "100", "0"),
        ("Confidence", "1.0", "0.0"),
        ("Quality", "192", "64"),
        ("Status", "Good", "Bad"),
        ("FIC4101.Status", "0", "2150694912"),
        ("QualityCode", "128", "64"),
        ("IsGood", "True", "False"),
        ("Quality", "0xC0", "0x00"),
    ],
)
@pytest.mark.parametrize("place", ["beside each signal", "last"])
def test_a_quality_column_is_used(heading, good, bad, place, loop):
    flags = [bad if k in BAD_ROWS else good for k in range(N)]
    pv = spoil(loop.pv, 0.0)
    if place == "last":
        text = csv_text(f"Timestamp,FIC4101.PV,FIC4101.OP,{heading}", stamps(), pv, loop.op, flags)
    else:
        header = f"Timestamp,FIC4101.PV,{heading},FIC4101.OP,{heading}"
        text = csv_text(header, stamps(), pv, flags, loop.op, flags)
    record = read_one(text)
    check_signals(record, loop, BAD_ROWS)
    check_verdict(record)


@pytest.mark.parametrize("states", [(246, 253), (254, 255), (248, 307), (-1, -2)])
def test_one_number_in_all_signals_at_one_time_is_a_state(states, loop):
    signals = [spoil(spoil(x, states[0]), states[1], BAD_ROWS[-4:]) for x in (loop.pv, loop.sp, loop.op)]
    record = read_one(csv_text("Time,FIC4101.PV,FIC4101.SP,FIC4101.OP", stamps(), *signals))
    check_signals(record, loop, BAD_ROWS)
    check_verdict(record)


@pytest.mark.parametrize("heading", ["", '" "', "Unnamed: 0", "index", "#"])
@pytest.mark.parametrize("form", ["%Y-%m-%d %H:%M:%S", "%m/%d/%Y %H:%M:%S", "%d-%b-%y %H:%M:%S"])
def test_stamps_under_a_blank_heading_are_the_time(heading, form, loop):
    record = read_one(
        csv_text(f"{heading},FIC4101.PV,FIC4101.SP,FIC4101.OP", stamps(form=form), loop.pv, loop.sp, loop.op)
    )
    check_signals(record, loop)
    assert record.start == START


def test_a_recorder_with_units_descriptions_and_words_for_bad_values(loop):
    header = (
        '" ","FIC4101 pv","FIC4101 sp","FIC4101 op"\n" ","M3/H","M3/H","%"\n" ","Reflux flow","Reflux flow","Output"'
    )
    signals = [[f" {x:g}" for x in signal] for signal in (loop.pv, loop.sp, loop.op)]
    for rows, word in ((BAD_ROWS[:15], " BAD"), (BAD_ROWS[15:], " MISSING")):
        for k in rows:
            signals[0][k] = signals[2][k] = word
    record = read_one(csv_text(header, stamps(form='"%m/%d/%Y %H:%M:%S"'), *signals))
    np.testing.assert_allclose(record.op, spoil(loop.op, np.nan))
    assert record.provenance.pv_unit == "M3/H"
    check_verdict(record)


@pytest.mark.parametrize("rows", [f'"#ROWS","{N}"', f"#ROWS,{N}", "#ROWS"])
@pytest.mark.parametrize("word", ["CV", "OP", "OUT", "Val_CVOut"])
def test_a_data_set_with_marker_lines(rows, word, loop):
    names = ["t_stamp", *(f"Area4/FIC4101/{one}" for one in ("PV", "SP", word))]
    header = "#NAMES\n{}\n#TYPES\ndate,D,D,D\n{}".format(",".join(names), rows)
    record = read_one(csv_text(header, stamps(), loop.pv, loop.sp, loop.op))
    check_signals(record, loop)
    check_verdict(record)


@pytest.mark.parametrize("heading", ["Milliseconds", "ms", "msec", "MS"])
@pytest.mark.parametrize("step", [1.5, 0.25])
def test_milliseconds_in_their_own_column(heading, step, loop):
    ms = [f"{1000 * k * step % 1000:.0f}" for k in range(N)]
    header = f"Time,{heading},FIC4101_PV,FIC4101_SP,FIC4101_OP"
    record = read_one(csv_text(header, stamps(step, "%d/%m/%Y %H:%M:%S"), ms, loop.pv, loop.sp, loop.op))
    check_signals(record, loop, step=step)


@pytest.mark.parametrize("header", ["Timestamp,Value", "Time,Value,Quality", "t_stamp,val", "Zeit;Value"])
@pytest.mark.parametrize("source", ["folder", "pattern", "list", "zip"])
def test_one_file_for_each_tag(header, source, loop, tmp_path):
    import zipfile

    delimiter = ";" if ";" in header else ","
    files = []
    for word in ("PV", "SP", "OP"):
        more = [["Good"] * N] if "Quality" in header else []
        text = csv_text(header, stamps(), getattr(loop, word.lower()), *more, delimiter=delimiter)
        files.append(tmp_path / f"FIC4101.{word}.csv")
        files[-1].write_text(text)
    if source == "zip":
        with zipfile.ZipFile(tmp_path / "tags.zip", "w") as archive:
            for file in files:
                archive.write(file, file.name)
    sources = {"folder": tmp_path, "pattern": str(tmp_path / "*.csv"), "list": files, "zip": tmp_path / "tags.zip"}
    [record] = st.read(sources[source])
    check_signals(record, loop)
    assert record.tag == "FIC4101"


@pytest.mark.parametrize(
    ("header", "order"),
    [
        ("Tag,Attribute,Timestamp,Value", "gatv"),
        ("Element,Attribute,Time,Value", "gatv"),
        ("Timestamp,Tag,Parameter,Value", "tgav"),
        ("TagName,Item,DateTime,Value,Quality", "gatvq"),
    ],
)
@pytest.mark.parametrize("by_time", [True, False], ids=["in order of time", "tag after tag"])
def test_a_long_table_with_the_attribute_in_its_own_column(header, order, by_time, loop):
    t, rows = stamps(), []
    for k in range(N):
        for word in ("PV", "SP", "OP"):
            cells = {"g": "FIC4101", "a": word, "t": t[k], "v": f"{getattr(loop, word.lower())[k]:g}", "q": "Good"}
            rows.append([cells[part] for part in order])
    if not by_time:
        rows.sort(key=lambda row: row[order.index("a")])
    record = read_one(csv_text(header, *zip(*rows, strict=True)))
    check_signals(record, loop, rtol=1e-5)
    check_verdict(record)


@pytest.mark.parametrize(
    "names",
    [
        ("Reflux flow PV (m3/h)", "Reflux flow SP (m3/h)", "Reflux valve OP (%)"),
        ("Steam flow PV", "Steam flow SP", "Steam valve output"),
        ("Column level PV", "Column level SP", "Column level valve OP"),
        ("FT4101.PV", "FIC4101.SP", "FV4101.OP"),
        ("FT-4101.PV", "FIC-4101.SP", "FCV-4101.OP"),
        ("4101FT.PV", "4101FIC.SP", "4101FV.OP"),
        ("FI4101.PV", "FIC4101.SP", "FIC4101.OP"),
    ],
)
def test_columns_that_are_paired_by_words_or_tag_letters(names, loop):
    record = read_one(csv_text(",".join(["Time", *names]), stamps(), loop.pv, loop.sp, loop.op))
    check_signals(record, loop)
    assert record.provenance.columns["op"] == names[2]
    if record.loop_type != "level":  # the record is of a flow, which a level does not follow
        check_verdict(record)


@pytest.mark.parametrize(
    ("corner", "form"),
    [
        ("Tag", "%d-%b-%y %H:%M:%S"),
        ("", "%Y-%m-%d %H:%M:%S"),
        ("Tagname", "%Y-%m-%dT%H:%M:%SZ"),
        ("Time", "%d/%m/%Y %H:%M:%S"),
    ],
)
def test_tags_in_rows(corner, form, loop):
    rows = [[f"FIC4101.{word}", *(f"{x:.3f}" for x in getattr(loop, word.lower()))] for word in ("PV", "SP", "OP")]
    text = "\n".join(",".join(row) for row in [[corner, *stamps(form=form)], *rows]) + "\n"
    record = read_one(text)
    check_signals(record, loop)
    assert any("transposed" in note for note in record.provenance.assumptions)


@pytest.mark.parametrize(("low", "high"), [(4.0, 20.0), (0.0, 1.0)])
def test_op_in_a_signal_without_a_unit_is_never_called_percent(low, high, loop):
    op = low + (high - low) * loop.op / 100.0
    text = csv_text("Time,FIC4101.PV,FIC4101.SP,FIC4101.OP", stamps(), loop.pv, loop.sp, op)
    record = read_one(text)
    if high > 1:
        assert record.op_unit == "OP units"
        assert any(f"{low:g} to {high:g}" in note for note in record.provenance.assumptions)
    else:
        check_signals(record, loop, rtol=1e-6)
        assert any("taken as a fraction of span" in note for note in record.provenance.assumptions)
    check_signals(read_one(text, op_range=(low, high)), loop, rtol=1e-6)
    with_unit = text.replace("FIC4101.OP", f"FIC4101.OP [{'mA' if high > 1 else 'fraction'}]")
    check_signals(read_one(with_unit), loop, rtol=1e-6)
    record = read_one(csv_text("Time,FIC4101.PV,FIC4101.OP,FIC4101.ZT", stamps(), loop.pv, op, loop.op))
    np.testing.assert_allclose(record.op, loop.op, rtol=1e-6)  # the position shows the range


@pytest.mark.parametrize(
    ("write", "start"),
    [
        (lambda t: t.strftime("%m/%d/%Y %I:%M:%S ") + ("p. m." if t.hour > 11 else "a. m."), START),
        (lambda t: f'="{t:%Y-%m-%d %H:%M:%S}"', START),
        (lambda t: t.strftime("%Y-%j %H:%M:%S"), START),
        (lambda t: f"{t:%d} novembre {t:%Y %H:%M:%S}", START),
        (lambda t: f"{t:%d}. nov {t:%Y %H:%M:%S}", START),
        (lambda t: str(int((t - datetime(1601, 1, 1)).total_seconds() * 1e7)), None),
    ],
    ids=["p. m.", "formula", "day of year", "French month", "Danish month", "FILETIME"],
)
def test_stamps_also_seen(write, start, loop):
    t = [write(START + timedelta(seconds=k * DT)) for k in range(N)]
    record = read_one(csv_text("Time,FIC4101.PV,FIC4101.SP,FIC4101.OP", t, loop.pv, loop.sp, loop.op))
    check_signals(record, loop)
    assert record.start is not None
    assert record.start.replace(tzinfo=None) == START


@pytest.mark.parametrize(
    "header",
    [
        "Time,FIC4101.PV,FIC4101.OP,FV4101.ZT",
        "Time,FIC4101/ScaledInput,FIC4101/Output,x",
        "Time,FIC4101.PV,FIC4101.OUTP,x",
    ],
)
def test_vendors_words_also_seen(header, loop):
    text = csv_text(header, stamps(), loop.pv, loop.op, loop.op + 1.0)
    record = read_one(text)
    check_signals(record, loop)
    assert (record.mv is not None) == ("ZT" in header)


def test_headings_in_gb18030_are_not_garbled(loop):
    text = csv_text("时间,FIC4101.PV,FIC4101.SP,FIC4101.OP,流量", stamps(), loop.pv, loop.sp, loop.op, loop.pv)
    [record] = st.read(io.BytesIO(text.encode("gb18030")))
    check_signals(record, loop)
