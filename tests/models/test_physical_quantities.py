"""Units: what is read, and what is refused with a sentence that helps."""

from __future__ import annotations

import copy
import pickle
from dataclasses import FrozenInstanceError, replace

import pytest

import stiction as st
from stiction.models.parameter_sets import PUBLISHED_VALVES, published_valve, table1_reading_a, table1_reading_b
from stiction.models.quantities import to_si

GOOD = {
    "mass": 2.0, "spring_rate": 1e5, "viscous": 100.0, "coulomb": 300.0, "static": 400.0,
    "stribeck_velocity": 1e-3, "area": 0.05, "stroke": 0.05,
}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("3 lbm", "kg", 1.36077711),
        ("384 lbf", "N", 1708.11710),
        ("300 lbf/in", "N/m", 52538.05057),
        ("3.5 lbf*s/in", "N*s/m", 612.94392),
        ("3.5 lbf s/in", "N*s/m", 612.94392),
        ("100 in**2", "m**2", 0.064516),
        ("0.01 in/s", "m/s", 2.54e-4),
        ("18 psig", "Pa", 124105.631),
        ("1.2 barg", "Pa", 120000.0),
        ("6 in", "m", 0.1524),
        ("2 min", "s", 120.0),
        (7, "N", 7.0),
    ],
)
def test_units_by_hand(text, unit, value):
    """Definitions: lbm 0.45359237 kg, lbf 4.4482216152605 N, inch 0.0254 m."""
    assert to_si("x", text, unit) == pytest.approx(value, rel=1e-7)


def test_pint_quantity_of_another_registry():
    pint = pytest.importorskip("pint")
    assert to_si("x", pint.UnitRegistry().Quantity(384.0, "force_pound"), "N") == pytest.approx(1708.11710, rel=1e-7)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"mass": "3 lb"}, ['mass = "3 lb"', '"3 lbm"', '"3 lbf"']),
        ({"coulomb": "3 lb"}, ['"3 lbm"', '"3 lbf"', "coulomb"]),
        ({"viscous": "3.5 lb/s"}, ['"3.5 lbm/s"', "N*s/m", "lbf*s/in"]),
        ({"mass": "3 pounds"}, ['"3 lbm"']),
        ({"mass": "3 lbf"}, ["mass", "kg"]),
        ({"static": "384 psi"}, ["static", "unit of N"]),
        ({"static": "384"}, ["static", "no unit"]),
        ({"stroke": "2 inchs of"}, ["stroke", "cannot be read"]),
        ({"coulomb": "3,5 lbf"}, ["comma"]),
        ({"mass": -1.0}, ["mass = -1 kg", "above 0"]),
        ({"mass": None}, ["mass must be a number"]),
        ({"static": 299.0}, ["static = 299 N", "coulomb = 300 N"]),
        ({"viscous": -1.0}, ["viscous", "negative"]),
        ({"stribeck_velocity": 0.0}, ["stribeck_velocity", "not positive"]),
        ({"friction": "dahl"}, ["'dahl'", "'karnopp'", "'lugre'"]),
        ({"hold": "first"}, ["'zero'", "'linear'"]),
        ({"pressure_range": ("15 psi", "3 psi")}, ["pressure_range", "lowest < highest"]),
        ({"pressure_range": 5.0}, ["pressure_range", "pair"]),
        ({"travel": (60.0, 40.0)}, ["travel", "lowest < highest"]),
        ({"substep": 0.0}, ["substep", "not positive"]),
        ({"preload": "2 kg"}, ["preload", "unit of N"]),
        ({"friction": "lugre", "coulomb": 0.0}, ["coulomb = 0 N"]),
    ],
    ids=str,
)
def test_bad_input_is_an_error_with_its_name(change, words):
    with pytest.raises(st.ParameterError) as raised:
        st.PhysicalValve(**{**GOOD, **change})
    assert [word for word in words if word not in str(raised.value)] == []


def test_missing_quantity_is_a_missing_argument():
    with pytest.raises(TypeError, match="stroke"):
        st.PhysicalValve(**{name: value for name, value in GOOD.items() if name != "stroke"})


def test_valve_is_a_value():
    valve = st.PhysicalValve(**GOOD)
    assert valve == st.PhysicalValve(**{**GOOD, "mass": "2 kg"})
    assert hash(valve) == hash(copy.deepcopy(valve))
    assert pickle.loads(pickle.dumps(valve)) == valve
    assert replace(valve, mass="4 kg").mass == 4.0
    with pytest.raises(FrozenInstanceError):
        valve.mass = 3.0


def test_table1_readings_differ_in_mass_alone():
    """E7: 3 lbf s2/in weighs 386.09 times 3 lbm; damping ratios 0.058 and 1.146."""
    a, b = table1_reading_a(), table1_reading_b()
    assert a.mass / b.mass == pytest.approx(386.088583)
    assert replace(a, mass=b.mass) == b
    assert (a.damping_ratio, b.damping_ratio) == pytest.approx((0.0583, 1.146), rel=1e-3)


def test_sets_by_name():
    assert all(isinstance(published_valve(name), st.PhysicalValve) for name in PUBLISHED_VALVES)
    with pytest.raises(st.ParameterError, match="nominal"):
        published_valve("teflon")
