"""What no command may let through: errors of libraries and of the machine, and characters that a screen obeys."""

from __future__ import annotations

import errno
import json

import numpy as np
import polars as pl
import pytest

import stiction as st
from stiction.apps import cli
from stiction.display.visible_text import visible
from stiction.foreign_errors import data_error

FOREIGN = {
    "panic": (pl.exceptions.PanicException("date out of range"), "cannot be read"),
    "memory": (MemoryError(), "there is not enough memory"),
    "overflow": (OverflowError(34, "Numerical result out of range"), "too large or too small"),
    "nesting": (RecursionError("maximum recursion depth exceeded"), "nested too deeply"),
    "surrogate": (UnicodeEncodeError("utf-8", "\ud800", 0, 1, "surrogates not allowed"), "cannot be used"),
    "full disk": (OSError(errno.ENOSPC, "No space left on device"), "the disk is full"),
}
TAG = "FIC\x1b[31m-\u202e101"


@pytest.mark.parametrize("name", FOREIGN)
def test_error_of_data_or_machine_is_a_message_and_3(monkeypatch, capfd, name):
    error, words = FOREIGN[name]

    def fail(_):
        raise error

    monkeypatch.setattr(cli, "_app", fail)
    code = cli.main(["doctor"])
    shown = capfd.readouterr().err
    assert code == 3
    assert words in shown
    assert "Traceback" not in shown


@pytest.mark.parametrize("error", [KeyError("x"), ZeroDivisionError(), AssertionError()])
def test_fault_of_the_program_is_no_error_of_data(error):
    assert data_error(error) is None


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), SystemExit(3)])
def test_request_to_end_is_no_error_of_data(stop):
    assert data_error(stop) is None


def test_tags_cannot_steer_the_terminal_or_the_page(tmp_path, run):
    rows = "\n".join(f"{k},{50 + k % 5},{40 + k % 7}" for k in range(300))
    (tmp_path / "a.csv").write_text(f"time_s,{TAG}.PV,{TAG}.OP\n{rows}\n")
    shown = run("diagnose", str(tmp_path / "a.csv"), "--report", str(tmp_path / "page.html"))
    page = (tmp_path / "page.html").read_text()
    for text in (shown.out, shown.err, page):
        assert not {"\x1b", "\u202e"} & set(text)
    assert "FIC\\x1b[31m-\\u202e101" in shown.out
    assert "FIC\\x1b[31m-\\u202e101" in page
    [one] = json.loads(run("diagnose", str(tmp_path / "a.csv"), "--json", "--no-report").out)
    assert one["tag"] == TAG


@pytest.mark.parametrize("code", [*range(9), *range(11, 32), 127, 133, 0x200E, 0x202A, 0x202E, 0x2066, 0x2069, 0xD800])
def test_obeyed_characters_are_shown_as_codes(code):
    assert visible(f"a{chr(code)}b") == (f"a\\x{code:02x}b" if code < 256 else f"a\\u{code:04x}b")


def test_text_of_people_stays():
    assert visible("Süd µ 弁\tנעול\n") == "Süd µ 弁\tנעול\n"


@pytest.mark.parametrize("factor", [1e-160, 1e-300, 1e-20])
def test_signals_of_any_size_are_judged(factor):
    k = np.arange(1500)
    frame = pl.DataFrame({
        "time_s": 1.0 * k, "F1.PV": factor * (3.0 * np.sin(k / 9) + (k * 7 % 11) / 40), "F1.OP": 40 + 4 * np.cos(k / 9),
    })  # fmt: skip
    assert st.diagnose(st.read(frame)[0]).verdict in ("stiction", "no_stiction", "undecided")


def test_audit_tells_the_files_that_cannot_be_read_with_their_reasons(tmp_path, run):
    (tmp_path / "plant").mkdir()
    rows = "\n".join(f"{k},{50 + k % 5},{40 + k % 7}" for k in range(300))
    (tmp_path / "plant" / "a.csv").write_text(f"time_s,F1.PV,F1.OP\n{rows}\n")
    (tmp_path / "plant" / "b.csv").write_text("")
    done = run("audit", str(tmp_path / "plant"), "--out", str(tmp_path / "out"), "--workers", "1")
    assert done.code in (0, 1)
    assert "1 loop in 1 part of the source" in done.err
    assert "1 file cannot be read" in done.err
    assert "b.csv: is empty; export the loop again" in done.out
    assert "b.csv" in (tmp_path / "out" / "index.html").read_text()
