"""The facts rows, both ways: what a row affirms holds for all inputs, what it denies has a counterexample."""

from __future__ import annotations

import dataclasses
from random import Random

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, find, given, settings
from hypothesis import strategies as hs
from hypothesis.errors import NoSuchExample
from tests.strategies import VALVES, dyadic, inputs

import stiction as st
from stiction.models.model_properties import VALVE_PROPERTIES

FACTORS = hs.sampled_from([0.25, 0.5, 2.0, 3.0, 8.0])


def drive(valve, op):
    return st.stroke(valve, op, dt=1.0).mv


def shift(valve, op, by, factor, where):
    return np.array_equal(drive(valve, np.array(op) + by), drive(valve, op) + by)


def scale(valve, op, by, factor, where):
    units = VALVE_PROPERTIES[type(valve).__name__].parameters
    grown = {name: getattr(valve, name) * factor for name, unit in units.items() if unit.startswith("% of span")}
    return np.array_equal(drive(dataclasses.replace(valve, **grown), np.array(op) * factor), drive(valve, op) * factor)


def odd(valve, op, by, factor, where):
    return np.array_equal(drive(valve, -np.array(op)), -drive(valve, op))


def hold(valve, op, by, factor, where):
    k = where % len(op)
    held = drive(valve, [*op[: k + 1], *op[k:]])
    return np.array_equal(np.delete(held, k + 1), drive(valve, op))


def refine(valve, op, by, factor, where):
    k = where % (len(op) - 1)
    between = (op[k] + op[k + 1]) / 2.0
    if between in (op[k], op[k + 1]):
        return True
    fine = drive(valve, [*op[: k + 1], between, *op[k + 1 :]])
    return np.array_equal(np.delete(fine, k + 1), drive(valve, op))


LAWS = {law.__name__: law for law in (shift, scale, odd, hold, refine)}
CASES = [(name, law) for name in VALVES for law in LAWS]
AFFIRMED = [case for case in CASES if getattr(VALVE_PROPERTIES[case[0]], case[1])]
DENIED = [case for case in CASES if not getattr(VALVE_PROPERTIES[case[0]], case[1])]
PLACES = hs.integers(0, 100)


def found(cases, wanted, tries=20_000):
    """Whether some case is as wanted; the first will do, the smallest is not asked for."""
    quick = settings(
        max_examples=tries, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
    )
    try:
        find(cases, wanted, settings=quick, random=Random(1))
    except NoSuchExample:
        return False
    return True


def test_every_model_with_numbers_alone_is_drawn():
    assert set(VALVES) == set(VALVE_PROPERTIES) - {"PhysicalValve"}


def test_both_ways_are_tested():
    assert len(AFFIRMED) > len(DENIED) > 5


@pytest.mark.parametrize(("name", "law"), AFFIRMED)
@settings(max_examples=40)
@given(data=hs.data(), op=inputs(), by=dyadic(-20.0, 20.0), factor=FACTORS, where=PLACES)
def test_what_the_row_affirms_holds(name, law, data, op, by, factor, where):
    assert LAWS[law](data.draw(VALVES[name]), op, by, factor, where)


@pytest.mark.parametrize(("name", "law"), DENIED)
def test_what_the_row_denies_fails_somewhere(name, law):
    cases = hs.tuples(VALVES[name], inputs(), dyadic(-20.0, 20.0), FACTORS, PLACES)
    assert found(cases, lambda case: not LAWS[law](*case)), f"no counterexample: should the row of {name} affirm it?"


@settings(max_examples=40)
@given(pair=hs.tuples(dyadic(0.0, 5.0), dyadic(0.0, 5.0)), op=inputs(), where=PLACES)
def test_choudhury_is_refined_for_J_up_to_S(pair, op, where):
    """The note of its row."""
    assert refine(st.Choudhury(max(pair), min(pair)), op, 0.0, 1.0, where)


@pytest.mark.parametrize("name", VALVES)
def test_overshoot(name):
    """The stem passes an input that only rises exactly in the models whose row says so."""

    def passes(case):
        valve, moves = case
        op = np.cumsum([0.0, *moves])
        return bool(np.any(drive(valve, op) > op))

    cases = hs.tuples(VALVES[name], hs.lists(dyadic(0.0, 5.0), min_size=1, max_size=10))
    assert found(cases, passes, tries=300) == VALVE_PROPERTIES[name].overshoot


def test_parameters_are_the_constructor_s():
    for name, facts in VALVE_PROPERTIES.items():
        known = {f.name for f in dataclasses.fields(getattr(st, name))}
        assert set(facts.parameters) <= known
        if name in VALVES:
            assert set(facts.parameters) == known - {"travel", "as_printed"}


def test_only_the_ideal_valve_is_rate_independent():
    assert [name for name, facts in VALVE_PROPERTIES.items() if facts.rate_independent] == ["Ideal"]


LIVELY = st.PhysicalValve(2.0, 1e5, 20.0, 100.0, 800.0, 1e-3, 0.1, 0.1, lag=2.0)
"""A badly damped stem, damping ratio 0.02, behind a slow actuator; fs is 8 %, fd 1 %."""


@pytest.mark.parametrize("law", LAWS)
def test_the_physical_valve_keeps_none_of_the_laws(law):
    facts = VALVE_PROPERTIES["PhysicalValve"]
    op = [40.0, 50.0, 62.0, 55.0, 70.0, 40.0]
    cases = [(LIVELY, op, by, 1.25, where) for by in (0.0, 35.0) for where in range(5)]
    assert not getattr(facts, law)
    assert any(not LAWS[law](*case) for case in cases)


def test_the_physical_valve_passes_its_input_in_a_slip():
    assert VALVE_PROPERTIES["PhysicalValve"].overshoot
    record = st.stroke(LIVELY, np.arange(40.0, 60.0, 0.25), dt=1.0)
    assert np.any(record.mv > record.op + 1.0)
