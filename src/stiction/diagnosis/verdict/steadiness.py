"""How steady an oscillation's amplitude is, from period to period."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.oscillation import about_drift, control_error

if TYPE_CHECKING:
    from stiction.diagnosis.result import Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["amplitude_spread"]


def amplitude_spread(record: LoopRecord, oscillation: Oscillation) -> tuple[float, float]:
    """Spread of the oscillation's amplitude from period to period, and the part that noise explains.

    Parameters
    ----------
    record : LoopRecord
        The record as analysed.
    oscillation : Oscillation
        Its oscillation.

    Returns
    -------
    tuple of float
        Half the distance of the 16th and 84th percentile over the median of the fundamental's amplitude, each
        period's own [-], infinity with fewer than four periods; and the standard deviation that white noise of
        the size seen from sample to sample gives it [-].
    """
    error = control_error(record)
    samples = oscillation.period / record.dt
    if error is None or not samples > 0.0 or error.size < 4.0 * samples:
        return float("inf"), 0.0
    wave = about_drift(error, samples)
    turning = np.concatenate([[0.0], np.cumsum(wave * np.exp(-2j * np.pi * np.arange(wave.size) / samples))])
    edges = np.round(np.arange(0.0, wave.size + 1.0, samples)).astype(int)
    edges = edges[edges <= wave.size]
    amplitude = np.abs(np.diff(turning[edges])) / np.diff(edges)
    if amplitude.size > 5:
        amplitude = amplitude[1:-1]  # a record may begin or end within a transient
    low, middle, high = np.percentile(amplitude, [16.0, 50.0, 84.0])
    if middle <= 0.0:
        return float("inf"), 0.0
    noise = float(np.std(np.diff(wave, 2))) / np.sqrt(6.0)
    return float((high - low) / (2.0 * middle)), float(noise / np.sqrt(2.0 * samples) / middle)
