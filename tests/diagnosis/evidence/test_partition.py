"""Change points: the recursion against the sum over all partitions, written out."""

from __future__ import annotations

from itertools import groupby, pairwise, product

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from stiction.diagnosis.evidence.partition import Level, find_boundaries

LEVELS = (Level(-1.0, 0.6, 0.5), Level(1.0, 0.8, 0.7))
HAZARD = 0.1


def log_weight(x: np.ndarray, kinds: tuple[int, ...]) -> float:
    """Log probability of a series and of the kind of each place."""
    edges = [0, *(k for k in range(1, len(kinds)) if kinds[k] != kinds[k - 1]), len(kinds)]
    total = np.log(0.5)
    for first, last in pairwise(edges):
        mean, between, within = LEVELS[kinds[first]]
        n = last - first
        covariance = within**2 * np.eye(n) + between**2 * np.ones((n, n))
        known = np.isfinite(x[first:last])
        if known.any():
            part = covariance[np.ix_(known, known)]
            normal = multivariate_normal(np.full(known.sum(), mean), part)  # pyright: ignore[reportArgumentType]
            total += normal.logpdf(x[first:last][known])
        total += (n - 1) * np.log(1.0 - HAZARD) + (np.log(HAZARD) if last < len(kinds) else 0.0)
    return float(total)


def is_long_enough(kinds: tuple[int, ...], shortest: int) -> bool:
    """Whether each run of one kind has some places."""
    return all(len(list(run)) >= shortest for _, run in groupby(kinds))


@pytest.mark.parametrize("shortest", [1, 2])
@pytest.mark.parametrize("seed", range(5))
def test_probability_equals_the_sum_over_all_partitions(seed, shortest):
    rng = np.random.default_rng(seed)
    x = np.concatenate([rng.normal(-1.0, 0.5, 4), rng.normal(1.2, 0.7, 4)])
    x[2] = np.nan if seed % 2 else x[2]
    possible = [kinds for kinds in product((0, 1), repeat=8) if is_long_enough(kinds, shortest)]
    weights = {kinds: np.exp(log_weight(x, kinds)) for kinds in possible}
    total = sum(weights.values())
    best = max(weights, key=lambda kinds: weights[kinds])
    places = [k for k in range(1, 8) if best[k] != best[k - 1]]
    found = find_boundaries([x], [LEVELS], hazard=HAZARD, least=0.0, shortest=shortest)
    assert [one.first for one in found] == places
    for one in found:
        near = [k for k in (one.first - 1, one.first, one.first + 1) if 1 <= k < 8]
        expected = sum(
            weight * sum(kinds[k] == one.kind != kinds[k - 1] for k in near) for kinds, weight in weights.items()
        )
        assert one.probability == pytest.approx(min(expected / total, 1.0), rel=1e-9)


def test_level_series_has_no_change():
    assert find_boundaries([np.full(30, -1.0)], [LEVELS], hazard=HAZARD, least=0.5) == []


def test_one_place_has_no_change():
    assert find_boundaries([np.zeros(1)], [LEVELS], hazard=HAZARD, least=0.0) == []
