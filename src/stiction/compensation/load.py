"""A random load: white noise behind a first-order lag."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["first_order"]


def first_order(rng: np.random.Generator, n: int, lag: float) -> NDArray[np.float64]:
    """Draw a load of standard deviation 1.

    Parameters
    ----------
    rng : numpy.random.Generator
        What draws it.
    n : int
        Number of samples [-].
    lag : float
        Time constant [samples].

    Returns
    -------
    ndarray, shape (n,)
        The load.
    """
    from scipy.signal import lfilter

    keep = float(np.exp(-1.0 / lag))
    white = rng.normal(0.0, np.sqrt(1.0 - keep * keep), n)
    out, _ = lfilter([1.0], [1.0, -keep], white, zi=[keep * float(rng.normal())])
    return np.asarray(out, dtype=np.float64)
