"""Why the rate matters: the paper's thresholds, closed forms against simulation, the map."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from tests.reference import physical as reference

import stiction as st
from stiction.models.parameter_sets import nominal, published_valve, table1_reading_a, table1_reading_b
from stiction.simulation.critical_rates import (
    critical_rate,
    inertial_rate,
    ramp_behaviour,
    stribeck_rates,
)


@pytest.mark.parametrize("row", reference.CRITICAL, ids=lambda row: row.case)
def test_published_thresholds(row):
    found = critical_rate(published_valve(row.given["set"]))
    assert 0.18 * found.rate == pytest.approx(row.expected["psi_per_s"], rel=row.tolerance)
    assert found.mechanism == row.expected["mechanism"]


def test_stribeck_closed_form_solves_its_equation():
    """b = (Fs - Fc)(2 v / vs^2) exp(-(v / vs)^2) at both ends; Table I: 0.0305 in/s, 0.0916 psi/s."""
    valve = table1_reading_b()
    for rate in stribeck_rates(valve):
        v = 0.01 * valve.gain * valve.stroke * rate
        slope = (valve.static - valve.coulomb) * 2.0 * v / valve.stribeck_velocity**2
        assert slope * math.exp(-((v / valve.stribeck_velocity) ** 2)) == pytest.approx(valve.viscous, rel=1e-9)
    assert v / 0.0254 == pytest.approx(0.0305, abs=5e-5)
    assert 0.18 * stribeck_rates(valve)[1] == pytest.approx(0.0916, abs=5e-5)


def test_inertial_closed_form_against_simulation():
    """With a small Stribeck velocity the closed form is the whole truth."""
    for zeta in (0.05, 0.2, 0.5):
        valve = table1_reading_a(stribeck_velocity="1e-6 in/s", velocity_tolerance="1e-7 in/s")
        valve = replace(valve, viscous=2.0 * zeta * math.sqrt(valve.spring_rate * valve.mass), substep=2e-5)
        found = critical_rate(valve)
        assert found.rate == pytest.approx(inertial_rate(valve), rel=0.01), zeta


def test_inertial_rate_scales_as_its_group():
    """Fs - Fc over sqrt(K m), and a damping ratio of 1 ends it."""
    valve = table1_reading_a()
    double = replace(valve, static=valve.coulomb + 2.0 * (valve.static - valve.coulomb))
    assert inertial_rate(double) == pytest.approx(2.0 * inertial_rate(valve))
    critical = 2.0 * math.sqrt(valve.spring_rate * valve.mass)
    assert inertial_rate(replace(valve, viscous=critical)) == 0.0
    assert inertial_rate(replace(valve, viscous=0.0)) == math.inf


@pytest.mark.parametrize(("psi_per_s", "kind"), [(0.08, "staircase"), (0.10, "follow")])
def test_stribeck_threshold_lies_between(psi_per_s, kind):
    """Reading B: 0.08 psi/s staircase, 0.10 psi/s smooth."""
    assert ramp_behaviour(table1_reading_b(), psi_per_s / 0.18).kind == kind


def test_no_excess_no_stairs():
    """Coulomb friction alone has a deadband but no stairs at any rate."""
    valve = replace(table1_reading_b(), static=table1_reading_b().coulomb)
    found = critical_rate(valve)
    assert (found.rate, found.mechanism) == (0.0, "none")
    assert "No ramp" in found.summary()
    assert ramp_behaviour(valve, 0.05).kind == "follow"


def test_heavily_packed_valve_follows_every_ramp():
    """The nominal valve creeps away slowly instead of slipping: an unstable band of speeds, but no rest."""
    low, high = stribeck_rates(nominal())
    found = critical_rate(nominal())
    assert 0.0 < low < high
    assert (found.mechanism, found.stribeck_low, found.stribeck) == ("none", low, high)


def test_lag_and_positioner_are_left_out():
    plain = critical_rate(table1_reading_b())
    assert critical_rate(table1_reading_b(lag=3.0, hold="linear")) == plain


@pytest.mark.parametrize("damping", [0.05, 0.3, 0.9])
def test_stairs_end_at_the_closed_form_boundaries(damping):
    valve = table1_reading_a(stribeck_velocity="1e-4 in/s", velocity_tolerance="1e-5 in/s")
    valve = replace(valve, viscous=damping * 2.0 * math.sqrt(valve.spring_rate * valve.mass))
    boundary = max(inertial_rate(valve), stribeck_rates(valve)[1])
    clear = [rate for rate in (5.0, 20.0, 80.0) if abs(math.log(rate / boundary)) > 0.15]
    assert len(clear) >= 2
    assert [ramp_behaviour(valve, rate).kind == "staircase" for rate in clear] == [rate < boundary for rate in clear]


def test_bad_input_is_an_error_with_its_name():
    with pytest.raises(st.ParameterError, match="Kano"):
        critical_rate(st.Kano(3.0, 1.0))
    with pytest.raises(st.ParameterError, match="rate = -1"):
        ramp_behaviour(table1_reading_a(), -1.0)
    with pytest.raises(st.ParameterError, match=r"rate = 1e-06 .* give a faster ramp"):
        ramp_behaviour(table1_reading_a(), 1e-6)
    for rate in (1e9, 1e308):
        with pytest.raises(st.ParameterError, match=r"rate = .* give a slower ramp"):
            ramp_behaviour(table1_reading_a(), rate)
