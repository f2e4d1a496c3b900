"""``stiction compensate``: advice and its price, refusals as answers, JSON, files for the plant, and wrong usage."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest

import stiction as st
from compensation.iec_interpreter import FunctionBlock
from stiction.apps.output_files import csv_text

KEYS = {
    "expected_improvement", "oscillation_cause",
    "file", "tag", "verdict", "probability", "action", "recommended", "refused", "reason", "risk", "S", "J",
    "weights", "seeds", "max_travel", "remedies", "twin", "retuning", "structured_text", "work_order", "error",
}  # fmt: skip
GIVEN = ["--valve", "kano:S=5,J=2", "--noise", "0.05", "--seeds", "1"]


@pytest.fixture
def sticky_file(folder, sticky_csv):
    """A record of a loop that cycles because of its valve."""
    (folder / "a.csv").write_text(sticky_csv)
    return "a.csv"


def strict(text):
    """JSON as the standard has it."""
    return json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))


def test_a_record_becomes_advice_and_what_the_plant_needs(run, folder, sticky_file):
    files = ["--report", "r.html", "--structured-text", "k.st", "--work-order", "w.md"]
    done = run("compensate", sticky_file, "--seeds", "1", *files)
    assert done.code == 1
    assert done.err == ""
    assert "FIC-101: Until the shutdown: " in done.out
    assert "Repair of the valve lowers the PV deviation by" in done.out
    assert "Drawbacks: stem travel" in done.out
    assert "The simulated loop oscillates like the record." in done.out
    for name in ("do nothing", "fix the valve", "knocker", "two-move", "integral deadband"):
        assert f"\n{name} " in done.out
    assert "What to do: Check packing" in done.out
    assert "FUNCTION_BLOCK FIC_101_" in (folder / "k.st").read_text()
    assert (folder / "w.md").read_text().startswith("# Work order: control valve of FIC-101, repair")
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["a.csv", "k.st", "r.html", "w.md"]


def test_json_of_a_record(run, folder, sticky_file):
    done = run("compensate", sticky_file, "--json", "--seeds", "2", "--weights", "travel=0.5", "--work-order", "w.md")
    [loop] = strict(done.out)
    assert done.code == 1
    assert loop.keys() == KEYS
    assert (loop["file"], loop["tag"], loop["verdict"], loop["error"]) == ("a.csv", "FIC-101", "stiction", None)
    assert loop["S"] == pytest.approx(5.0, rel=0.15)
    assert (loop["seeds"], loop["weights"]["travel"], loop["weights"]["iae"]) == (2, 0.5, 0.5)
    assert loop["twin"]["fits"]
    assert "overlay" not in loop["twin"]
    remedies = {one["name"]: one for one in loop["remedies"]}
    assert {"do nothing", "fix the valve", loop["recommended"]} <= remedies.keys()
    assert remedies["do nothing"]["cost"] == pytest.approx(1.0)
    assert (loop["structured_text"], loop["work_order"]) == (None, "w.md")
    assert "Work order: w.md" in done.err


def test_what_if_is_the_library_s(run):
    [loop] = strict(run("compensate", *GIVEN, "--json", "--tag", "FV-7").out)
    made = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    trial = st.compensate(made, seeds=1)
    assert (loop["tag"], loop["file"], loop["verdict"]) == ("FV-7", None, None)
    assert loop["recommended"] == trial.recommended
    assert [one["name"] for one in loop["remedies"]] == [one.name for one in trial.remedies]
    assert [one["cost"] for one in loop["remedies"]] == pytest.approx([one.cost for one in trial.remedies])


def test_what_if_in_words_and_from_a_file(run, folder):
    (folder / "loop.toml").write_text('valve = "kano:S=5,J=2"\nnoise = 0.05\ntag = "FV-9"\n')
    done = run("compensate", "--loop", "loop.toml", "--seeds", "1", "--structured-text", "k.st")
    assert done.code == 1
    assert "FV-9: Until the shutdown: " in done.out
    assert "The loop was not identified from a record" in done.out
    block = FunctionBlock((folder / "k.st").read_text())
    assert block.name.startswith("FV_9_")


def test_the_controller_s_limits_go_into_the_text(run, folder):
    limits = ["--controller", "pi:Kc=0.2,Ti=10,op_limits=20..90", "--structured-text", "k.st"]
    run("compensate", *GIVEN, *limits)
    lines = {line.split(":=")[0].strip(): line for line in (folder / "k.st").read_text().splitlines() if ":=" in line}
    assert [float(lines[f"{name} : LREAL"].split(":=")[1].split(";")[0]) for name in ("OP_LOW", "OP_HIGH")] == [20, 90]


def test_a_good_valve_is_an_answer(run, folder, healthy_csv):
    (folder / "h.csv").write_text(healthy_csv)
    files = ["--structured-text", "k.st", "--work-order", "w.md", "--report", "r.html"]
    done = run("compensate", "h.csv", *files)
    assert done.code == 0
    assert "No advice." in done.out
    assert "nothing to compensate" in done.out
    assert "Structured text: not written. No stiction was found" in done.out
    assert "Work order: not written. The valve needs no work." in done.out
    assert sorted(path.name for path in folder.iterdir()) == ["h.csv", "r.html"]
    [loop] = strict(run("compensate", "h.csv", "--json").out)
    assert loop.keys() == KEYS
    assert (loop["verdict"], loop["refused"], loop["recommended"], loop["remedies"]) == ("no_stiction", True, None, [])


def test_undecided_is_an_answer_and_an_order_to_test(run, folder):
    rows = "\n".join(f"{k},{50.0 + math.sin(k / 6.1):.4f},50" for k in range(400))
    (folder / "still.csv").write_text(f"time_s,PV,OP\n{rows}")
    done = run("compensate", "still.csv", "--work-order", "w.md")
    assert done.code == 0
    assert "No advice." in done.out
    assert "test before any repair" in (folder / "w.md").read_text()


def test_an_older_text_is_not_taken_for_this_one(run, folder, healthy_csv):
    older = "(*\nKnocker for the sticking valve of loop FIC-101.\nWritten 2026-01-31 by stiction 0.1.\n*)\n"
    (folder / "k.st").write_text(older)
    done = run("compensate", "-", "--structured-text", "k.st", stdin=healthy_csv.encode())
    assert "k.st is from an earlier run" in done.out
    assert (folder / "k.st").read_text() == older


@pytest.mark.parametrize("option", ["--structured-text", "--work-order", "--report"])
def test_a_file_of_another_is_left_alone(option, run, folder, sticky_file):
    (folder / "mine.txt").write_text("(* my own block, see # Work order: control valve of FIC-7 *)")
    done = run("compensate", sticky_file, option, "mine.txt")
    assert done.code == 3
    assert f"mine.txt was not written by stiction and is not replaced; give another name with {option}" in done.err
    assert (folder / "mine.txt").read_text().startswith("(* my own block")


def test_what_it_wrote_is_written_again(run, folder, sticky_file):
    files = ["--structured-text", "k.st", "--work-order", "w.md", "--report", "r.html"]
    for _ in range(2):
        assert run("compensate", sticky_file, "--seeds", "1", *files).code == 1


def test_several_loops_of_a_file(run, folder, sticky_csv, healthy_csv):
    """Each loop is told; what is for one loop needs its tag."""
    sick, good = sticky_csv.splitlines(), healthy_csv.splitlines()
    names = good[0].replace("time_s,", "").replace("SP", "FIC-9.SP").replace("PV", "FIC-9.PV").replace("OP", "FIC-9.OP")
    table = [f"{a},{b.partition(',')[2]}" for a, b in zip(sick[1:], good[1:], strict=False)]
    (folder / "two.csv").write_text("\n".join([f"{sick[0]},{names}", *table]))
    loops = strict(run("compensate", "two.csv", "--json", "--seeds", "1", "--report", "r.html").out)
    assert {loop["tag"]: loop["refused"] for loop in loops} == {"FIC-101": False, "FIC-9": True}
    page = (folder / "r.html").read_text()
    assert re.findall(r'<details class="fold" id="(loop-\d)"', page) == ["loop-0", "loop-1"]
    done = run("compensate", "two.csv", "--work-order", "w.md")
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "choose one with --tag" in done.err
    assert run("compensate", "two.csv", "--tag", "FIC-9", "--work-order", "w.md").code == 0


def test_a_loop_that_breaks_is_a_row(run, folder, sticky_file, monkeypatch):
    def broken(record):
        raise st.RecordError(f"{record.tag} cannot be used.")

    monkeypatch.setattr("stiction.diagnose", broken)
    done = run("compensate", sticky_file, "--json")
    [loop] = strict(done.out)
    assert done.code == 3
    assert loop.keys() == KEYS
    assert loop["error"] == "FIC-101 cannot be used."
    assert run("compensate", sticky_file).err == "stiction: FIC-101 cannot be used.\n"


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        ([], 2, "there is no file"),
        (["a.csv", "b.csv"], 2, "compensate takes one file"),
        (["a.csv", "--valve", "kano:S=3,J=1"], 2, "--valve describes a loop without a record"),
        (["a.csv", "--weights", "price=1"], 2, "'price' is unknown"),
        (["a.csv", "--weights", "travel"], 2, "NAME=VALUE"),
        (["a.csv", "--weights", "travel=1,travel=2"], 2, "NAME=VALUE"),
        (["a.csv", "--weights", "travel=-1"], 2, "travel"),
        (["a.csv", "--weights", "travel=nan"], 2, "travel"),
        (["a.csv", "--seeds", "0"], 2, "seeds = 0 is not positive"),
        (["a.csv", "--seeds", "1.5"], 2, "1.5 is not a whole number"),
        (["a.csv", "--seeds", "few"], 2, "--seeds"),
        (["a.csv", "--duration", "-5"], 2, "duration"),
        (["a.csv", "--controller", "pi:Kc=1"], 2, "Ti"),
        (["a.csv", "--jsn"], 2, "Did you mean --json"),
        (["a.csv", "--work-order", "a.csv"], 2, "would replace the record"),
        (["a.csv", "--work-order", "o", "--structured-text", "o"], 2, "would replace --structured-text"),
        (["a.csv", "--report", "a.csv"], 2, "--report a.csv would replace the record a.csv"),
        (["a.csv", "--structured-text", "none/k.st"], 3, "cannot be written"),
        (["none.csv"], 3, "no such file"),
        (["--valve", "ideal"], 2, "no S and J"),
        (["--valve", "kano:S=3,J=1", "--work-order", "w.md"], 2, "needs a record"),
        (["--valve", "kano:S=3,J=1", "--delimiter", ";"], 2, "--delimiter"),
        (["--loop", "with.toml"], 2, "has a compensator"),
    ],
)
def test_what_cannot_be_done_is_said_before_the_work(argv, code, says, run, folder, monkeypatch):
    (folder / "a.csv").write_text("never diagnosed")
    (folder / "with.toml").write_text('compensator = "knocker:amplitude=1,width=2,interval=5"\n')
    monkeypatch.setattr("stiction.diagnose", lambda _: pytest.fail("the work was begun"))
    done = run("compensate", *argv)
    assert done.code == code
    assert says in done.err
    assert done.err.startswith("stiction: ")
    assert done.err.count("\n") == 1
    assert done.out == ""
    assert sorted(path.name for path in folder.iterdir()) == ["a.csv", "with.toml"]


def test_a_file_that_cannot_be_used_is_an_object_of_json_too(run, folder):
    (folder / "bad.csv").write_bytes(bytes(range(256)) * 40)
    for name in ("none.csv", "bad.csv"):
        done = run("compensate", name, "--json")
        [failed] = strict(done.out)
        assert done.code == 3
        assert failed.keys() == KEYS
        assert failed["file"] == name
        assert done.err == f"stiction: {failed['error']}\n"


def test_a_file_that_is_no_record(run, folder):
    (folder / "bad.csv").write_bytes(bytes(range(256)) * 40)
    done = run("compensate", "bad.csv", "--report", "r.html", "--structured-text", "k.st")
    assert done.code == 3
    assert "binary" in done.err
    assert "Traceback" not in done.err
    assert [path.name for path in folder.iterdir()] == ["bad.csv"]


def test_a_missing_controller_is_asked_for_in_the_words_of_the_command(run, sticky_file, monkeypatch):
    """Found no controller: the remedy is an option here, not an argument of Python; given one, there is advice."""
    monkeypatch.setattr("stiction.compensation.controller_from_record.MIN_EXPLAINED_SHARE", 1.1)
    done = run("compensate", sticky_file)
    assert done.code == 0
    assert "give the controller with its Kc and Ti" in done.out
    assert "PID(" not in done.out
    assert run("compensate", sticky_file, "--seeds", "1", "--controller", "pi:Kc=0.2,Ti=10").code == 1


def test_progress_is_kept_from_a_pipe_and_shown_on_a_terminal(monkeypatch, capsys):
    from stiction.apps import output

    with output.progress_callback("FIC-1") as show:
        show(1, 2)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(output, "PROGRESS_DELAY_S", -1.0)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("FORCE_COLOR", "1")
    with output.progress_callback("FIC-1") as show:
        show(1, 2)
    assert "FIC-1" in capsys.readouterr().err


def test_reason_of_a_twin_that_does_not_fit_is_printed_once(run, sticky_file):
    """A controller that is not the loop's makes another cycle, or none: no advice, and what the twin does instead."""
    done = run("compensate", sticky_file, "--seeds", "1", "--controller", "pi:Kc=0.02,Ti=100", "--report", "r.html")
    assert done.code == 0
    assert "No advice." in done.out
    assert done.out.count("The simulated loop does not") == 1
    assert "\nThe twin\nRecord: period" in done.out


def test_no_text_for_the_plant_from_an_op_in_another_unit(run, folder, sticky_csv):
    """A record normalised before it was kept: its settings would be in the wrong unit."""
    head, *rows = sticky_csv.splitlines()
    at = head.split(",").index("FIC-101.OP")
    table = [row.split(",") for row in rows]
    for row in table:
        row[at] = str(float(row[at]) - 60.0)
    (folder / "n.csv").write_text("\n".join([head, *(",".join(row) for row in table)]))
    done = run("compensate", "n.csv", "--seeds", "1", "--structured-text", "k.st")
    assert not (folder / "k.st").exists()
    assert "Structured text: not written" in done.out + done.err
    assert "not in % of span" in done.out + done.err


@pytest.mark.parametrize("loop", [["--controller", "pi:Kc=-0.2,Ti=10"], ["--process", "1/(s-1)"]])
def test_unstable_loop_is_named_unstable(loop, run):
    """A wrong sign or an unstable process: 1 + L has roots in the right half plane whatever the valve does."""
    done = run("compensate", *loop)
    assert done.code == 0
    assert "The loop is unstable even without friction" in done.out
    assert "does not oscillate" not in done.out


def test_a_stem_that_only_jumps_is_seen_to_cycle(run):
    """He's valve on the default loop: 240 s in continuous time (test_exact), within 2 % in steps of 1 s."""
    [loop] = strict(run("compensate", "--valve", "he:fs=2,fd=1", "--seeds", "1", "--json").out)
    assert not loop["refused"]
    assert loop["twin"]["simulated"]["period_s"] == pytest.approx(240.0, rel=0.02)


def test_retuning_is_described_once(run, folder):
    """What new settings give without noise, and with it, stand together, and what does harm is not advised."""
    from stiction.report.pages.trial import remedy_note, retuning_text

    loop = st.Loop(st.PID(0.42, 6.0), st.Kano(6.0, 3.0), st.FOPDT(1.2, 4.0, 2.0), dt=1.0, noise=0.15)
    found = st.compensate(loop, seeds=1)
    assert found.retuning is not None
    told, tried = retuning_text(found), found["retune"]
    assert told.startswith(found.retuning.reason)
    assert "without noise and disturbances" in told
    assert f"{round(-100.0 * tried.improvement):+d} %" in told
    assert told.endswith("leave the settings.") == (tried.improvement <= 0.0 or remedy_note(tried, found) != "")


def test_advice_of_another_cause_is_none_on_the_valve(run, folder):
    """A loop tuned too tightly: what is to be done is not said of its valve."""
    from stiction.apps.output_files import csv_text
    from stiction.simulation.demo import demo_plant

    tight = next(one.record for one in demo_plant() if one.cause == "tight tuning")
    (folder / "t.csv").write_text(csv_text(tight))
    done = run("compensate", "t.csv", "--loop-type", "temperature")
    assert "\nWhat to do: Lower the controller gain" in done.out
    assert "Valve:" not in done.out


def test_a_small_price_is_no_price_of_nothing():
    from stiction.compensation.recommend import _format_ratio

    assert (_format_ratio(0.05, 1.0), _format_ratio(9.87, 1.0), _format_ratio(0.0, 1.0), _format_ratio(150.2, 1.0)) == (
        "0.05",
        "9.9",
        "0",
        "150",
    )


@pytest.mark.parametrize("source", [["a.csv"], GIVEN])
def test_a_run_too_long_for_the_memory_is_refused_before_it_is_made(source, run, sticky_file):
    done = run("compensate", *source, "--duration", "1e12", "--json")
    assert (done.code, done.out) == (2, "")
    assert "duration = 1e+12 s is 1e+12 samples of 1 s (limit 10,000,000); give at most 1e+07 s" in done.err


def test_a_run_shorter_than_two_cycles_says_nothing_of_a_deviation(run):
    done = run("compensate", *GIVEN, "--duration", "5")
    assert (done.code, done.out) == (2, "")
    assert re.search(r"duration = 5 s is shorter than 2 periods of the loop \(\d+\.?\d* s\); give at least", done.err)


def test_no_cause_is_named_where_there_is_none(run, folder):
    loop = st.Loop(st.PID(0.2, 10.0), st.Ideal(), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    sp = 150.0 + 5.0 * np.sign(np.sin(2.0 * np.pi * np.arange(1200) / 200.0))  # moves OP, so that stiction would show
    record = st.simulate(loop, sp, 1200.0, seed=1, pv_start=150.0, op_start=50.0, loop_type="flow")
    (folder / "good.csv").write_text(csv_text(record))
    done = run("compensate", "good.csv")
    assert "No stiction was found, so there is nothing to compensate" in done.out
