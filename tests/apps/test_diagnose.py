"""``stiction diagnose``: verdict, JSON contract, report, exit codes, and everything that can be wrong with a file."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys

import numpy as np
import pytest

KEYS = {
    "file", "tag", "verdict", "probability", "reason", "action", "loop_state", "stiction", "oscillation",
    "oscillation_cause", "features", "evidence", "quality",
}  # fmt: skip


def rows(op, pv, n=200):
    return "\n".join(["time_s,PV,OP", *(f"{k},{pv(k)},{op(k)}" for k in range(n))])


def wave(k):
    return f"{50.0 + math.sin(k / 6.1):.4f}"


def test_a_sticky_loop_is_found(run, folder, sticky_csv):
    (folder / "a.csv").write_text(sticky_csv)
    done = run("diagnose", "a.csv")
    assert done.code == 1
    assert done.err == ""
    assert "1 loop read" in done.out
    assert re.search(r"FIC-101: Valve stiction: S.=.(5|4\.9)", done.out)
    assert "Report: stiction-report.html" in done.out
    page = (folder / "stiction-report.html").read_text()
    assert "FIC-101" in page
    assert sorted(path.name for path in folder.iterdir()) == ["a.csv", "stiction-report.html"]
    assert "replaced" not in done.out
    assert "Report: stiction-report.html (the older report is replaced)" in run("diagnose", "a.csv").out


def test_json_keeps_the_contract_and_stands_alone(run, folder, sticky_csv):
    (folder / "a.csv").write_text(sticky_csv)
    done = run("diagnose", "a.csv", "--json")
    [found] = json.loads(done.out)
    assert done.code == 1
    assert found.keys() >= KEYS
    assert (found["file"], found["tag"], found["verdict"]) == ("a.csv", "FIC-101", "stiction")
    assert 0.5 < found["probability"] <= 1.0
    assert found["stiction"].keys() >= {"S", "J", "S_low", "S_high"}
    assert found["stiction"]["S"] == pytest.approx(5.0, rel=0.15)
    assert found["oscillation"].keys() >= {"oscillating", "period_s", "regularity"}
    assert all(row.keys() >= {"method", "index", "threshold", "vote", "valid", "why"} for row in found["evidence"])
    assert "1 loop read" in done.err
    assert sorted(path.name for path in folder.iterdir()) == ["a.csv"]


def test_json_with_a_report_asked_for(run, folder, sticky_csv):
    (folder / "a.csv").write_text(sticky_csv)
    done = run("diagnose", "a.csv", "--json", "--report", "r.html")
    assert len(json.loads(done.out)) == 1
    assert (folder / "r.html").exists()
    assert "Report: r.html" in done.err


def test_a_healthy_loop_is_0(run, healthy_csv):
    done = run("diagnose", "-", "--no-report", stdin=healthy_csv.encode())
    assert done.code == 0
    assert "the valve does not stick above" in done.out.replace("\xa0", " ")


def test_one_bad_file_is_a_row_with_its_reason(run, folder, sticky_csv, healthy_csv):
    (folder / "sticky.csv").write_text(sticky_csv)
    (folder / "healthy.csv").write_text(healthy_csv)
    (folder / "empty.csv").write_text("")
    files = ("empty.csv", "healthy.csv", "sticky.csv")
    done = run("diagnose", *files, "--report", "r.html")
    assert done.code == 1
    assert re.search(r"empty\.csv.{1,600}Not diagnosed", (folder / "r.html").read_text(), re.DOTALL)
    table = [line for line in done.out.splitlines() if line.startswith(("FIC-101 ", "healthy ", "empty.csv "))][-3:]
    assert [line.split()[0] for line in table] == ["FIC-101", "healthy", "empty.csv"]
    assert "Not diagnosed" in table[2]
    assert "is empty" in table[2]
    found = json.loads(run("diagnose", *files, "--json").out)
    assert [entry["verdict"] for entry in found] == ["no_stiction", "stiction", "undecided"]
    assert all(entry.keys() >= KEYS for entry in found)
    assert found[0].keys() == found[1].keys() == found[2].keys()
    assert [entry["error"] is None for entry in found] == [True, True, False]
    assert "is empty" in found[2]["error"]


def test_columns_are_named_instead_of_guessed(run, folder, sticky_csv):
    body = sticky_csv.split("\n", 1)[1]
    (folder / "a.csv").write_text("time_s,w,x,y\n" + body)
    named = ["--column", "sp=w", "--column", "pv=x", "--column", "op=3", "--tag", "FIC-7", "--loop-type", "flow"]
    [found] = json.loads(run("diagnose", "a.csv", "--json", *named).out)
    assert (found["tag"], found["verdict"]) == ("FIC-7", "stiction")


def test_prior_and_costs_change_the_verdict(run, sticky_csv):
    """With an open question free of charge nothing is decided; a higher prior gives a higher probability."""
    usual, rare, free = (
        json.loads(run("diagnose", "-", "--json", *options, stdin=sticky_csv.encode()).out)[0]
        for options in ((), ("--prior", "0.01"), ("--costs", "1", "1", "0"))
    )
    odds = [p["probability"] / (1.0 - p["probability"]) for p in (usual, rare)]
    assert odds[0] / odds[1] == pytest.approx((0.25 / 0.75) / (0.01 / 0.99), rel=0.05)
    assert (usual["verdict"], free["verdict"]) == ("stiction", "undecided")
    assert (rare["prior"], free["probability"]) == (0.01, usual["probability"])


@pytest.mark.parametrize(
    ("options", "text"),
    [(("--prior", "0"), "prior = 0 is not a probability"), (("--prior", "1.5"), "above 0 and below 1"),
     (("--costs", "1", "1", "-0.2"), "ask")],
)  # fmt: skip
def test_a_wrong_prior_or_cost_is_a_usage_error(options, text, run, healthy_csv):
    done = run("diagnose", "-", "--json", *options, stdin=healthy_csv.encode())
    assert done.code == 2
    assert text in done.err


def test_explain_prints_the_sections_in_order(run, sticky_csv):
    done = run("diagnose", "-", "--no-report", "--explain", stdin=sticky_csv.encode())
    steps = ("in detail", "Why this verdict", "Valve and process", "He curve fit", "Data quality")
    places = [done.out.index(step) for step in steps]
    assert places == sorted(places)


def test_explain_and_json_exclude_each_other(run, folder, sticky_csv):
    (folder / "a.csv").write_text(sticky_csv)
    done = run("diagnose", "a.csv", "--json", "--explain")
    assert done.code == 2
    assert done.out == ""
    assert "--json and --explain cannot be used together" in done.err
    assert sorted(path.name for path in folder.iterdir()) == ["a.csv"]


BAD_FILES = {
    "empty": (b"", "empty"),
    "binary": (bytes(range(256)) * 40, "binary"),
    "workbook": (b"PK\x03\x04" + b"\x00" * 100, "is damaged or cut off"),
    "one column": (b"OP\n" + b"50\n" * 100, "--column pv=NAME"),
    "text in numbers": (rows(lambda _: "fifty", wave).encode(), "fifty"),
    "three rows": (rows(wave, wave, 3).encode(), "3"),
    "all NaN": (rows(lambda _: "NaN", lambda _: "NaN").encode(), "no"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_file_that_is_no_record(name, run, folder):
    data, says = BAD_FILES[name]
    (folder / "bad.csv").write_bytes(data)
    done = run("diagnose", "bad.csv")
    if done.code != 3:
        found = json.loads(run("diagnose", "bad.csv", "--json").out)
        assert done.code == 0
        assert [entry["verdict"] for entry in found] == ["undecided"]
        assert says in found[0]["reason"]
        return
    assert done.err.startswith("stiction: bad.csv")
    assert says in done.err
    assert "Traceback" not in done.err
    assert sorted(path.name for path in folder.iterdir()) == ["bad.csv"]
    same = run("diagnose", "bad.csv", "--json")
    assert same.code == 3
    assert json.loads(same.out)[0]["error"] in done.err


def test_a_constant_op_is_not_judged(run, folder):
    (folder / "still.csv").write_text(rows(lambda _: "50", wave, 400))
    done = run("diagnose", "still.csv", "--json")
    [found] = json.loads(done.out)
    assert done.code == 0
    assert found["verdict"] == "undecided"
    assert (found["loop_state"]["state"], found["probability"], found["stiction"]) == ("manual", 0.25, None)
    assert "OP is constant in 100 % of the record while PV moves" in found["reason"]
    assert found["action"] == "Put the controller in automatic and record the loop again."


def test_zeros_without_end_are_refused_at_once():
    """Two gigabytes on the standard input are refused by their first bytes; the rest is never read."""
    feed = subprocess.Popen(["head", "-c", "2000000000", "/dev/zero"], stdout=subprocess.PIPE)
    done = subprocess.run(
        [sys.executable, "-m", "stiction.apps.cli", "diagnose", "-", "--no-report"],
        stdin=feed.stdout,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert feed.stdout is not None
    feed.stdout.close()
    assert feed.wait(timeout=60) != 0, "it read all of it"
    assert done.returncode == 3
    assert done.stdout == ""
    assert done.stderr == "stiction: stdin: is binary and begins with zeros only; export the loop as CSV.\n"


@pytest.mark.parametrize("place", ["missing/r.html", ".", "file/r.html"])
def test_a_report_that_cannot_be_written_is_refused_before_the_work(place, run, folder, monkeypatch):
    (folder / "a.csv").write_text("never read")
    (folder / "file").write_text("")
    monkeypatch.setattr("stiction.apps.diagnose.read_sources", lambda *_: pytest.fail("the work was begun"))
    done = run("diagnose", "a.csv", "--report", place)
    assert done.code == 3
    assert "cannot be written" in done.err
    assert sorted(path.name for path in folder.iterdir()) == ["a.csv", "file"]


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_rights(run, folder):
    closed = folder / "closed"
    closed.mkdir(mode=0o500)
    done = run("diagnose", "a.csv", "--report", "closed/r.html")
    assert done.code == 3
    assert "Permission denied" in done.err


def test_what_is_not_ours_is_not_replaced(run, folder, sticky_csv):
    (folder / "a.csv").write_text(sticky_csv)
    (folder / "stiction-report.html").write_text("<html>mine</html>")
    for argv in (["a.csv"], ["a.csv", "--report", "a.csv"]):
        done = run("diagnose", *argv)
        assert done.code == 3
        assert "was not written by stiction" in done.err
    assert (folder / "stiction-report.html").read_text() == "<html>mine</html>"
    assert (folder / "a.csv").read_text() == sticky_csv


@pytest.mark.parametrize("name", ["r.pdf", "r", "html"])
def test_a_report_is_named_html(name, run, folder, healthy_csv):
    (folder / "a.csv").write_text(healthy_csv)
    done = run("diagnose", "a.csv", "--report", name)
    assert done.code == 2
    assert f"--report writes HTML, but {name} does not end in .html or .htm; give a name that does." in done.err
    assert [path.name for path in folder.iterdir()] == ["a.csv"]


def test_a_loop_that_is_not_judged_has_no_probability_in_the_table(run, folder, healthy_csv):
    (folder / "healthy.csv").write_text(healthy_csv)
    (folder / "rest.csv").write_text(rows(lambda _: 50.0, wave))
    done = run("diagnose", "healthy.csv", "rest.csv", "--report", "r.HTM")
    [row] = [line for line in done.out.splitlines() if line.startswith("rest ") and "Cannot tell" in line]
    assert "0.25" not in row
    assert " – " in row


def test_our_own_report_is_replaced(run, folder, healthy_csv):
    old = '<html><head>\n<meta name="generator" content="stiction 0.0.1">'
    (folder / "stiction-report.html").write_text(old)
    assert run("diagnose", "-", stdin=healthy_csv.encode()).code == 0
    assert (folder / "stiction-report.html").read_text() != old


def test_no_signal_is_called_by_another_name():
    """`op_range` reaches the reader: OP of 0 to 4095 counts is the same loop in %."""
    from stiction.apps.reading_options import columns_of

    assert columns_of(()) is None
    assert columns_of(("op=A", "PV=3")) == {"op": "A", "pv": 3}


def test_counts_become_percent(run, folder, sticky_csv):
    header, *lines = sticky_csv.splitlines()
    table = np.array([[float(x) for x in line.split(",")] for line in lines])
    table[:, 3] *= 40.95
    (folder / "counts.csv").write_text("\n".join([header, *(",".join(map(repr, map(float, row))) for row in table)]))
    [found] = json.loads(run("diagnose", "counts.csv", "--json", "--op-range", "0", "4095").out)
    assert found["stiction"]["S"] == pytest.approx(5.0, rel=0.15)


def test_loops_with_one_tag_are_named_with_their_files(run, folder, sticky_csv):
    lines = sticky_csv.splitlines(keepends=True)
    for month, rows in (("may", lines[1:601]), ("june", lines[900:])):
        (folder / month).mkdir()
        (folder / month / "FIC-101.csv").write_text("".join(lines[:1] + rows))
    done = run("diagnose", "may/FIC-101.csv", "june/FIC-101.csv", "--explain")
    page = (folder / "stiction-report.html").read_text()
    for month in ("may", "june"):
        name = f"FIC-101 ({month}/FIC-101.csv)"
        assert re.search(rf"\n{re.escape(name)} +(Valve stiction|Probably valve stiction)", done.out)
        assert f"\n{name}, in detail" in done.out
        assert f">{name}</a>" in page
        assert f"{name} · " in page
