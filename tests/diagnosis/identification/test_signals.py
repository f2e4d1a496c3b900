"""Block means and local means against plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from stiction.diagnosis.identification.process_fit import remove_local_mean
from stiction.diagnosis.identification.signals import block_signals


@given(n=some.integers(100, 60_000), period=some.one_of(some.none(), some.floats(8.0, 5000.0)))
def test_blocks_are_means_of_the_samples_they_stand_for(n, period):
    op, pv = np.arange(n, dtype=float), np.sin(np.arange(n) / 50.0)
    blocks = block_signals(op, pv, period)
    count = blocks.pv.size
    used = slice(blocks.first, blocks.first + count * blocks.samples)
    assert 0 <= used.start < used.stop <= n
    np.testing.assert_allclose(blocks.pv, pv[used].reshape(count, blocks.samples).mean(axis=1))
    np.testing.assert_allclose(blocks.op, op[used].reshape(count * blocks.per_block, -1).mean(axis=1))
    assert count <= 2000
    assert blocks.per_block <= 8
    assert blocks.period is None if period is None else blocks.period == pytest.approx(period / blocks.samples)


def test_short_records_and_fast_cycles_are_not_averaged():
    x = np.arange(700.0)
    assert block_signals(x, x, None).samples == 1
    assert block_signals(np.arange(50_000.0), np.arange(50_000.0), 20.0).samples == 1


def test_a_long_record_is_used_in_its_middle():
    x = np.arange(20_000.0)
    blocks = block_signals(x, x, 20.0)
    assert blocks.pv.size == 2000
    assert blocks.first == pytest.approx((20_000 - 2000) // 2, abs=1)


def test_a_period_keeps_about_twelve_blocks():
    x = np.arange(86_400.0)
    blocks = block_signals(x, x, 900.0)
    assert 12 <= blocks.period <= 15


@pytest.mark.parametrize("period", [20.0, 31.0])
def test_a_wave_of_the_period_passes_and_constants_and_ramps_vanish(period):
    k = np.arange(600)
    wave = np.sin(2.0 * np.pi * k / period)
    inside = slice(30, -30)
    np.testing.assert_allclose(remove_local_mean(wave + 7.0 + 0.05 * k, period)[inside], wave[inside], atol=0.05)


def test_without_a_period_the_mean_is_removed():
    x = np.random.default_rng(0).normal(size=(2, 50))
    np.testing.assert_allclose(remove_local_mean(x, None), x - x.mean(axis=1, keepdims=True))


def test_the_local_mean_is_a_weighted_mean_over_one_period():
    x = np.random.default_rng(1).normal(size=200)
    k, half = 100, 10
    weights = np.ones(2 * half + 1)
    weights[[0, -1]] = 0.5
    expected = x[k] - float(x[k - half : k + half + 1] @ weights) / 20.0
    assert remove_local_mean(x, 20.0)[k] == pytest.approx(expected)
