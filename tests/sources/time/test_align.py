"""Tags with times of their own on one grid, against the value found by a loop over all stored ones."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.errors import RecordError
from stiction.sources.time.align import TagSeries, align_tags
from stiction.sources.time.stamps import Stamps

N = 240


def series(name, t, values=None, method="last", kind="relative"):
    t = np.asarray(t, dtype=float)
    return TagSeries(name, Stamps(t, kind), t.copy() if values is None else np.asarray(values, dtype=float), method)


def stored_at_random(rng, share, dt=1.0):
    there = rng.random(N) < share
    there[:12] = True
    return dt * np.flatnonzero(there), rng.normal(50.0, 5.0, int(there.sum())).round(3)


@settings(deadline=None, max_examples=60)
@given(
    seed=some.integers(0, 10**6),
    share=some.sampled_from([0.2, 0.5, 0.9]),
    dt=some.sampled_from([0.5, 1.0, 5.0]),
    method=some.sampled_from(["last", "hold", "interpolate"]),
    max_gap=some.sampled_from([2.0, 4.0, 1e6]),
)
def test_each_sample_has_the_value_that_the_method_asks_for(seed, share, dt, method, max_gap):
    rng = np.random.default_rng(seed)
    t, values = stored_at_random(rng, share, dt)
    max_gap *= dt
    base = series("PV", dt * np.arange(N))
    aligned = align_tags([base, series("OP", t, values, method)], max_gap=max_gap)
    assert aligned.dt == dt
    held = 0
    for k in range(N):
        now = k * dt
        before = max(i for i in range(len(t)) if t[i] <= now)
        expected = values[before] if method == "hold" or now - t[before] <= max_gap else np.nan
        after = next((i for i in range(len(t)) if t[i] >= now), None)
        if method == "interpolate" and after is not None and t[after] - t[before] <= max_gap:
            share_done = (now - t[before]) / (t[after] - t[before]) if after != before else 0.0
            expected = values[before] + share_done * (values[after] - values[before])
        np.testing.assert_allclose(aligned.values[1][k], expected, rtol=1e-12)
        held += k > 0 and aligned.rows[1][k] >= 0 and aligned.rows[1][k] == aligned.rows[1][k - 1]
    assert aligned.held_samples == [0, held]


@pytest.mark.parametrize("shuffled", [False, True])
def test_the_order_of_the_source_does_not_matter(shuffled):
    rng = np.random.default_rng(3)
    t, values = stored_at_random(rng, 0.5)
    order = rng.permutation(len(t)) if shuffled else np.arange(len(t))[::-1]
    tags = [series("PV", np.arange(N)), series("OP", t, values)]
    other = [tags[0], series("OP", t[order], values[order])]
    np.testing.assert_array_equal(align_tags(tags).values[1], align_tags(other).values[1])


def test_a_row_for_each_stored_value():
    pv, op = np.random.default_rng(1).normal(50.0, 5.0, (2, N))
    aligned = align_tags([series("PV", np.arange(N), pv), series("OP", np.arange(N) + 0.4, op)])
    assert aligned.dt == 1.0
    np.testing.assert_array_equal(aligned.values[0], pv)
    np.testing.assert_array_equal(aligned.values[1][1:], op[:-1])
    assert np.isnan(aligned.values[1][0])


def test_a_value_stands_over_moments_at_which_nothing_was_stored():
    t = np.array([0, 1, 2, 3, 7, 8, 9, 12, 13, 14, 15, 16])
    aligned = align_tags([series("PV", t), series("OP", t)])
    expected = [0, 1, 2, 3, 3, 3, 3, 7, 8, 9, 9, 9, 12, 13, 14, 15, 16]
    assert [values.tolist() for values in aligned.values] == [expected, expected]
    assert aligned.held_samples == [5, 5]


def test_a_value_stands_for_twenty_usual_steps_and_a_set_point_until_the_next():
    t = np.r_[0:100, 150:250]
    tags = [series("PV", t), series("SP", [0.0, 249.0], [7.0, 8.0], "hold"), series("OP", t)]
    aligned = align_tags(tags)
    assert np.flatnonzero(np.isnan(aligned.values[0])).tolist() == list(range(120, 150))
    assert aligned.values[1][:120].tolist() == [7.0] * 120
    limited = align_tags(tags, max_gap=5.0)
    assert np.flatnonzero(np.isnan(limited.values[0])).tolist() == list(range(105, 150))


def test_a_line_is_not_drawn_to_a_value_that_is_missing():
    pv = series("PV", np.arange(40))
    op = series("OP", [0, 10, 20, 30, 39], [0.0, 10.0, np.nan, 30.0, 39.0], "interpolate")
    values = align_tags([pv, op], max_gap=15.0).values[1]
    np.testing.assert_allclose(values[:11], np.arange(11.0))
    assert np.isnan(values[11:30]).all()
    np.testing.assert_allclose(values[30:], np.arange(30.0, 40.0))


def test_tags_of_text_give_their_rows():
    mode = TagSeries("MODE", Stamps(np.array([0.0, 100.0]), "relative"), None, "hold")
    aligned = align_tags([series("PV", np.arange(N)), mode])
    assert aligned.values[1] is None
    assert aligned.rows[1].tolist() == [0] * 100 + [1] * (N - 100)


def test_of_two_values_at_one_moment_the_last_counts():
    op = series("OP", [*range(50), *range(49, N)], [*range(50), 99.0, *range(50, N)])
    aligned = align_tags([series("PV", np.arange(N)), op])
    assert aligned.values[1][49] == 99.0
    assert any(
        "1 value of OP with the same time stamp as the next value, which differs" in note for note in aligned.notes
    )


def test_rounded_stamps_of_each_tag_are_spread():
    t = np.floor(10.0 * np.arange(120) / 60.0) * 60.0
    aligned = align_tags([series("PV", t, np.arange(120)), series("OP", t, np.arange(120))])
    assert aligned.dt == 10.0
    np.testing.assert_array_equal(aligned.values[1], np.arange(120))


def test_the_start_is_the_first_moment():
    begin = (datetime(2026, 2, 1) - datetime(1970, 1, 1)).total_seconds()
    aligned = align_tags(
        [series("PV", begin + np.arange(N), kind="local"), series("OP", begin + np.arange(N), kind="local")]
    )
    assert aligned.start == datetime(2026, 2, 1)


def test_a_clock_with_a_zone_beside_one_without_is_refused():
    tags = [series("PV", 1.7e9 + np.arange(N), kind="utc"), series("OP", 1.7e9 + np.arange(N), kind="local")]
    with pytest.raises(RecordError, match=r"file\.csv: .* different kinds \(local, utc\); .* timezone"):
        align_tags(tags, name="file.csv")


def test_tags_without_a_readable_stamp_are_refused():
    dead = TagSeries("PV", Stamps(np.full(5, np.nan), "local", first_unread=(2, "soon")), np.zeros(5))
    with pytest.raises(RecordError, match=r"file\.csv, line 4: 'soon' is not a known form of time stamp"):
        align_tags([dead], name="file.csv", first_line=2)
