"""The fitted line against numpy's polynomial of degree one, and far from the origin."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from stiction.records.straight_line import fit_line


@given(some.integers(2, 40), some.integers(0, 2**32 - 1), some.floats(-1e3, 1e3), some.floats(-1e3, 1e3))
def test_it_is_numpys(n, seed, slope, level):
    rng = np.random.default_rng(seed)
    x = np.sort(rng.uniform(-5.0, 5.0, n))
    x[-1] = x[0] + 1.0 + abs(x[-1])
    y = level + slope * x + rng.normal(size=n)
    line = fit_line(x, y)
    assert line.at(x) == pytest.approx(np.polyval(np.polyfit(x, y, 1), x), rel=1e-7, abs=1e-7)
    assert line.slope == pytest.approx(np.polyfit(x, y, 1)[0], rel=1e-6, abs=1e-7)


def test_times_since_1970_do_not_spoil_the_slope():
    t = 1.7e9 + np.arange(100.0)
    line = fit_line(t, 3.0 + 0.25 * (t - 1.7e9))
    assert line.slope == pytest.approx(0.25, rel=1e-12)
    assert float(line.at(np.float64(1.7e9))) == pytest.approx(3.0, abs=1e-9)
