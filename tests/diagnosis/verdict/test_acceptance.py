"""How often the verdict is right: on simulated loops and on real records."""

from __future__ import annotations

import csv
from collections import Counter, defaultdict
from dataclasses import replace

import pytest

import stiction as st
from stiction.simulation.population import CAUSES

from .population import OTHERS, SURE, judged, listed, measures, table

SEED, SHORT = 2, 800
"""Population of the quick tests, of records that are quickly judged; each still holds six periods."""


def test_sticky_loops_are_found():
    rows = judged(30, ("stiction",), SEED, SHORT)
    missed = [row for row in rows if row.probability < 1.0 - SURE]
    assert sum(row.right for row in rows) >= 20, listed(row for row in rows if not row.right)
    assert len(missed) <= 3, listed(missed)


def test_the_interval_holds_S():
    rows = [row for row in judged(30, ("stiction",), SEED, SHORT) if not row.refused]
    outside = [row for row in rows if not row.S_low <= row.S <= row.S_high]
    assert len(outside) <= 6, listed(outside)


@pytest.mark.xfail(reason="issue 5 asks for S within 10 % in 0.9 where J shows; docs/verdict.md says what was reached")
def test_S_is_measured_where_J_shows():
    rows = [row for row in judged(30, ("stiction",), SEED, SHORT) if row.visible]
    assert sum(row.S_close for row in rows) >= 0.9 * len(rows), listed(row for row in rows if not row.S_close)


def test_loops_that_oscillate_for_other_reasons_raise_no_alarm():
    rows = judged(30, OTHERS, SEED, SHORT)
    alarms = [row for row in rows if row.verdict == "stiction"]
    assert len(alarms) <= 4, listed(alarms)
    assert not [row for row in alarms if row.probability > SURE], listed(alarms)


@pytest.mark.parametrize("cause", CAUSES)
def test_the_cause_is_named(cause):
    rows = judged(8, (cause,), 31, 700)
    named = sum(row.cause == cause for row in rows)
    assert named >= 4, listed(row for row in rows if row.cause != cause)


@pytest.mark.slow
def test_a_population_of_all_causes():
    rows = judged(700, CAUSES, 7, jobs=2)
    told = measures(rows)
    assert told["balanced_accuracy"] >= 0.85, table(rows)
    assert told["calibration_error"] <= 0.04, table(rows)
    assert told["confident_false_alarms"] <= 0.01, table(rows)
    assert 0.88 <= told["interval_holds_S"] <= 0.98, table(rows)


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
