"""Every record gets a verdict with a reason, whatever is wrong with it and whatever its units."""

from __future__ import annotations

import importlib
import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import stiction as st
from stiction.diagnosis.verdict.doubt import LEAST
from stiction.diagnosis.verdict.features import Features
from stiction.diagnosis.verdict.findings import findings
from stiction.diagnosis.verdict.probability import UNDECIDED, causes
from stiction.errors import RecordError
from stiction.simulation.historian import averaged

page = importlib.import_module("stiction.diagnosis.verdict.diagnose")

N = 600
REQUIRED = {
    "": {"file", "tag", "verdict", "probability", "reason", "action", "stiction", "oscillation", "evidence", "quality"},
    "stiction": {"S", "J", "S_low", "S_high"},
    "oscillation": {"oscillating", "period_s", "regularity"},
    "evidence": {"method", "index", "threshold", "vote", "valid", "why"},
}
"""Keys that scripts outside the project rely on."""
VERDICTS = ("stiction", "no_stiction", "undecided")


@cache
def sticky():
    """A sticky flow loop with noise."""
    loop = st.Loop(st.PID(0.4, 5.0), st.Kano(5.0, 3.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    run = st.simulate(
        loop, 70.0, float(N), np.full(N, 6.0), seed=1, pv_start=70.0, op_start=50.0, tag="FC1", loop_type="flow"
    )
    return replace(run, mv=None)


@cache
def disturbed(n=N):
    """A good valve in a loop that something outside drives."""
    loop = st.Loop(st.PID(0.35, 6.0), st.Ideal(), st.FOPDT(1.5, 4.0, 2.0), dt=1.0, noise=0.1)
    load = 3.0 * np.sin(2.0 * np.pi * np.arange(n) / 60.0)
    run = st.simulate(loop, 70.0, float(n), load, seed=1, pv_start=70.0, op_start=50.0, tag="FC2", loop_type="flow")
    return replace(run, mv=None)


def changed(**signals):
    return replace(sticky(), **signals)


def some_missing(x, share, seed):
    x = x.copy()
    x[np.random.default_rng(seed).random(x.size) < share] = np.nan
    return x


def kinds():
    """Name -> record: healthy, sticky, and everything that can be wrong with a record."""
    run = sticky()
    op, pv, sp = run.op, run.pv, run.sp
    rng = np.random.default_rng(0)
    gap = pv.copy()
    gap[200:330] = np.nan
    half_saturated = np.where(np.arange(N) < 400, 100.0, op)
    at = np.arange(N)
    return {
        "sticky": run,
        "disturbed": disturbed(),
        "no set point": changed(sp=None),
        "set point missing": changed(sp=np.full(N, np.nan)),
        "unknown kind": changed(loop_type="other", integrating=None),
        "level": changed(loop_type="level", integrating=True),
        "noise only": changed(op=50.0 + rng.normal(size=N), pv=rng.normal(size=N)),
        "some missing": changed(op=some_missing(op, 0.05, 1), pv=some_missing(pv, 0.05, 2)),
        "mostly missing": changed(op=some_missing(op, 0.8, 1), pv=some_missing(pv, 0.8, 2)),
        "a gap": changed(pv=gap),
        "op all missing": changed(op=np.full(N, np.nan)),
        "pv all missing": changed(pv=np.full(N, np.nan)),
        "everything missing": changed(op=np.full(N, np.nan), pv=np.full(N, np.nan), sp=np.full(N, np.nan)),
        "infinite values": changed(pv=np.where(np.arange(N) % 97 == 5, np.inf, pv)),
        "saturated": changed(op=np.full(N, 100.0)),
        "half saturated": changed(op=half_saturated),
        "manual by its mode": changed(auto=np.zeros(N, dtype=bool)),
        "part manual": changed(auto=np.arange(N) > 250),
        "op constant": changed(op=np.full(N, 42.0)),
        "pv constant": changed(pv=np.full(N, 0.1)),
        "both constant": changed(op=np.full(N, 42.0), pv=np.full(N, 0.1)),
        "pv quantised": changed(pv=np.round(pv / 2.0) * 2.0),
        "pv two values": changed(pv=np.where(pv > 70.0, 71.0, 69.0)),
        "op quantised": changed(op=np.round(op)),
        "interpolated": changed(**{name: np.interp(at, at[::16], x[::16]) for name, x in (("op", op), ("pv", pv))}),
        "op interpolated": changed(op=np.interp(at, at[::16], op[::16])),
        "held": changed(op=np.repeat(op[::6], 6), pv=np.repeat(pv[::6], 6)),
        "a spike": changed(pv=np.where(np.arange(N) == 300, 1e9, pv)),
        "a ramp": changed(op=np.linspace(10.0, 90.0, N), pv=np.linspace(0.0, 5.0, N)),
        "huge": changed(pv=1e15 * pv, sp=1e15 * sp),
        "tiny": changed(pv=1e-15 * pv, sp=1e-15 * sp),
        "offset": changed(pv=1e7 + pv, sp=1e7 + sp),
        "op in milliampere": changed(op=4.0 + 0.16 * op),
        "short": run.window(0, 40),
        "very short": run.window(0, 3),
        "one sample": run.window(0, 1),
        "empty": run.window(0, 0),
        "slow sampling": replace(run.window(0, N), op=op[::25], pv=pv[::25], sp=None, dt=25.0),
    }


REFUSED = {
    "op all missing": "missing|length|samples|OP",
    "pv all missing": "missing|samples|PV",
    "everything missing": "missing|samples",
    "mostly missing": "missing|samples",
    "saturated": "limit|OP",
    "manual by its mode": "manual",
    "op constant": "OP is constant",
    "pv constant": "PV is constant",
    "both constant": "OP is constant",
    "pv two values": "PV swings over 2 steps",
    "short": "40 of 40 samples|record some hundred",
    "very short": "3 of 3 samples",
    "one sample": "1 of 1 samples",
    "empty": "0 of 0 samples",
    "interpolated": "straight lines",
}


@cache
def diagnosed(name):
    return st.diagnose(kinds()[name])


def test_an_op_on_lines_is_told_by_the_pv_and_the_controller():
    found, truth = diagnosed("op interpolated"), diagnosed("sticky")
    assert found.verdict == "stiction"
    assert (
        "OP is stored at 6 % of the samples; the others were reconstructed with the controller equation."
        in found.reason
    )
    assert pytest.approx(truth.identification.S, rel=0.02) == found.identification.S


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", kinds())
def test_every_record_gets_a_verdict_that_json_can_hold(name):
    found = diagnosed(name)
    told = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    more = {"cause", "causes", "controller", "counted", "dt_s", "loop_state", "op_unit", "probability_before_doubts", "windows"}
    assert set(told) == REQUIRED[""] | more
    assert set(told["oscillation"]) >= REQUIRED["oscillation"]
    assert all(set(row) >= REQUIRED["evidence"] for row in told["evidence"])
    assert told["stiction"] is None or set(told["stiction"]) >= REQUIRED["stiction"]
    assert told["verdict"] in VERDICTS
    assert 0.0 <= told["probability"] <= 1.0
    assert 0.0 <= told["probability_before_doubts"] <= 1.0
    assert set(found.settings) <= {"model", "undecided"}
    assert set(found.features) == (set(Features._fields) if found.identification is not None else set())
    assert {row["vote"] for row in told["evidence"]} <= set(VERDICTS)
    assert told["reason"].endswith(".")
    assert told["action"].endswith(".")
    assert found.summary().startswith(found.record.tag)


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_judged_is_undecided_and_says_why(name):
    found = diagnosed(name)
    assert (found.verdict, found.cause) == ("undecided", "unknown")
    assert found.identification is None
    assert re.search(REFUSED[name], found.reason), found.reason
    if "as the reason asks" in found.action:
        assert re.search("[;:,] (put|record|repair|export|check|set) ", found.reason.split(":", 1)[1]), found.reason


@pytest.mark.parametrize(
    "name", ["sticky", "no set point", "set point missing", "unknown kind", "some missing", "op in milliampere", "tiny"]
)
def test_a_sticky_valve_is_called_so(name):
    found = diagnosed(name)
    assert (found.verdict, found.cause) == ("stiction", "stiction")
    assert found.probability > 0.6
    assert found.identification is not None
    unit = 0.16 if name == "op in milliampere" else 1.0
    assert pytest.approx(5.0 * unit, rel=0.15) == found.identification.S


def test_a_driven_loop_is_called_so():
    found = st.diagnose(disturbed(1500))
    assert (found.verdict, found.cause) == ("no_stiction", "external disturbance")
    assert found.probability < 0.4


def test_ten_periods_of_a_driven_loop_may_be_one_that_rings():
    found = diagnosed("disturbed")
    assert found.verdict == "no_stiction"
    assert found.causes["external disturbance"] > 0.3
    assert found.causes["external disturbance"] + found.causes["tight tuning"] > 0.9


def test_the_first_row_of_the_evidence_is_the_identifications_own():
    found = diagnosed("sticky")
    assert (found.evidence[0].method, found.evidence[0].vote) == ("simulation_error", "stiction")
    assert len({row.method for row in found.evidence}) == len(found.evidence)
    assert all(row.source for row in found.evidence)


def test_without_a_pv_there_is_nothing_to_say():
    with pytest.raises(RecordError, match="FC1 has no PV"):
        st.diagnose(changed(pv=None))


@pytest.mark.parametrize("take", [st.diagnose, st.identify, st.compare_models, st.analyse_ramp, st.analyse_steps])
@pytest.mark.parametrize(
    ("given", "told"),
    [
        ([st.LoopRecord("FC1", 1.0, op=np.zeros(3))] * 2, "a list of 2, as"),
        ("loop.csv", r"'loop\.csv' is a path; read it"),
        (Path("loop.csv"), r"'loop\.csv' is a path; read it"),
        (5, "of type int, no LoopRecord; give"),
    ],
)
def test_what_is_no_record_is_told_to_be_none(take, given, told):
    with pytest.raises(RecordError, match=told):
        take(given)


@pytest.mark.parametrize(
    ("make", "mv"), [(sticky, sticky().op), (disturbed, disturbed().op), (sticky, np.full(N, 50.0))]
)
def test_a_position_that_shows_nothing_changes_the_reason_only(make, mv):
    plain = st.diagnose(make()).to_dict()
    plain["evidence"] = plain["evidence"][0]
    told = st.diagnose(replace(make(), mv=mv)).to_dict()
    assert told["reason"] != plain["reason"]
    assert told | {"evidence": told["evidence"][0], "reason": plain["reason"]} == plain


def test_the_record_is_left_as_it_was():
    run = sticky()
    before = run.op.copy(), run.pv.copy()
    st.diagnose(run)
    np.testing.assert_array_equal(run.op, before[0])
    np.testing.assert_array_equal(run.pv, before[1])


@settings(max_examples=4)
@given(
    exponent=some.floats(-30.0, 30.0),
    shift=some.floats(-50.0, 50.0),
    slower=some.sampled_from([0.001, 0.1, 60.0]),
    sticks=some.booleans(),
    upside_down=some.booleans(),
)
def test_units_do_not_change_the_verdict(exponent, shift, slower, sticks, upside_down):
    run = sticky() if sticks else disturbed()
    scale = 10.0**exponent * (-1.0 if upside_down else 1.0)
    other = replace(run, dt=slower, pv=scale * (run.pv + shift), sp=scale * (run.sp + shift))
    found, truth = st.diagnose(other), diagnosed("sticky" if sticks else "disturbed")
    assert (found.verdict, found.cause) == (truth.verdict, truth.cause)
    assert found.probability == pytest.approx(truth.probability, abs=1e-3)
    assert found.identification is not None
    assert truth.identification is not None
    assert pytest.approx(truth.identification.S, rel=1e-4) == found.identification.S
    assert found.oscillation.period == pytest.approx(truth.oscillation.period * slower, rel=1e-6)


@pytest.mark.parametrize(("name", "scale", "shift"), [("0..1", 0.01, 0.0), ("mA", 0.16, 4.0), ("counts", 40.95, 0.0)])
@pytest.mark.parametrize("kind", ["sticky", "disturbed"])
def test_the_unit_of_op_does_not_change_the_verdict(kind, name, scale, shift):
    run = kinds()[kind]
    found, truth = st.diagnose(replace(run, op=shift + scale * run.op)), diagnosed(kind)
    assert (found.verdict, found.cause) == (truth.verdict, truth.cause)
    assert found.identification is not None
    assert truth.identification is not None
    assert pytest.approx(scale * truth.identification.S, rel=1e-4) == found.identification.S


def test_play_on_a_level_is_not_called_stiction():
    loop = st.Loop(st.PID(3.0, 60.0), st.Kano(3.0, 0.0), st.Integrating(0.02, 6.0), dt=1.0, noise=0.02)
    load = np.where(np.arange(900) < 20, 2.0, 0.0)
    run = st.simulate(loop, 50.0, 900.0, load, 2, pv_start=50.0, op_start=50.0, tag="LC1", loop_type="level")
    found = st.diagnose(replace(run, mv=None))
    assert found.oscillation.oscillating
    assert found.verdict != "stiction"
    assert found.cause == "deadband"


def test_the_likelier_a_jump_the_less_a_valve_has_mere_play():
    loop = st.Loop(st.PID(3.0, 60.0), st.Kano(3.0, 1.0), st.Integrating(0.02, 6.0), dt=1.0, noise=0.02)
    load = np.where(np.arange(900) < 20, 2.0, 0.0)
    run = st.simulate(loop, 50.0, 900.0, load, 2, pv_start=50.0, op_start=50.0, tag="LC1", loop_type="level")
    row = findings(replace(run, mv=None)).features
    assert row is not None
    told = [causes(row._replace(likelier_than_play=more)) for more in np.linspace(0.0, 1.0, 9)]
    assert all(np.diff([one["stiction"] / one["deadband"] for one in told]) > 0.0)
    assert told[0]["deadband"] > 0.5 > told[-1]["deadband"]
    assert [sum(one.values()) for one in told] == pytest.approx([1.0] * 9)


def test_a_likely_jump_is_never_surely_none(monkeypatch):
    run = sticky()
    row = findings(run).features
    assert row is not None
    assert row.likely_jump_clear > 0.0
    good = {cause: 0.999 * (cause == "none") + 0.001 * (cause == "stiction") for cause in causes(row)}
    monkeypatch.setattr(page, "causes", lambda _: good)
    found = st.diagnose(run)
    assert found.probability == LEAST
    assert "a jump is likely" in found.reason


def test_a_sticky_valve_that_explains_far_more_is_never_called_good():
    # One upset, then the stem rests for good: no cycle, and all that a calm loop shows speaks for a good valve.
    found = upset(st.He(4.0, 1.0), 0, 20)
    valve = found.identification
    assert valve is not None
    assert valve.fit - valve.fit_linear > 80.0
    assert (found.verdict, found.cause) == ("undecided", "unknown")
    assert LEAST <= found.probability < UNDECIDED[0]
    assert "yet the rest of what was found speaks for no fault" in found.reason
    assert "ramp" in found.action


def test_what_only_the_dense_search_sees_counts_as_well():
    # Means of five seconds of a stem that rests but for one slip: the likeliest valve explains nothing of the slip.
    loop = st.Loop(st.PID(0.25, 20.0), st.He(2.1, 0.9), st.FOPDT(1.3, 5.0, 2.0), dt=1.0, noise=0.03)
    load = np.where(np.arange(9000) < 20, 2.0, 0.0)
    run = st.simulate(loop, 50.0, 9000.0, load, seed=5, pv_start=50.0, op_start=44.0, loop_type="flow")
    record = averaged(replace(run, mv=None), 5.0)
    seen, found = findings(record), st.diagnose(record)
    likeliest, valve = seen.found[seen.speaks], found.identification
    assert valve is not None
    assert likeliest.fit < likeliest.fit_linear < 5.0 < 40.0 < valve.fit
    assert (found.verdict, found.cause, found.probability) == ("undecided", "unknown", LEAST)
    assert f"A sticky valve explains {valve.fit:.0f} %" in found.reason


def upset(valve, first, width):
    """A loop that rests but for one pulse of its load."""
    loop = st.Loop(st.PID(0.4, 8.0), valve, st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    load = np.where((np.arange(2000) >= first) & (np.arange(2000) < first + width), 6.0, 0.0)
    run = st.simulate(loop, 70.0, 2000.0, load, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow")
    return st.diagnose(replace(run, mv=None))


@pytest.mark.parametrize("width", [5, 20, 200])
def test_one_upset_of_a_good_loop_is_nothing_wrong(width):
    found = upset(st.Ideal(), 700, width)
    assert (found.verdict, found.cause) == ("no_stiction", "none")


@pytest.mark.parametrize("valve", [st.He(4.0, 1.0), st.Kano(3.0, 0.0)], ids=["He", "play"])
def test_a_stem_that_rests_in_its_band_is_no_faulty_transmitter(valve):
    assert upset(valve, 0, 20).causes["sensor"] < 0.01
