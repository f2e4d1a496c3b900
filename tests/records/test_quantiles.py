"""Quantiles against numpy's, to the last bit."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from hypothesis.extra.numpy import arrays

from stiction.records.quantiles import quantiles

VALUES = some.floats(-1e9, 1e9) | some.just(math.nan)


@given(arrays(float, some.integers(1, 60), elements=VALUES), some.lists(some.floats(0.0, 1.0), min_size=1, max_size=3))
def test_they_are_numpys(x, shares):
    if np.isnan(x).all():
        assert all(map(math.isnan, quantiles(x, *shares)))
    else:
        assert quantiles(x, *shares) == tuple(np.nanquantile(x, shares).tolist())


def test_the_signal_stays_as_it_is():
    x = np.array([3.0, 1.0, 2.0])
    assert quantiles(x, 0.5) == (2.0,)
    assert x.tolist() == [3.0, 1.0, 2.0]


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_quantile_of_an_empty_signal_is_nan(share):
    assert math.isnan(quantiles(np.empty(0), share)[0])
