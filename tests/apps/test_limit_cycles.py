"""``stiction limit-cycles``: the paper's loop typed by hand gives the cycles of science.md N8 to N12."""

from __future__ import annotations

import json

import pytest

LOOP = ["--process", "1/(5s^2+6s+1)", "--controller", "parallel:Kp=0.5,Ki=1,Kd=0.1", "--valve", "stenman:d=0.5"]


def test_the_paper_s_loop(run):
    done = run("limit-cycles", *LOOP, "--json")
    cycles = [cycle for cycle in json.loads(done.out) if cycle["kind"] == "cycle"]
    half = sorted((cycle for cycle in cycles if cycle["family"] == "half"), key=lambda cycle: cycle["amplitude"])
    assert done.code == 1
    assert [cycle["amplitude"] for cycle in half] == pytest.approx([0.5730, 0.9448], abs=1e-4)
    assert [cycle["period_s"] for cycle in half] == pytest.approx([21.11, 16.28], abs=0.01)
    integer = sorted(cycle["exact"]["period_s"] for cycle in cycles if cycle["family"] == "integer")
    assert integer == pytest.approx([15.66, 17.59], abs=0.01)
    assert all(cycle["stable"] for cycle in cycles)


def test_table_and_page(run, folder):
    done = run("limit-cycles", *LOOP, "--report", "lc.html", "--over", "d")
    assert "21.11" in done.out
    assert "Good: period" in done.out
    page = (folder / "lc.html").read_text()
    titles = ("Nyquist plot", "Cycles over time", "Phase portrait", "Basins", "Bifurcation diagram")
    assert all(title in page for title in titles)


def test_a_good_valve_has_none(run, folder):
    done = run("limit-cycles", "--valve", "ideal", "--report", "lc.html")
    assert done.code == 0
    assert "No limit cycle" in done.out
    assert "no stable limit cycle" in (folder / "lc.html").read_text()


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        (["--valve", "kano:S=3"], 2, "needs J"),
        (["--process", "s^2/(s+1)"], 2, "improper"),
        (["--loop", "none.toml"], 3, "No such file"),
        ([*LOOP, "--over", "colour", "--report", "lc.html"], 2, "colour"),
    ],
)
def test_what_cannot_be_solved_is_said(argv, code, says, run, folder):
    done = run("limit-cycles", *argv)
    assert done.code == code
    assert says in done.err
    assert list(folder.iterdir()) == []
