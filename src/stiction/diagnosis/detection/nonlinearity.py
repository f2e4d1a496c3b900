"""Thornhill 2005: is the error easier to predict than a linear signal of the same spectrum? (`thornhill2005`).

A surrogate has the error's power spectrum and random phases: what a linear process driven by noise could have made
(`theiler1992`). Each series is predicted from its own nearest neighbours, stretches one period long.
N = (mean error of the surrogates - error of the series) / (3 deviations of the surrogates' errors); above 1 something
in the loop is nonlinear, which need not be the valve. A nearly pure sine says nothing, whatever N is.

Settings, after the spirit of the paper: about 10 samples to a period, 320 in all, ends matched, 8 neighbours,
half a period ahead, 12 surrogates from a fixed seed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import coarse, judge, objections, swing
from stiction.models.compiled import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["nonlinearity", "nonlinearity_index", "surrogates"]

PER_PERIOD, LONGEST = 10, 320
NEIGHBOURS, SURROGATES, SEED = 8, 12, 2005
FEWEST_CYCLES = 8.0


def nonlinearity(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Test the control error against surrogates of the same spectrum (`thornhill2005`).

    Parameters
    ----------
    record : LoopRecord
        The control error is used; valid for any process, with 8 periods or more.
    oscillation : Oscillation
        What `find_oscillation` says of the record.

    Returns
    -------
    Evidence
        `index` is N [-]; above 1 the loop is nonlinear.
    """
    error = swing(record, oscillation, "error")
    index = float("nan")
    if error is not None and oscillation.period > 0.0:
        x = coarse(record, oscillation, error, PER_PERIOD)[:LONGEST]
        period = oscillation.period / record.dt
        per_period = max(4, round(period / max(1, int(period / PER_PERIOD))))
        if x.shape[0] >= 5 * per_period:
            index = nonlinearity_index(x, min(per_period, 20))
    why = (
        f"The control error is {'easier' if index > 1.0 else 'no easier'} to predict than linear signals of its "
        f"spectrum: N {index:.2f}, above 1 something in the loop is nonlinear, not only a valve."
    )
    against = objections(record, oscillation, cycles=FEWEST_CYCLES)
    return judge("nonlinearity", index, 1.0, 0.5, why, against, source="thornhill2005")


def nonlinearity_index(x: NDArray[np.float64], per_period: int) -> float:
    """N of a series [-]; NaN where its surrogates do not differ.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        The series about its drift.
    per_period : int
        Samples to a period [-]; also the length of the stretches compared.

    Returns
    -------
    float
    """
    x = _end_matched(x, per_period)
    x = (x - x.mean()) / x.std() if x.std() > 0.0 else x
    ahead = max(1, per_period // 2)
    near, value = np.empty(NEIGHBOURS), np.empty(NEIGHBOURS)
    own = _prediction_error(x, per_period, ahead, near, value)
    others = np.array([_prediction_error(s, per_period, ahead, near, value) for s in surrogates(x, SURROGATES, SEED)])
    spread = float(others.std(ddof=1))
    return (float(others.mean()) - own) / (3.0 * spread) if spread > 0.0 else float("nan")


def surrogates(x: NDArray[np.float64], count: int, seed: int) -> NDArray[np.float64]:
    """Series with the power spectrum of `x` and random phases, shape (count, n_samples).

    Examples
    --------
    >>> import numpy as np
    >>> x = np.arange(16.0) % 5
    >>> bool(np.allclose(np.abs(np.fft.rfft(surrogates(x, 1, 0)[0])), np.abs(np.fft.rfft(x))))
    True
    """
    n = x.shape[0]
    spectrum = np.fft.rfft(x)
    turn = np.exp(2j * np.pi * np.random.default_rng(seed).random((count, spectrum.shape[0])))
    turn[:, 0] = 1.0
    if n % 2 == 0:
        turn[:, -1] = 1.0
    return np.fft.irfft(spectrum * turn, n, axis=1)


def _end_matched(x: NDArray[np.float64], per_period: int) -> NDArray[np.float64]:
    """Cut up to a period off each end, so that the ends join best in value and slope."""
    n, reach = x.shape[0], per_period
    heads, tails = np.arange(reach), n - 1 - np.arange(reach)
    value = x[heads][:, None] - x[tails][None, :]
    slope = (x[heads + 1] - x[heads])[:, None] - (x[tails] - x[tails - 1])[None, :]
    head, tail = np.unravel_index(np.argmin(np.abs(value) + np.abs(slope)), value.shape)
    return x[head : n - int(tail)]


@kernel
def _prediction_error(x, size, ahead, near, value):
    """Mean square error of predicting x[i + ahead] from the nearest stretches of `size` samples."""
    n = x.shape[0] - size - ahead + 1
    total = 0.0
    for i in range(n):
        near[:] = np.inf
        value[:] = 0.0
        worst = 0
        for j in range(n):
            if abs(i - j) < size:
                continue
            distance = 0.0
            limit = near[worst]
            for k in range(size):
                step = x[i + k] - x[j + k]
                distance += step * step
                if distance >= limit:
                    break
            if distance < limit:
                near[worst] = distance
                value[worst] = x[j + size - 1 + ahead]
                for k in range(near.shape[0]):
                    if near[k] > near[worst]:
                        worst = k
        guess = 0.0
        for k in range(value.shape[0]):
            guess += value[k]
        off = x[i + size - 1 + ahead] - guess / value.shape[0]
        total += off * off
    return total / n
