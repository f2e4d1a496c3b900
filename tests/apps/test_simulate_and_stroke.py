"""``stiction simulate`` and ``stiction stroke``: the signals are the library's, and what is written can be read."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest

import stiction as st

TOML = """
process = "3 exp(-10s)/(10s+1)"
sp = "50,53@20"
duration = 200
dt = 0.5

[valve]
model = "kano"
S = 2
J = 1

[controller]
model = "pi"
Kc = 0.2
Ti = 10
op_limits = [0, 100]
"""


def table(text: str) -> tuple[list[str], np.ndarray]:
    header, body = text.split("\n", 1)
    return header.split(","), np.loadtxt(io.StringIO(body), delimiter=",")


def test_csv_is_the_library_s_run(run):
    moves = ["--sp", "51,54@100", "--disturbance", "-1,1@200"]
    done = run("simulate", "--duration", "300", "--noise", "0.1", "--seed", "7", *moves)
    assert done.code == 0
    header, values = table(done.out)
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    sp, load = np.repeat([51.0, 54.0], [100, 200]), np.repeat([-1.0, 1.0], [200, 100])
    same = st.simulate(loop, sp, 300.0, load, seed=7, pv_start=50.0, op_start=50.0)
    assert header == ["time_s", "SP", "PV", "OP", "MV"]
    assert same.sp is not None
    assert same.pv is not None
    assert same.mv is not None
    for column, series in zip(values.T, (same.time, same.sp, same.pv, same.op, same.mv), strict=True):
        np.testing.assert_allclose(column, series, rtol=2e-9)


def test_csv_is_read_back(run, folder):
    assert run("simulate", "--duration", "300", "--out", "a.csv").code == 0
    [record] = st.read(folder / "a.csv")
    assert (len(record), record.dt) == (300, 1.0)
    assert record.sp is not None
    assert record.mv is not None
    assert record.mv[0] == 50.0


def test_a_file_of_another_is_left_alone(run, folder):
    for name, text in (("mine.html", "<html>my page</html>"), ("mine.csv", "Time,FIC101.PV,FIC101.OP\n0,1,2\n")):
        (folder / name).write_text(text)
        for verb in (("simulate",), ("stroke",), ("valve-test", "plan", "step", "--start", "50")):
            done = run(*verb, "--out", name)
            assert done.code == 3
            assert f"{name} was not written by stiction and is not replaced; give another name with --out" in done.err
            assert (folder / name).read_text() == text
    (folder / "empty.csv").touch()
    assert run("simulate", "--duration", "300", "--out", "empty.csv").code == 0
    assert run("stroke", "--out", "empty.csv").code == 0
    assert (folder / "empty.csv").read_text().startswith("time_s,OP,MV\n")


def test_a_compensator_in_the_loop_and_back_from_its_file(run, folder):
    knocker = "knocker:amplitude=1.5,width=2,interval=5"
    done = run("simulate", "--duration", "300", "--compensator", knocker, "--out", "a.csv")
    assert done.code == 0
    [record] = st.read(folder / "a.csv")
    parts = (st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), 1.0)
    loop = st.Loop(*parts, compensator=st.Knocker(1.5, 2.0, 5.0))
    same = st.simulate(loop, 51.0, 300.0, pv_start=50.0, op_start=50.0)
    assert record.valve_signal is not None
    assert same.valve_signal is not None
    np.testing.assert_allclose(record.valve_signal, same.valve_signal, rtol=2e-9)
    np.testing.assert_allclose(record.op, same.op, rtol=2e-9)
    wrong = run("simulate", "--compensator", "two-moves:S=3")
    assert wrong.code == 2
    assert 'no compensator "twomoves"' in wrong.err
    assert 'Did you mean "two-move"?' in wrong.err


def test_toml_file_with_an_option_before_it(run, folder):
    (folder / "loop.toml").write_text(TOML)
    _, values = table(run("simulate", "--loop", "loop.toml", "--sp", "50,51@10").out)
    loop = st.Loop(st.PID(0.2, 10.0, op_limits=(0, 100)), st.Kano(2.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=0.5)
    same = st.simulate(loop, np.repeat([50.0, 51.0], [20, 380]), 200.0, pv_start=50.0, op_start=50.0)
    np.testing.assert_allclose(values[:, 3], same.op, rtol=2e-9)


def test_summary_as_json(run, folder):
    done = run("simulate", "--json")
    found = json.loads(done.out)
    assert done.code == 0
    assert found["oscillation"]["oscillating"]
    assert found["settings"]["valve"] == "kano:S=3,J=1"
    assert list(folder.iterdir()) == []
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    op = st.simulate(loop, 51.0, 2000.0, pv_start=50.0, op_start=50.0).op[1000:]
    rises = np.flatnonzero((op[:-1] < op.mean()) & (op[1:] >= op.mean()))
    assert found["oscillation"]["period_s"] == pytest.approx(np.diff(rises).mean(), rel=0.02)
    assert found["oscillation"]["amplitude_op"] == pytest.approx(np.ptp(op) / 2.0, rel=0.06)


@pytest.mark.parametrize(
    "op",
    [
        "triangle:mean=50,amplitude=10,period=400,duration=1e12",
        "ramp:start=0,stop=20,rate=1e-12",
        "staircase:levels=50 51,hold=1e12",
    ],
)
def test_a_test_signal_too_long_for_the_memory_is_refused_before_it_is_made(op, run):
    done = run("stroke", "--op", op)
    assert (done.code, done.out) == (2, "")
    assert "(limit 10,000,000); give at most 1e+07 s" in done.err


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        (["--dt", "0"], 2, "dt = 0 s is not positive"),
        (["--duration", "0.2"], 2, "does not fit"),
        (
            ["--duration", "1e9"],
            2,
            "duration = 1e+09 s is 1e+09 samples of 1 s (limit 10,000,000); give at most",
        ),
        (["--dt", "1e-9"], 2, "duration = 2000 s is 2e+12 samples of 1e-09 s"),
        (["--noise", "-1"], 2, "noise"),
        (["--process", "3"], 2, "direct path"),
        (["--loop", "none.toml"], 3, "No such file"),
        (["--loop", "bad.toml"], 3, "not a TOML"),
        (["--loop", "odd.toml"], 2, '"gain" is not a setting'),
        (["--loop", "typed.toml"], 2, "noise"),
        (["--out", "none/a.csv"], 3, "no folder"),
        (["--out", "."], 3, "is a folder"),
        (["--seed", "-1"], 2, "seed = -1 is negative"),
        (["--noise", "0.1", "--seed", "-1"], 2, "seed = -1 is negative"),
        (["--seed", "1.5"], 2, "1.5 is not a whole number"),
        (["--loop", "half.toml"], 2, "seed = 1.5 is not a whole number"),
        (["--op-start", "120"], 2, "op_start = 120 % of span is outside 0 to 100"),
        (["--compensator", "foo"], 2, "constant-reinforcement"),
    ],
)
def test_what_cannot_be_simulated_is_said(argv, code, says, run, folder):
    (folder / "bad.toml").write_text("time_s,PV,OP\n")
    (folder / "odd.toml").write_text("gain = 3\n")
    (folder / "typed.toml").write_text('noise = "loud"\n')
    (folder / "half.toml").write_text("seed = 1.5\n")
    done = run("simulate", *argv)
    assert done.code == code
    assert says in done.err
    assert done.err.startswith("stiction: ")
    assert done.out == ""


def test_stroke_is_the_library_s(run):
    _, values = table(run("stroke", "--valve", "stenman:d=2", "--op", "ramp:start=0,stop=10,rate=0.5").out)
    op = np.arange(0.0, 10.5, 0.5)
    np.testing.assert_array_equal(values[:, 1], op)
    np.testing.assert_array_equal(values[:, 2], st.stroke(st.Stenman(2.0), op, dt=1.0).mv)


def test_stroke_as_json_and_from_a_rest_position(run):
    found = json.loads(
        run("stroke", "--json", "--op", "staircase:levels=50 51,hold=1", "--mv-start", "49", "--valve", "ideal").out
    )
    assert found == {"valve": "ideal", "dt_s": 1.0, "op": [50.0, 51.0], "mv": [50.0, 51.0]}


def test_stroke_page_shows_trend_and_signature(run, folder):
    done = run("stroke", "--report", "valve.html", "--valve", "kano:S=4,J=2")
    assert done.code == 0
    assert "valve.html" in done.out
    page = (folder / "valve.html").read_text()
    assert {"OP and valve position over time", "Valve signature"} <= set(re.findall(r">([^<>]+)<", page))


def test_stroke_over_a_piped_record(run):
    text = "\n".join(["time_s,PV,OP", *(f"{2 * k},1,{50 + k % 7}" for k in range(40))])
    _, values = table(run("stroke", "--op", "-", "--valve", "ideal", stdin=text.encode()).out)
    np.testing.assert_array_equal(values[:, 2], values[:, 1])
    assert values[1, 0] == 2.0


def test_a_loop_that_runs_away_is_said_to(run):
    """With a negative gain on a process of positive gain OP grows as an exponential: 1e33 % of span after 2000 s."""
    done = run("simulate", "--controller", "pi:Kc=-0.2,Ti=10")
    assert done.code == 0
    assert done.err.startswith("stiction: The loop runs away")
    assert "unstable even without friction" in done.err
    blank = run("simulate", "--controller", "pi:Kc=20,Ti=1", "--json")
    assert "The loop runs away" in blank.err
    assert json.loads(blank.out)["ran_away"] is True
    calm = run("simulate", "--json")
    assert calm.err == ""
    assert json.loads(calm.out)["ran_away"] is False


@pytest.mark.parametrize("start", ["500", "-20"])
def test_a_stem_cannot_rest_off_its_travel(start, run):
    done = run("stroke", "--mv-start", start)
    assert done.code == 2
    assert f"mv_start = {start} % of span is outside 0 to 100 %" in done.err
    deviations = ["--op", "triangle:mean=0,amplitude=30,period=400,duration=800"]
    assert run("stroke", *deviations, "--mv-start", "-20").code == 0


def test_message_on_a_missing_op_names_options_of_the_command(run, folder):
    (folder / "bad.csv").write_text("a,b\n" + "\n".join(f"{k},{k % 3}" for k in range(20)))
    (folder / "two.csv").write_text("Time,F1.OP,F2.OP\n" + "\n".join(f"{k},{k % 3},{k % 5}" for k in range(20)))
    for name in ("bad.csv", "two.csv"):
        done = run("stroke", "--op", name)
        assert done.code == 3
        assert name in done.err
        assert "columns=" not in done.err


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")
@pytest.mark.parametrize("argv", [["--seed", "1"], ["--json"], ["--out", "/dev/full"]])
def test_a_full_disk_is_no_fault_of_the_program(argv):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "stiction", "simulate", *argv], stdout=full, stderr=subprocess.PIPE, text=True,
            timeout=120,
        )  # fmt: skip
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1
    assert "No space left" in done.stderr


def test_codes_for_bad_values_are_no_strokes_of_a_valve(run, folder):
    op = [f"{50.0 + k % 20:.1f}" for k in range(200)]
    for bad, code in ((op, 0), ([*op[:40], "-9999", *op[41:90], "-9999", *op[91:]], 3)):
        (folder / "op.csv").write_text("\n".join(["time_s,OP", *(f"{k},{x}" for k, x in enumerate(bad))]))
        done = run("stroke", "--op", "op.csv", "--valve", "kano:S=3,J=1")
        assert done.code == code
    assert "2 samples of OP are missing" in done.err
    assert done.out == ""
