"""Long tables, against the values written into them."""

from __future__ import annotations

import io
from datetime import datetime, timedelta

import numpy as np
import polars as pl
import pytest

import stiction as st
from stiction.errors import RecordError
from stiction.sources.byte_source import open_sources
from stiction.sources.formats import text as text_format
from stiction.sources.frame import frame_to_table
from stiction.sources.layouts import long_table, read_layout
from stiction.sources.options import ReadOptions

START = datetime(2026, 2, 1, 10)
EPOCH = datetime(1970, 1, 1)
N = 60


def signal(seed):
    return np.round(50.0 + np.random.default_rng(seed).normal(0.0, 3.0, N), 3)


def table_of(text, **options):
    options = ReadOptions(**options)
    [table] = text_format.read(open_sources(io.BytesIO(text.encode()), options)[0], options)
    return table


def columns_of(text, **options):
    return {column.name: column for column in read_layout([table_of(text, **options)], ReadOptions(**options))}


def stamp(seconds):
    return str(START + timedelta(seconds=float(seconds)))


def numbers(column):
    return column.cells.cast(pl.Float64).to_list()


def seconds(column):
    return (column.clock.stamps.seconds - (START - EPOCH).total_seconds()).tolist()


def write(header, rows, mark=","):
    return "\n".join([header.replace(",", mark), *(mark.join(map(str, row)) for row in rows)]) + "\n"


PV, OP = signal(1), signal(2)


@pytest.mark.parametrize("order", ["by tag", "by time", "shuffled"])
@pytest.mark.parametrize(
    "header", ["Tag,Time,Value", "TAGNAME,TS,READING", "Point Name,Timestamp,Val", "what,when,how much"]
)
def test_a_row_for_each_tag_and_time(header, order):
    rows = [(f"FIC-1.{word}", stamp(k), x) for word, values in (("PV", PV), ("OP", OP)) for k, x in enumerate(values)]
    if order == "by time":
        rows.sort(key=lambda row: row[1])
    elif order == "shuffled":
        rows = [rows[k] for k in np.random.default_rng(3).permutation(len(rows))]
    columns = columns_of(write(header, rows))
    assert set(columns) == {"FIC-1.PV", "FIC-1.OP"}
    for name, values in (("FIC-1.PV", PV), ("FIC-1.OP", OP)):
        by_time = sorted(zip(seconds(columns[name]), numbers(columns[name]), strict=True))
        assert by_time == list(zip(map(float, range(N)), values.tolist(), strict=True))
        assert columns[name].own_clock


def test_equal_stamps_share_a_clock_and_others_do_not():
    rows = [(f"A.{word}", stamp(k), k) for word in ("PV", "OP") for k in range(N)]
    rows += [("A.SP", stamp(k + 0.5), k) for k in range(N)]
    rows += [("A.MODE", stamp(k), "AUTO") for k in range(N - 1)]
    columns = columns_of(write("Tag,Time,Value", rows))
    clocks = {name: column.clock for name, column in columns.items()}
    assert clocks["A.PV"] is clocks["A.OP"]
    assert len({id(clock) for clock in clocks.values()}) == 3
    assert seconds(columns["A.SP"]) == [k + 0.5 for k in range(N)]


ATTRIBUTES = [
    "Tag,Attribute,Timestamp,Value",
    "Loop,Signal,Time,Value",
    "Controller,Parameter,Time,Value",
    "Timestamp,Element,Attribute,Value",
    "Name,Item,Value,Time",
    "_measurement,_field,_time,_value",
]


@pytest.mark.parametrize("header", ATTRIBUTES)
@pytest.mark.parametrize("loops", [("FIC4101",), ("FIC4101", "LIC-7"), ("Reflux drum level",)])
@pytest.mark.parametrize("more", [(), ("MODE", "GAIN", "HI LIMIT")])
def test_loop_and_attribute_in_two_columns(header, loops, more):
    heads = header.split(",")
    rows = []
    for loop in loops:
        for word in ("PV", "SP", "OP", *more):
            for k in range(N):
                cells = {"time": stamp(k), "value": PV[k] if word == "PV" else OP[k], "word": word, "loop": loop}
                kinds = ["time" if "ime" in h else "value" if "alue" in h else "" for h in heads]
                left = iter(("loop", "word"))
                rows.append([cells[kind or next(left)] for kind in kinds])
    columns = columns_of(write(header, rows))
    assert list(columns) == [f"{loop}.{word}" for loop in loops for word in ("PV", "SP", "OP", *more)]
    for loop in loops:
        assert numbers(columns[f"{loop}.PV"]) == PV.tolist()
        assert numbers(columns[f"{loop}.OP"]) == OP.tolist()


def test_a_description_for_each_signal_is_no_loop():
    rows = [("Feed flow", "PV", stamp(k), PV[k]) for k in range(N)] + [
        ("Feed valve", "OP", stamp(k), OP[k]) for k in range(N)
    ]
    assert list(columns_of(write("Name,Signal,Time,Value", rows))) == ["PV", "OP"]


def test_quality_unit_and_description_stand_with_the_tag():
    rows = []
    for k in range(N):
        rows += [("FIC.PV", stamp(k), PV[k], "Bad" if k == 7 else "Good", "t/h", "Feed flow")]
        rows += [("FIC.OP", stamp(k), OP[k], "Good", "%", "Feed valve")]
    columns = columns_of(write("Tag,Time,Value,Quality,Units,Description", rows))
    assert [(c.unit, c.description) for c in columns.values()] == [("t/h", "Feed flow"), ("%", "Feed valve")]
    assert [k for k, cell in enumerate(columns["FIC.PV"].flags.popitem()[1]()) if cell != "Good"] == [7]
    assert set(columns["FIC.OP"].flags.popitem()[1]()) == {"Good"}


@pytest.mark.parametrize("heading", ["Status", "Confidence", "OPC Quality"])
def test_other_headings_of_quality(heading):
    rows = [(f"FIC.{word}", stamp(k), PV[k], 100) for k in range(N) for word in ("PV", "OP")]
    assert columns_of(write(f"Tag,Time,Value,{heading}", rows))["FIC.PV"].flags.popitem()[1]().to_list() == ["100"] * N


def test_date_and_clock_and_a_decimal_comma():
    rows = [
        (f"FIC.{word}", *stamp(864 * k).split(" "), str(x[k]).replace(".", ","))
        for k in range(N)
        for word, x in (("PV", PV), ("OP", OP))
    ]
    columns = columns_of(write("Tag,Date,Time,Value", rows, mark=";"))
    assert seconds(columns["FIC.OP"]) == [864.0 * k for k in range(N)]
    assert columns["FIC.OP"].table.decimal == ","


def test_rows_without_a_readable_stamp_are_left_out_and_reported():
    rows = [(f"FIC.{word}", stamp(k), PV[k]) for k in range(N) for word in ("PV", "OP")]
    rows[10:13] = [("FIC.PV", "n/a", 1.0), ("FIC.OP", "", 2.0), ("FIC.PV", "soon", 3.0)]
    columns = columns_of(write("Tag,Time,Value", rows))
    assert sum(len(column.cells) for column in columns.values()) == 2 * N - 3
    assert "Left out: 3 rows without a readable time stamp." in columns["FIC.PV"].table.notes


def test_typed_columns_of_a_frame():
    when = [START + timedelta(seconds=k) for k in range(N)]
    frame = pl.DataFrame({"tag": ["FIC.PV"] * N + ["FIC.OP"] * N, "time": when * 2, "value": [*PV, *OP]})
    for one in (frame, frame.with_columns(pl.col("tag").cast(pl.Categorical))):
        columns = {column.name: column for column in read_layout([frame_to_table(one, "frame")], ReadOptions())}
        assert columns["FIC.PV"].cells.dtype == pl.Float64
        assert columns["FIC.PV"].cells.to_list() == PV.tolist()
        assert seconds(columns["FIC.OP"]) == list(map(float, range(N)))


def test_tags_that_say_nothing_are_found_by_the_headings():
    rows = [(tag, stamp(k), PV[k]) for k in range(N) for tag in ("flow", "steam")]
    assert list(columns_of(write("Tag,when,Value", rows), columns={"time": "when", "pv": "flow", "op": "steam"})) == [
        "flow",
        "steam",
    ]


@pytest.mark.parametrize(
    "header",
    [
        "Time,FIC-1.PV,FIC-1.OP",
        "Time,PV,OP",
        "Name,Time,PV,OP",
        "Time,Reflux flow PV (m3/h),Reflux valve OP (%)",
        "Time,PV,SV,MV",
    ],
)
def test_wide_tables_are_none(header):
    rows = [["" if h == "Name" else stamp(k) if h == "Time" else PV[k] for h in header.split(",")] for k in range(N)]
    assert long_table.read(table_of(write(header, rows)), ReadOptions()) is None


def test_what_cannot_be_read_is_refused_in_words():
    rows = [(f"FIC.{word}", PV[k]) for k in range(N) for word in ("PV", "OP")]
    with pytest.raises(RecordError, match="is a long table without a time column; export"):
        columns_of(write("Tag,Value", rows))
    rows = [(f"FIC.{word}", "Tuesday evening", PV[k]) for k in range(N) for word in ("PV", "OP")]
    with pytest.raises(
        RecordError, match="line 2: 'Tuesday evening' is not a known form of time stamp; give time_format"
    ):
        columns_of(write("Tag,Time,Value", rows))


def test_a_long_table_without_a_header():
    rows = [(f"FIC-1.{word}", stamp(k), x[k]) for k in range(N) for word, x in (("PV", PV), ("OP", OP))]
    for order in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
        columns = columns_of("\n".join(",".join(str(row[i]) for i in order) for row in rows) + "\n")
        assert (numbers(columns["FIC-1.PV"]), numbers(columns["FIC-1.OP"])) == (PV.tolist(), OP.tolist())
        assert seconds(columns["FIC-1.OP"]) == list(map(float, range(N)))


@pytest.mark.parametrize("prefix", ["\\\\SERVER\\", "Area4/", "plant:unit."])
def test_tags_with_a_path(prefix):
    rows = [(f"{prefix}FIC-1.{word}", stamp(k), PV[k]) for k in range(N) for word in ("PV", "OP")]
    assert list(columns_of(write("Tag,Time,Value", rows))) == [f"{prefix}FIC-1.PV", f"{prefix}FIC-1.OP"]


def test_influx_blocks_each_under_a_header_of_its_own():
    lines = []
    for k, (field, x) in enumerate((("PV", PV), ("OP", OP))):
        lines += ["#datatype,string,long,dateTime:RFC3339,double,string,string", "#default,_result,,,,,"]
        lines += [",result,table,_time,_value,_field,_measurement"]
        lines += [
            f",,{k},{(START + timedelta(seconds=j)).isoformat()}Z,{value},{field},FIC-1" for j, value in enumerate(x)
        ]
        lines += [""]
    columns = columns_of("\r\n".join(lines))
    assert (numbers(columns["FIC-1.PV"]), numbers(columns["FIC-1.OP"])) == (PV.tolist(), OP.tolist())
    assert columns["FIC-1.PV"].clock.stamps.kind == "utc"


def test_mode_in_a_long_table_holds_until_the_next_one():
    rows = [(f"FIC-1.{word}", stamp(k), x[k]) for k in range(N) for word, x in (("PV", PV), ("OP", OP))]
    rows += [("FIC-1.MODE", stamp(0), "AUTO"), ("FIC-1.MODE", stamp(20), "MAN"), ("FIC-1.MODE", stamp(45), "AUTO")]
    [record] = st.read(io.BytesIO(write("Tag,Time,Value", rows).encode()))
    assert record.auto.tolist() == [True] * 20 + [False] * 25 + [True] * (N - 45)
