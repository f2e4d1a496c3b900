"""How sure S and J are: the profile likelihood of one stretch, and the spread from stretch to stretch."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.grid import Surface
    from stiction.diagnosis.identification.piece import Piece

__all__ = ["CHI2_1", "CHI2_2", "FLOOR", "MODEL_ERROR", "NORMAL", "independent_samples", "interval", "limit", "student"]

CHI2_1, CHI2_2 = 3.841, 5.991
"""95 % points of the chi-square distribution with one and two degrees of freedom."""
NORMAL = 1.95996
"""97.5 % point of the normal distribution."""
STUDENT = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)
"""97.5 % points of Student's distribution with one to ten degrees of freedom."""
MODEL_ERROR = 0.002
"""Share of the PV's energy that a process of two lags and a sampled stem may leave however good the data are [-]."""
FLOOR = 0.01
"""Half width below which no interval goes, as a share of S, or of J / S by the dense search [-]; what `contest` counts
of intervals that hold the truth is with it."""


def interval(pieces: Sequence[Piece], chosen: int, axis: int) -> tuple[float, float]:
    """95 % interval of S [% of span] (axis 0) or of J / S [-] (axis 1).

    Parameters
    ----------
    pieces : sequence of Piece
        The stretches searched.
    chosen : int
        The stretch whose valve is reported.
    axis : int
        0 for S, 1 for J / S.

    Returns
    -------
    tuple of float
        Lower and upper end: those of the chosen stretch's profile likelihood or, where that is wider and there
        are three stretches or more, of Student's interval about the estimates of all.
    """
    piece = pieces[chosen]
    value = piece.valve[axis]
    samples = independent_samples(piece, piece.simulated())
    low, high = _interval(piece.dense, limit(piece.error, samples, CHI2_1), axis)
    shrink = 1.0 / np.sqrt(len(pieces))
    below, above = (value - low) * shrink, (high - value) * shrink
    if len(pieces) > 2:
        values = np.array([one.valve[axis] for one in pieces])
        spread = max(1.4826 * float(np.median(np.abs(values - np.median(values)))), 0.25 * float(values.std()))
        width = student(len(pieces) - 1) * spread * shrink
        below, above = max(below, width), max(above, width)
    least = FLOOR * (value if axis == 0 else 1.0)
    return max(value - max(below, least), 0.0), value + max(above, least)


def student(degrees: int) -> float:
    """97.5 % point of Student's distribution; beyond ten degrees of freedom by its expansion about the normal one.

    Examples
    --------
    >>> student(1), round(student(17), 2), round(student(1000), 2)
    (12.706, 2.11, 1.96)
    """
    z = NORMAL
    if degrees <= len(STUDENT):
        return STUDENT[degrees - 1]
    return z + (z**3 + z) / (4.0 * degrees) + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * degrees**2)


def limit(error: float, samples: float, chi2: float) -> float:
    """Error below which a parameter lies in the likelihood region of `samples` independent samples."""
    return max(error * float(np.exp(chi2 / max(samples, 1.0))), error + MODEL_ERROR)


def independent_samples(piece: Piece, simulated: NDArray[np.float64]) -> float:
    """Independent samples in what the best valve leaves [-], at most a slip each way for each period.

    Parameters
    ----------
    piece : Piece
        A stretch searched.
    simulated : ndarray, shape of `target`
        Answer of its process to its stem, as `Piece.simulated` gives it [PV units].

    Returns
    -------
    float
        Their number.
    """
    signals = piece.signals
    inside = slice(signals.half, signals.target.size - signals.half)
    by_residual = _independent((signals.target - simulated)[inside])
    return min(by_residual, 2.0 * signals.target.size / signals.scale)


def _independent(residual: NDArray[np.float64]) -> float:
    """Number of independent samples in a residual, from its autocorrelation up to the first zero."""
    n = residual.size
    x = residual - residual.mean()
    spectrum = np.fft.rfft(x, 2 * n)
    acf = np.fft.irfft(spectrum.real**2 + spectrum.imag**2)[:n]
    if acf[0] <= 0.0:
        return float(n)
    acf = acf / acf[0]
    below = np.flatnonzero(acf <= 0.0)
    end = int(below[0]) if below.size else n
    return n / (1.0 + 2.0 * float(acf[1:end].sum()))


def _interval(surface: Surface, limit: float, axis: int) -> tuple[float, float]:
    """Ends of the profile likelihood interval over S (axis 0) or J / S (axis 1), between the grid's points."""
    knots = surface.S if axis == 0 else surface.ratio
    profile = surface.error.min(axis=1 - axis)
    inside = np.flatnonzero(profile <= limit)
    if inside.size == 0:
        best = knots[int(profile.argmin())]
        return float(best), float(best)
    first, last = int(inside[0]), int(inside[-1])
    low, high = float(knots[first]), float(knots[last])
    if first > 0:
        share = (limit - profile[first]) / (profile[first - 1] - profile[first])
        low -= float(share * (knots[first] - knots[first - 1]))
    if last < knots.size - 1:
        share = (limit - profile[last]) / (profile[last + 1] - profile[last])
        high += float(share * (knots[last + 1] - knots[last]))
    return low, high
