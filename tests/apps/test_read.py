"""`stiction read`: what a source holds, its conversion and its map, and the reading options of every verb."""

from __future__ import annotations

import csv
import gzip
import json
import sqlite3

import numpy as np
import polars as pl
import pytest

from stiction.sources import read

N = 200
K = np.arange(N)
RNG = np.random.default_rng(5)
PV = np.round(50.0 + 3.0 * np.sin(K / 9) + 0.1 * RNG.normal(size=N), 3)
OP = np.round(40.0 + 4.0 * np.cos(K / 9) + 0.1 * RNG.normal(size=N), 3)


@pytest.fixture
def plant(folder):
    """Two loops in one CSV file, with a bad value and a column that no loop has."""
    frame = pl.DataFrame({
        "time_s": K * 2.0, "FIC-1.PV": PV, "FIC-1.OP": OP, "FIC-1.XYZ": OP, "LIC-2.PV": PV + 1, "LIC-2.OP": OP + 1,
    })  # fmt: skip
    text = frame.write_csv().replace(f"\n{K[9] * 2.0},{PV[9]},", f"\n{K[9] * 2.0},Bad,")
    (folder / "plant.csv").write_text(text)
    return "plant.csv"


def test_the_summary_names_loops_bad_values_and_unused_columns(run, plant):
    done = run("read", plant)
    assert (done.code, done.err) == (0, "")
    for part in ("2 loops read", "FIC-1 (flow)", "200 rows, 200 samples every 2 s", "1 x 'Bad'", "not used: FIC-1.XYZ"):
        assert part in done.out
    [one, other] = json.loads(run("read", plant, "--json").out)["loops"]
    assert (one["tag"], one["dt"], one["bad_values"], one["unused_columns"]) == (
        "FIC-1",
        2.0,
        {"Bad": 1},
        ["FIC-1.XYZ"],
    )
    assert other["loop_type"] == "level"


def test_out_gives_equal_records(run, plant, folder):
    done = run("read", plant, "--out", "loops.parquet")
    assert (done.code, done.out.splitlines()[-1]) == (0, "Loops: loops.parquet")
    assert read("loops.parquet") == read(plant)
    assert sorted(path.name for path in folder.iterdir()) == ["loops.parquet", plant]
    assert run("read", plant, "--tag", "LIC-2", "--out", "loops.parquet").code == 0
    assert [record.tag for record in read("loops.parquet")] == ["LIC-2"]


def test_a_map_is_written_edited_and_read_back(run, plant, folder):
    assert run("read", plant, "--write-map", "map.csv").code == 0
    rows = list(csv.DictReader((folder / "map.csv").open(encoding="utf-8")))
    assert {(row["tag"], row["loop"], row["role"]) for row in rows} >= {
        ("FIC-1.PV", "FIC-1", "pv"),
        ("LIC-2.OP", "LIC-2", "op"),
    }
    text = (folder / "map.csv").read_text().replace("FIC-1.OP,FIC-1,op,,,", "FIC-1.OP,FIC-1,op,,0,200")
    (folder / "edited.csv").write_text(text)
    assert run("read", plant, "--map", "edited.csv", "--out", "loops.parquet").code == 0
    np.testing.assert_allclose(read("loops.parquet")[0].op, OP / 2.0)
    assert run("read", plant, "--write-map", "map.csv").code == 0  # the same rows
    done = run("read", plant, "--write-map", "edited.csv", "--out", "more.parquet")
    assert (done.code, done.out) == (3, "")
    assert "edited.csv exists with other rows" in done.err
    assert "Give another name with --write-map, or delete the file first." in done.err
    assert (folder / "edited.csv").read_text() == text
    assert not (folder / "more.parquet").exists()


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        ([], 2, "no source was given"),
        (["nothing.csv"], 3, "nothing.csv: no such file"),
        (["plant.csv", "--out", "loops.csv"], 2, "--out loops.csv does not end in .parquet"),
        (["plant.csv", "--write-map", "plant.csv"], 2, "would replace the source"),
        (["plant.csv", "--out", "none/loops.parquet"], 3, "there is no folder none"),
        (["plant.csv", "--write-map", "notes.csv"], 3, "notes.csv was not written by stiction"),
        (["empty"], 3, "is a folder without files"),
        (["data/*.csv"], 3, "no file matches this pattern"),
        (["plant.csv", "--map", "notes.csv"], 3, "notes.csv"),
        (["plant.csv", "--table", "trend"], 2, "can be used only with a database"),
        (["plant.csv", "--max-bytes", "100"], 3, "--max-bytes"),
        (["plant.csv", "--timezone", "Mars"], 2, "'Mars' is unknown"),
        (["nothing.csv", "--out", "loops.parquet"], 3, "nothing.csv: no such file"),
        (["plant.csv", "--tag", "FIC-9"], 3, "FIC-9"),
        (["sqlite:///none.db", "--table", "trend"], 3, "none.db"),
        (["postgresql+psycopg://ana:s3cret@127.0.0.1:1/plant", "--table", "trend"], 3, "ana:***@127.0.0.1"),
    ],
)
def test_a_problem_is_one_sentence_and_nothing_is_written(argv, code, says, run, plant, folder):
    (folder / "notes.csv").write_text("my,notes\n")
    (folder / "empty").mkdir()
    before = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    done = run("read", *argv)
    assert (done.code, done.err.count("\n")) == (code, 1)
    assert done.err.startswith("stiction: ")
    assert says in done.err
    assert "s3cret" not in done.err + done.out
    assert "max_bytes=" not in done.err
    assert {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before


def test_files_that_cannot_be_read_are_named_beside_the_others(run, plant, folder):
    (folder / "notes.csv").write_text("my,notes\n")
    done = run("read", ".", "--write-map", "map.csv", "--out", "loops.parquet")
    assert done.code == 0
    assert "2 loops read" in done.out
    assert "Not read: " in done.err
    assert "notes.csv" in done.err
    rows = list(csv.DictReader((folder / "map.csv").open(encoding="utf-8")))
    assert {row["loop"] for row in rows} == {"FIC-1", "LIC-2"}
    assert [record.tag for record in read("loops.parquet")] == ["FIC-1", "LIC-2"]


def write_one_file_per_tag(folder):
    for word, x in (("PV", PV), ("OP", OP)):
        pl.DataFrame({"Timestamp": K * 2.0, "Value": x}).write_csv(folder / f"FIC-1.{word}.csv")


def test_files_of_one_tag_each_are_one_loop_however_they_are_named(run, folder):
    (folder / "tags").mkdir()
    write_one_file_per_tag(folder / "tags")
    for sources in (["tags"], ["tags/*.csv"], ["tags/FIC-1.PV.csv", "tags/FIC-1.OP.csv"]):
        [loop] = json.loads(run("read", *sources, "--json").out)["loops"]
        assert (loop["tag"], loop["samples"]) == ("FIC-1", N)
    [found] = json.loads(run("diagnose", "tags/FIC-1.PV.csv", "tags/FIC-1.OP.csv", "--json").out)
    assert found["tag"] == "FIC-1"


def test_a_database_is_read_by_its_url(run, folder):
    with sqlite3.connect(folder / "plant.db") as database:
        database.execute("CREATE TABLE trend (t REAL, tag TEXT, v REAL)")
        rows = [(2.0 * k, f"FIC-1.{word}", float(x[k])) for k in K for word, x in (("PV", PV), ("OP", OP))]
        database.executemany("INSERT INTO trend VALUES (?, ?, ?)", rows)
    long = ["--time-column", "t", "--tag-column", "tag", "--value-column", "v"]
    done = run("read", "sqlite:///plant.db", "--table", "trend", *long, "--out", "loops.parquet")
    assert done.code == 0
    [record] = read("loops.parquet")
    np.testing.assert_array_equal(record.op, OP)
    done = run("read", "sqlite:///plant.db", "--table", "trend", *long, "--since", "100", "--json")
    assert json.loads(done.out)["loops"][0]["samples"] == N - 50
    [found] = json.loads(run("diagnose", "sqlite:///plant.db", "--table", "trend", *long, "--json").out)
    assert found["tag"] == "FIC-1"


def test_compressed_files_and_concentration_are_accepted(run, plant, folder):
    (folder / "plant.csv.gz").write_bytes(gzip.compress((folder / plant).read_bytes()))
    [loop] = json.loads(run("read", "plant.csv.gz", "--tag", "FIC-1", "--loop-type", "concentration", "--json").out)[
        "loops"
    ]
    assert loop["loop_type"] == "analyser"


@pytest.mark.parametrize("verb", ["read", "diagnose", "compensate", "valve-test analyse"])
def test_every_verb_has_the_same_reading_options(verb, run):
    from stiction.apps.reading_options import ReadingOptions

    shown = run(*verb.split(), "--help").out
    for name in vars(ReadingOptions()):
        assert f"--{name.replace('_', '-')}" in shown
