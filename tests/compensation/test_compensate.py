"""The trial of remedies: what is always there, what may be recommended, when none is, and on loops not seen before."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import stiction as st
from compensation.population import drawn, outcome
from stiction.compensation import LoopPerformance, RemedyTrial, repair
from stiction.compensation.cost import WEIGHTS, cost
from stiction.compensation.recommend import choose_remedy, repair_not_worthwhile
from stiction.compensation.remedies import NO_ACTION, REPAIR, Remedy
from stiction.compensation.replace_parts import replace_parts
from stiction.compensation.run_trials import METRICS, TrialProgramme, measure_performance, run_programme
from stiction.diagnosis.loop_state import LoopState
from stiction.records.check_result import CheckResult

LOOP = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)


@pytest.fixture(scope="module")
def trial() -> st.CompensationTrial:
    return st.compensate(LOOP, seeds=8)


@pytest.fixture(scope="module")
def diagnosis() -> st.Diagnosis:
    kick = np.zeros(2500)
    kick[:40] = 2.0
    loop = replace(LOOP, controller=st.PID(0.2, 10.0, op_limits=(0.0, 100.0)))
    record = st.simulate(loop, 50.0, 2500.0, kick, 3, pv_start=50.0, op_start=50.0, tag="FIC-1", loop_type="flow")
    return st.diagnose(replace(record, mv=None))


def test_nothing_and_repair_are_always_there(trial):
    names = [one.name for one in trial.remedies]
    assert {NO_ACTION, REPAIR, "knocker", "constant reinforcement", "two-move", "integral deadband"} <= set(names)
    assert trial[NO_ACTION].improvement == 0.0
    assert trial[NO_ACTION].cost == pytest.approx(1.0)
    assert trial[NO_ACTION].worst == pytest.approx(1.0)
    assert [one.cost for one in trial.remedies] == sorted(one.cost for one in trial.remedies)


def test_repair_scales_with_S():
    """A Kano cycle scales with S (science.md N24), so that 1 % left of 5 % takes four fifths of the deviation."""
    quiet = st.compensate(replace_parts(LOOP, noise=0.0, valve=st.Kano(5.0, 2.5)), seeds=8)
    assert quiet[REPAIR].improvement == pytest.approx(0.8, abs=0.05)


def test_wear_is_billed(trial):
    """science.md F: reinforcement with noise drives the stem many times as far; a knocker reverses more often."""
    assert trial["knocker"].behaviour.reversals > 2.0 * trial[NO_ACTION].behaviour.reversals
    assert trial["integral deadband"].behaviour.travel < trial[NO_ACTION].behaviour.travel
    assert trial["integral deadband"].behaviour.offset > 3.0 * trial[NO_ACTION].behaviour.offset


def test_recommendation_names_repair_price_and_error(trial):
    assert trial.recommended not in (None, NO_ACTION, REPAIR)
    assert "Repair of the valve" in trial.reason
    assert "stem travel" in trial.risk
    assert "30 %" in trial.risk
    assert trial[trial.recommended].improvement >= 0.1
    assert not trial[trial.recommended].hurts


def test_same_seeds_same_answer(trial):
    assert st.compensate(LOOP, seeds=8).to_dict() == trial.to_dict()


def test_trial_is_json(trial):
    kept = json.loads(json.dumps(trial.to_dict(), allow_nan=False))
    assert len(kept["remedies"]) == len(trial.remedies)
    assert set(kept["trends"]) == {NO_ACTION, REPAIR, trial.recommended}


def test_unit_of_pv_plays_no_part():
    """Four times the PV unit: the same improvement, but for rounding that a loop on the verge of a slip shows."""
    other = st.Loop(st.PID(0.05, 10.0), LOOP.valve, st.FOPDT(12.0, 10.0, 10.0), dt=1.0, noise=0.2)
    one, two = st.compensate(LOOP, seeds=2), st.compensate(other, seeds=2)
    assert len(one.remedies) == len(two.remedies) > 8
    for a in one.remedies:
        assert two[a.name].improvement == pytest.approx(a.improvement, abs=0.02)


def test_weights_decide():
    plain = dict.fromkeys(WEIGHTS, 0.0)
    by_pv = st.compensate(LOOP, weights=plain | {"pv_std": 1.0}, seeds=4, max_travel=1000.0)
    hand = [one for one in by_pv.remedies if one.at_hand]
    assert by_pv[by_pv.recommended].behaviour.pv_std == min(one.behaviour.pv_std for one in hand if not one.hurts)
    by_wear = st.compensate(LOOP, weights=plain | {"travel": 1.0, "pv_std": 0.1}, seeds=4)
    assert by_wear[by_wear.recommended].behaviour.travel < by_wear[NO_ACTION].behaviour.travel


@pytest.mark.parametrize("bad", [{"price": 1.0}, {"travel": -1.0}, dict.fromkeys(WEIGHTS, 0.0)])
def test_bad_weights(bad):
    with pytest.raises(st.ParameterError, match="weight"):
        st.compensate(LOOP, weights=bad)


def test_bad_source():
    with pytest.raises(st.ParameterError, match="Diagnosis or a Loop"):
        st.compensate("FIC-1")  # type: ignore[arg-type]
    with pytest.raises(st.ParameterError, match="seeds"):
        st.compensate(LOOP, seeds=0)
    with pytest.raises(st.ParameterError, match="no S and J"):
        st.compensate(replace_parts(LOOP, valve=st.Ideal()))


def test_progress_ends_at_the_total():
    seen: list[tuple[int, int]] = []
    st.compensate(LOOP, seeds=1, progress=lambda done, total: seen.append((done, total)))
    assert seen
    assert sorted(seen)[-1] == (seen[0][1], seen[0][1])


def test_diagnosed_loop_gets_advice(diagnosis):
    found = st.compensate(diagnosis, seeds=4)
    assert found.tag == "FIC-1"
    assert found.twin is not None
    assert found.twin.fits
    assert found[found.recommended].improvement > 0.3


def warning(name: str) -> CheckResult:
    return CheckResult(name, "warn", 1.0, 0.0, "%", name)


SHUT_IN = LoopState("shut_in", 0.0, 2500.0, 1.0, {"pv": 0.3, "op_start": 40.0, "op_end": 80.0})


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"verdict": "undecided"}, "It is unknown whether"),
        ({"verdict": "no_stiction"}, "No stiction was found"),
        ({"identification": None}, "no remedy can be simulated"),
        ({"check": "saturation"}, "OP is at its limits"),
        (
            {"loop_state": LoopState("manual", 0.0, 2500.0)},
            "OP is constant in 100 % of the record while PV moves, as in",
        ),
        ({"loop_state": SHUT_IN}, "The flow is shut in: it stays at 0.3 from"),
        ({"controller": st.PID(0.9, 3.0)}, "The simulated loop does not oscillate"),
    ],
)
def test_no_advice_where_there_is_no_ground_for_it(diagnosis, change, reason):
    change = dict(change)
    controller, name, state = (change.pop(key, None) for key in ("controller", "check", "loop_state"))
    source = replace(diagnosis, **change)
    if state:
        source = replace(source, segment=replace(source.segment, loop_state=state))
    if name:
        quality = replace(source.quality, checks=(*source.quality.checks, warning(name)))
        source = replace(source, segment=replace(source.segment, quality=quality))
    said = st.compensate(source, controller=controller, seeds=1)
    assert said.refused
    assert said.recommended is None
    assert reason in said.reason
    assert "nan" not in said.reason
    assert "no advice" in said.summary()
    json.dumps(said.to_dict(), allow_nan=False)


def test_loop_without_a_cycle_needs_no_remedy():
    """J = 0 on a self-regulating process: no cycle exists (science.md B)."""
    said = st.compensate(replace_parts(LOOP, valve=st.Kano(5.0, 0.0), noise=0.0))
    assert said.refused
    assert "does not oscillate" in said.reason


def trial_of(name: str, improvement: float, worst: float, price: float) -> RemedyTrial:
    behaviour = LoopPerformance(1.0 - improvement, 1.0, 0.1, 1.0, 1.0, 1.0, 1.0, 1.0)
    return RemedyTrial(Remedy(name, "Do it."), behaviour, improvement, improvement, (worst,), price, name != REPAIR)


numbers = some.tuples(some.floats(-1.0, 1.0), some.floats(0.0, 3.0), some.floats(0.1, 3.0))


@settings(deadline=None)
@given(rows=some.lists(numbers, min_size=1, max_size=6))
def test_what_hurts_or_hardly_helps_is_never_recommended(rows):
    trials = [trial_of(f"remedy {i}", *row) for i, row in enumerate(rows)]
    trials += [trial_of(NO_ACTION, 0.0, 1.0, 1.0), trial_of(REPAIR, 0.9, 0.5, 0.05)]
    ranked = tuple(sorted(trials, key=lambda one: one.cost))
    name, reason, *_ = choose_remedy(ranked)
    chosen = next(one for one in ranked if one.name == name)
    assert name != REPAIR
    assert "valve" in reason
    if name != NO_ACTION:
        assert chosen.improvement >= 0.1
        assert chosen.worst <= 1.05
        assert chosen.cost < 1.0
    else:
        assert not [
            one for one in ranked if one.at_hand and one.improvement >= 0.1 and not one.hurts and one.cost < 1.0
        ]


@pytest.mark.parametrize(
    ("improvement", "given", "found"), [(0.09, NO_ACTION, NO_ACTION), (0.19, "knocker", NO_ACTION)]
)
def test_a_record_asks_for_twice_as_much(improvement, given, found):
    """10 % on a loop that is given, 20 % on the twin of a record; where it helps by more it is taken on both."""
    ranked = (
        trial_of(REPAIR, 0.9, 0.5, 0.05),
        trial_of("knocker", improvement, 0.8, 0.7),
        trial_of(NO_ACTION, 0.0, 1.0, 1.0),
    )
    assert (choose_remedy(ranked)[0], choose_remedy(ranked, from_record=True)[0]) == (given, found)
    better = (ranked[0], trial_of("knocker", 0.21, 0.8, 0.7), ranked[2])
    assert (choose_remedy(better)[0], choose_remedy(better, from_record=True)[0]) == ("knocker", "knocker")


@pytest.mark.parametrize(("max_travel", "chosen"), [(3.0, "knocker"), (10.0, "reinforcement"), (1.5, NO_ACTION)])
def test_a_remedy_that_wears_the_valve_is_not_recommended(max_travel, chosen):
    fix, nothing = trial_of(REPAIR, 0.9, 0.5, 0.05), trial_of(NO_ACTION, 0.0, 1.0, 1.0)
    travel = nothing.behaviour.travel
    tried = [
        replace(one, behaviour=replace(one.behaviour, travel=times * travel))
        for one, times in ((trial_of("reinforcement", 0.6, 0.8, 0.5), 9.0), (trial_of("knocker", 0.5, 0.8, 0.6), 2.5))
    ]
    name, reason, *_ = choose_remedy((fix, *tried, nothing), max_travel=max_travel)
    assert name == chosen
    assert ("9 times as far as now, and wears it (limit 1.5 times)" in reason) == (chosen == NO_ACTION)


def test_a_valve_that_changes_nothing_is_not_compensated():
    fix = trial_of(REPAIR, 0.003, 1.0, 1.0)
    assert "change the PV deviation by 0 % only" in repair_not_worthwhile(fix)
    assert "-0" not in repair_not_worthwhile(trial_of(REPAIR, -0.001, 1.0, 1.0))
    text = "change the PV deviation by +44 %: something else moves"
    assert text in repair_not_worthwhile(trial_of(REPAIR, -0.44, 1.0, 1.0))
    assert repair_not_worthwhile(trial_of(REPAIR, 0.5, 0.5, 0.5)) == ""


def recorded(loop: st.Loop, sp: float | np.ndarray = 50.0) -> st.LoopRecord:
    """3000 s of a loop after an upset and under a load that keeps a stem from resting where the error is zero."""
    kick = np.full(3000, 0.17)
    kick[:40] += 1.0
    return st.simulate(loop, sp, 3000.0, kick, 3, pv_start=50.0, op_start=50.0, tag="FIC-2", loop_type="flow")


def deviation(record: st.LoopRecord) -> float:
    return float((record.pv - record.sp)[500:].std())


@pytest.mark.parametrize(
    ("K", "valve"),
    [(8.0, st.Kano(0.8, 0.8)), (8.0, st.Kano(0.6, 0.4)), (10.0, st.Stenman(0.5)), (10.0, st.Kano(1.0, 0.5))],
)
def test_a_small_S_that_makes_the_whole_cycle_is_worth_a_repair(K, valve):
    """A process of high gain makes of less than 1 % a cycle of many times the noise, and none with a good valve."""
    noise = 0.02 * K
    loop = st.Loop(st.PID(0.8 / K, 10.0, op_limits=(0.0, 100.0)), valve, st.FOPDT(K, 8.0, 2.0), dt=1.0, noise=noise)
    record, calm = recorded(loop), recorded(replace(loop, valve=st.Ideal()))
    assert deviation(calm) < 2.0 * noise < 0.4 * deviation(record)
    known_sticky = replace(st.diagnose(replace(record, mv=None)), verdict="stiction")
    found = st.compensate(known_sticky, seeds=4)
    assert found.S < 1.1
    assert not found.refused
    true = 1.0 - deviation(recorded(repair(loop))) / deviation(record)
    assert found[REPAIR].improvement == pytest.approx(true, abs=0.15)
    assert found[REPAIR].improvement > 0.4
    assert "half of the present S" in found[REPAIR].remedy.words


@pytest.mark.parametrize("K", [1.0, 8.0])
def test_a_small_S_in_a_loop_that_its_set_point_moves_is_not_worth_a_repair(K):
    loop = st.Loop(
        st.PID(0.8 / K, 10.0, op_limits=(0.0, 100.0)), st.Kano(0.6, 0.4), st.FOPDT(K, 8.0, 2.0), dt=1.0, noise=0.04 * K
    )
    sp = 50.0 + 4.0 * K * np.sign(np.sin(2.0 * np.pi * np.arange(3000) / 300.0))
    record = recorded(loop, sp)
    assert deviation(recorded(replace(loop, valve=st.Ideal()), sp)) > 0.95 * deviation(record)
    told = replace(st.diagnose(replace(record, mv=None)), verdict="stiction")
    found = st.compensate(told, seeds=4)
    assert found.S < 1.0
    assert found.refused
    assert "something else moves the PV" in found.reason


def test_on_the_twin_of_a_record_only_what_it_predicts():
    """The same trials: on a loop that is given the cheapest, on a record's twin the cheapest that is sure."""
    named = ("integral deadband", 0.8, 0.5, 0.3), ("knocker", 0.5, 0.95, 0.5), ("constant reinforcement", 0.4, 0.8, 0.6)
    ranked = (*(trial_of(*one) for one in named), trial_of(REPAIR, 0.9, 0.2, 0.7), trial_of(NO_ACTION, 0.0, 1.0, 1.0))
    assert choose_remedy(ranked)[0] == "integral deadband"
    name, reason, _, expected = choose_remedy(ranked, from_record=True)
    assert name == "constant reinforcement"
    assert expected == pytest.approx(0.36)
    assert "expect 36 % on the plant" in reason


def test_row_of_a_run():
    """Travel, reversals and errors of a stem that goes 1 up and 1 down every 4 samples, counted by hand."""
    n = 400
    mv = np.tile([0.0, 1.0, 1.0, 0.0], n // 4)
    pv = np.tile([1.0, 3.0], n // 2)
    record = st.LoopRecord("x", 9.0, op=2.0 * mv, pv=pv, sp=np.full(n, 1.0), mv=mv)
    plan = TrialProgramme(0.0, 0.0, 0, n, 0, 0.0, 0.0, 0.0)
    row = dict(zip(METRICS, measure_performance(record, plan._replace(steady=n - 2, step=1)), strict=True))
    assert row["pv_std"] == pytest.approx(1.0)
    assert row["iae"] == pytest.approx(1.0)
    assert row["offset"] == pytest.approx(1.0)
    assert row["travel"] == pytest.approx(199.0, rel=0.01)
    assert row["reversals"] == pytest.approx(198.0, rel=0.01)
    assert row["op_travel"] == pytest.approx(2.0 * row["travel"])


def test_each_step_is_billed_in_its_own_window():
    """8 samples left out, 12 undisturbed with an error of 1, 4 of 3 after the set point's step, 4 of 5 at the end."""
    error = np.repeat([9.0, 1.0, 3.0, 5.0], [8, 12, 4, 4])
    record = st.LoopRecord("x", 1.0, op=error, pv=error, sp=np.zeros(28), mv=error)
    row = dict(
        zip(METRICS, measure_performance(record, TrialProgramme(0.0, 0.0, 8, 12, 4, 0.0, 0.0, 0.0)), strict=True)
    )
    assert (row["iae"], row["sp_step"], row["load_step"]) == (1.0, 3.0, 5.0)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_run_goes_through_its_programme(seed):
    """An open loop shows what moves it: a step of the set point, then one of the load, both up or both down."""
    loop = st.Loop(st.PID(0.0, math.inf), st.Ideal(), st.FOPDT(2.0, 0.0, 1.0), dt=1.0)
    record = run_programme(loop, TrialProgramme(40.0, 30.0, 48, 20, 10, 3.0, 4.0, 0.0), seed)
    side = 1.0 if seed else -1.0
    assert set(record.pv[1:79]) == {40.0}
    assert set(record.pv[79:]) == {40.0 + 2.0 * 4.0 * side}
    assert set(record.sp[:68]) == {40.0}
    assert set(record.sp[68:]) == {40.0 + 3.0 * side}


def test_cost_of_nothing_is_one():
    row = np.array([2.0, 1.0, 0.1, 30.0, 20.0, 50.0, 1.0, 1.0])
    assert cost(row, row, 1.0, WEIGHTS) == pytest.approx(1.0)
    half = row.copy()
    half[0] /= 2.0
    assert cost(half, row, 1.0, WEIGHTS) == pytest.approx(1.0 - 0.5 * WEIGHTS["pv_std"] / sum(WEIGHTS.values()))


def test_exchanged_loop_runs_as_a_new_one():
    pid = st.PID(0.1, 20.0)
    a = st.simulate(replace_parts(LOOP, controller=pid, noise=0.0), 10.0, 300.0)
    b = st.simulate(replace(LOOP, controller=pid, noise=0.0), 10.0, 300.0)
    assert np.array_equal(a.pv, b.pv)


def test_advice_holds_on_loops_it_has_not_seen():
    """Loops of the population, identified from their records, and the true loop asked; all hundred: population.py."""
    # The first of those that the documentation counts. Another processor rounds otherwise, and a run may become another
    # one: of seven loops one may be missed.
    found = [outcome(case, plan, st.diagnose(case.record), known=True) for case, plan in drawn(18, 1, plain=False)]
    treated = [one for one in found if one.treated]
    assert len(treated) >= 5
    assert all(one.falls for one in treated)
    assert sum(one.close for one in treated) >= 0.8 * len(treated)


def test_a_controller_beside_a_loop_is_refused_and_not_passed_over():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    with pytest.raises(st.ParameterError, match="a Loop has its own"):
        st.compensate(loop, controller=st.PID(0.1, 10.0))
    with pytest.raises(st.ParameterError, match="period = -1 s is not positive"):
        st.retune(loop, -1.0)


@pytest.mark.parametrize(("improvement", "worth"), [(0.101, True), (0.099, False)])
def test_a_good_valve_must_lower_the_deviation_by_a_tenth(improvement, worth):
    fix = trial_of(REPAIR, improvement, 1.0, 1.0)
    assert (repair_not_worthwhile(fix) == "") is worth
    reason = choose_remedy((fix, trial_of(NO_ACTION, 0.0, 1.0, 1.0)))[1]
    assert reason.startswith("Repair of the valve lowers" if worth else "Repair of the valve changes")
