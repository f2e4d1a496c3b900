"""The words of a verdict: no reason argues against its verdict, and what is not sure is not told as a fact."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import stiction as st
from calibration.populations.loads import lagged_noise
from stiction.diagnosis.identified import J_UNKNOWN, Rival
from stiction.diagnosis.result import Counted, Oscillation
from stiction.diagnosis.verdict.cause import fits, named_cause
from stiction.diagnosis.verdict.meaning import strongest

from .found import FOUND

RHYTHM = Oscillation(True, 60.0, 5.0, 1.0, 3.0, 20.0, 0, 10)
COUNTED = (
    Counted("usual", math.nan, math.nan, 3.0),
    Counted("band", 0.7, 0.31, 2.4),
    Counted("share", 0.94, 0.5, -3.3),
    Counted("advantage", 0.4, 0.2, 0.5),
)
NAMES = ("deadband", "tight tuning", "external disturbance", "sensor", "saturation", "none")


def told(verdict, p, name="none", found=FOUND, **shares):
    """A cause whose name has almost all that stiction leaves."""
    causes = {"stiction": p, **dict.fromkeys(NAMES, 0.0), name: 1.0 - p, **shares}
    return named_cause(verdict, causes, found, RHYTHM, 1.0, COUNTED)


def fitting(fit, fit_linear, likelier=math.nan):
    return replace(FOUND, fit=fit, fit_linear=fit_linear, rivals={"good": Rival(likelier=likelier)})


def beside(found, **likelier):
    """What was found, and twice the log likelihood over further good valves."""
    return replace(found, rivals={**found.rivals, **{name: Rival(likelier=more) for name, more in likelier.items()}})


def test_a_valve_that_explains_more_is_said_to():
    assert told("stiction", 0.9).reason == (
        "A sticky valve with S = 3.0 % (95 % 2.7 to 3.3) explains 93 % of the PV's movement, a good valve 41 %."
    )


@pytest.mark.parametrize(("fit", "good"), [(40.7, 67.5), (99.9, 99.6), (84.2, 84.1), (-8.0, -3.0)])
def test_a_valve_that_explains_no_more_is_called_sticky_for_what_counted(fit, good):
    shares = f"({max(round(fit), 0)} %, a good valve {max(round(good), 0)} %)"
    by_cycle = told("stiction", 0.9, found=fitting(fit, good, 106.6)).reason
    assert "predicts the PV better than a good one, cycle by cycle (twice the log likelihood: 107), though" in by_cycle
    assert f"explains no more of its movement by simulation {shares}." in by_cycle
    for likelier in (-5.8, 0.9, math.nan):
        reason = told("stiction", 0.9, found=fitting(fit, good, likelier)).reason
        assert f"explains no more of the PV's movement than a good one {shares}; " in reason
        assert "what counted most for it: S takes so much of the OP's swing (0.7 or more, usually 0.31)." in reason
        assert "predicts" not in reason
        assert strongest(COUNTED) in told("undecided", 0.5, found=fitting(fit, good, likelier)).reason


@pytest.mark.parametrize("name", ["tight tuning", "external disturbance"])
def test_a_good_valve_is_not_defended_with_a_sticky_one_that_explains_more(name):
    against = "share of the error that the oscillation carries (0.94, usually 0.5)"
    more = told("no_stiction", 0.05, name, fitting(90.0, 70.0, 50.0)).reason
    assert more.endswith(f"a good valve 70 %; what counted most against it: {against}.")
    for likelier in (50.0, -50.0):
        less = told("no_stiction", 0.05, name, fitting(70.0, 90.0, likelier)).reason
        assert less.endswith("explains no more of the PV's movement than a good one (70 %, a good valve 90 %).")


@pytest.mark.parametrize(
    ("likelier", "bent", "wave", "named"),
    [
        (106.6, -20.0, math.nan, "with a bent characteristic (a seat at 15 % of OP's range)"),
        (106.6, 40.0, -3.0, "beside a wave from outside, the same every 60 s,"),
        (106.6, -20.0, -30.0, "beside a wave from outside, the same every 60 s,"),
        (106.6, -30.0, -20.0, "with a bent characteristic (a seat at 15 % of OP's range)"),
        (106.6, 40.0, 90.0, ""),
        (106.6, math.nan, math.nan, ""),
        (0.5, -20.0, -30.0, ""),  # the straight one is as good
    ],
)
def test_a_good_valve_that_predicts_better_is_named(likelier, bent, wave, named):
    found = beside(fitting(60.0, 41.0, likelier), bent=bent, wave=wave)
    found = replace(found, bent="a seat at 15 % of OP's range")
    sentence = f" A good valve {named} predicts the PV better than a sticky one."
    for verdict, p in (("no_stiction", 0.05), ("undecided", 0.5)):
        for cause in ("external disturbance", "none"):
            assert (sentence in told(verdict, p, cause, found).reason) is bool(named)
    # No reason argues against its verdict.
    assert "A good valve" not in told("stiction", 0.9, found=found).reason


@pytest.mark.parametrize("gated", [-25.0, -35.0])
def test_of_several_that_predict_better_the_likeliest_is_named(gated):
    found = beside(fitting(60.0, 41.0, 106.6), bent=-20.0, wave=-30.0, gated=gated)
    reason = told("no_stiction", 0.05, "none", found).reason
    assert ("A good valve given the past of the PV without its noise as well predicts" in reason) is (gated < -30.0)


def test_the_nearest_of_all_good_valves_is_the_one_to_beat():
    rivals = {"good": Rival(3.0, 9.0), "bent": Rival(-1.0, -4.0)}

    def nearest(**more):
        found = replace(FOUND, rivals=rivals | more)
        return found.beats_any, found.likelier_than_any

    assert nearest() == (-1.0, -4.0)
    assert nearest(wave=Rival(2.0, -6.0)) == (-1.0, -6.0)
    assert nearest(wave=Rival(2.0, -6.0), gated=Rival(-2.0, -5.0)) == (-2.0, -6.0)
    assert nearest(relaxation=Rival(-3.0, math.nan)) == (-3.0, -4.0)
    # With the wave beside both it is no valve that a sticky one has to beat.
    assert nearest(beside_wave=Rival(-9.0, -9.0)) == nearest()
    assert all(math.isnan(number) for number in (FOUND.beats_any, FOUND.likelier_than_any, *FOUND.over("good")))


def test_play_is_named_by_what_was_found():
    plain = told("no_stiction", 0.05, "deadband").reason
    assert plain == (
        "A valve with 3.0 % deadband and little or no slip jump explains 93 % of the PV's movement, a good valve 41 %."
    )
    torn = told("no_stiction", 0.05, "deadband", fitting(50.0, 60.0, -1.0)).reason
    assert torn.endswith("(50 %, a good valve 60 %). By all that was found play is the likeliest cause (0.95).")


@given(fit=some.floats(-50.0, 100.0), good=some.floats(-50.0, 100.0), likelier=some.floats(-100.0, 2000.0))
def test_more_is_said_only_where_the_numbers_shown_are_more(fit, good, likelier):
    said = fits(fitting(fit, good, likelier))
    shown = [max(round(x), 0) for x in (fit, good)]
    assert ("no more" in said) == (shown[0] <= shown[1])
    assert ("predicts" in said) == (shown[0] <= shown[1] and likelier > 1.0)
    assert "-" not in said


def test_a_jump_that_cannot_be_told_is_told():
    wide = replace(FOUND, J_low=0.1, J_high=2.9)
    reason = told("stiction", 0.8, "deadband", wide, deadband=0.15).reason
    play = "Stiction differs from play (deadband) by J only; the probability of play is 0.15."
    assert reason.endswith(f"J cannot be told from this record. {play}")
    assert told("stiction", 0.8, found=replace(wide, J_low=0.3)).reason.endswith("J cannot be told from this record.")
    rough = told("stiction", 0.8, found=replace(wide, J_low=0.5)).reason
    assert rough.endswith("J is told only roughly: the valve jumps, by how much is open.")
    causes = {"stiction": 1.0, **dict.fromkeys(NAMES, 0.0)}
    by_position = named_cause("stiction", causes, wide, RHYTHM, 1.0, by_position=True).reason
    assert "J cannot" not in by_position
    assert "and J = " in by_position
    assert "J = " not in reason
    unlikely = "J alone does not exclude play (deadband); by all that was found its probability is <0.01."
    assert told("stiction", 0.8, found=replace(FOUND, J_low=0.0)).reason.endswith(unlikely)
    assert "play" not in told("stiction", 0.8).reason


def test_an_interval_longer_than_three_fifths_of_S_leaves_J_open():
    J_high = 0.4 + 0.6 * FOUND.S
    assert [replace(FOUND, J_low=0.4, J_high=J_high + more).J_open for more in (-0.01, 0.01)] == [False, True]


def test_identification_and_verdict_say_it_alike():
    loop = st.Loop(st.PID(0.4, 5.0), st.Kano(4.0, 1.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.5)
    run = st.simulate(loop, 70.0, 600.0, 6.0, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow")
    found = st.diagnose(replace(run, mv=None))
    assert found.identification is not None
    assert found.identification.J_open
    assert found.verdict == "stiction"
    assert J_UNKNOWN in found.identification.reason
    assert J_UNKNOWN in found.reason


def test_where_the_position_was_recorded_J_is_found_and_told():
    loop = st.Loop(st.PID(0.4, 5.0), st.Kano(4.0, 1.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.5)
    found = st.diagnose(st.simulate(loop, 70.0, 600.0, 6.0, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow"))
    assert found.identification is not None
    assert pytest.approx(1.0, abs=0.1) == found.identification.J
    assert re.search(r"A sticky valve with S = 4\.0+ % \(95 % [\d.]+ to [\d.]+\) and J = (1\.0|0\.9)", found.reason)
    assert J_UNKNOWN not in found.reason + found.identification.reason


@pytest.mark.parametrize("p", [0.53, 0.6, 0.74])
def test_a_call_that_is_not_sure_says_what_would_decide(p):
    sticks, follows = told("stiction", p), told("no_stiction", 1.0 - p)
    for one in (sticks, follows):
        assert "What would decide: " in one.action
        assert one.action.endswith("the valve stroked by a ramp in manual, or the stem's position.")
    assert "if it sticks, retuning will not cure it." in sticks.action
    assert "Retuning will not" not in sticks.action
    assert follows.action.startswith("No action on the valve yet. ")
    assert "a good valve explains 41 % of the PV's movement (a sticky one 93 %)" in follows.reason


@pytest.mark.parametrize("p", [0.75, 0.9, 1.0])
def test_a_sure_one_does_not(p):
    assert told("stiction", p).action.endswith("Retuning will not cure it.")
    assert told("no_stiction", 1.0 - p).action == "No action on the valve."


def test_a_band_wider_than_a_small_swing_would_not_show():
    causes = {"stiction": 0.05, "external disturbance": 0.0, "none": 0.0}
    for name in ("none", "external disturbance"):
        for unit, swing, said in (("%", 1.84, True), ("%", 5.0, False), ("OP units", 0.02, False)):
            shares = causes | {name: 0.95}
            action = named_cause("no_stiction", shares, FOUND, RHYTHM, 1.0, COUNTED, unit=unit, swing=swing).action
            assert action.endswith("OP's swing of 1.8\u00a0% would not show; a step of OP in manual shows it.") == said


@pytest.mark.parametrize(("moves", "said"), [(False, True), (True, False)])
def test_a_pv_that_follows_its_set_point_shows_that_the_stem_moves(moves, said):
    sp = 50.0 + (np.sin(np.arange(2000) / 40.0) if moves else 0.0)
    loop = st.Loop(st.PID(0.4, 6.0), st.Ideal(), st.FOPDT(1.2, 6.0, 2.0), dt=1.0, noise=0.1)
    load = 0.3 * lagged_noise(np.random.default_rng(1), 2000, 30.0)
    found = st.diagnose(st.simulate(loop, sp, 2000.0, load, seed=3, pv_start=50.0, op_start=50.0, loop_type="flow"))
    assert found.verdict == "no_stiction"
    assert ("would not show" in found.action) is said


def test_a_stem_that_never_moves_is_not_taken_for_a_good_one_without_a_word():
    # A wave moves the PV, the controller OP, and OP no stem: by OP and PV alone the valve looks good.
    wave = 2.0 * np.sin(2.0 * np.pi * np.arange(2000) / 100.0)
    loop = st.Loop(st.PID(0.4, 60.0), st.Kano(20.0, 4.0), st.FOPDT(1.5, 10.0, 3.0), dt=1.0, noise=0.1)
    record = st.simulate(loop, 50.0, 2000.0, wave, seed=3, pv_start=50.0, op_start=50.0, loop_type="flow")
    assert record.mv is not None
    assert np.ptp(record.mv) == 0.0
    found = st.diagnose(replace(record, mv=None))
    assert found.verdict == "no_stiction"
    assert "a step of OP in manual shows it." in found.action


def test_what_would_decide_is_the_same_list():
    assert told("undecided", 0.5).action in told("stiction", 0.6).action
    slow = replace(RHYTHM, cycles=4.0)
    causes = {"stiction": 0.6, "deadband": 0.0, "none": 0.4}
    action = named_cause("stiction", causes, FOUND, slow, 10.0).action
    assert "What would decide: a longer record; samples every 2 s or faster, without compression; the valve" in action


def test_a_type_that_was_not_given_would_decide():
    causes = {"stiction": 0.47, "deadband": 0.53, "none": 0.0}
    asked = "What would decide: the loop's type (flow, level, ...), which was not given; the valve"
    for known in (True, False):
        action = named_cause("no_stiction", causes, FOUND, RHYTHM, 1.0, kind_known=known).action
        assert (asked in action) != known


def test_a_real_record_is_not_argued_against(records):
    # A plant's flow loop, sticky by its label: a good valve explains more by simulation, a sticky one by likelihood.
    (record,) = st.read(records / "plant" / "2111FIC46005_20241014T2155.csv")
    found = st.diagnose(record)
    valve = found.identification
    assert valve is not None
    assert (found.verdict, valve.fit < valve.fit_linear, valve.over("good").likelier > 0.0) == ("stiction", True, True)
    assert "predicts the PV better than a good one, cycle by cycle" in found.reason


def test_the_strongest_finding_is_none_of_the_constant():
    assert strongest(COUNTED[:1]) == ""
    assert strongest(COUNTED[2:3]) == ""
    assert strongest(COUNTED[1:2], against=True) == ""
    assert strongest((Counted("stem", 0.4, math.nan, 5.0), *COUNTED)).endswith("OP's swing (0.4)")


def test_s_is_told_in_the_unit_of_op():
    causes = {"stiction": 0.9, **dict.fromkeys(NAMES, 0.0), "deadband": 0.1}
    sticks, plays = (
        named_cause(verdict, causes, FOUND, RHYTHM, 1.0, unit="OP units").reason
        for verdict in ("stiction", "no_stiction")
    )
    assert sticks.startswith("A sticky valve with S = 3.0 OP units (95 % 2.7 to 3.3) explains 93 % ")
    assert plays.startswith("A valve with 3.0 OP units deadband")


def test_a_set_point_that_cycles_is_named():
    causes = {"stiction": 0.02, **dict.fromkeys(NAMES, 0.0), "none": 0.98}
    for cycles in (False, True):
        reason = named_cause("no_stiction", causes, FOUND, replace(RHYTHM, sp_cycles=cycles), 1.0, COUNTED).reason
        assert ("look at what moves it" in reason) == cycles
