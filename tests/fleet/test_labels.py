"""labels.csv: append-only, two people at once, rows that a crash cut off."""

from __future__ import annotations

import csv
import subprocess
import sys

import pytest

from fleet.small_plant import ROOT
from stiction.errors import ParameterError, RecordError
from stiction.fleet import LabelConflictError, append_label, read_labels
from stiction.fleet.labels import newest_labels


def test_newest_row_of_a_tag_counts(tmp_path):
    first = append_label(tmp_path, "FIC-1", "acknowledged", "packing ordered", "Ana")
    append_label(tmp_path, "FIC-2", "not stiction")
    last = append_label(tmp_path, "FIC-1", "repaired", 'new packing, "PTFE"; 3 mm\nsee order 7', "Bo")
    assert newest_labels(read_labels(tmp_path))["FIC-1"] == last
    assert last.time > first.time
    with (tmp_path / "labels.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["tag", "time", "label", "note", "author"]
    assert rows[3][3] == 'new packing, "PTFE"; 3 mm\nsee order 7'


def test_newer_label_of_another_is_not_overruled(tmp_path):
    first = append_label(tmp_path, "FIC-1", "acknowledged", "mine", "Ana", seen="")
    append_label(tmp_path, "FIC-1", "not stiction", "theirs", "Bo", seen=first.time)
    with pytest.raises(
        LabelConflictError, match=r"Bo wrote 'not stiction', 'theirs'.*your 'repaired', 'again'"
    ) as caught:
        append_label(tmp_path, "FIC-1", "repaired", "again", "Ana", seen=first.time)
    assert (caught.value.theirs.note, caught.value.yours.note) == ("theirs", "again")
    assert len(read_labels(tmp_path)) == 2
    append_label(tmp_path, "FIC-1", "repaired", "again", "Ana", seen=caught.value.theirs.time)


def test_two_processes_lose_no_row(tmp_path):
    code = (
        "import sys; from stiction.fleet.labels import append_label\n"
        "for k in range(50): append_label(sys.argv[1], f'{sys.argv[2]}-{k}', 'note', 'x' * 500)"
    )
    command = [sys.executable, "-c", code, str(tmp_path)]
    both = [subprocess.Popen([*command, name], env={"PYTHONPATH": str(ROOT / "src")}) for name in ("A", "B")]
    assert [one.wait(120) for one in both] == [0, 0]
    assert len({label.tag for label in read_labels(tmp_path)}) == 100


def test_row_that_was_cut_off_is_left_out(tmp_path):
    append_label(tmp_path, "FIC-1", "acknowledged")
    path = tmp_path / "labels.csv"
    path.write_text(path.read_text() + "FIC-2,2026-01-0")
    assert [label.tag for label in read_labels(tmp_path)] == ["FIC-1"]
    append_label(tmp_path, "FIC-3", "note", "after the crash")
    assert [label.tag for label in read_labels(tmp_path)] == ["FIC-1", "FIC-3"]


def test_bad_labels(tmp_path):
    with pytest.raises(ParameterError, match="give one of acknowledged"):
        append_label(tmp_path, "FIC-1", "broken")
    (tmp_path / "labels.csv").write_text("loop,when\nA,B\n")
    with pytest.raises(RecordError, match="write tag,time,label,note,author in its first line"):
        read_labels(tmp_path)
