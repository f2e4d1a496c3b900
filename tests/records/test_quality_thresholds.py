"""The public data checks on both sides of each threshold, on signals whose answer is known by construction."""

from __future__ import annotations

import numpy as np
import pytest

from stiction import quality
from stiction.records.gaps import fill_short_gaps, forward_fill, interpolate_gaps

N = 1000
K = np.arange(N)
WAVE = 50.0 + 10.0 * np.sin(K / 9.0)
NOISE = np.random.default_rng(0).normal(size=(2, N))


def held(x, first, samples, value=None):
    """A signal that keeps one value for so many samples."""
    out = x.copy()
    out[first : first + samples] = out[first] if value is None else value
    return out


def count(mask):
    return int(np.count_nonzero(mask))


@pytest.mark.parametrize(("samples", "found"), [(9, 0), (10, 10)])
@pytest.mark.parametrize("limit", [0.0, 100.0])
def test_saturation_needs_min_samples(samples, found, limit):
    op = held(np.round(WAVE / 5.0) * 5.0, 300, samples, limit)  # rounded, so that OP is often constant
    assert count(quality.find_saturation(op)) == found
    assert count(quality.find_saturation(op, min_samples=samples + 1)) == 0


@pytest.mark.parametrize(("samples", "found"), [(2, 0), (3, 3)])
def test_a_moving_op_is_saturated_after_fewer_samples(samples, found):
    op = held(WAVE, 300, samples, 100.0)
    assert count(quality.find_saturation(op)) == found
    assert count(quality.find_saturation(op, min_samples_if_moving=samples)) == samples


@pytest.mark.parametrize(("distance", "found"), [(0.09, 20), (0.11, 0)])
def test_saturation_within_the_tolerance(distance, found):
    op = held(WAVE, 300, 20, 100.0 - distance)
    op[320] = 100.0
    assert count(quality.find_span_ends(op, min_samples=2)) == (found + 1 if found else 0)
    assert count(quality.find_span_ends(op, min_samples=2, tolerance=0.0005)) == 0


@pytest.mark.parametrize(("values", "found"), [(13, False), (14, True)])
def test_clipping_needs_values_between_the_extremes(values, found):
    op = np.repeat(30.0 + np.concatenate([np.arange(values), np.arange(values)[-2:0:-1]]), 2)
    op = np.concatenate([op] * 20)
    op = np.concatenate([op, np.full(20, op.max()), op])
    pv = np.sin(np.arange(op.size))
    assert quality.find_clipping(op, pv).any() == found
    assert quality.find_clipping(op, pv, min_values=values - 2).any()
    assert not quality.find_clipping(op, np.zeros(op.size), min_values=values - 2).any()  # PV must vary


@pytest.mark.parametrize(("samples", "found"), [(100, 0), (101, 101)])
def test_a_shutdown_takes_more_than_a_tenth(samples, found):
    assert count(quality.find_shutdown(held(WAVE, 300, samples, 0.0))) == found


@pytest.mark.parametrize(("other", "found"), [(23, 0), (22, 200)])
def test_a_shutdown_takes_nine_tenths_of_the_time_at_the_ends(other, found):
    op = held(held(WAVE, 300, 200, 0.0), 700, other, 100.0)  # 200 > 0.9 (200 + other)
    assert count(quality.find_shutdown(op)) == found


@pytest.mark.parametrize(("samples", "found"), [(11, 0), (12, 24)])
def test_manual_steps_need_min_samples(samples, found):
    op = held(held(WAVE, 300, samples, 52.0), 300 + samples, samples, 47.0)
    assert count(quality.find_manual_steps(op)) == found


@pytest.mark.parametrize(("between", "found"), [(1, True), (2, False)])
def test_manual_steps_follow_one_another(between, found):
    op = held(held(WAVE, 300, 30, 52.0), 330 + between, 30, 47.0)
    assert quality.find_manual_steps(op).any() == found
    assert quality.find_manual_steps(op, max_transition=between).any()


@pytest.mark.parametrize(("groups", "found"), [(5, True), (6, False)])
def test_many_groups_of_steps_are_the_controller(groups, found):
    op = WAVE.copy()
    for k in range(groups):
        op = held(held(op, 100 * k, 30, 52.0 + k / 9), 100 * k + 30, 30, 47.0 + k / 9)
    assert quality.find_manual_steps(op).any() == found
    assert quality.find_manual_steps(op, max_groups=groups).any()


@pytest.mark.parametrize(("samples", "found"), [(11, 0), (12, 12)])
def test_a_moving_op_is_in_manual_after_twelve_samples(samples, found):
    assert count(quality.find_manual(held(WAVE, 300, samples, 52.0), WAVE)) == found


@pytest.mark.parametrize(("samples", "found"), [(59, 0), (60, 60)])
def test_an_op_that_is_often_constant_is_in_manual_after_sixty(samples, found):
    op = held(np.repeat(WAVE[::4], 4), 300, samples + 4, 52.3)
    op[300 + samples : 304 + samples] = 52.9
    assert count(quality.find_manual(op, WAVE)) == found
    assert count(quality.find_manual(op, WAVE, min_samples=samples + 1)) == 0


@pytest.mark.parametrize(("samples", "found"), [(12, 0), (13, 13)])
def test_frozen_pv(samples, found):
    assert count(quality.find_frozen(held(WAVE, 300, samples))) == found


@pytest.mark.parametrize(("samples", "found"), [(6, 0), (7, 7)])
def test_outages(samples, found):
    op, pv = held(NOISE[0], 300, samples), held(NOISE[1], 300, samples)
    op[300 + samples] += 9.0
    assert count(quality.find_outages(op, pv)) == found
    assert count(quality.find_outages(held(NOISE[0], 300, samples), NOISE[1])) == 0  # PV goes on


@pytest.mark.parametrize(("samples", "found"), [(7, 0), (8, 8)])
def test_copied_data_of_unrounded_signals(samples, found):
    op, pv = NOISE.copy()
    op[600 : 600 + samples], pv[600 : 600 + samples] = op[100 : 100 + samples], pv[100 : 100 + samples]
    assert count(quality.find_copied_data(op, pv)[0]) == found
    assert count(quality.find_copied_data(op, pv, min_samples_if_unrounded=samples)[0]) == samples


@pytest.mark.parametrize(("interval", "changes", "found"), [(5, 20, False), (5, 21, True)])
def test_a_slower_signal_needs_min_changes(interval, changes, found):
    pv = np.repeat(NOISE[1][: changes + 1], interval)
    slower = quality.find_slower_signal(NOISE[0][: pv.size], pv)
    assert (slower is not None) == found


@pytest.mark.parametrize(("values", "coarse"), [(50, True), (51, False)])
def test_coarse_signals_have_few_values(values, coarse):
    assert quality.is_coarse(np.tile(np.arange(float(values)), 3)) == coarse


@pytest.mark.parametrize(("share", "step"), [(0.985, 0.5), (0.97, 0.0)])
def test_a_quantisation_step_fits_nearly_all_differences(share, step):
    gaps = np.full(1000, 0.5)
    gaps[: round((1.0 - share) * 1000)] = 0.63
    x = np.cumsum(np.random.default_rng(1).permutation(np.concatenate([gaps, np.tile([1.0, 1.5], 150)])))
    assert quality.quantisation_step(np.concatenate([x, x[::-1]])) == pytest.approx(step, rel=2e-2)


def test_a_signal_that_rests_has_no_reversal():
    assert quality.count_reversals(np.full(5, 3.0)) == 0


@pytest.mark.parametrize(("move", "reversals"), [(1.46, 0), (1.54, 2)])
def test_a_reversal_is_more_than_the_smallest_move(move, reversals):
    """A ramp with one ripple on its way."""
    ramp = np.linspace(0.0, 10.0, 100_001)
    x = np.concatenate([ramp[:50_001], [5.0 - move], ramp[50_001:]])
    assert quality.count_reversals(x, 1.5) == reversals


@pytest.mark.parametrize(("ends", "scale"), [
    ((0.0, 1.0), "fraction"), ((0.0, 1.01), "percent"), ((-10.0, 110.0), "percent"), ((-10.1, 90.0), "other"),
    ((20.0, 110.1), "other"), ((-0.5, 5.0), "percent"), ((-0.51, 5.0), "normalised"), ((-0.51, 5.1), "percent"),
])  # fmt: skip
def test_op_scale(ends, scale):
    assert quality.detect_op_scale(*ends) == scale


@pytest.mark.parametrize(("distance", "found"), [(0.99, 0), (1.01, 1)])
def test_an_outlier_lies_one_width_away(distance, found):
    x = np.where(K % 2, 0.5, -0.5)
    x[501] = 0.5 + distance
    assert count(quality.find_outliers(x)) == found
    assert count(quality.find_outliers(x, min_distance=0.9)) == 1


@pytest.mark.parametrize(("samples", "found"), [(30, 30), (31, 0)])
def test_a_constant_code_stands_for_thirty_samples(samples, found):
    x = held(np.tile(NOISE[0], 4), 300, samples, 500.0)
    x[800] = 501.0  # the code is not the largest value, so it is none that comes again and again
    assert count(quality.find_outliers(x)) == found + 1


@pytest.mark.parametrize(("changes", "found"), [(11, False), (12, True)])
def test_exception_reporting_needs_min_changes(changes, found):
    places = np.cumsum(np.random.default_rng(2).integers(3, 30, changes))
    x = np.zeros(places[-1] + 20)
    x[places] = np.random.default_rng(3).uniform(1.0, 2.0, changes) * np.where(np.arange(changes) % 3, 1.0, -1.0)
    assert (quality.exception_deviation(np.cumsum(x)) > 0.0) == found


@pytest.mark.parametrize(("jumps", "found"), [(0, 0), (1, 1), (2, 2)])
def test_discontinuities_are_at_most_the_clock_jumps(jumps, found):
    op, pv = np.sin(K / 9.0), np.cos(K / 9.0)
    for first in (300, 600):
        op[first:], pv[first:] = op[first:] + 3.0, pv[first:] - 3.0
    assert count(quality.find_discontinuities(op, pv, max_count=jumps)) == found


@pytest.mark.parametrize(("gap", "filled"), [(5, True), (6, False)])
def test_short_gaps_are_filled(gap, filled):
    x = held(WAVE, 300, gap, np.nan)
    assert np.isfinite(fill_short_gaps(x)).all() == filled
    assert np.isfinite(fill_short_gaps(x, max_gap=gap)).all()
    assert not np.isfinite(fill_short_gaps(x, max_gap=gap - 1)).all()


@pytest.mark.parametrize("seed", range(20))
def test_gaps_are_filled_as_a_plain_loop_does(seed):
    rng = np.random.default_rng(seed)
    x = np.where(rng.random(60) < 0.4, np.nan, rng.normal(size=60))
    last, forward = np.nan, []
    for value in x:
        last = value if np.isfinite(value) else last
        forward.append(last)
    np.testing.assert_array_equal(forward_fill(x), forward)
    first = x[np.isfinite(x)][0]
    np.testing.assert_array_equal(forward_fill(x, fill_start=True), np.where(np.isnan(forward), first, forward))
    line = interpolate_gaps(x)
    for k in np.flatnonzero(np.isnan(x)):
        before, after = np.flatnonzero(np.isfinite(x[:k])), k + np.flatnonzero(np.isfinite(x[k:]))
        ends = (before[-1] if before.size else after[0], after[0] if after.size else before[-1])
        share = (k - ends[0]) / (ends[1] - ends[0]) if ends[0] < ends[1] else 0.0
        assert line[k] == pytest.approx(x[ends[0]] + share * (x[ends[1]] - x[ends[0]]))
