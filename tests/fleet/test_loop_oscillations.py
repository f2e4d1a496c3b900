"""Envelopes, harmonics, delays: against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter, sawtooth

from stiction.fleet import common_clock, make_block_means
from stiction.fleet.coherence import coherence_floor, coherence_matrix, link_coherent
from stiction.fleet.loop_oscillations import complex_envelope, find_loop_oscillations
from stiction.fleet.root_features import arrival_order, harmonics_share
from stiction.records import LoopRecord

T = np.arange(4000)


def wandering_phase(period: float, seed: int, n: int = 4000, spread: float = 0.3) -> np.ndarray:
    return np.cumsum(2 * np.pi / period * (1.0 + spread * np.random.default_rng(seed).standard_normal(n)))


@pytest.mark.parametrize("period", [12.0, 40.3, 111.0])
def test_envelope_has_amplitude_and_phase(period):
    harmonic = 0.5 * np.cos(3 * 2 * np.pi * T / period)
    envelope = complex_envelope(2.0 * np.cos(2 * np.pi * T / period + 0.7) + harmonic + 0.01 * T, period)
    np.testing.assert_allclose(np.abs(envelope), 2.0, rtol=0.03)
    np.testing.assert_allclose(np.angle(envelope), 0.7, atol=0.03)


def test_envelope_needs_two_windows():
    assert complex_envelope(T[:200].astype(float), 40.0).size == 0


@pytest.mark.parametrize(("shape", "share"), [(1.0, None), (0.5, 1 / 81 + 1 / 625 + 1 / 2401)])
def test_harmonics_share_of_triangle_and_square(shape, share):
    if share is None:
        wave, share = np.sign(np.sin(2 * np.pi * (T + 0.5) / 100)), 1 / 9 + 1 / 25 + 1 / 49
    else:
        wave = sawtooth(2 * np.pi * T / 100, width=shape)
    assert harmonics_share(wave, 100.0) == pytest.approx(share, rel=0.03)


def test_noise_has_no_harmonics():
    noise = np.random.default_rng(0).normal(0.0, 0.3, T.size)
    assert harmonics_share(np.sin(2 * np.pi * T / 40) + noise, 40.0) < 0.02


@pytest.mark.parametrize("gain", [1.0, -2.0])
def test_arrival_order_is_the_group_delay_of_a_lag(gain):
    """A first-order lag delays the changes of a wave by tau / (1 + (omega tau)^2)."""
    period, tau = 60.0, 10.0
    wave = np.sin(wandering_phase(period, seed=3, n=20000, spread=1.0))
    pole = np.exp(-1.0 / tau)
    late = gain * lfilter([1.0 - pole], [1.0, -pole], np.concatenate([np.zeros(7), wave[:-7]]))
    delay = float(np.diff(arrival_order([(wave, 1.0), (late, 1.0)], period))[0])
    expected = (7.0 + tau / (1.0 + (2 * np.pi / period * tau) ** 2)) / period
    assert delay == pytest.approx(expected, abs=0.03)


def test_arrival_order_of_a_steady_wave_is_unknown():
    wave = np.sin(2 * np.pi * T / 40)
    assert np.isnan(arrival_order([(wave, 1.0), (np.roll(wave, 5), 1.0)], 40.0)).all()


def test_floor_is_that_of_noise():
    """Coherence of K independent envelopes: P(|C| > x) = (1 - x^2)^(K - 1)."""
    rng = np.random.default_rng(1)
    noise = rng.normal(size=(40, 50)) + 1j * rng.normal(size=(40, 50))
    noise /= np.linalg.norm(noise, axis=1, keepdims=True)
    floors = [coherence_floor(noise, np.random.default_rng(k)) for k in range(20)]
    assert np.mean(floors) == pytest.approx(np.sqrt(1.0 - 0.05 ** (1.0 / 49.0)), rel=0.1)


def test_linkage_finds_two_blocks():
    coherence = np.full((5, 5), 0.2)
    coherence[:2, :2] = coherence[2:, 2:] = 0.9
    assert sorted(cluster.tolist() for cluster in link_coherent(coherence, 0.6)) == [[0, 1], [2, 3, 4]]
    assert link_coherent(np.full((3, 3), 0.2), 0.6) == []


def test_coherence_does_not_depend_on_size_and_phase():
    wave = np.sin(wandering_phase(40.0, seed=0))
    envelopes = np.array([complex_envelope(x, 40.0) for x in (wave, -3.0 * np.roll(wave, 5))])
    envelopes /= np.linalg.norm(envelopes, axis=1, keepdims=True)
    assert coherence_matrix(envelopes)[0, 1] > 0.95


@pytest.mark.parametrize("period", [40.0, 150.0, 700.0])
def test_period_of_a_loop_with_noise(period):
    """Fast part and block means find the same periods as the wave has, and noise has none."""
    t = 5.0 * np.arange(17280)
    noise = np.random.default_rng(0).normal(0.0, 0.5, (2, t.size))
    pv = 30.0 + np.sign(np.sin(2 * np.pi * t / period)) + noise[0]
    one = LoopRecord("FIC-1", 5.0, op=50.0 + noise[1], pv=pv, sp=np.full(t.size, 30.0))
    found = [row for row in find_loop_oscillations(make_block_means(one, common_clock([one]))) if row.regular]
    assert [row.period for row in found] == pytest.approx([period], rel=0.01)
    assert found[0].signal == "error"
