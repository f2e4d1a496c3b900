"""How an oscillation goes on over a record, and how its signals are distributed about the drift."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.oscillation import about_drift, control_error, filled
from stiction.diagnosis.verdict.held import held

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["Rhythm", "rhythm_of"]

NORMAL_TAILS = 0.3
"""Fourth moment of a normal distribution over 10 [-]: what is told of a signal that is missing or stands still."""
FEWEST = 4
"""Periods below which nothing is said of how the amplitude changes."""


class Rhythm(NamedTuple):
    """The course of the oscillation; the field names are those of `Features`."""

    cycles: float
    samples: float
    wander: float
    unknown_wander: float
    decay: float
    skew_pv: float
    skew_op: float
    tails_pv: float
    tails_op: float


def rhythm_of(record: LoopRecord, oscillation: Oscillation) -> Rhythm:
    """Measure how the oscillation goes on.

    Parameters
    ----------
    record : LoopRecord
        The stretch that was analysed.
    oscillation : Oscillation
        Its oscillation.

    Returns
    -------
    Rhythm
        Its course; without an oscillation only the distributions, about the mean.
    """
    samples = oscillation.period / record.dt if oscillation.oscillating else math.nan
    skew_pv, tails_pv = _moments(record.pv, samples)
    skew_op, tails_op = _moments(record.op, samples)
    if not samples > 0.0:
        return Rhythm(0.0, 0.0, 0.0, 1.0, 0.0, skew_pv, skew_op, tails_pv, tails_op)
    cycles = math.log1p(oscillation.cycles) / 4.0 if math.isfinite(oscillation.cycles) else 0.0
    amplitudes, noise = _amplitudes(record, samples)
    known = amplitudes.size >= FEWEST and float(np.median(amplitudes)) > 0.0
    return Rhythm(
        cycles=held("cycles", cycles),
        samples=held("samples", math.log(max(samples, 1.0)) / 6.0),
        wander=_wander(amplitudes, noise) if known else 0.0,
        unknown_wander=float(not known),
        decay=_decay(amplitudes) if known else 0.0,
        skew_pv=skew_pv,
        skew_op=skew_op,
        tails_pv=tails_pv,
        tails_op=tails_op,
    )


def _moments(x: NDArray[np.float64] | None, samples: float) -> tuple[float, float]:
    """Size of the third moment, and the fourth over 10, of a signal about its drift or its mean."""
    whole = filled(x)
    if whole is None:
        return 0.0, NORMAL_TAILS
    wave = about_drift(whole, samples) if samples > 0.0 else whole - whole.mean()
    spread = float(wave.std())
    if not spread > 0.0:
        return 0.0, NORMAL_TAILS
    wave = wave / spread
    return abs(float(np.mean(wave**3))), held("tails_pv", float(np.mean(wave**4)) / 10.0)


def _amplitudes(record: LoopRecord, samples: float) -> tuple[NDArray[np.float64], float]:
    """Amplitude of each period's fundamental, and the standard deviation that white noise gives it."""
    error = control_error(record)
    if error is None or error.size < FEWEST * samples:
        return np.empty(0), 0.0
    wave = about_drift(error, samples)
    turning = np.concatenate([[0.0], np.cumsum(wave * np.exp(-2j * np.pi * np.arange(wave.size) / samples))])
    edges = np.round(np.arange(0.0, wave.size + 1.0, samples)).astype(int)
    edges = edges[edges <= wave.size]
    noise = float(np.std(np.diff(wave, 2))) / np.sqrt(6.0)  # of second differences, which an oscillation hardly moves
    return np.abs(np.diff(turning[edges])) / np.diff(edges), noise / float(np.sqrt(2.0 * samples))


def _wander(amplitudes: NDArray[np.float64], noise: float) -> float:
    """Half the distance of the 16th and 84th percentile over the median, less twice what noise explains, held at 1."""
    inner = amplitudes[1:-1] if amplitudes.size > 5 else amplitudes  # a record may begin or end within a transient
    low, middle, high = (float(x) for x in np.percentile(inner, [16.0, 50.0, 84.0]))
    if not middle > 0.0:  # the error stands still for half of the periods
        return 1.0
    return held("wander", max((high - low) / (2.0 * middle) - 2.0 * noise / middle, 0.0))


def _decay(amplitudes: NDArray[np.float64]) -> float:
    """Log of the median amplitude in the first third over that in the last."""
    third = amplitudes.size // 3
    if third < 2:
        return 0.0
    first, last = float(np.median(amplitudes[:third])), float(np.median(amplitudes[-third:]))
    least = 1e-12 * float(amplitudes.max())
    decay = math.log(max(first, least) / max(last, least))
    return math.copysign(held("decay", abs(decay)), decay)
