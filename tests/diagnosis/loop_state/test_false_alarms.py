"""Loops in control, good and sticky, are nearly never said to be out of control."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

import stiction as st
from calibration.populations import CAUSES, plant_population, population, wandering_population
from stiction.diagnosis.loop_state import assess_loop_state
from stiction.simulation.demo import demo_plant

IN_CONTROL = tuple(cause for cause in CAUSES if cause != "saturation")


@cache
def loops():
    """At least 300 loops of three populations."""
    return (
        *population(180, IN_CONTROL, seed=71),
        *plant_population(80, seed=72),
        *wandering_population(50, seed=73),
    )


@pytest.mark.parametrize("with_sp", [True, False], ids=["SP", "no SP"])
def test_fewer_than_one_in_a_hundred(with_sp):
    records = [case.record if with_sp else replace(case.record, sp=None) for case in loops()]
    states = [assess_loop_state(record).state for record in records]
    assert len(states) > 300
    assert sum(state != "in_control" for state in states) < 0.01 * len(states)


def test_real_loops_are_in_control(records):
    files = [*records.glob("plant/*.csv"), *records.glob("isdb/*.csv")]
    states = {file.name: assess_loop_state(st.read(file)[0]).state for file in files}
    assert len(states) > 20
    assert {name for name, state in states.items() if state != "in_control"} == set()


def test_demo_loops_are_in_control():
    assert all(assess_loop_state(loop.record).in_control for loop in demo_plant())
