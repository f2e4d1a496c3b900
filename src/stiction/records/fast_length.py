"""Lengths whose Fourier transform is fast: a large prime factor makes it ten times as slow."""

from __future__ import annotations

from functools import lru_cache

__all__ = ["next_fast_length", "previous_fast_length"]

ODD = tuple(3**threes * 5**fives for threes in range(6) for fives in range(4))
"""Odd parts of the lengths; the rest is a power of two."""


@lru_cache(256)
def next_fast_length(n: int) -> int:
    """Smallest fast length of at least `n` samples."""
    return min(odd << (-(-n // odd) - 1).bit_length() for odd in ODD)


@lru_cache(256)
def previous_fast_length(n: int) -> int:
    """Largest fast length of at most `n` samples."""
    return max(odd << ((n // odd).bit_length() - 1) for odd in ODD if odd <= n)
