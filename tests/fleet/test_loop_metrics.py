"""Numbers of a loop: against closed forms."""

from __future__ import annotations

import json

import numpy as np
import pytest

from stiction.errors import ParameterError
from stiction.fleet import compute_priority, loop_metrics
from stiction.records import LoopRecord

N = 7200
WAVE = np.sin(2 * np.pi * np.arange(N) / 60)


def record(**changes) -> LoopRecord:
    signals = {"op": 50.0 + 2.0 * WAVE, "pv": 30.0 + 4.0 * WAVE, "sp": np.full(N, 30.0), **changes}
    return LoopRecord("FIC-101", 1.0, **signals)


def test_sine_has_its_closed_forms():
    """Mean of |sin| is 2 / pi, its deviation 1 / sqrt(2); a path of 4 amplitudes and 2 reversals in each period."""
    metrics = loop_metrics(record(), span=(0.0, 200.0))
    assert metrics.error_mean_absolute == pytest.approx(2.0 * 2.0 / np.pi, rel=1e-3)
    assert metrics.variability == pytest.approx(2.0 / np.sqrt(2.0), rel=1e-3)
    assert metrics.valve_travel_per_day == pytest.approx(4 * 2.0 * 1440, rel=2e-3)
    assert metrics.reversals_per_day == pytest.approx(2 * 1440, rel=0.01)


def test_small_moves_are_no_reversals():
    assert loop_metrics(record(op=50.0 + 0.2 * WAVE)).reversals_per_day == 0.0


@pytest.mark.parametrize("noise", [0.2, 0.5])
def test_noise_makes_no_reversals(noise):
    """120 periods reverse 240 times in two hours, however noisy OP is."""
    op = 50.0 + 4.0 * WAVE + np.random.default_rng(3).normal(0.0, noise, N)
    assert loop_metrics(record(op=op)).reversals_per_day == pytest.approx(2 * 1440, rel=0.02)


def test_position_counts_where_it_is_recorded():
    assert loop_metrics(record(mv=50.0 + WAVE)).valve_travel_per_day == pytest.approx(4 * 1440, rel=2e-3)


def test_modes_and_limits_are_shares_of_time():
    auto = np.arange(N) >= N // 4
    op = np.where(np.arange(N) >= N // 2, 100.0, 50.0 + 2.0 * WAVE)
    metrics = loop_metrics(record(auto=auto, op=op))
    assert (metrics.automatic_share, metrics.manual_share) == (0.75, 0.25)
    assert metrics.saturated_share == pytest.approx(0.5, abs=0.01)
    assert metrics.severity_parts["not in automatic"] == pytest.approx(0.125)


def test_what_is_unknown_is_none():
    row = json.loads(json.dumps(loop_metrics(record()).to_dict()))
    assert row["variability"] is None
    assert row["automatic_share"] is None
    assert row["severity_parts"]["error"] == 0.0


def test_severity_joins_its_parts():
    metrics = loop_metrics(record(), span=(0.0, 100.0), oscillation_index=0.5, reversals_limit=2880.0)
    error = 1.0 - np.exp(-metrics.variability / 5.0)
    wear = 1.0 - np.exp(-metrics.reversals_per_day / 2880.0)
    assert metrics.severity == pytest.approx(1.0 - (1.0 - error) * 0.5 * (1.0 - wear))
    assert 0.0 <= loop_metrics(record(op=np.full(N, 50.0), pv=np.full(N, 30.0))).severity < 1e-9


def test_missing_samples_are_counted_and_bridged():
    op = 50.0 + 2.0 * WAVE
    op[100:172] = np.nan
    metrics = loop_metrics(record(op=op))
    assert metrics.missing_share == pytest.approx(0.01)
    assert np.isfinite(metrics.valve_travel_per_day)


def test_priority_is_a_product():
    assert compute_priority(0.5, 0.5, 3.0) == 0.75
    with pytest.raises(ParameterError, match="confidence"):
        compute_priority(0.5, 1.5)


@pytest.mark.parametrize("options", [{"span": (5.0, 5.0)}, {"min_move": 0.0}, {"error_limit": -1.0}])
def test_limits_are_refused(options):
    with pytest.raises(ParameterError):
        loop_metrics(record(), **options)
