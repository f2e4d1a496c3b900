"""Windows of a record: those in which a simulated valve sticks, and no others, are said to stick."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from itertools import islice, pairwise

import numpy as np
import pytest

import stiction as st
from calibration.populations import population
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.result import Window
from stiction.diagnosis.verdict.windows import changes, said, windows
from stiction.report.figures import windows as strip
from stiction.report.view import View

SEED, LOOPS, LONGEST = 5, 14, 2000
MOSTLY, HARDLY = 0.7, 0.15
"""Shares of a window in which the valve sticks, above and below which there is a truth to hit [-]."""


def searched(case):
    record, period = case.record, find_oscillation(case.record).period
    found = st.identify(record, period=period, closer=False)
    return record, found


@cache
def judged():
    """Loops whose valve sticks at times, each with the share of each window in which it did, and that window."""
    drawn = population(1000, ("stiction",), SEED, historian=False)
    short = (case for case in drawn if case.kind == "intermittent" and len(case.record) <= LONGEST)
    return [
        [(max(min(b, w.last) - max(a, w.first), 0) / (w.last - w.first), w) for w in windows(*searched(case))]
        for case in islice(short, LOOPS)
        for a, b in case.sticking
    ]


def test_the_windows_in_which_a_valve_sticks_are_found():
    rows = [row for loop in judged() for row in loop]
    sticks = [window.verdict for share, window in rows if share >= MOSTLY]
    rests = [window.verdict for share, window in rows if share <= HARDLY]
    assert len(sticks) >= 10
    assert len(rests) >= 5
    assert sticks.count("stiction") >= 0.7 * len(sticks), sticks
    assert rests.count("stiction") <= 0.15 * len(rests), rests


def test_windows_follow_each_other_without_gap_or_overlap():
    assert sum(len(loop) > 1 for loop in judged()) >= 5
    for loop in judged():
        assert all(one.last == other.first for (_, one), (_, other) in pairwise(loop))


@cache
def always():
    loop = st.Loop(st.PID(0.4, 5.0), st.Kano(5.0, 3.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    run = st.simulate(loop, 70.0, 2400.0, 6.0, seed=1, pv_start=70.0, op_start=50.0, tag="FC1", loop_type="flow")
    record = replace(run, mv=None)
    return record, st.identify(record, period=find_oscillation(record).period, closer=False)


def test_a_valve_that_always_sticks_does_so_in_every_window():
    record, found = always()
    rows = windows(record, found)
    assert len(rows) >= 3
    assert {row.verdict for row in rows} == {"stiction"}
    assert (rows[0].first, rows[-1].last) == (0, len(record))
    assert said(rows, record.dt) == ""
    assert [row.first for row in windows(record, found, start=300)] == [row.first + 300 for row in rows]


def test_a_record_searched_as_one_has_no_windows():
    record, _ = always()
    assert windows(record, st.identify(record, period=np.inf, closer=False)) == ()
    assert said((), 1.0) == ""


def some(*verdicts):
    return tuple(Window(10 * k, 10 * k + 10, verdict, 2.0, 1.0, 90.0, 80.0) for k, verdict in enumerate(verdicts))


@pytest.mark.parametrize(
    ("verdicts", "sentence"),
    [
        (
            ("no_stiction", "stiction", "stiction", "no_stiction"),
            "The valve sticks in 2 of 4 windows, from 5 s to 15 s; in the others it follows.",
        ),
        (
            ("stiction", "undecided", "stiction"),
            "The valve sticks in 2 of 3 windows, from 0 s to 5 s and from 10 s to 15 s; "
            "in the other it cannot be told.",
        ),
        (
            ("undecided", "stiction", "no_stiction"),
            "The valve sticks in 1 of 3 windows, from 5 s to 10 s; in the others it follows or cannot be told.",
        ),
        (("no_stiction", "no_stiction"), "In none of 2 windows by itself is the valve seen to stick."),
    ],
)
def test_the_sentence_says_when(verdicts, sentence):
    assert said(some(*verdicts), 0.5) == sentence


def test_windows_reach_json_and_the_page():
    record, _ = always()
    plain = st.diagnose(record)
    assert strip(View(replace(plain, windows=()))) is None
    found = replace(plain, windows=some("stiction", "no_stiction", "undecided", "stiction"))
    told = json.loads(json.dumps(found.to_dict(), allow_nan=False))["windows"]
    assert [(row["first"], row["last"], row["verdict"]) for row in told][1] == (10, 20, "no_stiction")
    figure = strip(View(found))
    assert figure is not None
    assert [trace["name"] for trace in figure.plot["data"]] == ["sticks", "follows", "cannot tell"]
    assert figure.plot["data"][0]["x"] == pytest.approx([5.0 / 60.0, 35.0 / 60.0])  # minutes
    assert "sticks in 2 of 4 windows" in figure.caption


@cache
def tightened(S):
    """A valve of S = 5 %, and from the middle on another one of S [% of span]."""
    runs = [
        st.simulate(
            st.Loop(st.PID(0.4, 5.0), st.Kano(size, 0.6 * size), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1),
            70.0, 2000.0, 6.0, seed=seed, pv_start=70.0, op_start=50.0, loop_type="flow",
        )
        for seed, size in ((1, 5.0), (2, S))
    ]  # fmt: skip
    joined = {name: np.concatenate([getattr(run, name) for run in runs]) for name in ("op", "pv", "sp")}
    return st.diagnose(replace(runs[0], mv=None, auto=None, valve_signal=None, **joined))


@pytest.mark.parametrize("S", [5.0, 4.0, 3.0])
def test_a_valve_that_sticks_by_another_S_sticks_in_its_windows(S):
    rows = [w for w in tightened(S).windows if w.last <= 2000 or w.first >= 2000]
    assert {w.verdict for w in rows} == {"stiction"}
    for window in rows:
        assert (S if window.first >= 2000 else 5.0) == pytest.approx(window.S, rel=0.08)
        assert window.fit > window.fit_linear
    assert all(w.verdict != "no_stiction" for w in tightened(S).windows)


def test_a_drift_of_S_is_told_where_it_is_plain():
    assert "S falls by" in tightened(3.0).reason
    assert "over the record" not in tightened(5.0).reason
    found = tightened(5.0).identification
    hour = {"duration": 3600.0}
    assert changes(replace(found, S=5.0, drift=-1.0, drift_error=0.3), **hour) == (
        "S falls by 1 % over the record (-1 % per hour)."
    )
    assert changes(replace(found, S=5.0, drift=1.0, drift_error=0.4), **hour) == ""
    assert changes(replace(found, S=11.0, drift=1.0, drift_error=0.1), **hour) == ""
    assert changes(replace(found, S=5.0, drift=float("nan"), drift_error=0.1), **hour) == ""
