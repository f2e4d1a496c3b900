"""How many samples of a residual are independent."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["independent_share"]


def independent_share(residual: NDArray[np.float64]) -> float:
    r"""Share of the samples of a residual that are independent.

    Parameters
    ----------
    residual : ndarray, shape (n_samples,)
        Residual about zero [any unit].

    Returns
    -------
    float
        :math:`1 / (1 + 2 \sum_k \rho_k)`, with the autocorrelation up to its first zero [-].

    Examples
    --------
    >>> white = np.random.default_rng(0).normal(size=5000)
    >>> round(independent_share(white), 1), round(independent_share(np.repeat(white, 5)), 1)
    (1.0, 0.2)
    """
    spectrum = np.fft.rfft(residual, 2 * residual.size)
    acf = np.fft.irfft(spectrum.real**2 + spectrum.imag**2)[: residual.size]
    if not acf[0] > 0.0:
        return 1.0
    negative = np.flatnonzero(acf <= 0.0)
    positive = acf[1 : negative[0] if negative.size else residual.size]
    return 1.0 / (1.0 + 2.0 * float(positive.sum()) / float(acf[0]))
