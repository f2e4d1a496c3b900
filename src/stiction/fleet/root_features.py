"""What tells the source of an oscillation from the loops that it reaches: harmonics, nonlinearity, arrival, size."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.fleet.loop_oscillations import complex_envelope, signal_at

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.fleet.block_means import BlockMeans

__all__ = ["arrival_order", "harmonics_share", "nonlinearity_of", "oscillation_amplitude"]


def harmonics_share(x: NDArray[np.floating], blocks_per_period: float, *, orders: tuple[int, ...] = (3, 5, 7)) -> float:
    """Power of the harmonics over the power of the fundamental.

    `x`, of shape (n_blocks,): the signal [any unit]. `blocks_per_period`: period over the length of a block [-].
    `orders`: harmonics that count [-]; those above half of the sampling frequency are left out. Returns the share [-];
    NaN where the signal is shorter than 8 periods. Power that the neighbourhood of a harmonic holds as well is taken
    off as noise.

    Examples
    --------
    >>> square = np.sign(np.sin(2 * np.pi * (np.arange(4000) + 0.5) / 40))
    >>> round(harmonics_share(square, 40.0, orders=(3, 5)), 2)
    0.15
    """
    size = round(8 * blocks_per_period)
    if x.size < size:
        return float("nan")
    hop = max(1, size // 2)
    weight = np.hanning(size + 2)[1:-1]
    windows = np.lib.stride_tricks.sliding_window_view(x - x.mean(), size)[::hop]
    power = (np.abs(np.fft.rfft(windows * weight, axis=1)) ** 2).mean(axis=0)

    def peak(order: int) -> float:
        """Power within one bin of a harmonic, less the median beside it."""
        at = round(order * size / blocks_per_period)
        beside = np.concatenate([power[at - 4 : at - 2], power[at + 3 : at + 5]])
        return max(0.0, float(power[at - 1 : at + 2].sum() - 3.0 * np.median(beside)))

    fundamental = peak(1)
    inside = [order for order in orders if order * size / blocks_per_period + 5 <= power.size]
    return sum(peak(order) for order in inside) / fundamental if fundamental > 0.0 else float("nan")


def nonlinearity_of(x: NDArray[np.floating], blocks_per_period: float, *, per_period: int = 10) -> float:
    """Thornhill's nonlinearity index N of a signal [-]: above 1 is nonlinear (`thornhill2005`).

    `x`, of shape (n_blocks,): the signal [any unit]; its first 350 samples after averaging to `per_period` count.
    `blocks_per_period`: period over the length of a block [-]. `per_period`: samples to a period after averaging [-].
    Returns N; NaN where the signal is too short or too close to a sine.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> t = np.arange(2000)
    >>> nonlinearity_of(np.sin(2 * np.pi * t / 40) + 0.3 * rng.standard_normal(2000), 40.0) < 1.0
    True
    """
    from stiction.diagnosis.detection.nonlinearity import nonlinearity_index

    width = max(1, int(blocks_per_period / per_period))
    samples = max(4, round(blocks_per_period / width))
    n = min(x.size // width, 320 + 3 * samples)
    means = x[: n * width].reshape(n, width).mean(axis=1).astype(np.float64)
    return nonlinearity_index(means - means.mean(), samples)


def oscillation_amplitude(means: BlockMeans, period: float, signal: str) -> tuple[float, float]:
    """Amplitude of an oscillation in one signal, and the share of the signal's variance that it carries.

    `period`: period [s]. Returns amplitude (half peak to peak) [unit of the signal] and share [-]; both 0 where the
    signal does not move.

    Examples
    --------
    >>> from stiction.fleet.block_means import common_clock, make_block_means
    >>> from stiction.records import LoopRecord
    >>> wave = 2.0 * np.sin(2 * np.pi * np.arange(4000) / 50)
    >>> record = LoopRecord("FIC-101", 2.0, op=50 + wave, pv=wave)
    >>> means = make_block_means(record, common_clock([record]))
    >>> [round(float(x), 2) for x in oscillation_amplitude(means, 100.0, "op")]
    [2.0, 1.0]
    """
    x, dt = signal_at(means, period, signal)
    envelope = complex_envelope(x, period / dt)
    variance = float(np.var(x, dtype=np.float64)) if x.size else 0.0
    if not envelope.size or not variance > 0.0:
        return 0.0, 0.0
    power = float(np.mean(np.abs(envelope) ** 2))
    return float(np.sqrt(power)), min(1.0, 0.5 * power / variance)


def arrival_order(
    signals: Sequence[tuple[NDArray[np.floating], float]], period: float, *, half_band: float = 0.4, reach: float = 1.5
) -> NDArray[np.float64]:
    """Delay of the changes of an oscillation from loop to loop.

    `signals`: signal of each loop, all of one length, and the length of its blocks [s]. `period`: period [s].
    `half_band`: half width of the frequency band that is used, over the frequency of the oscillation [-]. `reach`:
    largest delay that is looked for [periods]. Returns group delay of each signal against the common oscillation
    [periods]; the mean is 0, shape (n_loops,). NaN where the amplitude and the phase are too steady, or the coherence
    too low, to see one.

    The phase alone cannot order loops: a negative gain turns it by half a period, a fast controller by a quarter. The
    slope of the phase over the frequencies near the oscillation does not depend on either. It needs an oscillation
    whose amplitude or period changes.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> phase = np.cumsum(2 * np.pi / 40 * (1 + 0.3 * rng.standard_normal(4000)))
    >>> late = [(-np.sin(phase)[10:3000], 1.0), (np.sin(phase)[:2990], 1.0)]
    >>> [round(float(delay), 2) for delay in np.diff(arrival_order(late, 40.0))]
    [0.24]
    """
    n = min(x.size for x, _ in signals)
    dt = signals[0][1]
    if n * dt < 8.0 * period:
        return np.full(len(signals), np.nan)
    weight = np.hanning(n)
    spectra = np.array([np.fft.rfft(weight * (x[:n] - np.mean(x[:n]))) for x, _ in signals])
    f = np.fft.rfftfreq(n, dt) * period
    band = np.abs(f - 1.0) <= half_band
    spectra, f = spectra[:, band], f[band] - 1.0
    norm = np.linalg.norm(spectra, axis=1, keepdims=True)
    spectra = np.divide(spectra, norm, out=np.zeros_like(spectra), where=norm > 0.0)
    grid = np.linspace(-reach, reach, 301)
    turns = np.exp(2j * np.pi * np.outer(f, grid))
    delays, known = np.zeros(len(signals)), np.ones(len(signals), dtype=bool)
    for _ in range(3):
        aligned = spectra * np.exp(2j * np.pi * np.outer(delays, f))
        common = np.linalg.svd(aligned, full_matrices=False)[2][0]
        match = np.abs((spectra * common.conj()) @ turns)
        best = match.argmax(axis=1)
        delays = grid[best]
        drop = match.max(axis=1) - np.minimum(match[:, 0], match[:, -1])
        known = (match.max(axis=1) > 0.5) & (drop > 0.02) & (best > 0) & (best < grid.size - 1)
        delays = np.where(known, delays - (delays[known].mean() if known.any() else 0.0), 0.0)
    return np.where(known, delays, np.nan)
