"""``stiction valve-test``: a plan, its stroke and its analysis fit together, and find the valve that was stroked."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest

import stiction as st


@pytest.fixture
def ramp_csv(run):
    """A ramp test of a valve with sb = 3, sj = 1, r = 0.05."""
    span = ["--low", "10", "--high", "30"]
    assert run("valve-test", "plan", "ramp", *span, "--threshold", "0.05", "--out", "p.csv").code == 0
    assert run("stroke", "--valve", "srinivasan:sb=3,sj=1,r=0.05", "--op", "p.csv", "--out", "t.csv").code == 0
    return "t.csv"


def test_plan_is_the_library_s(run):
    done = run("valve-test", "plan", "ramp", "--low", "10", "--high", "14", "--rates", "0.1", "0.2", "--wait", "20")
    plan = st.plan_ramp_test(10.0, 14.0, rates=[0.1, 0.2], wait=20.0)
    op = np.loadtxt(done.out.splitlines()[1:], delimiter=",")[:, 1]
    np.testing.assert_allclose(op, plan.op, rtol=1e-8)
    assert "Ramp test" in done.err
    steps = st.plan_step_test(50.0, sizes=[1.0], hold=10.0)
    found = json.loads(run("valve-test", "plan", "step", "--start", "50", "--sizes", "1", "--wait", "10", "--json").out)
    assert found["duration_s"] == steps.duration


def test_ramp_test_finds_the_valve(run, folder, ramp_csv):
    done = run("valve-test", "analyse", "ramp", ramp_csv, "--json")
    found = json.loads(done.out)
    assert done.code == 1
    assert found["sb"]["value"] == pytest.approx(3.0, rel=0.05)
    assert found["sj"]["value"] == pytest.approx(1.0, rel=0.1)
    assert found["r_low"] <= 0.05 <= found["r_high"]
    done = run("valve-test", "analyse", "ramp", ramp_csv, "--limit", "8", "--report", "v.html", "--before", ramp_csv)
    assert done.code == 0
    assert "sb: " in done.out
    page = (folder / "v.html").read_text()
    assert all(title in page for title in ("OP and stem over time", "Valve signature", "sb and sj over the travel"))


def test_step_test_judges_by_the_limit(run, folder):
    run("valve-test", "plan", "step", "--start", "50", "--out", "p.csv")
    run("stroke", "--valve", "kano:S=1.2,J=0.4", "--op", "p.csv", "--out", "s.csv")
    done = run("valve-test", "analyse", "step", "s.csv", "--report", "v.html")
    assert done.code == 1
    assert "beyond limit" in done.out
    assert "Every step" in (folder / "v.html").read_text()
    assert run("valve-test", "analyse", "step", "s.csv", "--limit", "3").code == 0


def test_the_default_plan_tells_a_sticking_valve(run):
    run("valve-test", "plan", "step", "--start", "50", "--out", "p.csv")
    run("stroke", "--valve", "kano:S=3,J=1", "--op", "p.csv", "--out", "s.csv")
    done = run("valve-test", "analyse", "step", "s.csv")
    assert done.code == 1
    assert "beyond limit. The stem did not respond to 4 % of OP travel" in done.out
    assert "widen the fine range (--fine-range)" in done.out


def test_a_loop_in_automatic_is_no_ramp_test(run, folder, sticky_csv):
    (folder / "loop.csv").write_text(sticky_csv)
    done = run("valve-test", "analyse", "ramp", "loop.csv")
    assert done.code == 3
    assert "reacts to PV" in done.err


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (
            "plan step --start 50 --low 3",
            "A step test does not use --low; its options are --fine-step, --fine-range, --sizes",
        ),
        ("plan step --start 50 --rates 1 2 --repeats 1", "A step test does not use --rates, --repeats"),
        (
            "plan ramp --low 10 --high 30 --threshold 0.1 --sizes 1 2",
            "A ramp test does not use --sizes; its options are --low",
        ),
        ("analyse step t.csv --lag 0", "A step test does not use --lag; its options are --limit, --signal, --before"),
    ],
)
def test_options_of_the_other_kind_are_refused(argv, says, run):
    done = run("valve-test", *argv.split())
    assert (done.code, done.out) == (2, "")
    assert says in done.err


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        (["plan", "ramp", "--threshold", "0.1"], 2, "--low and --high"),
        (["plan", "step"], 2, "--start"),
        (["plan", "rmp"], 2, 'Did you mean "ramp"'),
        (["plan", "ramp", "--low", "10", "--high", "20"], 2, "threshold"),
        (["analyse", "ramp", "none.csv"], 3, "no such file"),
        (["analyse", "ramp", "alone.csv"], 3, "no loop with OP and PV or valve position (MV) was found"),
        (["analyse", "step", "alone.csv"], 3, "--column op=NAME --column mv=NAME"),
        (["analyse", "step", "still.csv"], 3, "OP"),
        (["analyse", "ramp", "still.csv", "--report", "none/v.html"], 3, "cannot be written"),
        (["frob"], 2, "Unknown command"),
    ],
)
def test_what_cannot_be_tested_is_said(argv, code, says, run, folder):
    (folder / "alone.csv").write_text("\n".join(["time_s,OP", *(f"{k},50" for k in range(100))]))
    (folder / "still.csv").write_text("\n".join(["time_s,OP,MV", *(f"{k},50,50" for k in range(100))]))
    done = run("valve-test", *argv)
    assert done.code == code
    assert says in done.err
    assert done.err.count("\n") == 1
    assert done.out == ""


@pytest.mark.parametrize(
    ("header", "zero", "span", "options"),
    [
        ("time_s,OP [mA],ZT [mA]", 4.0, 0.16, ()),
        ("time_s,OP [fraction],ZT [fraction]", 0.0, 0.01, ()),
        ("time_s,OP,ZT", 0.0, 0.01, ()),
        ("time_s,OP,ZT", 4.0, 0.16, ("--op-range", "4", "20", "--mv-range", "4", "20")),
    ],
)
def test_a_position_in_the_unit_of_op_is_the_same_test(header, zero, span, options, run, folder, ramp_csv):
    rows = np.loadtxt(folder / ramp_csv, delimiter=",", skiprows=1)
    lines = [f"{t:g},{zero + span * op:.9g},{zero + span * mv:.9g}" for t, op, mv in rows]
    (folder / "raw.csv").write_text("\n".join([header, *lines]))
    found = json.loads(run("valve-test", "analyse", "ramp", "raw.csv", "--json", *options).out)
    assert found["sb"]["value"] == pytest.approx(3.0, rel=0.05)
    assert found["sj"]["value"] == pytest.approx(1.0, rel=0.1)
    if options:
        done = run("valve-test", "analyse", "ramp", "raw.csv", "--op-range", "4", "20")
        assert "assumed: The valve position lies between 5.6" in done.out
        assert "agrees with OP as a signal of 4 to 20: it is converted" in done.out


def test_a_test_comes_by_standard_input_too(run, folder, ramp_csv, monkeypatch):
    by_file = run("valve-test", "analyse", "ramp", ramp_csv, "--json")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO((folder / ramp_csv).read_bytes())))
    by_input = run("valve-test", "analyse", "ramp", "-", "--json")
    assert by_input.code == by_file.code == 1
    assert json.loads(by_input.out)["sb"] == json.loads(by_file.out)["sb"]
    done = run("valve-test", "analyse", "ramp", "--jsn")
    assert done.code == 2
    assert "Did you mean --json? Try: stiction valve-test analyse --help" in done.err


@pytest.mark.parametrize(
    "argv",
    [
        ["ramp", "--low", "5", "--high", "25", "--threshold", "0.05", "--wait", "1e12"],
        ["ramp", "--low", "5", "--high", "25", "--rates", "1e-9"],
        ["ramp", "--low", "5", "--high", "25", "--threshold", "0.05", "--repeats", "1000000000"],
        ["step", "--start", "50", "--wait", "1e12"],
        ["step", "--start", "50", "--fine-step", "1e-9"],
    ],
)
def test_a_plan_too_long_for_the_memory_is_refused_before_it_is_made(argv, run):
    done = run("valve-test", "plan", *argv)
    assert (done.code, done.out) == (2, "")
    assert "together = " in done.err
    assert "(limit 10,000,000); give at most 1e+07 s" in done.err


@pytest.mark.parametrize(("header", "low", "span"), [("OP [V],MV [V]", 1.0, 0.04), ("OP,MV", 3.0, 0.12)])
def test_an_op_in_another_unit_is_not_judged_by_a_limit_in_percent(header, low, span, run, folder, ramp_csv):
    rows = np.loadtxt(folder / ramp_csv, delimiter=",", skiprows=1)
    rows[:, 1:] = low + span * rows[:, 1:]
    lines = [",".join(f"{x:.6f}" for x in row) for row in rows]
    (folder / "raw.csv").write_text("\n".join([f"time_s,{header}", *lines]))
    done = run("valve-test", "analyse", "ramp", "raw.csv")
    assert done.code == 3
    assert "not in % of span, which a valve test needs; give --op-range to" in done.err
    ends = [str(low), str(low + 100.0 * span)]
    done = run("valve-test", "analyse", "ramp", "raw.csv", "--op-range", *ends, "--mv-range", *ends, "--json")
    assert json.loads(done.out)["sb"]["value"] == pytest.approx(3.0, rel=0.05)


def test_an_error_names_the_verb_and_not_the_function(run, folder, ramp_csv):
    done = run("valve-test", "analyse", "step", ramp_csv)
    assert done.code == 3
    assert "use stiction valve-test analyse ramp for ramps" in done.err
    assert "_" not in done.err


def test_a_position_that_counts_the_closing_is_refused_and_not_called_stuck(run, folder, ramp_csv):
    rows = np.loadtxt(folder / ramp_csv, delimiter=",", skiprows=1)
    lines = [f"{t:g},{op:.4f},{100.0 - mv:.4f}" for t, op, mv in rows]
    (folder / "closing.csv").write_text("\n".join(["time_s,OP,MV", *lines]))
    done = run("valve-test", "analyse", "ramp", "closing.csv")
    assert (done.code, done.out) == (3, "")
    assert "The valve position of closing moves against the OP, by -0." in done.err
    assert "give the opening, which is 100 minus this signal" in done.err


def test_a_file_that_cannot_be_used_is_an_object_of_json_too(run, folder, ramp_csv):
    done = run("valve-test", "analyse", "ramp", "none.csv", "--json")
    failed = json.loads(done.out)
    assert done.code == 3
    assert failed["record"]["file"] == "none.csv"
    assert done.err == f"stiction: {failed['error']}\n"
    assert run("valve-test", "analyse", "ramp", "none.csv").out == ""
    assert json.loads(run("valve-test", "analyse", "ramp", ramp_csv, "--json").out)["error"] is None
    before = run("valve-test", "analyse", "ramp", ramp_csv, "--before", "none.csv", "--json")
    assert json.loads(before.out)["record"]["file"] == "none.csv"
