"""OP and PV stored at two rates are seen."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from stiction.records.quality.storage_rate import SlowerSignal, find_slower_signal, find_stored_samples


def held(x, every, first):
    """Each value held until the next one is stored."""
    k = np.arange(x.size)
    return x[np.maximum(k - (k - first) % every, 0)]


@given(
    every=some.integers(2, 9), first=some.integers(0, 8), name=some.sampled_from(["op", "pv"]), seed=some.integers(0, 9)
)  # fmt: skip
def test_the_one_that_is_held_is_found(every, first, name, seed):
    first %= every
    signals = dict(zip(("op", "pv"), np.random.default_rng(seed).normal(size=(2, 40 * every)), strict=True))
    slow = held(signals[name], every, first)
    assert find_slower_signal(**signals | {name: slow}) == SlowerSignal(name.upper(), every, first)
    assert find_slower_signal(**{one: x[first::every] for one, x in signals.items()}) is None


@pytest.mark.parametrize("name", ["op", "pv"])
@pytest.mark.parametrize("every", [2, 5, 10])
@pytest.mark.parametrize("missing", [0.05, 0.15])
def test_missing_values_hide_no_rate(name, every, missing):
    rng = np.random.default_rng(3)
    signals = dict(zip(("op", "pv"), rng.normal(size=(2, 200 * every)), strict=True))
    signals |= {name: held(signals[name], every, 1)}
    for x in signals.values():
        x[rng.random(x.size) < missing] = np.nan
    assert find_slower_signal(**signals) == SlowerSignal(name.upper(), every, 1)


def test_a_coarse_value_is_stored_again_as_it_was():
    rng = np.random.default_rng(5)
    pv = np.round(rng.normal(size=3000).cumsum() / 20.0)
    assert find_slower_signal(rng.normal(size=3000), held(pv, 5, 2)) == SlowerSignal("PV", 5, 2)


def test_a_coarse_value_that_rests_at_times_has_no_rate():
    rng = np.random.default_rng(4)
    for step in (0.5, 1.0, 2.0):
        assert find_slower_signal(rng.normal(size=3000), np.round(rng.normal(size=3000).cumsum() / step) * step) is None


@pytest.mark.parametrize("change", [lambda x: x, lambda x: np.full(x.size, x[0])])
def test_what_is_stored_equally_often_or_rests_stays(change):
    op, pv = np.random.default_rng(1).normal(size=(2, 300))
    assert find_slower_signal(op, change(pv)) is None


def test_both_held_alike_are_no_two_rates():
    op, pv = np.random.default_rng(2).normal(size=(2, 300))
    assert find_slower_signal(held(op, 5, 0), held(pv, 5, 0)) is None


def lines(x, at):
    """Straight lines between the values at some samples."""
    return np.interp(np.arange(x.size), at, x[at])


@given(seed=some.integers(0, 2**16), name=some.sampled_from(["op", "pv"]), decimals=some.sampled_from([None, 3]))
def test_what_is_drawn_as_lines_was_stored_at_their_ends(seed, name, decimals):
    rng = np.random.default_rng(seed)
    signals = dict(zip(("op", "pv"), rng.normal(size=(2, 400)).cumsum(axis=1), strict=True))
    at = np.unique([0, 399, *rng.choice(399, 80)])
    x = lines(signals[name], at)
    signals[name] = x if decimals is None else np.round(x, decimals)
    found = np.flatnonzero(getattr(find_stored_samples(**signals), name))
    assert set(found) <= set(at)
    assert len(found) >= 0.9 * at.size
    assert getattr(find_stored_samples(**signals), "pv" if name == "op" else "op").all()


def resting(x, at):
    """Each value held until the next one is stored."""
    return np.repeat(x[np.concatenate([[0], at])], np.diff([0, *at, x.size]))


def test_a_pv_that_rests_was_stored_where_it_is_new_and_an_op_that_rests_may_do_so_itself():
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 300)).cumsum(axis=1)
    at, other = (np.sort(rng.choice(np.arange(1, 300), 90, replace=False)) for _ in range(2))
    kept = find_stored_samples(y, resting(x, at))
    np.testing.assert_array_equal(np.flatnonzero(kept.pv), [0, *at])
    assert kept.op.all()
    assert all(one.all() for one in find_stored_samples(resting(x, at), y))
    both = find_stored_samples(resting(y, other), resting(x, at))
    np.testing.assert_array_equal(np.flatnonzero(both.op), [0, *other])
    np.testing.assert_array_equal(np.flatnonzero(both.pv), [0, *at])


def test_two_that_rest_together_were_repeated():
    rng = np.random.default_rng(2)
    x, y = rng.normal(size=(2, 300)).cumsum(axis=1)
    at = np.sort(rng.choice(np.arange(1, 300), 250, replace=False))
    assert all(one.all() for one in find_stored_samples(resting(x, at), resting(y, at)))


def test_missing_values_are_not_stored_and_lines_next_to_them_count():
    rng = np.random.default_rng(3)
    x, y = rng.normal(size=(2, 300)).cumsum(axis=1)
    gone = rng.random(300) < 0.2
    kept = find_stored_samples(np.where(gone, np.nan, x), y)
    np.testing.assert_array_equal(kept.op, ~gone)
    assert kept.pv.all()


def test_coarse_signal_held_evenly_is_stored_at_every_interval():
    rng = np.random.default_rng(5)
    pv = np.round(rng.normal(size=3000).cumsum() / 20.0)
    kept = find_stored_samples(rng.normal(size=3000), held(pv, 5, 2))
    np.testing.assert_array_equal(np.flatnonzero(kept.pv), np.arange(2, 3000, 5))


def test_a_coarse_signal_rests_by_itself():
    rng = np.random.default_rng(3)
    x, y = rng.normal(size=(2, 2000)).cumsum(axis=1)
    for step in (1.0, 2.0, 4.0):
        assert find_stored_samples(y, np.round(x / step) * step).pv.all()
