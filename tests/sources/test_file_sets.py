"""Several files as one source: each as it is alone; joined where one lacks a signal or times follow each other."""

from __future__ import annotations

import shutil
import zipfile
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

import stiction as st
from stiction.sources import open_loops

N = 200


def write(
    path: Path, tag: str, first: int = 0, seed: int = 0, *, rows: int = N, words=("PV", "OP", "SP"), zone=""
) -> None:
    """A loop of `rows` seconds from second `first` of a day; the values depend on seed and second alone."""
    values = np.round(50.0 + np.random.default_rng(seed).normal(size=(1000, 3)), 3)
    columns = dict(zip(("PV", "OP", "SP"), range(3), strict=True))
    lines = [",".join(["time", *(f"{tag}.{word}" if tag else word for word in words)])]
    for k in range(first, first + rows):
        moment = (datetime(2026, 3, 2) + timedelta(seconds=k)).isoformat()
        lines.append(",".join([moment + zone, *(f"{values[k % 1000, columns[word]]}" for word in words)]))
    path.write_text("\n".join(lines) + "\n")


def told(record: st.LoopRecord) -> str:
    return " ".join(record.provenance.assumptions)


def test_file_among_others_is_read_as_it_is_alone(tmp_path: Path) -> None:
    write(tmp_path / "trend7.csv", "")
    alone = st.read(tmp_path / "trend7.csv")[0]
    write(tmp_path / "unit.csv", "FIC-1", seed=1)
    write(tmp_path / "trend8.csv", "", seed=2)
    records = st.read(tmp_path)
    assert [one.tag for one in records] == ["trend7", "trend8", "FIC-1"]
    assert np.array_equal(records[0].op, alone.op)
    assert records[0].provenance.assumptions == alone.provenance.assumptions


def test_signals_that_one_file_lacks_come_from_the_other(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", "FIC-1", words=("PV",))
    write(tmp_path / "b.csv", "FIC-1", words=("OP",))
    write(tmp_path / "c.csv", "LIC-2", words=("PV", "OP"))
    write(tmp_path / "d.csv", "LIC-2", words=("SP",))
    second, first = st.read(tmp_path)
    assert (first.tag, second.tag) == ("FIC-1", "LIC-2")
    assert all(name in told(first) for name in ("a.csv", "b.csv"))
    assert second.sp is not None
    assert "LIC-2.SP of " in told(second)


def test_set_point_of_another_time_is_not_added(tmp_path: Path) -> None:
    write(tmp_path / "c.csv", "LIC-2", words=("PV", "OP"))
    write(tmp_path / "d.csv", "LIC-2", 5000, words=("SP",))
    records, failures = open_loops(tmp_path).read_all()
    assert [one.sp for one in records] == [None]
    assert [Path(one.file).name for one in failures] == ["d.csv"]


@pytest.mark.parametrize("order", ["ab", "ba"])
def test_consecutive_times_of_one_tag_are_one_record(tmp_path: Path, order: str) -> None:
    write(tmp_path / f"{order[0]}.csv", "FIC-1", 0)
    write(tmp_path / f"{order[1]}.csv", "FIC-1", N + 5, words=("OP", "PV", "SP"))  # 5 s later, in another order
    write(tmp_path / "whole.csv", "FIC-1", 0, rows=2 * N + 5)
    whole = st.read(tmp_path / "whole.csv")[0]
    (tmp_path / "whole.csv").unlink()
    [record] = st.read(tmp_path)
    known = np.isfinite(record.op)
    assert (len(record), known.sum()) == (2 * N + 5, 2 * N)
    assert np.array_equal(record.op[known], whole.op[known])
    assert np.array_equal(record.pv[known], whole.pv[known])
    assert "2 files of FIC-1 were joined" in told(record)


def test_equal_values_in_the_overlap_are_joined(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", "FIC-1", 0)
    write(tmp_path / "b.csv", "FIC-1", N // 2)
    shutil.copy(tmp_path / "a.csv", tmp_path / "copy.csv")
    [record] = st.read(tmp_path)
    assert len(record) == N + N // 2
    assert np.isfinite(record.op).all()
    assert "3 files of FIC-1 were joined" in told(record)


def test_values_that_differ_make_two_loops_with_a_warning(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", "FIC-1", 0)
    write(tmp_path / "b.csv", "FIC-1", N // 2, seed=1)
    records = st.read(tmp_path)
    assert [one.tag for one in records] == ["FIC-1 (a.csv)", "FIC-1 (b.csv)"]
    assert [len(one) for one in records] == [N, N]
    assert all("has other values of FIC-1 at the same times" in told(one) for one in records)


def test_times_far_apart_are_records_of_one_loop(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", "FIC-1", 0)
    write(tmp_path / "b.csv", "FIC-1", 3 * N)
    records = st.read(tmp_path)
    assert [one.tag for one in records] == ["FIC-1", "FIC-1"]
    assert all("has another record of FIC-1" in told(one) for one in records)


def test_units_that_differ_are_not_joined(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", "FIC-1", 0)
    write(tmp_path / "b.csv", "FIC-1", N)
    for name, unit in (("a.csv", "t/h"), ("b.csv", "kg/h")):
        text = (tmp_path / name).read_text()
        (tmp_path / name).write_text(text.replace("FIC-1.PV", f"FIC-1.PV [{unit}]", 1))
    assert [len(one) for one in st.read(tmp_path)] == [N, N]


def test_pieces_of_one_signal_are_joined_before_the_loop(tmp_path: Path) -> None:
    for word in ("PV", "OP"):
        for day in range(3):
            write(tmp_path / f"{word}_{day}.csv", "FIC-1", day * N, words=(word,))
    [record] = st.read(tmp_path)
    assert len(record) == 3 * N
    assert np.isfinite(record.op).all()


def test_files_that_cannot_be_read_are_failures_with_reasons(tmp_path: Path) -> None:
    write(tmp_path / "good.csv", "FIC-1")
    (tmp_path / "empty.csv").write_bytes(b"")
    (tmp_path / "scan.csv").write_bytes(b"%PDF-1.7 ...")
    (tmp_path / "pv_only.csv").write_text("time,LIC-9.PV\n" + "\n".join(f"{k},{k % 7}" for k in range(50)))
    (tmp_path / "broken.csv.gz").write_bytes(b"\x1f\x8b\x08\0" + b"\1" * 80)
    records, failures = open_loops(tmp_path).read_all()
    assert [one.tag for one in records] == ["FIC-1"]
    reasons = {Path(one.file).name: str(one.error) for one in failures}
    assert sorted(reasons) == ["broken.csv.gz", "empty.csv", "pv_only.csv", "scan.csv"]
    assert "is empty" in reasons["empty.csv"]
    assert "PDF" in reasons["scan.csv"]
    assert "OP is missing" in reasons["pv_only.csv"]
    assert "damaged" in reasons["broken.csv.gz"]
    [record] = st.read(tmp_path)
    assert told(record).count("Left out: ") == 4


def test_nothing_readable_is_an_error_with_all_reasons(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").write_bytes(b"")
    (tmp_path / "scan.csv").write_bytes(b"%PDF-1.7 ...")
    with pytest.raises(st.RecordError, match=r"from 2 files: \(1\) .*empty.*\(2\) .*PDF"):
        st.read(tmp_path)


def test_members_of_an_archive_are_files(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", "FIC-1")
    write(tmp_path / "b.csv", "", seed=3)
    with zipfile.ZipFile(tmp_path / "all.zip", "w") as archive:
        for name in ("a.csv", "b.csv"):
            archive.write(tmp_path / name, name)
        archive.writestr("notes.csv", "a letter,without numbers\nto,whom\nit,may\n")
    loops = open_loops(tmp_path / "all.zip")
    assert sorted(loops.tags) == ["FIC-1", "b"]
    assert [Path(one.file).name for one in loops.failures] == ["notes.csv"]


def test_naive_file_among_others_is_taken_in_their_zone(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", "")
    write(tmp_path / "b.csv", "FIC-1", zone="+05:30")
    write(tmp_path / "c.csv", "FIC-2", zone="Z")
    by_tag = {one.tag: one for one in st.read(tmp_path)}
    moment = datetime(2026, 3, 1, 18, 30, tzinfo=UTC)
    assert by_tag["a"].start == by_tag["FIC-1"].start == moment
    assert "taken as +05:30" in told(by_tag["a"])
    given = {one.tag: one for one in st.read(tmp_path, timezone="Europe/Berlin")}
    assert given["a"].start == datetime(2026, 3, 1, 23, tzinfo=UTC)
    assert given["FIC-1"].start == moment


def test_wanted_tag_is_chosen_among_all_files(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", "FIC-1")
    write(tmp_path / "b.csv", "")
    assert [one.tag for one in st.read(tmp_path, tag="fic-1")] == ["FIC-1"]
    assert [one.tag for one in st.read(tmp_path, tag="b")] == ["b"]
    with pytest.raises(st.RecordError, match=r"has no loop 'x'; its loops are FIC-1, b"):
        st.read(tmp_path, tag="x")


def test_parts_open_as_the_whole_source(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", "FIC-1", 0)
    write(tmp_path / "b.csv", "FIC-1", N)
    write(tmp_path / "c.csv", "FIC-3", words=("PV",))
    write(tmp_path / "d.csv", "FIC-3", words=("OP",))
    write(tmp_path / "e.csv", "FIC-5")
    loops = open_loops(tmp_path)
    for tag, files in zip(loops.tags, loops.files, strict=True):
        assert tag in open_loops(list(files)).tags
    assert sorted(len(files) for files in loops.files) == [1, 2, 2]


def test_following_files_of_another_sampling_period_or_scale_are_not_joined(tmp_path):
    """A day in seconds and one in steps of 5 s, or with OP as a fraction, would be one record with gaps or a jump."""
    import stiction as st

    def write(name, start, step, scale):
        rows = [f"{start + k * step},{150 + k % 7},{scale * (50 + k % 5)},150" for k in range(200)]
        (tmp_path / name).write_text("\n".join(["Time,FIC1.PV,FIC1.OP,FIC1.SP", *rows]) + "\n")

    write("a.csv", 0, 1, 1.0)
    for step, scale, loops in ((1, 1.0, 1), (5, 1.0, 2), (1, 0.01, 2)):
        write("b.csv", 200, step, scale)
        assert len(st.read([tmp_path / "a.csv", tmp_path / "b.csv"])) == loops, (step, scale)


def test_files_of_one_name_and_without_a_tag_are_not_one_loop(tmp_path: Path) -> None:
    for seed, folder in enumerate(("north", "south")):
        (tmp_path / folder).mkdir()
        write(tmp_path / folder / "trend.csv", "", seed=seed)
    files = [tmp_path / folder / "trend.csv" for folder in ("north", "south")]
    with pytest.raises(st.RecordError, match=r"2 files without a tag have this name \(.*north.*, .*south.*\); give"):
        st.read(files, tag="trend")
    assert [one.tag for one in st.read(files[:1], tag="X")] == ["X"]
