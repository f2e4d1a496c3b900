"""A report is written completely or not at all."""

from __future__ import annotations

import os
import sys

import pytest

from stiction.atomic_write import write_atomically
from stiction.errors import RecordError, StictionError
from stiction.report import Text, write_page


def test_written_file_replaces_the_old_one(tmp_path):
    target = tmp_path / "report.html"
    target.write_text("old")
    assert write_atomically("new: 2 ≥ 1\n", target) == target
    assert target.read_bytes() == "new: 2 ≥ 1\n".encode()
    assert os.listdir(tmp_path) == ["report.html"]


def test_a_failure_leaves_the_old_file_and_no_draft(tmp_path, monkeypatch):
    target = tmp_path / "report.html"
    target.write_text("old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(RecordError, match=r"report\.html: cannot be written \(No space left on device\)"):
        write_atomically("new", target)
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["report.html"]


def test_an_interrupt_leaves_no_draft(tmp_path, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_atomically("new", tmp_path / "report.html")
    assert os.listdir(tmp_path) == []


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(StictionError, match=r"there is no folder .*nowhere"):
        write_page("t", [Text("x")], tmp_path / "nowhere" / "report.html")


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(RecordError, match="it is a folder"):
        write_atomically("x", tmp_path)


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="the system lets this user write anywhere")
def test_an_unwritable_folder_is_named(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(RecordError, match="Permission denied"):
        write_atomically("x", tmp_path / "report.html")


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="no /proc on this system")
def test_a_folder_that_takes_no_files_is_named():
    with pytest.raises(RecordError, match=r"/proc/self/report\.html: cannot be written .* you may write to"):
        write_atomically("x", "/proc/self/report.html")
