"""One tag in each table, tables that are pieces of one, and tags in rows."""

from __future__ import annotations

import io
from datetime import datetime, timedelta

import numpy as np
import polars as pl
import pytest

from stiction.sources.byte_source import open_sources
from stiction.sources.formats import text as text_format
from stiction.sources.frame import frame_to_table
from stiction.sources.layouts import LAYOUTS, read_layout, register_layout
from stiction.sources.options import ReadOptions
from stiction.sources.table import TagColumn

START = datetime(2026, 2, 1, 10)
ZERO = (START - datetime(1970, 1, 1)).total_seconds()
N = 60
K = np.arange(N)
SIGNALS = {
    "PV": np.round(200 + 9 * np.cos(K / 9.5), 3),
    "SP": np.full(N, 200.5),
    "OP": np.round(50 + 6 * np.sin(K / 9.5), 3),
}


def table_of(text, path=None):
    source = io.BytesIO(text.encode())
    if path is not None:
        path.write_text(text)
        source = path
    [table] = text_format.read(open_sources(source, ReadOptions())[0], ReadOptions())
    return table


def stamp(seconds):
    return str(START + timedelta(seconds=float(seconds)))


def values(column):
    return [float(cell) for cell in column.cells]


def check(columns, names):
    assert [column.name for column in columns] == names
    for column, x in zip(columns, SIGNALS.values(), strict=True):
        assert values(column) == x.tolist()
        assert (column.clock.stamps.seconds - ZERO).tolist() == K.tolist()
        assert column.own_clock


def rows(x, more=""):
    return "".join(f"{stamp(k)},{x[k]}{more}\n" for k in K)


@pytest.mark.parametrize("name", ["FIC4101.{}.csv", "FIC4101.{}_2026-11-21.csv", "FIC4101.{}_20261121_0600.csv"])
@pytest.mark.parametrize("header", ["Timestamp,Value\n", "Time,Val\n", "Date/Time,Reading\n", ""])
def test_the_file_name_is_the_tag(name, header, tmp_path):
    tables = [table_of(header + rows(x), tmp_path / name.format(word)) for word, x in SIGNALS.items()]
    check(read_layout(tables, ReadOptions()), [f"FIC4101.{word}" for word in SIGNALS])


@pytest.mark.parametrize("heading", ["Value", "{}"])
def test_the_folder_is_the_loop_of_files_named_by_their_signals(heading, tmp_path):
    folder = tmp_path / "FIC4101"
    folder.mkdir()
    tables = [
        table_of(f"Time,{heading.format(word)}\n" + rows(x), folder / f"{word}.csv") for word, x in SIGNALS.items()
    ]
    check(read_layout(tables, ReadOptions()), [f"FIC4101.{word}" for word in SIGNALS])


def test_a_bare_signal_is_named_by_the_file_when_that_says_the_same(tmp_path):
    tables = [table_of(f"Time,{word}\n" + rows(x), tmp_path / f"FIC4101_{word}.csv") for word, x in SIGNALS.items()]
    check(read_layout(tables, ReadOptions()), [f"FIC4101_{word}" for word in SIGNALS])
    [column] = read_layout([table_of("Time,PV\n" + rows(SIGNALS["PV"]), tmp_path / "june.csv")], ReadOptions())
    assert column.name == "PV"


ABOVE = [
    "Tag: FIC4101.{}\nTimestamp,Value\n",
    "Tag,FIC4101.{}\n\nTimestamp,Value\n",
    "# Point Name = FIC4101.{}\nTimestamp,Value\n",
    "Trend export\nTagname,FIC4101.{}\nUnits,%\nFrom,2026-02-01 10:00:00\n\nTimestamp,Value\n",
    "FIC4101.{}\nTimestamp,Value\n",
    "Timestamp,FIC4101.{}\n",
    ",FIC4101.{}\n",
    "Timestamp,FIC4101.{} [%]\n",
]


@pytest.mark.parametrize("above", ABOVE)
def test_a_heading_or_a_line_above_is_the_tag(above, tmp_path):
    tables = [
        table_of(above.format(word) + rows(x), tmp_path / f"export{k}.csv")
        for k, (word, x) in enumerate(SIGNALS.items())
    ]
    unit = " [%]" if "[%]" in above else ""
    columns = read_layout(tables, ReadOptions())
    check(columns, [f"FIC4101.{word}{unit}" for word in SIGNALS])
    assert {column.unit for column in columns} == {"%" if "%" in above else ""}


@pytest.mark.parametrize("heading", ["Quality", "Status", "Confidence"])
def test_the_quality_stands_with_the_value(heading, tmp_path):
    tables = [
        table_of(f"Timestamp,Value,{heading}\n" + rows(x, ",100"), tmp_path / f"F.{word}.csv")
        for word, x in SIGNALS.items()
    ]
    columns = read_layout(tables, ReadOptions())
    check(columns, [f"F.{word}" for word in SIGNALS])
    assert set(columns[0].flags.popitem()[1]()) == {"100"}


def test_date_and_clock_beside_one_value(tmp_path):
    lines = "".join(f"{stamp(k).replace(' ', ',')},{x}\n" for k, x in enumerate(SIGNALS["PV"]))
    [column] = read_layout([table_of("Date,Time,Value\n" + lines, tmp_path / "F.PV.csv")], ReadOptions())
    assert (column.name, values(column)) == ("F.PV", SIGNALS["PV"].tolist())


@pytest.mark.parametrize("header", ["when,Value,Units", "Time,Value,", "No,Time,Value"])
def test_other_columns_beside_the_value(header, tmp_path):
    cells = {"when": stamp, "Time": stamp, "Units": lambda _: "t/h", "": lambda _: "", "No": str}
    lines = [
        ",".join(str(SIGNALS["PV"][k]) if h == "Value" else cells[h](k) for h in header.split(",")) for k in range(N)
    ]
    [column] = read_layout([table_of("\n".join([header, *lines]) + "\n", tmp_path / "F.PV.csv")], ReadOptions())
    assert (column.name, values(column)) == ("F.PV", SIGNALS["PV"].tolist())
    assert (column.clock.stamps.seconds - ZERO).tolist() == K.tolist()


@pytest.mark.parametrize("header", ["Time,Value,Steam", "Time,PV,Steam", "Time,Value,OP"])
def test_a_second_column_of_values_is_no_one_tag(header):
    text = header + "\n" + "".join(f"{stamp(k)},{SIGNALS['PV'][k]},{SIGNALS['OP'][k]}\n" for k in K)
    assert [column.name for column in read_layout([table_of(text)], ReadOptions())] == header.split(",")[1:]


@pytest.mark.parametrize("header", ["Tag,Time,Value", "Time,FIC-1.PV,FIC-1.OP"])
def test_tables_with_the_same_tags_are_pieces_of_one(header, tmp_path):
    def piece(part):
        if header.startswith("Tag"):
            return "".join(f"FIC-1.{word},{stamp(k)},{SIGNALS[word][k]}\n" for word in ("PV", "OP") for k in part)
        return "".join(f"{stamp(k)},{SIGNALS['PV'][k]},{SIGNALS['OP'][k]}\n" for k in part)

    tables = [table_of(f"{header}\n{piece(part)}", tmp_path / f"{part[0]}.csv") for part in (K[:20], K[20:35], K[35:])]
    columns = {column.name: column for column in read_layout(tables, ReadOptions())}
    assert list(columns) == ["FIC-1.PV", "FIC-1.OP"]
    for word in ("PV", "OP"):
        assert values(columns[f"FIC-1.{word}"]) == SIGNALS[word].tolist()
        assert (columns[f"FIC-1.{word}"].clock.stamps.seconds - ZERO).tolist() == K.tolist()
    assert any("3 tables with the same headings" in note for note in columns["FIC-1.PV"].table.notes)


def test_sheets_of_one_loop_each_are_not_joined():
    frames = [pl.DataFrame({"Time": K + 0.0, "PV": SIGNALS["PV"], "OP": SIGNALS["OP"]}) for _ in range(2)]
    columns = read_layout([frame_to_table(frame, f"loop {k}") for k, frame in enumerate(frames)], ReadOptions())
    assert [(column.name, column.table.origin.stem) for column in columns] == [
        ("PV", columns[0].table.origin.stem),
        ("OP", columns[0].table.origin.stem),
        ("PV", columns[2].table.origin.stem),
        ("OP", columns[2].table.origin.stem),
    ]
    assert [len(column.cells) for column in columns] == [N] * 4


@pytest.mark.parametrize("corner", ["Tag", "", "Point", "Time"])
@pytest.mark.parametrize("form", ["%d-%b-%y %H:%M:%S", "%Y-%m-%d %H:%M:%S", "%d/%m/%Y %H:%M:%S", "%H:%M:%S"])
@pytest.mark.parametrize("words", [("PV", "SP", "OP"), ("PV", "OP")])
def test_tags_in_rows(corner, form, words):
    head = ",".join([corner, *((START + timedelta(seconds=2 * k)).strftime(form) for k in range(N))])
    lines = [",".join([f"FIC-1.{word}", *map(str, SIGNALS[word])]) for word in words]
    columns = read_layout([table_of("\n".join([head, *lines]) + "\n")], ReadOptions())
    assert [column.name for column in columns] == [f"FIC-1.{word}" for word in words]
    for column, word in zip(columns, words, strict=True):
        assert values(column) == SIGNALS[word].tolist()
        assert np.diff(column.clock.stamps.seconds).tolist() == [2.0] * (N - 1)
    assert any("is transposed" in note for note in columns[0].table.notes)


@pytest.mark.parametrize("title", ["", "Trend of unit 3\n\n"])
def test_units_and_descriptions_before_the_times(title):
    head = ",".join(["Tag", "Description", "Units", *(stamp(k) for k in K)])
    lines = [
        ",".join([f"FIC-1.{word}", "Reflux", unit, *map(str, SIGNALS[word])])
        for word, unit in (("PV", "t/h"), ("OP", "%"))
    ]
    pv, op = read_layout([table_of(title + "\n".join([head, *lines]) + "\n")], ReadOptions())
    assert (pv.unit, op.unit, pv.description) == ("t/h", "%", "Reflux")
    assert values(op) == SIGNALS["OP"].tolist()


def test_a_layout_of_the_user_is_tried_first():
    class Mine:
        def recognises(self, table, options):
            return table.header[0][0] == "mine"

        def read(self, table, options):
            return [TagColumn("X.PV", table, None, lambda: table.column(1))]

    register_layout(mine := Mine())
    try:
        assert [c.name for c in read_layout([table_of("mine,a\n1,2\n3,4\n")], ReadOptions())] == ["X.PV"]
    finally:
        LAYOUTS.remove(mine)
