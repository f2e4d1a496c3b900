"""Random-effects meta-analysis against an independent calculation."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.diagnosis.evidence.sizes import pool_estimates


def test_log_odds_ratios_of_the_bcg_trials():
    """Colditz et al. (1994): estimate -0.7141 and its interval by DerSimonian and Laird, as metafor prints them."""
    y = [-0.8893, -1.5854, -1.3481, -1.4416, -0.2175, -0.7861, -1.6209, 0.0120, -0.4694, -1.3713, -0.3394, 0.4459,
         -0.0173]  # fmt: skip
    variance = [0.3256, 0.1946, 0.4154, 0.0200, 0.0512, 0.0069, 0.2230, 0.0040, 0.0564, 0.0730, 0.0124, 0.5325, 0.0714]
    found = pool_estimates(
        np.array(y), np.sqrt(np.array(variance)), np.ones(13), shared_error=0.0, scale=1.0
    )  # fmt: skip
    assert found.value == pytest.approx(-0.7141, abs=0.003)
    assert found.low == pytest.approx(-1.0644, abs=0.01)
    assert found.high == pytest.approx(-0.3638, abs=0.01)


def test_shared_error_stays_however_many_windows():
    many = pool_estimates(np.zeros(1000), np.full(1000, 0.1), np.ones(1000), shared_error=0.2, scale=1.0)
    assert many.high == pytest.approx(1.96 * 0.2, rel=1e-3)
