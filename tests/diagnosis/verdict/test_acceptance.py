"""How often the verdict is right: on simulated loops and on real records."""

from __future__ import annotations

import csv
from collections import Counter, defaultdict
from dataclasses import replace

import pytest

import stiction as st
from calibration.populations import CAUSES
from stiction.diagnosis.verdict.findings import findings
from stiction.diagnosis.verdict.weighing import weighing

from .population import OTHERS, judged, listed, measures, table

SEED, SHORT = 2, 800
"""Population of the quick tests, of records that are quickly judged; each still holds six periods."""


def short_of(what):
    """A bound that is asked for and not reached; `docs/verdict-measured.md` says what limits it."""
    return pytest.mark.xfail(reason=what, strict=True)


REACHED = {"sticky loops found, of 30": 17, "S within 10 %, of 25": 18, "sticky loops named, of 20": 14}
"""Counted with the tables in use. A little noise of a new count is let pass, one loop; more is a step back."""


def test_no_step_back_from_what_was_reached():
    rows, others = judged(30, ("stiction",), SEED, SHORT), judged(20, ("stiction",), 31, 700)
    counted = (
        sum(row.right for row in rows),
        sum(row.S_close for row in rows if row.visible),
        sum(row.cause == "stiction" for row in others),
    )
    for (what, reached), now in zip(REACHED.items(), counted, strict=True):
        assert now >= reached - 1, f"{what}: {now}, {reached} were reached"


@short_of("17 of 30; 27 are asked")
def test_sticky_loops_are_found():
    rows = judged(30, ("stiction",), SEED, SHORT)
    assert sum(row.right for row in rows) >= 27, listed(row for row in rows if not row.right)


@short_of("S within 10 % in 18 of the 25 where J shows; 9 in 10 are asked")
def test_S_is_measured_where_J_shows():
    rows = [row for row in judged(30, ("stiction",), SEED, SHORT) if row.visible]
    assert sum(row.S_close for row in rows) >= 0.9 * len(rows), listed(row for row in rows if not row.S_close)


def test_sticky_loops_are_not_missed_for_sure_and_S_lies_in_its_interval():
    rows = [row for row in judged(30, ("stiction",), SEED, SHORT) if not row.refused]
    missed = [row for row in rows if row.probability < 0.1]
    outside = [row for row in rows if not row.S_low <= row.S <= row.S_high]
    assert len(missed) <= 2, listed(missed)
    assert len(outside) <= 5, listed(outside)  # 19 in 20 miss 1.5 of 30; more than 5 would be chance in one of 300


def test_loops_that_oscillate_for_other_reasons_raise_no_alarm():
    rows = judged(30, OTHERS, SEED, SHORT)
    alarms = [row for row in rows if row.verdict == "stiction"]
    assert len(alarms) <= 2, listed(alarms)


NOT_NAMED = {
    "stiction": short_of("29 of 40 short sticky loops are told; 32 are asked"),
}


@pytest.mark.parametrize("cause", [pytest.param(cause, marks=NOT_NAMED.get(cause, ())) for cause in CAUSES])
def test_the_cause_is_named(cause):
    rows = judged(20, (cause,), 31, 700) + judged(20, (cause,), 32, 700)
    named = sum(row.cause == cause for row in rows)
    assert named >= 32, listed(row for row in rows if row.cause != cause)


@pytest.mark.slow
@short_of("issue 5 asks for 90")
def test_a_hundred_sticky_loops():
    rows = judged(100, ("stiction",), 7)
    good = sum(row.right and row.S_close for row in rows)
    assert good >= 90, table(rows) + listed(row for row in rows if not (row.right and row.S_close))


@pytest.mark.slow
def test_a_hundred_loops_that_oscillate_for_other_reasons():
    rows = judged(100, OTHERS, 7)
    alarms = [row for row in rows if row.verdict == "stiction"]
    assert len(alarms) <= 5, table(rows) + listed(alarms)


@pytest.mark.slow
def test_few_confident_false_alarms_in_a_population_of_all_causes():
    rows = judged(700, CAUSES, 7, jobs=2)
    assert measures(rows)["confident_false_alarms"] <= 0.01, table(rows)


@pytest.mark.slow
def test_the_causes_of_a_population_are_named():
    assert measures(judged(700, CAUSES, 7, jobs=2))["balanced_accuracy"] >= 0.9


@pytest.mark.slow
def test_the_probabilities_of_a_population_hold():
    told = measures(judged(2000, CAUSES, 10, jobs=2))
    assert told["calibration_error"] <= 0.03, table(judged(2000, CAUSES, 10, jobs=2))
    assert 0.92 <= told["interval_holds_S"] <= 0.98


def test_real_loops(records):
    votes, labels = defaultdict(Counter), {}
    with (records / "labels.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            kind = {"concentration": "analyser"}.get(row["loop_type"], row["loop_type"])
            (record,) = st.read(records / row["file"], dt=float(row["dt_s"]), loop_type=kind)
            found = st.diagnose(replace(record, integrating=row["integrating"] == "true"))
            votes[row["group"]][found.verdict] += 1
            labels[row["group"]] = row["label"]
    wrong = [
        f"\n  {group}: {label}, called {dict(votes[group])}"
        for group, label in labels.items()
        if 2 * votes[group][label] <= votes[group].total()
    ]
    assert len(labels) >= 20
    assert len(wrong) <= 0.15 * len(labels), "".join(wrong)


def test_a_table_that_has_seen_no_recorded_loop_tells_them(records):
    plant, right = weighing("plant"), defaultdict(list)
    sticks = plant.outcomes.index("stiction")
    with (records / "labels.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            (record,) = st.read(
                records / row["file"],
                dt=float(row["dt_s"]),
                loop_type={"concentration": "analyser"}.get(row["loop_type"], row["loop_type"]),
            )
            found = findings(record).features
            assert found is not None, row["file"]
            odds = plant.constant + plant.added([getattr(found, name) for name in plant.features]).sum(axis=0)
            right[row["group"]].append((odds[sticks] > 0.0) == (row["label"] == "stiction"))
    loops = {group: 2 * sum(told) > len(told) for group, told in right.items()}
    assert len(loops) >= 20
    assert sum(loops.values()) >= 0.9 * len(loops), [group for group, told in loops.items() if not told]
