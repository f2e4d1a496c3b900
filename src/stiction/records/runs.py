"""Runs of samples: where a mask is true, and where a signal is constant."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["is_rarely_constant", "run_bounds", "run_lengths", "runs", "varies_within"]


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First sample, and one past the last sample, of every run of True."""
    edges = run_bounds(mask).ravel().tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def run_bounds(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The same as `runs`, as an array of shape (n_runs, 2): for masks that may have many runs."""
    padded = np.zeros(mask.size + 2, dtype=bool)
    padded[1:-1] = mask
    return np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2)


def run_lengths(bounds: list[tuple[int, int]] | NDArray[np.int64]) -> NDArray[np.int64]:
    """Samples in each run [-]."""
    bounds = np.asarray(bounds, dtype=np.int64).reshape(-1, 2)
    return bounds[:, 1] - bounds[:, 0]


def is_rarely_constant(
    lengths: NDArray[np.int64], samples: int, *, min_long_run: int = 12, max_share: float = 0.02, max_long_runs: int = 5
) -> bool:
    """Whether constant runs below `min_long_run` take less than `max_share` of all `samples`, and few are longer."""
    short = lengths[lengths < min_long_run].sum()
    return bool(short < max_share * samples and np.count_nonzero(lengths >= min_long_run) <= max_long_runs)


def varies_within(x: NDArray[np.float64] | None, first: int, last: int) -> bool:
    """Whether a signal takes more than two values in a segment and covers over 5 % of its whole range there."""
    if x is None:
        return False
    part = x[first:last]
    part = part[np.isfinite(part)]
    low, high = (part.min(), part.max()) if part.size else (0.0, 0.0)
    if not np.any((part != low) & (part != high)):
        return False
    return float(high - low) > 0.05 * float(np.nanmax(x) - np.nanmin(x))
