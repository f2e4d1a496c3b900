"""Lengths with a fast Fourier transform, against those of SciPy."""

from __future__ import annotations

import pytest
from scipy.fft import next_fast_len

from stiction.records.correlation import next_fast_length, previous_fast_length


@pytest.mark.parametrize("n", [1, 2, 7, 61, 1009, 43_199, 86_398, 131_073])
def test_lengths_are_fast_and_near(n):
    for found in (above := next_fast_length(n), below := previous_fast_length(n)):
        assert next_fast_len(found, real=True) == found  # no prime factor above 5
    assert below <= n <= above
    assert above - n <= 0.1 * n + 1
    assert n - below <= 0.1 * n + 1
