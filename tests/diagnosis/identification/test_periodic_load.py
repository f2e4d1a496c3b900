"""Periods and harmonics against known waves and NumPy's least squares."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.diagnosis.identification.periodic_load import fundamental_period, remove_harmonics

K = np.arange(900)


@pytest.mark.parametrize("period", [23.7, 41.3, 60.0])
@pytest.mark.parametrize("off", [0.9, 1.0, 1.1])
def test_the_period_of_a_square_wave_in_noise_is_found(period, off):
    wave = np.sign(np.sin(2.0 * np.pi * K / period)) + 0.3 * np.random.default_rng(0).normal(size=K.size)
    assert fundamental_period(wave - wave.mean(), off * period, 5) == pytest.approx(period, rel=5e-3)


def test_the_period_lies_in_the_range_searched():
    wave = np.sin(2.0 * np.pi * K / 100.0)
    found = fundamental_period(wave, 30.0, 2)
    assert 0.8 * 30.0 <= found <= 1.25 * 30.0


def test_what_is_left_is_what_least_squares_leaves():
    signals = np.random.default_rng(1).normal(size=(3, K.size)) + np.sin(2.0 * np.pi * K / 37.0)
    design = [np.ones(K.size)]
    for harmonic in range(1, 5):
        design += [np.cos(2.0 * np.pi * harmonic * K / 37.0), np.sin(2.0 * np.pi * harmonic * K / 37.0)]
    design = np.array(design).T
    expected = signals.T - design @ np.linalg.lstsq(design, signals.T, rcond=None)[0]
    np.testing.assert_allclose(remove_harmonics(signals, 37.0, 4), expected.T, atol=1e-9)
