"""The story of a verdict: what it shows as counted is what the probability was made of."""

from __future__ import annotations

import ast
import inspect
import math
import re
from dataclasses import replace
from itertools import pairwise

import pytest
from stiction.diagnosis.identified import J_UNKNOWN, RIVALS, ProcessFit, Rival
from stiction.diagnosis.verdict.held import HELD

import stiction as st
import stiction.diagnosis.verdict.features
from report.diagnoses import diagnosis, record
from stiction.diagnosis.result import Counted
from stiction.report import labels
from stiction.report.explanation import COUNTED, counted_step, story


@pytest.fixture(scope="module")
def found():
    return st.diagnose(record())


def test_what_counted_adds_up_to_what_is_told(found):
    step = counted_step(found)
    assert step is not None
    assert step.table is not None
    *rows, others, total = step.table.rows
    assert (others[0], total[0]) == ("the others together", "all together")
    assert len(rows) == COUNTED < len(found.counted)
    shown = [float(row[3]) for row in (*rows, others)]
    assert sum(shown) == pytest.approx(float(total[3]), abs=0.05 * (len(shown) + 1))
    # Stiction against all but play, before doubts drew stiction and left the others in proportion.
    before, after = found.probability_before_doubts, found.causes["stiction"]
    play = found.causes["deadband"] * (1.0 - before) / (1.0 - after)
    assert float(total[3]) == pytest.approx(math.log(before / (1.0 - before - play)), abs=0.06)
    assert labels.format_probability(before) in step.lines[0]
    assert step.lines[0].startswith(f"{len(found.counted) - 1} findings, ")


def test_few_findings_need_no_others():
    few = (Counted("band", 0.7, 0.3, 2.4), Counted("usual", math.nan, math.nan, -1.7))
    step = counted_step(diagnosis(200, counted=few))
    assert step is not None
    assert step.table is not None
    assert [row[0] for row in step.table.rows][2:] == ["all together"]
    assert step.table.rows[-1][3] == "+0.7"
    assert step.lines[0].startswith("1 finding, ")
    assert counted_step(diagnosis(200)) is None


def test_no_share_of_a_cause_is_shown_as_nothing(found):
    [table] = [step.table for step in story(found) if step.title == "Which cause?"]
    assert table is not None
    shown = [row[1] for row in table.rows]
    assert "<0.01" in shown
    assert not {"0.00", "1.00"} & set(shown)


def test_each_good_valve_to_beat_is_told(found):
    def told(valve):
        steps = story(replace(found, identification=valve))
        [lines] = [step.lines for step in steps if step.title == "Which valve and process explain the PV?"]
        return [line for line in lines if "twice the log likelihood" in line]

    valve = found.identification
    straight, bent, gated, turns, wave, beside = (labels.format_number(valve.rivals[name].likelier) for name in RIVALS)
    by = (
        f"In twice the log likelihood a sticky valve predicts the PV better by {straight} than a good one, "
        f"better by {bent} than a good one of a bent characteristic ({valve.bent}), "
        f"better by {gated} than a good one given the past of the PV without its noise, "
        f"better by {turns} than a good one beside a disturbance that turns where the PV comes to a level"
    )
    waves = (
        f"better by {wave} than a good one beside a wave from outside, better by {beside} with that wave beside both"
    )
    assert told(valve) == [f"{by}, {waves}."]
    worse = {**valve.rivals, "wave": Rival(0.0, -7.0)}
    assert "worse by 7 than a good one beside a wave from outside" in told(replace(valve, rivals=worse))[0]
    without = {name: rival for name, rival in valve.rivals.items() if name not in ("wave", "beside_wave")}
    assert told(replace(valve, rivals=without)) == [f"{by}."]
    assert told(replace(valve, rivals={})) == []


@pytest.mark.parametrize(("left_out", "said"), [(0, None), (1, "1 sample"), (34, "34 samples")])
def test_what_was_left_out_is_told(found, left_out, said):
    steps = story(replace(found, identification=replace(found.identification, left_out=left_out)))
    [lines] = [step.lines for step in steps if step.title == "Which valve and process explain the PV?"]
    told = [line for line in lines if line.startswith("Left out")]
    assert told == ([f"Left out of that: {said} that neither valve predicts, as where the load steps."] if said else [])


def valve_told(found, **known):
    steps = story(replace(found, identification=replace(found.identification, **known)))
    [lines] = [step.lines for step in steps if step.title == "Which valve and process explain the PV?"]
    return lines


def test_the_process_behind_a_good_valve_is_told_beside_that_of_a_sticky_one(found):
    known = ProcessFit(1.2, 5.0, 2.0, integrating=False)
    lines = valve_told(found, process=replace(known, gain=0.6), linear=known)
    assert lines[1].startswith("The process has a gain of 0.6 PV units per %")
    known_as = "a gain of 1.2 PV units per %, a time constant of 5 s and a dead time of 2 s"
    assert lines[2].replace("\u00a0", " ") == f"Behind a good valve the process has {known_as}."
    integrates = valve_told(found, linear=replace(known, integrating=True))[2].replace("\u00a0", " ")
    assert "the process integrates 1.2 PV units per % and second after a dead time of 2 s." in integrates
    told = replace(found.identification, linear=known).to_dict()["linear"]
    assert told == {"gain": 1.2, "time_constant": 5.0, "dead_time": 2.0, "lag": 0.0, "integrating": False}
    assert replace(found.identification, linear=None).to_dict()["linear"] is None
    assert not any("good valve the process" in line for line in valve_told(found, linear=None))


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        ((2.7, 3.4), "lies between 2.7 and 3.4 %"),
        ((3.0, 3.0), "is 3.00 %"),
        ((3.001, 3.004), "between 3.001 and 3.004 %"),
    ],
)
def test_equal_ends_of_the_draws_are_one_number(found, ends, said):
    [line] = [line for line in valve_told(found, S_bootstrap=ends) if "draws" in line]
    assert line.endswith(f"{said}.")


@pytest.mark.parametrize(
    ("drift", "error", "said"),
    [
        (0.0, 0.0, []),
        (1e-9, 2e-9, []),
        (math.nan, math.nan, []),
        (-0.31, 0.12, ["S changes by -0.31 % per hour (standard error 0.12)."]),
        (0.0, 0.12, ["S changes by 0 % per hour (standard error 0.12)."]),
    ],
)
def test_a_drift_of_nothing_is_not_told(found, drift, error, said):
    assert [line for line in valve_told(found, drift=drift, drift_error=error) if "per hour" in line] == said


def test_a_finding_at_the_end_of_its_scale_is_not_shown_as_measured():
    held = (Counted("band", 0.7, 0.3, 2.4), Counted("advantage", 0.7 - 1e-16, 0.1, 1.1), Counted("fit", 0.7, 0.4, 0.2))
    step = counted_step(diagnosis(200, counted=(*held, Counted("band", 0.42, 0.3, 0.4))))
    assert step is not None
    assert step.table is not None
    assert [row[1] for row in step.table.rows[:4]] == ["0.7 or more", "0.7 or more", "0.7", "0.42"]


def test_every_finding_that_is_held_is_said_to_be():
    tree = ast.parse(inspect.getsource(stiction.diagnosis.verdict.features))
    [row] = [one for one in tree.body if isinstance(one, ast.ClassDef) and one.name == "Features"]
    said = {
        ast.unparse(name.target): re.search(r"held at ([1-9.]+\b|0\.\d+)", ast.unparse(doc))
        for name, doc in pairwise(row.body)
        if isinstance(name, ast.AnnAssign) and isinstance(doc, ast.Expr)
    }
    told = {name: float(end[1]) for name, end in said.items() if end is not None and not name.startswith("keeps_")}
    assert len(told) > 10
    # Some say no more than that they are the same as the one before, others are held by what they are made of.
    assert {name: HELD.get(name) for name in told} == told
    assert set(HELD) <= set(said)


def test_an_open_jump_has_no_number_in_any_step(found):
    valve = replace(found.identification, J=1.2345, J_low=0.0, J_high=found.identification.S)
    assert valve.J_told == J_UNKNOWN
    steps = story(replace(found, identification=valve))
    [lines] = [step.lines for step in steps if step.title == "Which valve and process explain the PV?"]
    for line in (lines[0], steps[-1].lines[0].replace("\u00a0", " ")):
        assert "J open (0.0 to" in line
        assert "J = " not in line
    told = replace(valve, J_low=1.2, J_high=1.3)
    assert "J = 1.23 % (95 % 1.20 to 1.30)" in told.summary()
