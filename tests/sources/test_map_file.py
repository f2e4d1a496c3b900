"""The mapping file: what it settles, what it refuses, and that a written one reads back."""

from __future__ import annotations

import polars as pl
import pytest

from stiction.atomic_write import write_atomically
from stiction.errors import RecordError
from stiction.sources.options import ReadOptions
from stiction.sources.roles.assign import assign_roles
from stiction.sources.roles.map_file import map_text, read_map
from stiction.sources.table import Origin, RawTable, TagColumn


@pytest.fixture
def columns():
    names = ["AI1", "AO2", "AI3", "LIC9.PV", "LIC9.OP"]
    table = RawTable(Origin("plant.csv", "plant"), [names], [], len(names), lambda _: pl.DataFrame())
    return [TagColumn(name, table, None, lambda: pl.Series(["1"]), position=k) for k, name in enumerate(names)]


@pytest.fixture
def write(tmp_path):
    def writing(text):
        path = tmp_path / "map.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return writing


def test_a_map_settles_all(columns, write):
    path = write(
        "# areas of unit 3\n"
        "tag;loop;role;unit;low;high;area;master;importance\n"
        "ai1;FIC7;PV;t/h;;;north;TIC1;high\n"
        "AO2;FIC7;op;mA;4,0;20,0;;;\n"
        "AI3;FIC7;pv quality;;;;;;\n"
    )
    [loop] = assign_roles(columns, ReadOptions(), read_map(path))
    assert {role: column.name for role, column in loop.roles.items()} == {"pv": "AI1", "op": "AO2", "pv quality": "AI3"}
    assert (loop.tag, loop.loop_type, loop.area, loop.master, loop.importance) == (
        "FIC7",
        "flow",
        "north",
        "TIC1",
        "high",
    )
    assert (loop.spans, loop.unit_of("op"), loop.unit_of("pv")) == ({"op": (4.0, 20.0)}, "mA", "t/h")
    assert loop.notes == []


GOOD = "AO2,F1,op\nAI1,F1,pv\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("tag,loop,rolle\n", r"line 1: column 'rolle' is unknown; use tag, loop, role"),
        ("tag,loop\nAO2,F1\n", r"line 1: has no column 'role'"),
        ("tag,loop,role\n" + GOOD + "AI3,F1,valve\n", r"line 4: role 'valve' is unknown; use one of pv, sp, op"),
        ("tag,loop,role\nAI1,F1,pv\n", r"line 2: loop F1 has no row with role op"),
        ("tag,loop,role\n" + GOOD + "AI3,F1,pv\n", r"line 4: 'AI3' is the PV of F1, but 'AI1' is it already"),
        ("tag,loop,role\n" + GOOD + "ao2,F2,op\n", r"line 4: 'ao2' is in the map twice: as op of F2 and as op of F1"),
        ("tag,loop,role,low,high\nAO2,F1,op,20,4\n", r"line 2: low = 20 is not below high = 4"),
        ("tag,loop,role,low,high\nAO2,F1,op,4,\n", r"line 2: gives only one of low and high"),
        ("tag,loop,role,low,high\nAO2,F1,op,a,4\n", r"line 2: low = 'a' is not a number"),
        ("tag,loop,role,low,high\nAO2,F1,op,-inf,4\n", r"line 2: low = '-inf' is not a number"),
        ("tag,loop,role\n,F1,op\n", r"line 2: tag or loop is empty"),
        ("tag,loop,role,master\nAO2,F1,op,f1\n", r"line 2: F1 is its own master"),
        ("tag,loop,role\n", r"no rows below its header"),
        ("tag,loop,role\nAI1,F1,unused\n", r"no rows below its header that assign a tag"),
        ("\n", r"the map is empty"),
        ("tag,loop,role\n" + GOOD + "X9,F1,sp\n", r"line 4: tag 'X9' is not in the source; its columns are AI1, AO2"),
    ],
)
def test_each_mistake_has_its_message(text, message, columns, write):
    path = write(text)
    with pytest.raises(RecordError, match=message) as caught:
        assign_roles(columns, ReadOptions(), read_map(path))
    assert str(caught.value).startswith(str(path))


def test_loops_of_a_plant_wide_map_that_are_not_in_the_source_are_left_out(columns, write):
    other = "X1,F8,op\nX2,F8,pv\n"
    [loop] = assign_roles(columns, ReadOptions(), read_map(write("tag,loop,role\n" + other + GOOD)))
    assert (loop.tag, loop.notes) == (
        "F1",
        ["Left out: F8, as 2 of 4 tags of the map are not in the source."],
    )
    with pytest.raises(RecordError, match="line 2: tag 'X1' is not in the source"):
        assign_roles(columns, ReadOptions(), read_map(write("tag,loop,role\n" + other)))


def test_a_map_that_cannot_be_read(tmp_path):
    with pytest.raises(RecordError, match="cannot be read"):
        read_map(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"tag,loop\xff\xfe")
    with pytest.raises(RecordError, match="UTF-8"):
        read_map(tmp_path / "bytes.csv")


def test_a_written_map_gives_the_same_loops(columns, tmp_path):
    [level] = assign_roles(columns[3:], ReadOptions())
    [chosen] = assign_roles(columns[:3], ReadOptions(columns={"pv": "AI1", "op": "AO2"}))
    chosen.spans["op"], chosen.units["op"], chosen.area = (4.0, 20.0), "mA", 'north, "old"'
    path = tmp_path / "map.csv"
    path.write_text("old", encoding="utf-8")
    write_atomically(map_text([level, chosen]), path)
    back = assign_roles(columns, ReadOptions(), read_map(path))
    assert [loop.tag for loop in back] == ["LIC9", "plant"]
    assert [loop.roles for loop in back] == [level.roles, chosen.roles]
    assert (back[1].spans, back[1].units, back[1].area) == (chosen.spans, chosen.units, chosen.area)
    assert [entry.name for entry in tmp_path.iterdir()] == ["map.csv"]


def test_a_written_map_lists_unused_columns_which_an_edit_can_use(columns, tmp_path):
    [chosen] = assign_roles(columns[:3], ReadOptions(columns={"pv": "AI1", "op": "AO2"}))
    path = tmp_path / "map.csv"
    write_atomically(map_text([chosen]), path)
    assert path.read_text().splitlines()[1:] == [
        "AI1,plant,pv,,,,,,,", "AO2,plant,op,,,,,,,", "AI3,plant,unused,,,,,,,",
    ]  # fmt: skip
    [back] = assign_roles(columns[:3], ReadOptions(), read_map(path))
    assert (back.roles, back.unused) == (chosen.roles, ["AI3"])
    path.write_text(path.read_text().replace("unused", "sp"))
    [edited] = assign_roles(columns[:3], ReadOptions(), read_map(path))
    assert (edited.roles["sp"].name, edited.unused) == ("AI3", [])


def test_columns_without_a_name_are_mapped_by_their_number(columns, tmp_path):
    nameless = [TagColumn("", one.table, None, one.load, position=one.position) for one in columns[:2]]
    [chosen] = assign_roles(nameless, ReadOptions(columns={"pv": 0, "op": 1}))
    write_atomically(map_text([chosen]), tmp_path / "map.csv")
    [back] = assign_roles(nameless, ReadOptions(), read_map(tmp_path / "map.csv"))
    assert back.roles == chosen.roles
