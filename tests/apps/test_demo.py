"""``stiction demo``: the plant is as it says, and the command sets verdicts beside the truth."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.simulation.demo import demo_plant


@pytest.fixture(scope="module")
def plant():
    return demo_plant()


def test_plant_shows_each_cause(plant):
    causes = [loop.cause for loop in plant]
    assert len(plant) >= 8
    assert causes.count("stiction") >= 4
    assert set(causes) == {"stiction", "deadband", "tight tuning", "external disturbance", "sensor", "none"}
    assert any(loop.cause == "stiction" and loop.record.integrating for loop in plant)
    assert len({loop.record.tag for loop in plant}) == len(plant)


def test_truth_is_what_was_simulated(plant):
    """Sticky valves have a jump, play has none, all others a valve that is ideal."""
    for loop in plant:
        assert (loop.J > 0.0) == (loop.cause == "stiction")
        assert (loop.S > 0.0) == (loop.cause in ("stiction", "deadband"))


def test_records_look_like_a_plant(plant):
    for loop in plant:
        record = loop.record
        assert record.mv is None, "the stem position would give it away"
        assert record.sp is not None
        assert record.pv is not None
        assert record.start is not None
        assert 10.0 < record.op.min() < record.op.max() < 90.0, record.tag
        assert np.abs(record.pv - record.sp).max() < 0.1 * record.sp[0], record.tag


def test_same_seed_same_plant(plant):
    for one, other in zip(plant, demo_plant(), strict=True):
        np.testing.assert_array_equal(one.record.pv, other.record.pv)
    assert not np.array_equal(plant[0].record.pv, demo_plant(2)[0].record.pv)


def test_command_writes_report_and_records(run, folder, plant, monkeypatch):
    some = tuple(replace(loop, record=loop.record.window(0, 1200)) for loop in (plant[0], plant[7]))
    monkeypatch.setattr("stiction.simulation.demo.demo_plant", lambda: some)
    monkeypatch.setattr("webbrowser.open", lambda *_: pytest.fail("no one asked for a browser"))
    done = run("demo", "--report", "plant.html")
    assert done.code == 0
    assert "1 of 2 findings are right, 1 open, 0 wrong." in done.out
    page = (folder / "plant.html").read_text()
    assert {"FIC-101", "FIC-108"} <= set(re.findall(r"FIC-\d+", page))
    for loop in some:
        [record] = st.read(folder / "plant" / f"{loop.record.tag}.csv")
        assert (record.tag, record.dt, record.loop_type) == (loop.record.tag, loop.record.dt, loop.record.loop_type)
        assert record.start == loop.record.start
        np.testing.assert_allclose(record.op, loop.record.op)


def test_wrong_finding_is_marked(run, folder, plant, monkeypatch):
    """A sticky valve of which the demo claims that it is good, and a quiet one that no record could show as sticky."""
    called_good = replace(plant[0], cause="none")
    quiet = replace(plant[7], record=plant[7].record.window(0, 900), cause="stiction", S=3.0)
    monkeypatch.setattr("stiction.simulation.demo.demo_plant", lambda: (called_good, quiet))
    done = run("demo", "--json")
    found = json.loads(done.out)
    assert (done.code, found["right"], found["open"]) == (1, 0, 1)
    assert [loop["result"] for loop in found["loops"]] == ["wrong", "open"]
    assert found["loops"][0]["diagnosis"]["verdict"] == "stiction"
    assert found["loops"][1]["diagnosis"]["finding"] == "cannot_tell"
    done = run("demo", "--report", "table.html")
    rows = [re.split(r" {2,}", line.strip())[:2] for line in done.out.splitlines()]
    assert ["WRONG", called_good.record.tag] in rows
    assert ["open", quiet.record.tag] in rows
    assert "0 of 2 findings are right, 1 open, 1 wrong." in done.out
    assert "Cannot tell whether the valve sticks" in (folder / "table.html").read_text()


def test_a_report_that_is_not_ours_is_left_alone(run, folder):
    (folder / "stiction-demo.html").write_text("mine")
    done = run("demo")
    assert done.code == 3
    assert (folder / "stiction-demo.html").read_text() == "mine"


@pytest.mark.slow
def test_every_fault_is_found_and_none_where_there_is_none(run):
    """Of the healthy loop the record cannot show that its valve is good: OP hardly moves."""
    done = run("demo", "--json")
    results = {loop["tag"]: loop["result"] for loop in json.loads(done.out)["loops"]}
    assert done.code == 0
    assert {tag: result for tag, result in results.items() if result != "right"} == {"FIC-108": "open"}
