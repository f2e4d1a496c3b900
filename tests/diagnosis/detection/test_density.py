"""Horch's histogram: what it says of signals whose density is known."""

from __future__ import annotations

import numpy as np

from stiction.diagnosis.detection.horch_histogram import camel_index


def test_histogram_tells_a_sine_from_noise_and_from_spikes():
    rng = np.random.default_rng(0)
    t = np.arange(4000)
    sine = np.sin(2 * np.pi * t / 61)
    assert camel_index(sine) < 0.3
    assert camel_index(sine + 0.2 * rng.standard_normal(4000)) < 0.3
    assert camel_index(rng.standard_normal(4000)) > 0.7
    spikes = np.where(t % 50 == 0, np.where(t % 100 == 0, 1.0, -1.0), 0.0)
    assert camel_index(np.convolve(spikes, np.hanning(9), "same") + 0.02 * rng.standard_normal(4000)) > 0.6
