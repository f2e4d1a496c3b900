"""The simplex search against SciPy's, evaluation by evaluation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize, rosen

from stiction.diagnosis.identification.simplex_search import simplex_search


def kinks(x):
    return float(np.abs(x - 0.3).sum() + 0.5 * np.abs(np.sin(7.0 * x)).sum())


def steps(x):
    return float(np.round(x, 1) @ np.round(x, 1))


@pytest.mark.parametrize("function", [rosen, kinks, steps])
@pytest.mark.parametrize("n", [1, 2, 3, 5])
@pytest.mark.parametrize("evaluations", [20, 33, 50, 2000])
def test_search_is_that_of_scipy(function, n, evaluations):
    def recorded(calls):
        return lambda x: calls.append(x.tolist()) or function(np.append(x, 1.0))

    for seed in range(5):
        simplex = np.random.default_rng(seed).normal(size=(n + 1, n))
        ours, theirs = [], []
        point, error = simplex_search(recorded(ours), simplex, evaluations, 1e-3, 1e-6)
        expected = minimize(
            recorded(theirs), simplex[0], method="Nelder-Mead",
            options={"initial_simplex": simplex, "maxfev": evaluations, "xatol": 1e-3, "fatol": 1e-6},
        )  # fmt: skip
        assert ours == theirs
        assert (point.tolist(), error) == (expected.x.tolist(), expected.fun)
