"""A column of time stamps for each tag, against the stamps and values written into the table."""

from __future__ import annotations

import io
from datetime import datetime, timedelta

import numpy as np
import pytest

from stiction.sources.byte_source import open_sources
from stiction.sources.formats import text as text_format
from stiction.sources.layouts import read_layout, time_value_pairs
from stiction.sources.options import ReadOptions

START = datetime(2026, 2, 1, 10)
ZERO = (START - datetime(1970, 1, 1)).total_seconds()
N = 80
K = np.arange(N)
PV = np.round(200 + 9 * np.cos(K / 9.5), 3)
OP = np.round(50 + 6 * np.sin(K / 9.5), 3)
OP_TIMES = np.array([2 * k + (k % 7 == 3) for k in range(N - 9)])


def table_of(header, rows):
    text = "\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n"
    [table] = text_format.read(open_sources(io.BytesIO(text.encode()), ReadOptions())[0], ReadOptions())
    return table


def stamp(seconds):
    return str(START + timedelta(seconds=float(seconds)))


def pair_rows():
    right = [(stamp(s), OP[k]) for k, s in enumerate(OP_TIMES)] + [("", "")] * 9
    return [(stamp(k), PV[k], *right[k]) for k in K]


HEADERS = [
    "Time,FIC-1.PV,Time,FIC-1.OP",
    "Timestamp,FIC-1.PV,Timestamp.1,FIC-1.OP",
    "Time 1,FIC-1.PV,Time 2,FIC-1.OP",
    ",FIC-1.PV,,FIC-1.OP",
    "FIC-1.PV,,FIC-1.OP,",
    "FIC-1.PV,,FIC-1.OP,\nTimestamp,Value,Timestamp,Value",
    "FIC-1.PV,FIC-1.PV,FIC-1.OP,FIC-1.OP\nTime,Value,Time,Value",
    "Time,FIC-1.PV,Time,FIC-1.OP\ns,t/h,s,%",
]


@pytest.mark.parametrize("header", HEADERS)
def test_each_time_column_is_that_of_the_signal_after_it(header):
    pv, op = read_layout([table_of(header, pair_rows())], ReadOptions())
    assert (pv.name, op.name) == ("FIC-1.PV", "FIC-1.OP")
    assert pv.own_clock
    assert op.own_clock
    assert (pv.clock.stamps.seconds - ZERO).tolist() == K.tolist()
    assert (op.clock.stamps.seconds - ZERO).tolist() == OP_TIMES.tolist()
    assert [float(cell) for cell in pv.cells] == PV.tolist()
    assert [float(cell) for cell in op.cells] == OP[: len(OP_TIMES)].tolist()
    if "t/h" in header:
        assert (pv.unit, op.unit) == ("t/h", "%")


def test_elapsed_seconds_of_each_tag():
    rows = [(k, PV[k], 2 * k + 1, OP[k]) for k in K]
    pv, op = read_layout([table_of("time_s,FIC.PV,time_s,FIC.OP", rows)], ReadOptions())
    assert np.diff(pv.clock.stamps.seconds).tolist() == [1.0] * (N - 1)
    assert np.diff(op.clock.stamps.seconds).tolist() == [2.0] * (N - 1)


def test_signals_after_one_time_column_share_its_clock():
    rows = [(stamp(k), PV[k], OP[k], stamp(5 * k), 2 * PV[k], OP[k]) for k in K]
    columns = read_layout([table_of("Time,FIC.PV,FIC.OP,Time,LIC.PV,LIC.OP", rows)], ReadOptions())
    assert [column.name for column in columns] == ["FIC.PV", "FIC.OP", "LIC.PV", "LIC.OP"]
    assert columns[0].clock is columns[1].clock is not columns[2].clock is columns[3].clock
    assert (columns[3].clock.stamps.seconds - ZERO).tolist() == (5 * K).tolist()


def test_a_quality_after_each_value_keeps_its_place():
    rows = [(stamp(k), PV[k], "Good", stamp(k + 0.25), OP[k], "Bad") for k in K]
    columns = read_layout([table_of("Time,FIC.PV,Quality,Time,FIC.OP,Quality", rows)], ReadOptions())
    assert [(column.position, column.name) for column in columns] == [
        (1, "FIC.PV"),
        (2, "Quality"),
        (4, "FIC.OP"),
        (5, "Quality"),
    ]
    assert set(columns[3].cells) == {"Bad"}


def test_time_columns_that_hold_the_same_are_one_clock():
    table = table_of("Time,FIC.PV,Time,FIC.OP", [(stamp(k), PV[k], stamp(k), OP[k]) for k in K])
    pv, op = read_layout([table], ReadOptions())
    assert pv.clock is op.clock
    assert not pv.own_clock
    assert any("2 time columns contain the same times" in note for note in table.notes)


@pytest.mark.parametrize(
    ("header", "other"),
    [
        ("Time,PV,Local time,OP", [stamp(k + 3600) for k in K]),
        ("UTC,PV,Local time,OP", [stamp(k) for k in K]),
        ("Time,PV,T,OP", np.round(80 + np.sin(K), 2)),
        ("Time,PV,T1,OP", np.round(80 + np.sin(K), 2)),
        ("Time,PV,T [degC],OP", np.round(80 + np.sin(K), 2)),
        ("Time,PV,Seconds,OP", K % 60),
        ("Date,Time,PV,OP", PV),
    ],
)
def test_another_clock_or_a_temperature_makes_no_pairs(header, other):
    rows = [(stamp(k), PV[k], other[k], OP[k]) for k in K]
    if header.startswith("Date"):
        rows = [(*stamp(k).split(" "), PV[k], OP[k]) for k in K]
    table = table_of(header, rows)
    assert time_value_pairs.read(table, ReadOptions()) is None
    columns = {column.name: column for column in read_layout([table], ReadOptions())}
    assert [float(cell) for cell in columns["OP"].cells] == OP.tolist()
    assert columns["OP"].clock is columns["PV"].clock
    assert np.diff(columns["OP"].clock.stamps.seconds).tolist() == [1.0] * (N - 1)
