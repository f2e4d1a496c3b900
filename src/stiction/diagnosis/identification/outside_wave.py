r"""How well a good valve predicts the PV if a wave from outside, the same in every period, moves it as well.

A pump, another loop or a batch moves the PV in a rhythm of its own, and the regression on the past of the PV predicts
a sine of any phase, but no saw. What it leaves of a wave that is no sine comes at the same phase in every period, and
so does the slip of a valve. So the good valve gets the wave for nothing: the harmonics of one period are taken out of
PV and OP by least squares, which leaves what a regression on them beside all else leaves ([frisch1933]_), but for the
ends of the window. A valve that sticks, in a loop with noise, makes no two periods alike. What disturbs a loop begins
and ends: once in the record the wave may become another one, where that is worth its weights.

A loop may have both. The sticky valve beside the wave is therefore compared with the good one beside it as well.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.contest import LookAlike
from stiction.diagnosis.identification.likelihood import errors_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Prediction

__all__ = ["Beside", "fundamental", "outside_wave", "repeated"]

HARMONICS = 24
"""Harmonics of the wave at most [-]."""
PER_HARMONIC = 2.5
"""Samples that a period of the highest must have [-]."""
FEWEST_PERIODS = 4.0
"""Periods in the record below which no wave can be told from a slow load [-]."""
NEAR = 0.8, 1.25
"""How far off the period of the oscillation that of the wave may be, as a share of it [-]."""
CHANGES = 1 / 3, 1 / 2, 2 / 3
"""Places of the record at which the wave may become another one, as where it begins or ends within it [-]."""
CHANGE_WORTH = 12.0
"""Twice the log likelihood that such a change has to be worth beyond its weights [-]: the best of three is worth some
by chance."""
PADDED = 64
"""How much finer than the record's own frequencies the period is looked for, at least [-]: the 24th harmonic of one
that is off by half a step is 0.6 rad off at the ends of the record."""


class Beside(NamedTuple):
    """A good valve and a sticky one beside the same wave."""

    good: LookAlike
    """The good one; the wave's weights are its own."""
    sticky: NDArray[np.float64]
    """Sum of squares that the sticky one leaves in each half cycle, shape (n_halves,)."""


def outside_wave(prediction: Prediction, period: float, stem: NDArray[np.float64]) -> Beside | None:
    """Let a wave from outside, beside a good valve and beside a sticky one, predict the PV.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    period : float
        Period of the oscillation [samples of the PV].
    stem : ndarray, shape (n_samples * width,)
        Stem position of the sticky valve [% of span].

    Returns
    -------
    Beside or None
        What they leave; None where the record has too few periods, or a period too few samples.
    """
    n, fewest = prediction.pv.size, FEWEST_PERIODS * NEAR[1] * period
    most = min(HARMONICS, int(NEAR[0] * period / PER_HARMONIC))
    if most < 1 or n < fewest:
        return None
    own = fundamental(prediction.pv, period, most)
    signals = np.stack([prediction.pv, *(u.reshape(n, prediction.width).mean(axis=1) for u in (prediction.op, stem))])
    changes = [int(share * n) for share in CHANGES if min(share, 1.0 - share) * n >= fewest]
    tried = [_beside(prediction, signals, [slice(0, n)], own, most)]
    tried += [_beside(prediction, signals, [slice(0, at), slice(at, n)], own, most) for at in changes]
    return min(tried, key=lambda one: prediction.samples * np.log(one.good.error.sum()) + one.good.weights)


def _beside(
    prediction: Prediction, signals: NDArray[np.float64], parts: list[slice], period: float, harmonics: int
) -> Beside:
    """What is left of PV, OP and stem (`signals`) without the wave of each part of the record."""
    rest = np.concatenate([signals[:, part] - repeated(signals[:, part], period, harmonics) for part in parts], axis=1)
    good, sticky = errors_of(prediction._replace(pv=rest[0], op_mean=rest[1]), rest[1:])[1]
    return Beside(LookAlike(good, 2.0 * harmonics * len(parts) + CHANGE_WORTH * (len(parts) - 1)), sticky)


def repeated(signals: NDArray[np.float64], period: float, harmonics: int) -> NDArray[np.float64]:
    """Part of signals that is the same in every period, by least squares.

    Parameters
    ----------
    signals : ndarray, shape (n_signals, n_samples)
        Signals, a row each [any unit].
    period : float
        Period [samples].
    harmonics : int
        Harmonics of it, beside a constant [-].

    Returns
    -------
    ndarray, shape (n_signals, n_samples)
        That part [unit of the signals].
    """
    n, order = signals.shape[1], np.arange(2 * harmonics + 1)
    turns = np.empty((harmonics, n), dtype=np.complex128)
    turns[0] = np.exp(2j * np.pi / period * np.arange(n))
    for h in range(1, harmonics):
        np.multiply(turns[h - 1], turns[0], out=turns[h])
    waves = np.concatenate([turns.real, turns.imag])
    # The products of two harmonics add up to geometric series of the difference of their orders.
    step = np.exp(2j * np.pi / period * order[1:])
    series = np.concatenate([[n], (step**n - 1.0) / (step - 1.0)])
    apart = order - order[:, np.newaxis]
    alike = np.where(apart < 0, series[np.abs(apart)].conj(), series[np.abs(apart)])
    # Not by `@`: the threads of a linear algebra library take longer to start than so small a product takes.
    shares = np.einsum("hn,kn->hk", waves, signals)
    shares = shares[:harmonics] - 1j * shares[harmonics:]
    shares = np.concatenate([shares[::-1].conj(), signals.sum(axis=1)[np.newaxis], shares])
    weights = np.linalg.solve(alike, shares)[harmonics:]
    each = 2.0 * np.concatenate([weights[1:].real, -weights[1:].imag])
    return weights[:1].real.T + np.einsum("hk,hn->kn", each, waves)


def fundamental(pv: NDArray[np.float64], period: float, harmonics: int) -> float:
    """Find the period, near that of the oscillation, whose harmonics carry most of the PV.

    Parameters
    ----------
    pv : ndarray, shape (n_samples,)
        PV about its mean.
    period : float
        Period of the oscillation [samples].
    harmonics : int
        Harmonics that count, the first among them [-].

    Returns
    -------
    float
        The period [samples].
    """
    size = 1 << (PADDED * pv.size - 1).bit_length()
    spectrum = np.fft.rfft(pv, size)
    low, high = (size / (share * period) for share in reversed(NEAR))
    places = np.arange(int(np.ceil(low)), min(int(high), (spectrum.size - 1) // harmonics) + 1)
    carried = sum(np.abs(spectrum[h * places]) ** 2 for h in range(1, harmonics + 1))
    return size / float(places[np.argmax(carried)])
