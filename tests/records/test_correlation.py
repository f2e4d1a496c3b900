"""Lagged products against numpy's direct sum, and phase means against signals whose mean cycle is known."""

import numpy as np
import pytest

from stiction.diagnosis.oscillation.phase_average import average_by_phase
from stiction.records.correlation import lagged_products


@pytest.mark.parametrize(("n", "lags"), [(50, 50), (51, 7), (3000, 40), (9000, 9000), (20_000, 300)])
def test_lagged_products_are_the_direct_sum(n, lags):
    rng = np.random.default_rng(n)
    x, y = rng.normal(size=n), np.cumsum(rng.normal(size=n))
    scale = np.linalg.norm(x) * np.linalg.norm(y)
    direct = [float(x[: n - lag] @ y[lag:]) for lag in range(lags)]
    assert np.abs(lagged_products(x, y, lags) - direct).max() < 1e-12 * scale
    own = [float(x[: n - lag] @ x[lag:]) for lag in range(lags)]
    assert np.abs(lagged_products(x, x, lags) - own).max() < 1e-12 * float(x @ x)


def test_means_of_a_wave_of_steps_are_its_steps():
    """Four levels of 25 samples each: with 48 bins of 100 samples every bin but those at an edge holds one level."""
    levels = np.tile(np.repeat([1.0, 4.0, -2.0, -3.0], 25), 12)
    found = average_by_phase(levels, np.sin(2.0 * np.pi * (np.arange(levels.size) + 0.5) / 100.0), 100.0)
    assert found.n_cycles == 10
    assert found.means.size == 48
    for level, first in zip((1.0, 4.0, -2.0, -3.0), range(0, 48, 12), strict=True):
        assert found.means[first + 1 : first + 11] == pytest.approx(level)
    assert found.values()[(found.phase > 0.05) & (found.phase < 0.2)] == pytest.approx(1.0)


def test_cycles_of_unusual_length_are_left_out():
    t = np.concatenate([np.arange(0.0, 10.0, 0.01), 10.0 + np.arange(0.0, 1.0, 0.04), 11.0 + np.arange(0.0, 5.0, 0.01)])
    wave = np.sin(2.0 * np.pi * (t + 0.003))
    found = average_by_phase(wave, wave, 100.0)
    fast = np.flatnonzero((t > 10.02) & (t < 10.98))
    assert not np.isin(fast, found.inside).any()
    assert found.n_cycles >= 12


def test_a_signal_without_cycles_has_no_mean_cycle():
    found = average_by_phase(np.ones(50), -np.ones(50), 10.0)
    assert found.n_cycles == 0
    assert found.inside.size == 0
    assert not found.means.any()
