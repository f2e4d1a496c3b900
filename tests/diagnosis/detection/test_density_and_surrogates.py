"""Horch's histogram and the surrogate test: what each says of signals whose nature is known."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.diagnosis.detection.horch_histogram import camel_index
from stiction.diagnosis.detection.nonlinearity import nonlinearity_index, surrogates


def test_histogram_tells_a_sine_from_noise_and_from_spikes():
    rng = np.random.default_rng(0)
    t = np.arange(4000)
    sine = np.sin(2 * np.pi * t / 61)
    assert camel_index(sine) < 0.3
    assert camel_index(sine + 0.2 * rng.standard_normal(4000)) < 0.3
    assert camel_index(rng.standard_normal(4000)) > 0.7
    spikes = np.where(t % 50 == 0, np.where(t % 100 == 0, 1.0, -1.0), 0.0)
    assert camel_index(np.convolve(spikes, np.hanning(9), "same") + 0.02 * rng.standard_normal(4000)) > 0.6


def test_surrogates_keep_the_spectrum_and_nothing_else():
    x = np.random.default_rng(0).standard_normal(101) ** 3
    made = surrogates(x, 5, 1)
    np.testing.assert_allclose(np.abs(np.fft.rfft(made)), np.abs(np.fft.rfft(x))[None, :].repeat(5, 0), atol=1e-9)
    assert np.abs(np.corrcoef(np.vstack([x, made]))[0, 1:]).max() < 0.5
    np.testing.assert_array_equal(made, surrogates(x, 5, 1))


@pytest.fixture(scope="module")
def resonances():
    """Forty noisy linear resonances of about ten samples a period."""
    rng = np.random.default_rng(0)
    made, radius, turn = [], 0.97, 2 * np.pi / 10
    for _ in range(40):
        x, drive = np.zeros(520), rng.standard_normal(520)
        for k in range(2, 520):
            x[k] = 2 * radius * np.cos(turn) * x[k - 1] - radius**2 * x[k - 2] + drive[k]
        made.append(x[200:])
    return made


@pytest.fixture(scope="module")
def relays():
    """Forty square waves of ten samples a period, give or take 15 %, with noise."""
    rng = np.random.default_rng(1)
    made = []
    for _ in range(40):
        ends = np.concatenate(([0.0], np.cumsum(10 * np.exp(0.15 * rng.standard_normal(80)))))
        phase = np.interp(np.arange(320), ends, np.arange(81)) % 1.0
        made.append(np.where(phase < 0.5, 1.0, -1.0) + 0.2 * rng.standard_normal(320))
    return made


def test_surrogate_test_seldom_accuses_a_linear_loop(resonances):
    assert np.mean([nonlinearity_index(x, 10) > 1.0 for x in resonances]) <= 0.15


def test_surrogate_test_mostly_finds_a_relay(relays):
    assert np.mean([nonlinearity_index(x, 10) > 1.0 for x in relays]) >= 0.6
