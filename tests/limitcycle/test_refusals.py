"""What limit cycles are asked for and cannot be given: each gets a sentence that names it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import stiction as st
from stiction.limitcycle import (
    basin_map,
    bifurcation,
    describing_function,
    exact_limit_cycles,
    harmonic_balance,
    predict_limit_cycles,
    sampled_limit_cycles,
    smallest_pulse,
)

LOOP = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)


@pytest.mark.parametrize("valve", [st.Kano(3.0, 1.0), st.Stenman(3.0), st.Srinivasan(2.0, 1.0, 0.1)])
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"family": "abc"}, "family = 'abc' is unknown"),
        ({"family": math.nan}, "family = nan is unknown"),
        ({"centre": math.nan}, "centre must be a finite number"),
        ({"tolerance": math.nan}, "tolerance must be a finite number"),
        ({"tolerance": 0.0}, "tolerance = 0 is not positive"),
        ({"omega": [1.0, 2.0, 3.0]}, r"amplitude has shape \(2,\) and omega \(3,\)"),
        ({"omega": [0.0, 1.0]}, "omega = .* must be positive"),
        ({"omega": "fast"}, "omega must be a number"),
        ({"amplitude": [4.0, math.nan]}, "amplitude has entries that are not finite"),
        ({"amplitude": 1j}, "amplitude must be a number"),
    ],
)
def test_a_describing_function_that_cannot_be(valve, given, message):
    with pytest.raises(st.ParameterError, match=message):
        describing_function(valve, **{"amplitude": [4.0, 5.0], "omega": 1.0} | given)


def test_an_array_that_is_wrong_is_not_printed_whole():
    with pytest.raises(st.ParameterError, match="amplitude") as message:
        describing_function(st.Kano(3.0, 1.0), np.zeros(1000))
    assert len(str(message.value)) < 150


@pytest.mark.parametrize("valve", [st.Kano(3.0, 1.0), st.Stenman(3.0)])
@pytest.mark.parametrize(
    ("families", "message"),
    [
        (["abc"], "family = 'abc' is unknown"),
        ([math.nan], "family = nan is unknown"),
        ("half", "families = 'half' is not a list of families"),
        (5, "families = 5 is not a list of families"),
    ],
)
def test_families_that_are_none(valve, families, message):
    loop = st.Loop(LOOP.controller, valve, LOOP.process, dt=1.0)
    for ask in (predict_limit_cycles, exact_limit_cycles):
        with pytest.raises(st.ParameterError, match=message):
            ask(loop, families=families)
    with pytest.raises(st.ParameterError, match=message):
        bifurcation(loop, "Kc", [0.2], families=families)
    with pytest.raises(st.ParameterError, match=message):
        harmonic_balance(st.TransferFunction([8], [1, 2, 2, 1]), valve, families)


@pytest.mark.parametrize(
    "ask",
    [
        predict_limit_cycles,
        exact_limit_cycles,
        sampled_limit_cycles,
        basin_map,
        lambda loop: bifurcation(loop, "Kc", [0.2]),
    ],
)
def test_what_is_no_loop(ask):
    for other in ("loop", None, LOOP.valve):
        with pytest.raises(st.ParameterError, match=r"loop is of type .*; give a Loop\(controller, valve"):
            ask(other)


def test_what_is_no_valve_no_record_and_no_cycle():
    with pytest.raises(st.ParameterError, match="valve is of type str; give a valve model"):
        describing_function("Kano", [4.0], omega=1.0)
    with pytest.raises(st.ParameterError, match="valve is of type NoneType"):
        harmonic_balance(LOOP.process, None)
    (cycle,) = exact_limit_cycles(LOOP)
    with pytest.raises(st.ParameterError, match="end is of type str; give a cycle of exact_limit_cycles"):
        smallest_pulse(LOOP, cycle, "large", 5.0)


def test_values_of_a_parameter_that_cannot_be():
    for values, message in (
        ([], "values is empty"),
        (["a"], "values must be a number"),
        ([0.2, math.nan], "not finite"),
    ):
        with pytest.raises(st.ParameterError, match=message):
            bifurcation(LOOP, "Kc", values)
    with pytest.raises(st.ParameterError, match="searches = 0 is not positive"):
        bifurcation(LOOP, "Kc", [0.2], searches=0)
    with pytest.raises(st.ParameterError, match=r"Kano.* has no stiction: .* Give a valve that sticks"):
        bifurcation(st.Loop(LOOP.controller, st.Kano(3.0, 0.0), LOOP.process, 1.0), "S", [0.0, 3.0])
