"""Tags and loops below each other, against the values written into the table."""

from __future__ import annotations

import io
from datetime import datetime, timedelta

import numpy as np
import pytest

from stiction.sources.byte_source import open_sources
from stiction.sources.formats import text as text_format
from stiction.sources.layouts import read_layout, stacked_tags
from stiction.sources.options import ReadOptions

START = datetime(2026, 2, 1, 10)
ZERO = (START - datetime(1970, 1, 1)).total_seconds()
N = 250
K = np.arange(N)
PV = np.round(200 + 9 * np.cos(K / 9.5), 3)
OP = np.round(50 + 6 * np.sin(K / 9.5), 3)


def table_of(text):
    [table] = text_format.read(open_sources(io.BytesIO(text.encode()), ReadOptions())[0], ReadOptions())
    return table


def columns_of(text):
    return {column.name: column for column in read_layout([table_of(text)], ReadOptions())}


def stamp(seconds):
    return str(START + timedelta(seconds=float(seconds)))


def values(column):
    return [float(cell.replace(",", ".")) for cell in column.cells]


def blocks(heading="Tag: {}", header="Time,Value", *, loops=("FIC101",), decimal=".", unit="", n=N):
    """Write a block for PV and OP of each loop, with a blank line after each; OP is stored half a second later."""
    mark = next((mark for mark in "\t;" if mark in header), ",")
    lines = []
    for loop in loops:
        for word, x, late in (("PV", PV, 0.0), ("OP", OP, 0.5)):
            lines += [heading.format(f"{loop}.{word}"), *[f"Units: {unit}"] * bool(unit), *[header] * bool(header)]
            lines += [f"{stamp(k + late)}{mark}{str(x[k]).replace('.', decimal)}" for k in K[:n]]
            lines += [""]
    return "\n".join(lines)


FORMS = [
    ("Tag: {}", "Time,Value", "."),
    ("{}", "", "."),
    ("{}", "Timestamp,Value", "."),
    ("[{}]", "Timestamp\tValue", "."),
    ("Point;{};", "Zeit;Wert", ","),
    ("Tag Name,{}", "Date/Time,Value", "."),
    ('"{}"', '"Time","Value"', "."),
    ("# Tag = {}", "Time,Value", "."),
]


@pytest.mark.parametrize(("heading", "header", "decimal"), FORMS)
@pytest.mark.parametrize("above", ["", "Trend of unit 3\nPrinted by me\n\n"])
@pytest.mark.parametrize("loops", [("FIC101",), ("FIC101", "LIC7")])
@pytest.mark.parametrize("n", [30, 120, N])
def test_tags_below_each_other(heading, header, decimal, above, loops, n):
    columns = columns_of(above + blocks(heading, header, decimal=decimal, loops=loops, n=n))
    assert list(columns) == [f"{loop}.{word}" for loop in loops for word in ("PV", "OP")]
    for loop in loops:
        pv, op = columns[f"{loop}.PV"], columns[f"{loop}.OP"]
        assert (values(pv), values(op)) == (PV[:n].tolist(), OP[:n].tolist())
        assert (op.clock.stamps.seconds - ZERO).tolist() == (K[:n] + 0.5).tolist()
    assert not any("Left out" in note for note in pv.table.notes)


def test_a_unit_under_the_heading_is_that_of_the_block():
    text = blocks(unit="mA") + blocks(unit="t/h", loops=("LIC7",))
    assert [column.unit for column in columns_of(text).values()] == ["mA", "mA", "t/h", "t/h"]


def test_blocks_of_one_tag_are_joined():
    halves = [(word, x, part) for part in (K[:100], K[100:]) for word, x in (("PV", PV), ("OP", OP))]
    lines = [line for word, x, part in halves for line in (f"Tag: A1.{word}", *(f"{stamp(k)},{x[k]}" for k in part))]
    columns = columns_of("\n".join(lines) + "\n")
    assert [values(column) for column in columns.values()] == [PV.tolist(), OP.tolist()]


@pytest.mark.parametrize("title", ["FIC101.PV", "Tag: FIC101.PID", "Tag: FIC101.PV\nTag: FIC101.OP", "Tag: FIC101.PV"])
def test_a_line_above_one_loop_makes_no_blocks(title):
    table = table_of(title + "\nTime,PV,OP\n" + "\n".join(f"{stamp(k)},{PV[k]},{OP[k]}" for k in K) + "\n")
    assert stacked_tags.read(table, ReadOptions()) is None


def test_loops_below_each_other():
    rows = [line for k in K for line in (f"FIC-1,{stamp(k)},{PV[k]},{OP[k]}", f"LIC-2,{stamp(k)},{2 * PV[k]},{OP[k]}")]
    columns = columns_of("\n".join(["Tag,Time,PV [t/h],OP", *rows]) + "\n")
    assert list(columns) == ["FIC-1.PV [t/h]", "FIC-1.OP", "LIC-2.PV [t/h]", "LIC-2.OP"]
    assert values(columns["LIC-2.PV [t/h]"]) == (2 * PV).tolist()
    assert columns["FIC-1.PV [t/h]"].unit == "t/h"
    assert columns["FIC-1.OP"].clock is columns["FIC-1.PV [t/h]"].clock
    assert (columns["LIC-2.OP"].clock.stamps.seconds - ZERO).tolist() == K.tolist()


@pytest.mark.parametrize("names", ["ABC", ("Feed", "Draw")])
def test_names_of_loops_that_share_times_are_tags(names):
    rows = [f"{stamp(k)},{PV[k]},{OP[k]},{name}" for name in names for k in range(50)]
    assert list(columns_of("\n".join(["Time,PV,OP,Loop", *rows]) + "\n")) == [
        f"{name}.{word}" for name in names for word in ("PV", "OP")
    ]


@pytest.mark.parametrize("heading", ["Name", "Loop", "Controller"])
@pytest.mark.parametrize(
    "names",
    [
        ["Alarm" if 100 <= k < 115 else "" for k in K],
        ["A12" if k < 90 else "B7" if k < 150 else "C1" for k in K],
        ["Smith" if k // 50 % 2 else "Jones" for k in K],
        ["AUTO" if k < 100 else "MAN" for k in K],
    ],
)
def test_names_that_are_no_tags_split_nothing(heading, names):
    rows = [f"{stamp(k)},{PV[k]},{OP[k]},{names[k]}" for k in K]
    columns = columns_of("\n".join([f"Time,PV,OP,{heading}", *rows]) + "\n")
    assert values(columns["PV"]) == PV.tolist()
    assert any("does not name loops" in note for note in columns["PV"].table.notes)


def test_a_loop_with_few_rows_is_left_out_and_reported():
    rows = [f"FIC-1,{stamp(k)},{PV[k]},{OP[k]}" for k in K] + [f"LIC-2,{stamp(k)},1,2" for k in range(9)]
    columns = columns_of("\n".join(["Tag,Time,PV,OP", *rows]) + "\n")
    assert list(columns) == ["FIC-1.PV", "FIC-1.OP"]
    assert any("fewer than 10 rows: LIC-2." in note for note in columns["FIC-1.PV"].table.notes)


@pytest.mark.parametrize("names", [("A", "B"), ("1", "2")])
@pytest.mark.parametrize("in_blocks", [False, True])
def test_column_that_makes_the_times_single_splits_the_loops_whatever_its_heading(names, in_blocks):
    pairs = [(k, n) for k in range(N) for n in (0, 1)]
    if in_blocks:
        pairs.sort(key=lambda pair: pair[1])
    rows = [f"{stamp(k)},{names[n]},{PV[k] - 100 * n:.3f},{OP[k]}" for k, n in pairs]
    columns = columns_of("\n".join(["time,train,pv,op", *rows]))
    assert set(columns) == {f"{name}.{role}" for name in names for role in ("pv", "op")}
    np.testing.assert_allclose(values(columns[f"{names[1]}.pv"]), PV - 100, atol=1e-9)
    assert columns[f"{names[0]}.pv"].clock.stamps.seconds[1] == ZERO + 1.0


def test_two_columns_together_tell_the_loops_apart():
    rows = [f"{stamp(k)},{u},{i},{PV[k]},{OP[k]}" for k in range(N) for u, i in (("N", "x"), ("N", "y"), ("S", "x"))]
    columns = columns_of("\n".join(["time,plant,place,pv,op", *rows]))
    assert {name.rpartition(".")[0] for name in columns} == {"N.x", "N.y", "S.x"}


def test_two_rows_of_each_second_of_one_loop_stay_one_loop():
    rows = [f"{stamp(k // 2)},{k % 7},{PV[k]},{OP[k]}" for k in range(N)]
    assert set(columns_of("\n".join(["time,shift,pv,op", *rows]))) == {"shift", "pv", "op"}
