"""Findings that contradict one another: a valve is then neither surely good nor surely sticking."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identified import Rival
from stiction.diagnosis.verdict.contradiction import (
    against_good,
    against_short,
    against_sticking,
    explains_much_more,
    explains_nothing,
)
from stiction.diagnosis.verdict.doubt import LEAST, MOST, held_back
from stiction.diagnosis.verdict.findings import findings
from stiction.diagnosis.verdict.objection import Objection
from stiction.records.assess import Quality, assess_quality
from calibration.populations import plant_population

from .found import FOUND

HEALTHY = {"sensor": 0.0, "saturation": 0.0, "deadband": 0.0}
"""Probabilities of causes with which nothing else is to blame."""
EVEN = {"wave": Rival(0.0, 0.0)}
"""A rival that is as likely as a sticky valve."""
SLOW = Objection.SLIPS_DROWN
"""What a record such as plants keep is told to be."""
SOUND = Quality((), True, 1000, 1000.0, 0.0, 0, 1000)
"""What a record is worth that no gate finds anything in."""
NOT_ITS_OWN, NO_JUMP, AS_MUCH = Objection.NOT_ITS_OWN, Objection.NO_JUMP, Objection.AS_MUCH
MOST_OF_IT, SMALL_BAND = Objection.MOST_OF_IT, Objection.SMALL_BAND
"""What keeps a valve from surely sticking."""


def test_no_objection_is_told_as_a_gate_is_named():
    """`doubt` looks up both in one row of names."""
    wave = np.sin(np.arange(600.0) / 5.0)
    gates = assess_quality(st.LoopRecord("FIC-1", 1.0, op=50.0 + wave, pv=40.0 + wave)).checks
    assert not {*Objection} & {gate.name for gate in gates}


def fits(fit, fit_linear=0.0):
    rivals = {"good": Rival(likelier=1.0), **EVEN}
    return replace(FOUND, fit=fit, fit_linear=fit_linear, rivals=rivals, likelier_than_play=0.0)


@pytest.mark.parametrize(("fit", "said"), [(14.9, True), (15.0, False)])
def test_what_chance_explains_is_nothing(fit, said):
    assert bool(explains_nothing(fits(fit))) is said


@pytest.mark.parametrize(("fit", "more"), [(30.0, False), (30.1, True)])
def test_three_tenths_are_much_more(fit, more):
    assert explains_much_more(fits(fit)) is more


@pytest.mark.parametrize(("likeness", "told"), [(0.5, ()), (0.51, (SLOW,))])
def test_the_limit_of_likeness_to_a_plants_record(monkeypatch, likeness, told):
    monkeypatch.setattr("stiction.diagnosis.verdict.contradiction.kept_by_plant", lambda _row: likeness)
    assert against_good(fits(50.0, 50.0), SimpleNamespace(likely_jump_clear=0.0), HEALTHY) == told


def valve(
    J=1.0, J_high=2.0, likelier_than_play=30.0, fit=90.0, fit_linear=60.0, integrating=False, over=(200.0, 200.0, 200.0)
):
    """A valve of S = 3 % that was found, likelier `over` a good one, a bent one and one given the PV without noise."""
    return replace(
        FOUND,
        S=3.0,
        J=J,
        J_high=J_high,
        likelier_than_play=likelier_than_play,
        fit=fit,
        fit_linear=fit_linear,
        process=replace(FOUND.process, integrating=integrating),
        rivals={name: Rival(likelier=by) for name, by in zip(("good", "bent", "gated"), over, strict=True)},
    )


@pytest.mark.parametrize(
    ("found", "told"),
    [
        ({}, ()),
        ({"over": (200.0, 100.0, 100.0)}, ()),
        ({"over": (200.0, 99.0, 200.0)}, (MOST_OF_IT,)),
        ({"over": (200.0, 200.0, 99.0)}, (MOST_OF_IT,)),
        ({"over": (200.0, math.nan, math.nan)}, ()),
        ({"over": (60.0, 0.0, 0.0)}, ()),
        ({"J": 0.29, "J_high": 0.89, "likelier_than_play": 0.0}, (NO_JUMP,)),
        ({"J": 0.31, "J_high": 0.89, "likelier_than_play": 0.0}, ()),
        ({"J": 0.29, "J_high": 0.91, "likelier_than_play": 0.0}, ()),
        ({"J": 0.29, "J_high": 0.89, "likelier_than_play": 0.1}, ()),
        ({"J": 0.29, "J_high": 0.89, "likelier_than_play": 0.0, "integrating": True}, ()),
        ({"fit": 60.0, "likelier_than_play": 19.9}, (AS_MUCH,)),
        ({"fit": 60.0, "likelier_than_play": 20.0}, ()),
        ({"fit": 60.1, "likelier_than_play": 19.9}, ()),
        ({"fit": 60.0, "likelier_than_play": 20.0, "oscillating": 0.0}, (AS_MUCH,)),
        ({"fit": 60.1, "likelier_than_play": 20.0, "oscillating": 0.0}, ()),
        ({"band": 0.099, "fit": 61.9, "over": (61.0, 61.0, 61.0)}, (SMALL_BAND,)),
        ({"band": 0.1, "fit": 61.9, "over": (61.0, 61.0, 61.0)}, ()),
        ({"band": 0.099, "fit": 62.0, "over": (61.0, 61.0, 61.0)}, ()),
        ({"band": 0.099, "fit": 61.9, "over": (60.0, 60.0, 60.0)}, ()),
    ],
)
def test_a_valve_that_does_not_jump_or_explains_no_more_is_not_sure(found, told):
    found = {"oscillating": 1.0, "band": 0.5} | found
    row = SimpleNamespace(
        oscillating=found.pop("oscillating"), regularity=0.0, own_amplitude=0.9, jump=0.5, integrating=0.0,
        likely_band=found.pop("band"),
    )  # fmt: skip
    assert against_sticking(valve(**found), valve(**found), row, lambda: False) == told


@pytest.mark.parametrize("p", [0.05, 0.25, 0.6, 0.97])
def test_a_small_band_that_explains_nothing_leaves_the_usual_share_of_valves(p):
    found = held_back(p, SOUND, against_sticking=(SMALL_BAND,))
    assert found.probability == min(p, 0.25)
    assert (SMALL_BAND in found.why) is (p > 0.25)


@pytest.mark.parametrize("p", [0.05, 0.5, 0.6, 0.97])
def test_a_short_record_whose_op_seldom_turns_round_leaves_it_open(p):
    found = held_back(p, SOUND, against_sticking=(Objection.FEW_TURNS,))
    assert found.probability == min(p, 0.5)
    assert (Objection.FEW_TURNS in found.why) is (p > 0.5)


@pytest.mark.parametrize(("samples", "turns", "told"), [(499, 5, True), (500, 5, False), (499, 6, False)])
def test_few_turns_of_a_short_record_are_no_stiction(samples, turns, told):
    k = np.arange(float(samples))
    wave = 5.0 * np.cos(np.pi * (turns + 0.5) * k / samples)
    quality = assess_quality(st.LoopRecord("FIC-1", 1.0, op=50.0 + wave, pv=40.0 + wave))
    assert {gate.name: gate.value for gate in quality.checks}["op reversals"] == turns
    assert against_short(quality) == ((Objection.FEW_TURNS,) if told else ())


@pytest.mark.parametrize("seed", range(8))
def test_a_load_that_wanders_for_a_short_time_is_no_stiction(seed):
    rng = np.random.default_rng(1000 + seed)
    load = 0.4 * np.cumsum(rng.standard_normal(300))
    K, tau = rng.uniform(0.5, 3.0), rng.uniform(3.0, 20.0)
    loop = st.Loop(st.PID(0.35 / K, tau), st.Ideal(), st.FOPDT(K, tau, 4.0), dt=1.0, noise=0.1)
    record = st.simulate(loop, 100.0, 300.0, load, seed, pv_start=100.0, op_start=50.0, loop_type="flow")
    found = st.diagnose(record.window(180, 300))
    few = any(gate.name == "op reversals" for gate in found.quality.warnings)
    assert found.verdict != "stiction" or not few
    assert found.probability <= 0.9


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({}, (NOT_ITS_OWN,)),
        ({"own_amplitude": 0.3}, ()),
        ({"jump": 0.15}, ()),
        ({"likelier_than_play": 20.0}, (NOT_ITS_OWN,)),
        ({"makes_cycle": True}, (NOT_ITS_OWN,)),
        ({"likelier_than_play": 20.0, "makes_cycle": True}, ()),
        ({"integrating": 1.0}, ()),
        ({"regularity": 0.95}, ()),
        ({"oscillating": 0.0}, ()),
    ],
)
def test_what_keeps_a_valve_from_surely_sticking(changed, told):
    row = {"oscillating": 1.0, "regularity": 1.0, "own_amplitude": 0.29, "jump": 0.1, "integrating": 0.0}
    row |= {"likely_band": 0.5}
    likeliest, row = (
        valve(likelier_than_play=changed.get("likelier_than_play", 19.9)),
        SimpleNamespace(**(row | changed)),
    )
    assert against_sticking(likeliest, likeliest, row, lambda: "makes_cycle" in changed) == told
    for p in (0.05, 0.6, 0.97):
        found = held_back(p, SOUND, against_sticking=told)
        assert found.probability == (min(p, MOST) if told else p)
        assert (NOT_ITS_OWN in found.why) is (NOT_ITS_OWN in told and p > MOST)


PLAIN = Objection.PREDICTS
"""What a valve is told to be whose S is plain, though its loop may be driven."""


@pytest.mark.parametrize(
    ("changed", "own_samples", "causes", "told"),
    [
        ({}, True, {}, (PLAIN,)),
        ({"good": Rival(8.0, 500.0)}, True, {}, ()),
        ({"wave": Rival(0.0, 0.0)}, True, {}, ()),
        ({}, False, {}, ()),
        ({}, True, {"deadband": 0.5}, ()),
        ({}, True, {"sensor": 0.3, "saturation": 0.2}, ()),
        ({"wave": Rival(0.1, 60.1)}, False, {"sensor": 0.5}, (PLAIN,)),
        ({"wave": Rival(0.1, 59.9)}, False, {"sensor": 0.5}, ()),
        ({"wave": Rival(0.1, 60.1)}, True, {"sensor": 0.5}, ()),
    ],
)
def test_a_plain_valve_in_a_driven_loop(monkeypatch, changed, own_samples, causes, told):
    monkeypatch.setattr("stiction.diagnosis.verdict.contradiction.kept_by_plant", lambda _row: 0.0)
    rivals = {"good": Rival(8.1, 500.0), "wave": Rival(0.1, 0.0), **changed}
    found = replace(fits(50.0, 50.0), own_samples=own_samples, rivals=rivals)
    assert against_good(found, SimpleNamespace(likely_jump_clear=0.0), HEALTHY | causes) == told


@pytest.mark.parametrize(
    ("changed", "play", "told"),
    [
        ({}, 0.51, (Objection.JUMP_OPEN,)),
        ({}, 0.5, ()),
        ({"own_samples": True}, 0.99, ()),
        ({"J_high": 0.2}, 0.99, (Objection.JUMP_OPEN,)),
    ],
)
def test_play_is_not_sure_between_the_samples(monkeypatch, changed, play, told):
    monkeypatch.setattr("stiction.diagnosis.verdict.contradiction.kept_by_plant", lambda _row: 0.0)
    open_jump = {"S": 3.0, "J_high": 3.0, "own_samples": False, "rivals": {"good": Rival(likelier=0.0), **EVEN}}
    found = replace(fits(50.0, 50.0), **(open_jump | changed))
    assert against_good(found, SimpleNamespace(likely_jump_clear=0.0), HEALTHY | {"deadband": play}) == told


@pytest.mark.parametrize(("clear", "told"), [(0.33, ()), (0.34, (Objection.JUMP_PLAIN,))])
def test_a_jump_is_plain_whatever_else_is_wrong(clear, told):
    row = SimpleNamespace(likely_jump_clear=clear)
    assert against_good(fits(99.0), row, HEALTHY | {"saturation": 0.9}) == told


def test_a_valve_that_slips_into_a_limit_is_seen():
    """A loop whose set point asks for more than the valve gives, for a third of the time."""
    loop = st.Loop(
        st.PID(0.4, 12.0, op_limits=(0.0, 100.0)), st.Kano(6.0, 3.5), st.FOPDT(1.0, 12.0, 3.0), dt=1.0, noise=0.05
    )
    steps = 20.0 * (np.arange(3000.0) // 500 % 2) + 85.0
    record = st.simulate(loop, steps, 3000.0, seed=3, pv_start=85.0, op_start=85.0, loop_type="flow")
    found = st.diagnose(replace(record, mv=None))
    assert found.verdict == "stiction"
    assert pytest.approx(6.0, rel=0.02) == found.identification.S


def test_slow_records_such_as_plants_keep_are_never_surely_good():
    seen = [(case, findings(case.record)) for case in plant_population(24, 3)]
    told = [(case, st.diagnose(case.record), against_good(one.found[one.speaks], one.features, HEALTHY))
            for case, one in seen if one.features is not None]  # fmt: skip
    slow = [SLOW in against for case, _, against in told if case.record.dt > 3.0 * case.loop.dt]
    assert len(slow) > 12
    assert np.mean(slow) > 0.6
    assert min(found.probability for _, found, against in told if SLOW in against) >= LEAST
    # The controller's own samples hide no slip, however the rest of the record looks.
    assert not any(SLOW in against_good(replace(one.found[one.speaks], own_samples=True), one.features, HEALTHY)
                   for _, one in seen if one.features is not None)  # fmt: skip
