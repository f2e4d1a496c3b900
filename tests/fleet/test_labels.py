"""labels.csv: append-only, two people at once, rows that a crash cut off."""

from __future__ import annotations

import csv
import errno
import os
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


BAD_ROWS = {
    "cut off": ("FIC-2,2026-01-0", 3, "label"),
    "a comma too many": ("FIC-2,2026-01-01,note,packing, glands,Ana\n", 3, "between quotes"),
    "open quote": ('FIC-2,2026-01-01,note,"see order 7,Ana\nFIC-3,2026-01-02,note,x,Bo\n', 3, "quote"),
    "open quote before another": ('FIC-2,2026-01-01,note,"order,Ana\nFIC-3,2026-01-02,note,"x",Bo\n', 3, "quote"),
    "unknown label": ("FIC-2,2026-01-01,note,x,Bo\n\nFIC-3,2026-01-01,broken,x,Bo\n", 5, "broken"),
}


@pytest.mark.parametrize("name", BAD_ROWS)
def test_bad_row_is_refused_by_its_number(tmp_path, name):
    append_label(tmp_path, "FIC-1", "acknowledged")
    path = tmp_path / "labels.csv"
    text, line, word = BAD_ROWS[name]
    path.write_text(path.read_text() + text)
    before = path.read_bytes()
    with pytest.raises(RecordError, match=rf"labels\.csv, line {line}: .*{word}"):
        read_labels(tmp_path)
    with pytest.raises(RecordError, match=f"line {line}"):
        append_label(tmp_path, "FIC-4", "note", "must not be lost")
    assert path.read_bytes() == before


WRITINGS = {
    "utf-8 with mark": lambda text: text.encode("utf-8-sig"),
    "latin-1": lambda text: text.encode("cp1252"),
    "utf-16": lambda text: text.encode("utf-16"),
    "CR": lambda text: text.replace("\n", "\r").encode(),
    "CRLF": lambda text: text.replace("\n", "\r\n").encode(),
    "semicolons": lambda text: text.replace(",", ";").encode("cp1252"),
    "no end": lambda text: text.rstrip("\n").encode(),
}


@pytest.mark.parametrize("name", WRITINGS)
def test_any_writing_of_a_spreadsheet_can_be_appended_to(tmp_path, name):
    text = "tag,time,label,note,author\nFIC-1,2026-01-01,note,Dürr & Söhne,Jörg\nFIC-2,2026-01-02,repaired,,Ana\n"
    path = tmp_path / "labels.csv"
    path.write_bytes(WRITINGS[name](text))
    before = path.read_bytes()
    append_label(tmp_path, "FIC-3", "note", 'a "quoted", 3 µm; note\nof two lines', "Zoë")
    labels = read_labels(tmp_path)
    assert [label.tag for label in labels] == ["FIC-1", "FIC-2", "FIC-3"]
    assert labels[0].note == "Dürr & Söhne"
    assert labels[2].note == 'a "quoted", 3 µm; note\nof two lines'
    assert path.read_bytes().startswith(before)
    added = path.read_bytes()[len(before) :].replace(b"\0", b"")
    assert added.startswith(b"\n") == (name == "no end")


def test_character_that_the_file_cannot_hold_is_refused(tmp_path):
    path = tmp_path / "labels.csv"
    path.write_bytes("tag,time,label,note,author\nFIC-1,2026-01-01,note,Söhne,Jörg\n".encode("cp1252"))
    with pytest.raises(RecordError, match=r"does not have the character '弁'; save it as CSV in UTF-8"):
        append_label(tmp_path, "FIC-2", "note", "弁")
    assert len(read_labels(tmp_path)) == 1


def test_surrogates_and_line_ends_are_stored(tmp_path):
    append_label(tmp_path, "FIC-1", "note", "a\udc80b\r\nc\rd\0")
    assert read_labels(tmp_path)[0].note == "a?b\nc\nd"


def test_full_disk_is_called_a_full_disk(tmp_path, monkeypatch):
    append_label(tmp_path, "FIC-1", "note", "first")

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(RecordError, match="the disk is full"):
        append_label(tmp_path, "FIC-2", "note", "second")
    monkeypatch.undo()
    assert [label.tag for label in read_labels(tmp_path)] == ["FIC-1"]


def test_bad_labels(tmp_path):
    with pytest.raises(ParameterError, match="give one of acknowledged"):
        append_label(tmp_path, "FIC-1", "broken")
    (tmp_path / "labels.csv").write_text("loop,when\nA,B\n")
    with pytest.raises(RecordError, match="write tag,time,label,note,author in its first line"):
        read_labels(tmp_path)
