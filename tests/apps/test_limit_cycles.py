"""``stiction limit-cycles``: the paper's loop typed by hand gives the cycles of science.md N8 to N12."""

from __future__ import annotations

import json
import re
from types import SimpleNamespace

import pytest

import stiction as st
from stiction.limitcycle.study import scan_values

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


def test_shares_of_the_basins_cover_every_start(run, folder):
    assert run("limit-cycles", "--valve", "kano:S=5,J=2", "--report", "lc.html").code == 1
    caption, *_ = re.findall(r"starts from rest with the stem at 0: ([^<]*)\.<", (folder / "lc.html").read_text())
    assert "come to rest" in caption
    assert sum(float(part.split()[0]) for part in caption.split(";")) == pytest.approx(100.0, abs=1.0)


def test_a_good_valve_has_none(run, folder):
    done = run("limit-cycles", "--valve", "ideal", "--report", "lc.html")
    assert done.code == 0
    assert "No limit cycle" in done.out
    assert "No limit cycle: the valve does not stick." in (folder / "lc.html").read_text()


def test_a_loop_without_gain_has_none(run):
    done = run("limit-cycles", "--controller", "pi:Kc=0,Ti=10")
    assert done.code == 0
    assert "the controller has no gain" in done.out


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        (["--valve", "kano:S=3"], 2, "needs J"),
        (["--process", "s^2/(s+1)"], 2, "improper"),
        (["--loop", "none.toml"], 3, "No such file"),
        ([*LOOP, "--over", "colour", "--report", "lc.html"], 2, "colour"),
        (["--over", "disturbance"], 2, "--over disturbance is for the diagram of the report"),
        (["--disturbance", "nan"], 2, "disturbance must be a finite number"),
        (["--sp", "nan"], 2, "sp must be a finite number"),
        (["--sp", "inf"], 2, "sp must be a finite number"),
    ],
)
def test_what_cannot_be_solved_is_said(argv, code, says, run, folder):
    done = run("limit-cycles", *argv)
    assert done.code == code
    assert says in done.err
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("loop", [["--controller", "pi:Kc=-0.2,Ti=10"], ["--process", "1/(s-1)"]])
def test_a_loop_that_runs_away_is_not_said_to_be_calm(loop, run, folder):
    done = run("limit-cycles", *loop, "--report", "lc.html")
    assert done.code == 0
    assert done.out.startswith("The loop is unstable even without friction.")
    assert "No limit cycle" not in done.out
    assert "unstable even without friction" in run("limit-cycles", *loop, "--json").err
    assert "The loop is unstable even without friction" in (folder / "lc.html").read_text()


def test_the_exact_amplitudes_stand_beside_the_predicted_ones(run):
    """science.md N15: 166.0 s, OP_pp 3.4286 % and PV_pp 4.2857, where the describing function says 238.3 s."""
    header, row = run("limit-cycles").out.splitlines()
    shown = dict(zip(re.split(r"\s{2,}", header), re.split(r"\s{2,}", row), strict=True))
    assert float(shown["Period [s]"]) == pytest.approx(238.3)
    assert float(shown["Exact period [s]"]) == pytest.approx(166.0)
    assert float(shown["Exact OP [%]"]) == pytest.approx(3.4286 / 2.0, rel=1e-3)
    assert float(shown["Exact PV"]) == pytest.approx(4.2857 / 2.0, rel=1e-3)


def test_a_jump_beyond_the_band_is_solved_as_sampled(run, folder):
    """Choudhury's valve with J > S is no valve of the theory; the loop cycles at 58.67 s when it is simulated."""
    done = run("limit-cycles", "--valve", "choudhury:S=3,J=5", "--json", "--report", "lc.html")
    [cycle] = json.loads(done.out)
    assert done.code == 1
    assert (cycle["method"], cycle["stable"]) == ("sampled", True)
    assert cycle["period_s"] == pytest.approx(58.67, abs=0.02)
    assert cycle["amplitude"] == pytest.approx(4.1, abs=0.1)


def test_a_process_of_dead_time_alone(run):
    """OP steps back 10 s after every slip, and the stem rests from then on.

    By hand, with L = (0.6 + 0.06 / s) exp(-10 s) and the stem at -a: it slips from -a to 1 - a, follows for 10 s at
    0.06 a per second, and rests at a = 1 / 1.4. OP turns at a + 1. From there to its slip at a - 2 it falls by 3: 0.6
    at once, 0.6 * 0.6 a + 0.06 * 0.5 * 10 within 10 s, the rest at 0.06 a per second, 43 s; half a period is
    10 + 10 + 43 s.
    """
    [cycle] = json.loads(run("limit-cycles", "--process", "3 exp(-10s)", "--json").out)
    exact = cycle["exact"]
    assert exact["levels"] == pytest.approx([-5.0 / 7.0, 5.0 / 7.0], rel=1e-6)
    assert exact["period_s"] == pytest.approx(126.0, rel=1e-6)
    assert exact["amplitude"] == pytest.approx(12.0 / 7.0, rel=1e-6)


def test_rest_levels_are_explained_where_there_are_any(run):
    """He's stem keeps its levels: a set point of 51 puts them elsewhere than the two families listed."""
    jumping = run("limit-cycles", "--valve", "he:fs=2,fd=1")
    assert "half and integer are symmetric about the steady state" in jumping.out
    assert "half and integer" not in run("limit-cycles").out


def test_one_branch_is_one_and_its_axis_has_a_unit(run, folder):
    run("limit-cycles", "--over", "S", "--report", "lc.html")
    page = (folder / "lc.html").read_text()
    assert "1 branch over S" in page
    assert "S [% of span]" in page


def test_no_sign_before_nothing(run):
    assert "-0.0 %" not in run("limit-cycles", *LOOP).out


@pytest.mark.parametrize(
    ("over", "valve", "dead_time", "low", "high"),
    [
        ("dead_time", st.Kano(3.0, 1.0), 0.0, 0.0, 10.0),  # a quarter of the longest period, 40 s
        ("Td", st.Kano(3.0, 1.0), 10.0, 0.0, 10.0),
        ("J", st.Kano(3.0, 0.0), 10.0, 0.0, 3.0),  # a jump of the whole S
        ("load", st.Kano(3.0, 1.0), 10.0, -1.0, 1.0),
        ("dead_time", st.Kano(3.0, 1.0), 10.0, 4.0, 16.0),
    ],
)
def test_a_parameter_of_0_is_scan_values_from_0_upwards(over, valve, dead_time, low, high):
    loop = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, dead_time), 1.0)
    values = scan_values(loop, over, [SimpleNamespace(period=period) for period in (24.0, 40.0)])
    assert (values[0], values[-1]) == (pytest.approx(low), pytest.approx(high))
