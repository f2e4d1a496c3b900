from __future__ import annotations

import math

import numpy as np
import pytest
from tests.reference import physical as reference

from stiction.models.parameter_sets import table1_reading_b
from stiction.paper import equations1to3, figure2, table1

READING = {"table1_reading_a": "A", "table1_reading_b": "B"}


@pytest.fixture(scope="module")
def fig2():
    return figure2()


def test_table_1_by_hand():
    # Fs / A = 384 lbf / 100 in2; bands over 18 psi x 100 in2 = 1800 lbf; zeta = 3.5 / (2 sqrt(300 x 3)) in reading A,
    # with 3 lbm = 3 / 386.09 lbf s2/in in reading B.
    a, b = table1().readings
    for reading in (a, b):
        assert reading.first_break == pytest.approx(3.84)
        bands = (reading.fs, reading.fd, reading.S, reading.J)
        assert bands == pytest.approx((100 * 384 / 1800, 100 * 320 / 1800, 100 * 704 / 1800, 100 * 64 / 1800))
    assert a.damping_ratio == pytest.approx(3.5 / (2 * math.sqrt(300 * 3)))
    assert b.damping_ratio == pytest.approx(3.5 / (2 * math.sqrt(300 * 3 / 386.0886)), rel=1e-5)
    assert a.natural_frequency == pytest.approx(10.0)


@pytest.mark.parametrize("row", reference.CRITICAL, ids=lambda row: row.case)
def test_critical_rate(row):
    # N3 and N4: 6.82 psi/s by inertia; 0.0916 psi/s, 0.0305 in/s by the Stribeck effect.
    reading = next(r for r in table1().readings if r.name == READING[row.given["set"]])
    assert reading.critical_pressure == pytest.approx(row.expected["psi_per_s"], rel=row.tolerance)
    assert reading.critical.mechanism == row.expected["mechanism"]


def test_both_boundaries_of_reading_b_are_shown():
    """N4: a steady slide is unstable below 0.0916 psi/s; stairs from rest go on above it, where the slide is stable."""
    from stiction.simulation.critical_rates import ramp_behaviour, stribeck_rates

    b = next(r for r in table1().readings if r.name == "B")
    assert b.slide_pressure == pytest.approx(0.0916, abs=5e-5)
    assert 1.0 < b.critical_pressure / b.slide_pressure < 1.02
    between = math.sqrt(b.critical_pressure * b.slide_pressure) / 0.18
    valve = table1_reading_b()
    assert between > stribeck_rates(valve)[1]
    assert ramp_behaviour(valve, between, slips=100.0).kind == "staircase"
    assert "0.0916 psi/s" in table1().summary()
    assert "0.0922 psi/s" in table1().summary()


@pytest.mark.parametrize("row", reference.STAIRS, ids=lambda row: row.case)
def test_figure_2b(row, fig2):
    panel = fig2.panel("2b", READING[row.given["set"]])
    assert panel.behaviour == "staircase"
    assert panel.first_break == pytest.approx(row.expected["first"], rel=row.tolerance)
    assert panel.slips == row.expected["slips"]
    assert panel.slip == pytest.approx(row.expected["slip"], rel=row.tolerance)


def test_stairs_of_reading_b_are_as_far_apart_as_derived(fig2):
    # N4 and section 1.4: 0.644 psi apart, stuck 99 % of the time; reading A stuck 36 %.
    assert fig2.panel("2b", "B").spacing == pytest.approx(0.644, abs=0.001)
    assert fig2.panel("2b", "B").at_rest == pytest.approx(0.99, abs=0.005)
    assert fig2.panel("2b", "A").at_rest == pytest.approx(0.36, abs=0.005)


@pytest.mark.parametrize("row", reference.FOLLOW, ids=lambda row: row.case)
def test_figure_2c(row, fig2):
    panel = fig2.panel("2c", READING[row.given["set"]])
    assert (panel.behaviour, panel.slips) == ("follow", 0)
    assert panel.first_break == pytest.approx(3.84, abs=0.003)
    assert panel.slowest == pytest.approx(row.expected["slowest"], rel=row.tolerance)


def test_figure_2a_is_the_linear_answer_of_mass_and_spring(fig2):
    # m x'' + b x' + K x = A s t from rest, in closed form, with zeta and omega of reading A.
    panel = fig2.panel("2a", "A")
    omega, zeta, speed = 10.0, 3.5 / 60.0, 4.0 * 100.0 / 300.0
    damped, t = omega * math.sqrt(1.0 - zeta**2), panel.time
    swing = np.exp(-zeta * omega * t) * (
        2 * zeta / omega * np.cos(damped * t) + (2 * zeta**2 - 1) / damped * np.sin(damped * t)
    )
    assert panel.position == pytest.approx(speed * (t - 2 * zeta / omega + swing), abs=0.005)


def test_the_plain_twin_goes_in_the_same_stairs(fig2):
    twin, panel = equations1to3(), fig2.panel("2b", "A")
    position = np.interp(panel.pressure, twin.pressure, twin.position["corrected"])
    assert panel.position == pytest.approx(position, abs=0.01)
