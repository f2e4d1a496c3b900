"""Wide tables: header rows of several kinds, and signals that have rows of their own."""

from __future__ import annotations

import io
from datetime import datetime, timedelta

import numpy as np
import pytest

from stiction.errors import RecordError
from stiction.sources.byte_source import open_sources
from stiction.sources.formats import text as text_format
from stiction.sources.layouts import read_layout
from stiction.sources.options import ReadOptions

pytestmark = pytest.mark.quick

START = datetime(2026, 2, 1, 10)
ZERO = (START - datetime(1970, 1, 1)).total_seconds()
N = 300
K = np.arange(N)
PV = np.round(200 + 9 * np.cos(K / 9.5), 3)
OP = np.round(50 + 6 * np.sin(K / 9.5), 3)


def columns_of(text, **options):
    options = ReadOptions(**options)
    tables = text_format.read(open_sources(io.BytesIO(text.encode()), options)[0], options)
    return {column.name: column for column in read_layout(tables, options)}


def stamp(seconds):
    return str(START + timedelta(seconds=float(seconds)))


def values(column):
    return [float(cell) for cell in column.cells]


def elapsed(column):
    return (column.clock.stamps.seconds - ZERO).tolist()


def lines(*columns):
    return "".join(",".join(str(cell) for cell in row) + "\n" for row in zip(*columns, strict=True))


IGNITION = '"#NAMES"\n"t_stamp","Area4/FIC1/PV","Area4/FIC1/CV"\n"#TYPES"\n{types}\n"#ROWS","300"\n'


@pytest.mark.parametrize("types", ['"date","D","D"', '"date","F8","F8"', '"date","I","D"', '"Date","Double","Float"'])
@pytest.mark.parametrize("mark", [",", "\t"])
def test_markers_between_names_and_data(types, mark):
    header = IGNITION.format(types=types)
    columns = columns_of((header + lines([f"{stamp(k)}.000" for k in K], PV, OP)).replace(",", mark))
    assert list(columns) == ["Area4/FIC1/PV", "Area4/FIC1/CV"]
    pv = columns["Area4/FIC1/PV"]
    assert (values(pv), elapsed(pv), pv.unit) == (PV.tolist(), K.tolist(), "")
    assert not any("above the header" in note for note in pv.table.notes)


@pytest.mark.parametrize("corner", ["", " ", "Time", "Unnamed: 0", "index"])
def test_stamps_under_a_blank_or_foreign_heading(corner):
    columns = columns_of(f'"{corner}",FIC1.PV,FIC1.OP\n' + lines([stamp(k) for k in K], PV, OP))
    assert list(columns) == ["FIC1.PV", "FIC1.OP"]
    assert elapsed(columns["FIC1.OP"]) == K.tolist()


NAMES, UNITS, TEXTS = "Time,FIC1.PV,FIC1.OP", ",t/h,%", ",Feed flow,Feed valve"


@pytest.mark.parametrize(
    "header",
    [
        [NAMES, UNITS, TEXTS],
        [TEXTS, NAMES, UNITS],
        [UNITS, TEXTS, NAMES],
        [NAMES, TEXTS, UNITS, "date,Double,Double"],
        [" ,FIC1 pv,FIC1 op", " ,t/h,%", " ,Feed flow,Feed valve"],
        [",FIC1,", "Time,PV,OP", ",t/h,%", TEXTS],
    ],
)
def test_units_and_descriptions_in_rows_of_the_header(header):
    pv, op = columns_of("\n".join(header) + "\n" + lines([stamp(k) for k in K], PV, OP)).values()
    assert (pv.name[-2:].upper(), pv.unit, op.unit) == ("PV", "t/h", "%")
    if "FIC1," not in header[0]:
        assert (pv.description, op.description) == ("Feed flow", "Feed valve")
    assert (pv.position, values(op)) == (1, OP.tolist())


def test_columns_without_a_header_are_named_by_number():
    text = lines([stamp(k) for k in K], PV, OP, PV)
    with pytest.raises(RecordError, match="line 1: there is no header above the 4 columns; name them"):
        columns_of(text)
    options = ReadOptions(columns={"time": 0, "pv": 1, "op": 2})
    tables = text_format.read(open_sources(io.BytesIO(text.encode()), options)[0], options)
    assert [column.position for column in read_layout(tables, options)] == [1, 2, 3]


def test_a_table_without_time_has_no_clock():
    columns = columns_of("PV,OP\n" + lines(PV, OP), dt=1.0)
    assert columns["PV"].clock is None
    assert columns["OP"].clock is None


def test_a_row_for_each_stored_value():
    text = "".join(f"{stamp(k)}.000,{PV[k]},\n{stamp(k)}.400,,{OP[k]}\n" for k in K)
    columns = columns_of("Time,FIC1.PV,FIC1.OP\n" + text)
    assert (values(columns["FIC1.PV"]), values(columns["FIC1.OP"])) == (PV.tolist(), OP.tolist())
    np.testing.assert_allclose(elapsed(columns["FIC1.OP"]), K + 0.4, atol=1e-6)
    assert columns["FIC1.PV"].own_clock
    assert columns["FIC1.OP"].own_clock


@pytest.mark.parametrize("empty", ["", "NULL", "-", "NaN"])
def test_an_op_in_every_fifth_row_and_a_set_point_that_is_stored_when_it_changes(empty):
    op = [x if k % 5 == 0 else empty for k, x in enumerate(OP)]
    sp = [200.0 if k == 0 else 205.0 if k == 250 else empty for k in K]
    columns = columns_of("Time,PV,OP,SP\n" + lines([stamp(k) for k in K], PV, op, sp))
    assert (elapsed(columns["OP"]), values(columns["OP"])) == (K[::5].tolist(), OP[::5].tolist())
    assert (elapsed(columns["SP"]), values(columns["SP"])) == ([0.0, 250.0], [200.0, 205.0])
    assert not columns["PV"].own_clock
    assert values(columns["PV"]) == PV.tolist()


def test_a_long_gap_or_a_few_blanks_are_missing_values():
    for op in (
        ["" if 30 <= k < 190 else x for k, x in enumerate(OP)],
        ["" if k % 9 == 4 else x for k, x in enumerate(OP)],
    ):
        columns = columns_of("Time,PV,OP\n" + lines([stamp(k) for k in K], PV, op))
        assert columns["OP"].clock is columns["PV"].clock
        assert [cell or "" for cell in columns["OP"].cells] == list(map(str, op))


def test_an_analyser_stored_now_and_then_changes_nothing_for_the_loops():
    lab = [x if k % 12 == 0 else "" for k, x in enumerate(PV)]
    columns = columns_of("Time,FIC1.PV,FIC1.OP,LAB.PV\n" + lines([stamp(k) for k in K], PV, OP, lab))
    assert columns["FIC1.PV"].clock is columns["FIC1.OP"].clock is columns["LAB.PV"].clock


@pytest.mark.parametrize(
    "header", ["Time,FIC1.PV,Quality,FIC1.OP,Quality", "Time,FIC1.PV,FIC1.PV.Quality,FIC1.OP,FIC1.OP.Quality"]
)
def test_the_quality_of_values_with_rows_of_their_own(header):
    text = "".join(f"{stamp(k)}.000,{PV[k]},Bad,,\n{stamp(k)}.400,,,{OP[k]},Good\n" for k in K)
    pv, op = columns_of(f"{header}\n{text}").values()
    assert (values(pv), values(op)) == (PV.tolist(), OP.tolist())
    assert (set(pv.flags.popitem()[1]()), set(op.flags.popitem()[1]())) == ({"Bad"}, {"Good"})


def test_one_quality_of_all_values_with_rows_of_their_own():
    text = "".join(f"{stamp(k)}.000,{PV[k]},,{192 * (k % 2)}\n{stamp(k)}.400,,{OP[k]},192\n" for k in K)
    pv, op = columns_of(f"Time,FIC1.PV,FIC1.OP,Quality\n{text}").values()
    assert pv.flags.popitem()[1]().to_list() == ["0", "192"] * (N // 2)
    assert set(op.flags.popitem()[1]()) == {"192"}
