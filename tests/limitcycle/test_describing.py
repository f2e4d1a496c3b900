"""Describing functions against numbers and methods from outside: published, python-control, sums over samples."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as some
from tests.reference import limitcycle as known

import stiction as st
from stiction.limitcycle import Deadband, Quantiser, Relay, Saturation, describing_function
from stiction.limitcycle.continuous_form import continuous_form
from stiction.limitcycle.describing.staircase import rest_level_offset, staircase_amplitudes


@pytest.mark.parametrize(("amplitude", "value"), known.STENMAN_HALF.items())
def test_stenman_half_family(amplitude, value):
    assert describing_function(st.Stenman(0.5), amplitude) == pytest.approx(value, abs=1e-4 if amplitude < 5 else 6e-4)


@pytest.mark.parametrize(("amplitude", "value"), known.STENMAN_INTEGER.items())
def test_stenman_integer_family(amplitude, value):
    assert describing_function(st.Stenman(0.5), amplitude, family="integer") == pytest.approx(value, abs=1e-4)


@pytest.mark.parametrize(("amplitude", "value"), known.STENMAN_CONTROL.items())
def test_stenman_as_python_control_sees_eq_4(amplitude, value):
    assert describing_function(st.Stenman(0.5), amplitude) == pytest.approx(value, abs=2e-5)


def test_printed_equations_are_wrong_in_two_places():
    valve = st.Stenman(0.5)
    literal = describing_function(valve, [0.5, 0.2, 1.25], as_printed=True)
    assert literal[0].real == pytest.approx(1.0 / math.pi, abs=1e-12)
    assert literal[1] == 0.0
    assert np.isnan(literal[2])
    repaired = describing_function(valve, [0.5, 0.8, 1.0], as_printed="roots repaired")
    right = describing_function(valve, [0.5, 0.8, 1.0])
    assert repaired[0] == pytest.approx(right[0], abs=1e-12)
    assert repaired[1].real == pytest.approx(0.51642, abs=1e-5)
    assert repaired[2] == pytest.approx(0.5187 - 0.2387j, abs=1e-4)
    assert np.allclose(repaired.imag, right.imag)


@pytest.mark.parametrize(("S", "J", "amplitude", "value"), known.TWO_PARAMETER)
def test_two_parameter_valves(S, J, amplitude, value):
    assert describing_function(st.Kano(S, J), amplitude) == pytest.approx(value, abs=1.1e-4)
    if J <= S:
        assert describing_function(st.Choudhury(S, J), amplitude) == pytest.approx(value, abs=1.1e-4)


def test_choudhury_with_large_jump_is_not_kano():
    assert describing_function(st.Choudhury(3.0, 5.0), 4.5) == pytest.approx(1.414 - 0.424j, abs=1e-3)
    assert describing_function(st.Kano(3.0, 5.0), 4.5) == pytest.approx(1.375 - 0.047j, abs=1e-3)


def test_he_rests_after_every_slip():
    assert describing_function(st.He(2.0, 1.0), 4.5, family="integer") == pytest.approx(0.7145 - 0.2830j, abs=3e-4)


@pytest.mark.parametrize(("amplitude", "value"), known.DEADBAND.items())
def test_deadband(amplitude, value):
    assert Deadband(1.0).describing_function(np.array(amplitude)) == pytest.approx(value, abs=1e-6)
    assert describing_function(st.Kano(1.0, 0.0), amplitude) == pytest.approx(value, abs=1e-6)


@pytest.mark.parametrize(("amplitude", "value"), known.RELAY.items())
def test_relay(amplitude, value):
    assert Relay(1.0, 0.5).describing_function(np.array(amplitude)) == pytest.approx(value, abs=1e-6)


def test_first_branch_of_stenman_is_a_relay_with_hysteresis():
    a = np.linspace(0.26, 0.74, 30)
    assert np.allclose(describing_function(st.Stenman(0.5), a), Relay(0.25, 0.25).describing_function(a), atol=1e-14)


@pytest.mark.parametrize("valve", [st.Ideal(travel=(0.0, 100.0)), st.Kano(0.0, 0.0, travel=(0.0, 100.0))])
def test_a_good_valve_between_its_end_stops_is_a_saturation(valve):
    amplitudes = np.array([20.0, 80.0])
    stopped = Saturation(50.0).describing_function(amplitudes)
    assert describing_function(valve, amplitudes, centre=50.0) == pytest.approx(stopped, abs=1e-4)


@pytest.mark.parametrize("nonlinearity", [Saturation(0.8), Quantiser(0.7)])
def test_memoryless_against_its_own_fourier_integral(nonlinearity):
    phase = (np.arange(400_000) + 0.5) / 400_000 * 2.0 * np.pi
    for a in (0.5, 1.3, 4.1):
        u = a * np.sin(phase)
        y = np.clip(u, -0.8, 0.8) if isinstance(nonlinearity, Saturation) else 0.7 * np.round(u / 0.7)
        value = 2.0 * np.mean(y * np.sin(phase)) / a
        assert nonlinearity.describing_function(np.array([a]))[0] == pytest.approx(value, abs=2e-5)


VALVES = some.one_of(
    some.builds(st.Stenman, some.floats(0.1, 3.0)),
    some.builds(lambda S, j: st.Kano(S, j * S), some.floats(0.2, 4.0), some.floats(0.0, 1.5)),
    some.builds(lambda fs, ratio: st.He(fs, ratio * fs), some.floats(0.2, 3.0), some.floats(0.1, 0.8)),
)


@settings(deadline=None, max_examples=60)
@given(VALVES, some.floats(1.05, 8.0), some.sampled_from(["half", "integer"]))
def test_closed_forms_equal_the_event_by_event_integral(valve, ratio, family):
    band = getattr(valve, "d", None) or getattr(valve, "fs", None) or valve.S / 2 + valve.J / 2
    a = ratio * band
    form = continuous_form(valve)
    steps = staircase_amplitudes(*form[:2], rest_level_offset(form.jump, family), 2.0 * a) if form.staircase else []
    assume(all(abs(step - a) > 1e-9 * a for step in steps))
    closed = describing_function(valve, a, family=family)
    assert describing_function(valve, a, family=family, method="events") == pytest.approx(closed, abs=1e-9)


@settings(deadline=None, max_examples=40)
@given(VALVES, some.floats(1.05, 6.0), some.floats(0.1, 10.0))
def test_describing_function_does_not_depend_on_the_scale(valve, ratio, scale):
    assume(abs(2.0 * ratio - round(2.0 * ratio)) > 1e-6)  # at a tie of a level with the amplitude rounding decides
    bigger = type(valve)(*(scale * value for name, value in vars(valve).items() if name != "travel"))
    a = ratio * max(value for name, value in vars(valve).items() if name != "travel")
    assert describing_function(bigger, scale * a) == pytest.approx(describing_function(valve, a), abs=1e-9)


@pytest.mark.parametrize("valve", [st.Stenman(0.5), st.Kano(0.8, 0.3), st.He(0.6, 0.2), st.Srinivasan(0.6, 0.3, 0.1)])
def test_numeric_meets_the_tolerance_it_was_asked_for(valve):
    for tolerance in (1e-3, 1e-4):
        numeric = describing_function(valve, 1.13, 0.4, method="numeric", tolerance=tolerance)
        assert abs(numeric - describing_function(valve, 1.13, 0.4, method="events")) < tolerance


def test_srinivasan_goes_from_staircase_to_follower_with_frequency():
    valve = st.Srinivasan(2.0, 1.0, 0.5)
    fast, slow = describing_function(valve, 4.5, [1e4, 1e-3])
    assert fast == pytest.approx(complex(describing_function(st.Kano(3.0, 1.0), 4.5)), abs=1e-4)
    assert slow.imag == pytest.approx(complex(describing_function(st.He(2.0, 1.0), 4.5)).imag, abs=1e-9)
    with pytest.raises(st.ParameterError, match="omega"):
        describing_function(valve, 4.5)


def test_physical_valve_at_a_crawl_goes_in_stairs_as_he_s_valve_does():
    """The valve after the USP group: fs = 12.644 %, fd = 11.347 % by its own forces; a slip takes 0.6 s."""
    valve = st.PhysicalValve(
        1.6, 210490, 125000, 700, 780, 5e-4, 0.0445, 0.029, pressure_range=(41368, 180000), preload=2550
    )
    crawl = complex(describing_function(valve, 30.0, 0.002, centre=50.0, tolerance=4e-3))
    assert crawl == pytest.approx(complex(describing_function(st.He(12.644, 11.347), 30.0)), abs=0.03)
    brisk = complex(describing_function(valve, 30.0, 1.0, centre=50.0, tolerance=4e-3))
    assert abs(brisk) < 0.95 * abs(crawl)


def test_refusals_name_the_quantity():
    with pytest.raises(st.ParameterError, match="amplitude"):
        describing_function(st.Stenman(0.5), [0.5, -1.0])
    with pytest.raises(st.ParameterError, match="family"):
        describing_function(st.Stenman(0.5), 1.0, family="odd")
    with pytest.raises(st.ParameterError, match="as_printed"):
        describing_function(st.Kano(1.0, 1.0), 1.0, as_printed=True)
