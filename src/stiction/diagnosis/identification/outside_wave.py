r"""How well a good valve foretells the PV if a wave from outside, the same in every period, moves it as well.

A pump, another loop or a batch moves the PV in a rhythm of its own, and the regression on the past of the PV foretells
a sine of any phase, but no saw. What it leaves of a wave that is no sine comes at the same phase in every period, and
so does the slip of a valve. So the good valve gets the wave for nothing: the harmonics of one period are taken out of
PV and OP by least squares, which leaves what a regression on them beside all else leaves ([frisch1933]_), but for the
ends of the window. A valve that sticks, in a loop with noise, makes no two periods alike.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.contest import Rival
from stiction.diagnosis.identification.likelihood import errors_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Prediction

__all__ = ["fundamental", "outside_wave"]

HARMONICS = 24
"""Harmonics of the wave at most [-]."""
PER_HARMONIC = 2.5
"""Samples that a period of the highest must have [-]."""
FEWEST_PERIODS = 4.0
"""Periods in the record below which no wave can be told from a slow load [-]."""
NEAR = 0.8, 1.25
"""How far off the period of the oscillation that of the wave may be, as a share of it [-]."""
PADDED = 64
"""How much finer than the record's own frequencies the period is looked for, at least [-]: the 24th harmonic of one
that is off by half a step is 0.6 rad off at the ends of the record."""


def outside_wave(prediction: Prediction, period: float) -> Rival | None:
    """Let a good valve and a wave from outside foretell the PV.

    Parameters
    ----------
    prediction : Prediction
        What is foretold.
    period : float
        Period of the oscillation [samples of the PV].

    Returns
    -------
    Rival or None
        What they leave; None where the record has too few periods, or a period too few samples.
    """
    pv, n = prediction.pv, prediction.pv.size
    most = min(HARMONICS, int(NEAR[0] * period / PER_HARMONIC))
    if most < 1 or n < FEWEST_PERIODS * NEAR[1] * period:
        return None
    own = fundamental(pv, period, most)
    angle = 2.0 * np.pi / own * np.outer(np.arange(1, most + 1), np.arange(n))
    basis = np.concatenate([np.ones((1, n)), np.cos(angle), np.sin(angle)])
    both = np.stack([pv, prediction.op.reshape(n, prediction.width).mean(axis=1)])
    # Not by `@`: the threads of a linear algebra library take longer to start than so small a product takes.
    alike, shares = np.einsum("in,jn->ij", basis, basis), np.einsum("in,kn->ik", basis, both)
    both -= np.einsum("ik,in->kn", np.linalg.solve(alike, shares), basis)
    error = errors_of(prediction._replace(pv=both[0]), both[1:])[1][0]
    return Rival(error, 2.0 * most)


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
    power = np.abs(np.fft.rfft(pv, size)) ** 2
    low, high = (size / (share * period) for share in reversed(NEAR))
    places = np.arange(int(np.ceil(low)), min(int(high), (power.size - 1) // harmonics) + 1)
    carried = sum(power[h * places] for h in range(1, harmonics + 1))
    return size / float(places[np.argmax(carried)])
