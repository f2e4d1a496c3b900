"""Both sides of the thresholds of each check."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.diagnosis.loop_state import (
    are_signals_swapped,
    find_bad_data,
    find_manual,
    find_not_in_command,
    find_pv_frozen,
    find_saturated,
    find_shut_in,
    find_unrelated_signals,
    find_valve_not_responding,
    find_wind_up,
)
from stiction.errors import ParameterError

N = 1000
RNG = np.random.default_rng(7)
NOISE = RNG.normal(size=N)
WAVE = 10.0 * np.sin(np.arange(N) / 9.0)


def integrated(pv, sp, rate=0.03):
    return 40.0 + rate * np.cumsum(sp - pv)


def test_manual_follows_the_mode_where_it_is_recorded():
    auto = np.arange(N) < 300
    assert find_manual(50.0 + NOISE, WAVE, auto).tolist() == (~auto).tolist()


@pytest.mark.parametrize(("length", "marked"), [(59, 0), (60, 60)])
def test_manual_needs_a_long_rest(length, marked):
    op = 50.0 + NOISE
    op[200 : 200 + length] = 50.0
    assert find_manual(op, WAVE, min_rest_share=0.0).sum() == marked


def test_manual_needs_pv_to_move():
    op = 50.0 + NOISE
    op[200:400] = 50.0
    assert find_manual(op, WAVE).sum() == 200
    assert not find_manual(op, np.where((np.arange(N) >= 200) & (np.arange(N) < 400), 0.0, WAVE)).any()


def test_a_rest_that_the_rounding_of_op_explains_is_not_manual():
    pv = np.sin(np.arange(N) / 100.0)
    assert not find_manual(np.round(50.0 - 3.0 * pv), pv).any()
    held = 50.0 - 3.0 * pv
    held[300:600] = held[300]
    assert find_manual(held, pv).sum() == 300


def test_a_slow_controller_is_not_in_manual():
    op = np.repeat(50.0 + 10.0 * RNG.normal(size=10), 100)
    assert not find_manual(op, WAVE).any()
    uneven = np.repeat(50.0 + 10.0 * RNG.normal(size=6), [70, 300, 90, 350, 60, 130])
    assert find_manual(uneven, WAVE).mean() > 0.9


@pytest.mark.parametrize(("op", "marked"), [(100.0, 12), (99.9, 12), (99.8, 0), (0.1, 12), (0.2, 0)])
def test_saturation_begins_at_the_tolerance(op, marked):
    signal = np.concatenate([np.linspace(40.0, 60.0, 30), np.full(12, op)])
    assert find_saturated(signal).sum() == marked


@pytest.mark.parametrize(("visits", "marked"), [(2, 0), (3, 60)])
def test_an_own_limit_is_reached_several_times(visits, marked):
    one = np.concatenate([np.linspace(40.0, 84.0, 50), np.full(20, 85.0)])
    assert find_saturated(np.concatenate([*[one] * visits, [30.0]])).sum() == marked


@pytest.mark.parametrize(("limits", "min_samples"), [((100.0, 0.0), 10), ((0.0, 100.0), 0)])
def test_saturation_refuses_bad_parameters(limits, min_samples):
    with pytest.raises(ParameterError, match=r"limits|min_samples"):
        find_saturated(NOISE, limits=limits, min_samples=min_samples)


@pytest.mark.parametrize(("length", "marked"), [(59, 0), (60, 60)])
def test_a_frozen_pv_rests_long(length, marked):
    pv = 150.0 + NOISE
    pv[300 : 300 + length] = 150.0
    assert find_pv_frozen(50.0 + NOISE, pv).sum() == marked


def test_a_coarse_pv_is_not_frozen():
    slow = np.cumsum(NOISE) / 30.0
    assert not find_pv_frozen(50.0 + NOISE, np.round(slow)).any()


@pytest.mark.parametrize(("values", "marked"), [(9, 0), (10, 500)])
def test_a_frozen_pv_took_several_values_before(values, marked):
    pv = np.concatenate([np.tile(np.arange(float(values)), N)[: N // 2], np.full(N // 2, 99.0)])
    assert find_pv_frozen(50.0 + NOISE, pv, min_values=values + 1 if not marked else values).sum() == marked


def test_pv_and_op_that_rest_together_are_no_frozen_transmitter():
    pv = 150.0 + NOISE
    pv[300:600] = 150.0
    op = 50.0 + NOISE
    op[300:600] = 50.0
    assert not find_pv_frozen(op, pv).any()


@pytest.mark.parametrize(("flow", "marked"), [(2.9, 600), (3.1, 0)])
def test_the_flow_counts_as_zero_up_to_its_limit(flow, marked):
    pv = np.where(np.arange(N) < 400, 150.0, flow)
    assert find_shut_in(np.full(N, 60.0), pv).sum() == marked


def test_no_flow_through_a_closed_valve_is_normal():
    pv = np.where(np.arange(N) < 400, 150.0, 0.0)
    assert find_shut_in(np.full(N, 60.0), pv).sum() == 600
    assert not find_shut_in(np.full(N, 1.0), pv).any()


def test_no_flow_at_all_is_inferred_from_the_set_point():
    assert find_shut_in(np.full(N, 60.0), 0.1 * NOISE, np.full(N, 150.0)).all()
    assert not find_shut_in(np.full(N, 60.0), 0.1 * NOISE).all()


@pytest.mark.parametrize(("rate", "is_found"), [(0.0045, True), (0.0030, False)])
def test_a_wind_up_travels_far(rate, is_found):
    pv, sp = 150.0 + 0.3 * NOISE, np.full(N, 154.0)  # OP travels 18 and 12 %
    assert (find_valve_not_responding(integrated(pv, sp, rate), pv, sp) is not None) == is_found


def test_a_pv_that_answers_is_no_wind_up():
    sp = np.full(N, 154.0)
    pv = 150.0 + 3.9 * np.linspace(0.0, 1.0, N) + 0.1 * NOISE
    assert find_wind_up(integrated(pv, sp, 0.02), pv, sp) is None


def test_op_that_travels_there_and_back_is_no_wind_up():
    sp = np.full(N, 150.0)
    pv = sp + np.where(np.arange(N) < N // 2, -4.0, 4.0) + 0.3 * NOISE
    assert find_wind_up(integrated(pv, sp), pv, sp) is None


def test_proportional_travel_is_no_wind_up():
    sp = np.full(N, 150.0)
    pv = sp - np.linspace(1.0, 20.0, N) + 0.01 * NOISE
    assert find_wind_up(40.0 + 2.0 * (sp - pv), pv, sp) is None


def test_an_oscillating_pv_parts_the_two_states():
    sp = np.full(N, 156.0)
    for pv, is_stuck in ((150.0 + 0.3 * NOISE, True), (150.0 + WAVE, False)):
        op = np.minimum(integrated(pv, sp, 0.02), 100.0)
        assert (find_valve_not_responding(op, pv, sp) is not None) == is_stuck
        assert (find_not_in_command(op, pv, sp) is None) == is_stuck


@pytest.mark.parametrize(("offset", "is_found"), [(1.4, False), (1.7, True)])
def test_at_a_limit_the_offset_counts_against_its_spread(offset, is_found):
    slow = np.sin(np.arange(N) / 150.0) + np.sin(np.arange(N) / 61.0)
    pv, at_limit = 150.0 + slow / slow.std(), np.ones(N, dtype=bool)
    found = find_not_in_command(np.full(N, 100.0), pv, np.full(N, 150.0 + offset), at_limit=at_limit, min_one_sided=0.0)
    assert (found is not None) == is_found


def test_proportional_action_alone_counts_only_where_integral_is_the_rule():
    pv = 150.0 + np.cumsum(NOISE) / 30.0
    sp = np.full(N, 170.0)
    op = 30.0 + 0.8 * (sp - pv)
    assert find_not_in_command(op, pv, sp) is None
    assert find_not_in_command(op, pv, sp, needs_integral=True) is not None


def test_a_filtered_relation_is_no_unrelated_pair():
    one, other = np.cumsum(RNG.normal(size=(2, 4000)), axis=1)
    late = np.convolve(one, np.ones(30) / 30.0, "full")[:4000]
    assert find_unrelated_signals(one, late + 0.3 * other) is None
    assert find_unrelated_signals(np.diff(one), np.diff(other)) is not None
    assert find_unrelated_signals(np.diff(one)[:200], np.diff(other)[:200]) is None  # too short to say


def test_a_pair_with_both_laws_is_not_called_swapped():
    pv = np.cumsum(NOISE)
    op = 40.0 - 0.5 * (pv + np.cumsum(pv) / 20.0)
    assert are_signals_swapped(pv, op) is not None
    assert are_signals_swapped(op, pv) is None
    assert are_signals_swapped(50.0 - 0.5 * pv, pv) is None  # a proportional controller holds both ways


@pytest.mark.parametrize(("gap", "marked"), [(5, 0), (6, 6)])
def test_bad_data_are_long_gaps(gap, marked):
    pv = 150.0 + NOISE
    pv[100 : 100 + gap] = np.nan
    assert find_bad_data(NOISE, pv).sum() == marked
