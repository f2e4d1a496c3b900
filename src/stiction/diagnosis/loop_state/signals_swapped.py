"""Swapped signals: the columns named OP and PV hold PV and OP."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.quantiles import robust_std

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["PIFit", "are_signals_swapped", "fit_pi_equation"]


@dataclass(frozen=True, slots=True)
class PIFit:
    """A PI or PID equation fitted to the increments of the output."""

    unexplained: float
    """Variance of the increments that is not explained, by the median, over their variance [-]."""
    gain: float
    """Proportional gain on the error [output unit per input unit]; of either sign."""
    integral_samples: float
    """Integral time [samples]."""
    set_point: float
    """Set point for which the increments are zero [input unit]; NaN when SP was given."""


def fit_pi_equation(
    output: NDArray[np.float64], measured: NDArray[np.float64], sp: NDArray[np.float64] | None = None
) -> PIFit | None:
    """Fit a PID equation that computes `output` from `measured` and SP; None when there is too little to fit.

    Examples
    --------
    >>> import numpy as np
    >>> pv = np.random.default_rng(1).normal(size=200)
    >>> fit = fit_pi_equation(0.5 * (-pv + np.cumsum(-pv) / 10.0), pv)
    >>> round(fit.gain, 3), round(fit.integral_samples, 1)
    (0.5, 10.0)
    """
    if output.size < 60:
        return None
    error = -measured if sp is None else sp - measured
    columns = [np.diff(error)[1:], error[2:], np.diff(error, 2)]
    if sp is not None and np.nanmax(sp) > np.nanmin(sp):
        columns += [np.diff(measured)[1:], np.diff(measured, 2)]
    design, increments = np.array(columns), np.diff(output)[1:]
    known = np.isfinite(increments) & np.isfinite(design).all(axis=0)
    if not known.all():
        design, increments = design[:, known], increments[known]
    if increments.size < 60 or not np.any(increments):
        return None
    means, variance = design.mean(axis=1, keepdims=True), float(increments.var())
    design -= means
    sizes = np.maximum(design.std(axis=1), 1e-150)
    products = np.einsum("ik,jk->ij", design, design) / np.outer(sizes, sizes)
    moves = increments - increments.mean()
    weights = np.linalg.pinv(products, hermitian=True) @ (np.einsum("ik,k->i", design, moves) / sizes) / sizes
    unexplained = robust_std(moves - weights @ design, centre=0.0) ** 2 / variance if variance > 0.0 else 1.0
    gain, integral = float(weights[0]), float(weights[1])
    constant = float(increments.mean() - weights @ means[:, 0])
    set_point = constant / integral if sp is None and integral else np.nan
    return PIFit(unexplained, gain, gain / integral if integral else np.inf, set_point)


def are_signals_swapped(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    sp: NDArray[np.float64] | None = None,
    *,
    max_unexplained: float = 1e-4,
    min_ratio: float = 300.0,
    min_integral_samples: float = 1.5,
) -> tuple[float, float] | None:
    """Say whether the column named PV is the output of a controller that measures the column named OP.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        The columns as they are named [their units]; NaN is missing.
    sp : ndarray, shape (n_samples,), optional
        Set point [unit of one of them].
    max_unexplained : float
        Largest share of the increments that the equation of a controller leaves unexplained [-].
    min_ratio : float
        Smallest ratio of the unexplained shares, as named over the other way round [-].
    min_integral_samples : float
        Shortest integral time of a controller [samples].

    Returns
    -------
    (float, float) or None
        Unexplained share as named, and the other way round [-]; None when the columns are not surely swapped.

    Notes
    -----
    A controller computes OP from PV and SP, noise included, so its equation leaves next to nothing unexplained. The
    process adds loads and noise of its own: no such equation computes PV from OP. A pure integrator does so too, but
    with an integral time of about one sample. Where both directions hold, as for a proportional controller, the
    columns are left as they are.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(1)
    >>> pv = np.convolve(rng.normal(size=500), np.ones(9) / 9.0, "same") + 0.1 * rng.normal(size=500)
    >>> op = 40.0 - 0.5 * (pv + np.cumsum(pv) / 20.0)
    >>> are_signals_swapped(op, pv) is None, are_signals_swapped(pv, op) is None
    (True, False)
    """
    if sp is not None and (np.array_equal(sp, pv, equal_nan=True) or np.array_equal(sp, op, equal_nan=True)):
        sp = None  # a set point that follows another column would explain that column
    other = fit_pi_equation(pv, op, sp)
    if other is None or other.unexplained > max_unexplained:
        return None
    named = fit_pi_equation(op, pv, sp)
    if named is None or named.unexplained < max(min_ratio * other.unexplained, max_unexplained):
        return None
    is_controller = other.integral_samples > min_integral_samples
    return (named.unexplained, other.unexplained) if is_controller else None
