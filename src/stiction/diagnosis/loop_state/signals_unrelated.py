"""Unrelated signals: OP and PV belong to different loops."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.loop_state.arrays import about_line
from stiction.records.correlation import next_fast_length
from stiction.records.gaps import interpolate_gaps

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["find_unrelated_signals"]


def find_unrelated_signals(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    sp: NDArray[np.float64] | None = None,
    *,
    segments: int = 16,
    min_segment_samples: int = 32,
    max_coherence: float = 0.2,
    shifts: int = 40,
    max_rank: float = 0.95,
    min_moving: float = 0.2,
) -> tuple[float, float] | None:
    """Say whether OP and PV have nothing in common.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span]; NaN is missing.
    pv : ndarray, shape (n_samples,)
        Process variable [its unit].
    sp : ndarray, shape (n_samples,), optional
        Set point [unit of PV]; OP may follow a set point that moves.
    segments : int
        Segments over which the coherence is averaged, overlapping by half [-].
    min_segment_samples : int
        Shortest segment [samples].
    max_coherence : float
        Largest coherence of unrelated signals [-].
    shifts : int
        Shifts of OP against PV with which the coherence is compared [-].
    max_rank : float
        Largest share of the shifts with a smaller coherence [-].
    min_moving : float
        Share of the samples in which each signal must move [-]; a rounded signal at rest is coherent with nothing.

    Returns
    -------
    (float, float) or None
        Coherence, and its median over the shifts [-]; None when the signals are related or the record is too short.

    Notes
    -----
    A controller makes OP of PV and SP, and the valve makes PV of OP: in a loop both are strongly coherent wherever they
    have power. Two signals of different loops are no more coherent than one of them shifted in time. The mean squared
    coherence is weighted by the power of both signals.

    Examples
    --------
    >>> import numpy as np
    >>> one, other = np.cumsum(np.random.default_rng(1).normal(size=(2, 2000)), axis=1)
    >>> find_unrelated_signals(one, one + other) is None, find_unrelated_signals(one, other) is None
    (True, False)
    """
    signals = [interpolate_gaps(x) for x in (op, pv) if np.isfinite(x).any()]
    length = op.size // ((segments + 1) // 2)
    if (
        len(signals) < 2
        or length < min_segment_samples
        or any(np.mean(np.diff(x) != 0.0) < min_moving for x in signals)
    ):
        return None
    inputs = [signals[1]]
    if sp is not None and np.isfinite(sp).any() and np.ptp(sp := interpolate_gaps(sp)) > 0.0:
        error = sp - signals[1]
        inputs += [error] if np.ptp(error) > 0.0 else []  # a constant set point would leave the coherence as it is
    own, spectra = _spectra(signals[0], length), [_spectra(x, length) for x in inputs]
    found = max(_coherence(own, one) for one in spectra)
    if found > max_coherence:
        return None
    steps = np.linspace(length, op.size - length, shifts).astype(int)
    moved = [_spectra(np.roll(signals[0], step), length) for step in steps]
    others = np.array([max(_coherence(x, one) for one in spectra) for x in moved])
    return (found, float(np.median(others))) if np.mean(others < found) <= max_rank else None


def _spectra(x: NDArray[np.float64], length: int) -> NDArray[np.complex128]:
    """Spectra of half overlapping segments about their straight line, shape (n_segments, n_frequencies)."""
    parts = about_line(np.lib.stride_tricks.sliding_window_view(x, length)[:: max(1, length // 2)])
    return np.fft.rfft(parts * np.hanning(length), next_fast_length(length))[:, 1:]


def _coherence(x: NDArray[np.complex128], y: NDArray[np.complex128]) -> float:
    """Squared coherence of two signals, weighted by their power [-]."""
    power_x, power_y = np.mean(np.abs(x) ** 2, axis=0), np.mean(np.abs(y) ** 2, axis=0)
    weight = np.sqrt(power_x * power_y)
    squared = np.abs(np.mean(x * np.conj(y), axis=0)) ** 2 / np.maximum(power_x * power_y, 1e-300)
    return float(np.sum(weight * squared) / max(weight.sum(), 1e-300))
