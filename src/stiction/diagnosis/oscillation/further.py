"""Further oscillations beside the main one: what is left when the main one is taken off with all its harmonics.

A limit cycle is no sine: its harmonics are regular too, and a search for further peaks of the spectrum would report
them. Here the wave is averaged over its own cycles (time-synchronous averaging): the zero crossings of its fundamental
say when each cycle began, every sample takes its place in the cycle, and the mean over the cycles, place by place, is
the wave. What follows the cycle, harmonics included, is in it, however the period wanders; the rest averages out and
is searched by the same rules.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.oscillation.phase_average import average_by_phase
from stiction.diagnosis.oscillation.rhythm import octave, octaves
from stiction.diagnosis.oscillation.signals import about_drift, smooth
from stiction.diagnosis.result import FurtherOscillation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.oscillation.rhythm import Rhythm

__all__ = ["cycle_average", "further_oscillations"]

LEAST_SHARE = 0.05  # of the error's variance
MOST = 2
APART = 0.15  # periods closer than this to the main one are the same wave, coming and going
IN_TUNE = 0.04  # periods that meet a simple ratio this closely are what a wandering cycle leaves of its harmonics
MAJORITY = 0.5  # autocorrelation one period later: the part of its octave that a sine in noise carries
LASTS = 0.3  # the smaller of its amplitudes in both halves of the record over the larger
HARMONICS = (1.0 / 3.0, 1.0 / 2.0, *np.arange(2.0, 6.0).tolist())


def further_oscillations(
    error: NDArray[np.float64], samples_per_period: float, dt: float
) -> tuple[float, tuple[FurtherOscillation, ...]]:
    """Share of the main oscillation, and the others.

    Parameters
    ----------
    error : ndarray, shape (n_samples,)
        Control error [engineering units].
    samples_per_period : float
        Period of the main oscillation over sampling period [-].
    dt : float
        Sampling period [s].

    Returns
    -------
    share : float
        Share of the error's variance that the main oscillation carries, harmonics included [-].
    others : tuple of FurtherOscillation
        At most two, the larger first.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.diagnosis.oscillation import further_oscillations
    >>> t = np.arange(2000)
    >>> share, others = further_oscillations(np.sin(t * 2 * np.pi / 100) + 0.5 * np.sin(t * 2 * np.pi / 23), 100.0, 1.0)
    >>> round(share, 1), [round(other.period) for other in others]
    (0.8, [23])
    """
    total = float(error.var())
    band, swing = _wave(error, samples_per_period)
    rest = error - _average(swing, band, samples_per_period)
    # Cycles are cut where the error rises; cut where it falls, they leave out other ends of the record.
    falling = error - _average(swing, -band, samples_per_period)
    share = max(0.0, 1.0 - 0.5 * float(rest.var() + falling.var()) / total)
    known, found = [samples_per_period], []
    while len(found) < MOST and float(rest.var()) > LEAST_SHARE * total:
        candidates = [
            (one.power, around, one if all_samples else None)
            for around, one, all_samples in octaves(rest)
            if one.regular and one.height > MAJORITY and not _belongs(one, known)
        ]
        if not candidates:
            break
        _, around, exact = max(candidates, key=lambda one: one[:2])
        best = exact or octave(rest, around)
        if not best.period > 0.0:
            break
        wave = cycle_average(rest, best.period)
        carried = float(rest.var() - (rest - wave).var()) / total
        if carried < LEAST_SHARE or not _lasts(wave, rest):
            break
        found.append(FurtherOscillation(best.period * dt, best.regularity, carried))
        known.append(best.period)
        rest = rest - wave
    found.sort(key=lambda one: -one.share)
    return share, tuple(found)


def cycle_average(x: NDArray[np.float64], samples_per_period: float) -> NDArray[np.float64]:
    """Mean of a signal over its cycles, laid out again along the cycles found.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        Signal without gaps [any unit].
    samples_per_period : float
        Period over sampling period [-].

    Returns
    -------
    ndarray, shape (n_samples,)
        The mean cycle about zero [unit of `x`]; 0 before the first and after the last whole cycle.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.diagnosis.oscillation import cycle_average
    >>> t = np.arange(2000)
    >>> slow, fast = np.sin(2 * np.pi * t / 100), np.sin(2 * np.pi * t / 23)
    >>> mean = cycle_average(slow + fast, 100.0)
    >>> bool(np.std((mean - slow)[200:1800]) < 0.2)
    True
    """
    band, swing = _wave(x, samples_per_period)
    return _average(swing, band, samples_per_period)


def _wave(x: NDArray[np.float64], samples_per_period: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The fundamental, whose zero crossings cut the cycles, and the signal about its drift, shape (n_samples,) each."""
    fundamental = about_drift(smooth(x, samples_per_period / 2.0), samples_per_period)
    return fundamental, about_drift(x, samples_per_period)


def _average(swing: NDArray[np.float64], band: NDArray[np.float64], samples_per_period: float) -> NDArray[np.float64]:
    """Mean cycle of `swing`, laid out along the cycles that begin where `band` rises through zero."""
    found, wave = average_by_phase(swing, band, samples_per_period), np.zeros(swing.shape[0])
    wave[found.inside] = found.values()
    return wave


def _lasts(wave: NDArray[np.float64], rest: NDArray[np.float64]) -> bool:
    """Whether the wave is there in both halves of the record: a period that drifts is met at each but once."""
    middle = wave.size // 2
    halves = slice(None, middle), slice(middle, None)
    gains = [float((wave[half] * rest[half]).sum()) / max(float((wave[half] ** 2).sum()), 1e-300) for half in halves]
    return min(gains) > LASTS * max(gains)


def _belongs(found: Rhythm, known: list[float]) -> bool:
    """Whether a period is that of a known oscillation, or in tune with it."""
    for period in known:
        if abs(found.period / period - 1.0) < APART:
            return True
        if any(abs(period / found.period / ratio - 1.0) < IN_TUNE for ratio in HARMONICS):
            return True
    return False
