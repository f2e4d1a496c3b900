"""The oscillations of one loop, from the zero crossings of the autocorrelation of its block means (`thornhill2003`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.fleet.block_means import BlockMeans

__all__ = ["LoopOscillation", "complex_envelope", "find_loop_oscillations", "signal_at"]

SAME_PERIOD = 0.04
"""Relative difference up to which two periods count as one [-]."""
FIRST_OCTAVE = 6.0
"""Middle of the shortest octave, which begins near 4 samples to a period [samples]."""
MAX_BLOCKS = 28.0
"""Blocks to the shortest period of an octave above which every two are averaged [-]."""
MIN_PERIODS = 3.0
"""Periods that a record must hold [-]."""
HARMONICS = (2, 3, 4, 5, 6, 7)
"""Orders at which a shorter period counts as a harmonic of a longer one [-]."""


@dataclass(frozen=True, slots=True)
class LoopOscillation:
    """One candidate for an oscillation of one loop."""

    period: float
    """Period [s]."""
    regularity: float
    """Thornhill's regularity r of the zero crossings [-]; above 1 is regular."""
    height: float
    """Autocorrelation one period later [-]."""
    regular: bool
    """Whether it is regular and repeats more than noise does."""
    signal: str
    """Signal that shows it best: "error" or "op"."""


def find_loop_oscillations(means: BlockMeans, *, min_blocks: float = 10.0) -> tuple[LoopOscillation, ...]:
    """Find the candidates for an oscillation in the control error and the OP of a loop.

    `min_blocks`: blocks to a period below which the fast part is used [-]. Returns one for each period, the shortest
    first; of periods that are harmonics of a stronger one only that one.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.fleet.block_means import common_clock, make_block_means
    >>> from stiction.records import LoopRecord
    >>> wave = np.sin(2 * np.pi * np.arange(4000) / 50)
    >>> record = LoopRecord("FIC-101", 2.0, op=50 + wave, pv=3 * wave)
    >>> [round(one.period, 1) for one in find_loop_oscillations(make_block_means(record, common_clock([record])))]
    [100.0]
    """
    clock = means.clock
    limit = min_blocks * clock.dt if clock.fast_count else 0.0
    found: list[tuple[LoopOscillation, float]] = []
    for signal in ("error", "op"):
        rows = []
        for x, dt, low, high in (
            (getattr(means, f"fast_{signal}"), clock.fast_dt, 0.0, limit),
            (getattr(means, signal), clock.dt, limit, np.inf),
        ):
            if x.size:
                rows += _candidates(x.astype(np.float64), dt, low, high, signal)
        found += [row for row in rows if not _is_harmonic(row, rows)]
    found.sort(key=lambda row: (row[0].regular, row[0].height), reverse=True)
    kept: list[LoopOscillation] = []
    for one, _ in found:
        if all(abs(one.period / other.period - 1.0) > SAME_PERIOD for other in kept):
            kept.append(one)
    return tuple(sorted(kept, key=lambda one: one.period))


def _candidates(
    x: NDArray[np.float64], dt: float, low: float, high: float, signal: str
) -> list[tuple[LoopOscillation, float]]:
    """Candidates with a period from `low` to `high` [s], each with its power.

    Octave by octave; the samples are halved where the shortest period of the octave is longer than `MAX_BLOCKS`.
    """
    from stiction.diagnosis.oscillation.rhythm import octave

    rows = []
    middle = FIRST_OCTAVE
    while 0.6 * middle * dt < high and 0.6 * middle <= x.size / MIN_PERIODS:
        if 1.5 * middle * dt > low:
            rhythm = octave(x, middle)
            period = rhythm.period * dt
            if low <= period < high:
                one = LoopOscillation(period, rhythm.regularity, rhythm.height, bool(rhythm.regular), signal)
                rows.append((one, rhythm.power))
        middle *= 2.0
        if 0.6 * middle > MAX_BLOCKS:
            even = x.size // 2 * 2
            x, dt, middle = x[:even].reshape(-1, 2).mean(axis=1), 2.0 * dt, 0.5 * middle
    return rows


def _is_harmonic(row: tuple[LoopOscillation, float], rows: list[tuple[LoopOscillation, float]]) -> bool:
    """Whether a stronger regular candidate has a period of 2 to 7 times this one."""
    one, power = row
    ratios = [other.period / one.period for other, more in rows if other.regular and more > power]
    return any(abs(ratio / order - 1.0) < SAME_PERIOD for ratio in ratios for order in HARMONICS)


def signal_at(means: BlockMeans, period: float, signal: str, *, min_blocks: float = 10.0):
    """Block means in which a period is best seen: the fast part for short periods.

    `period`: period [s]. `min_blocks`: blocks to a period below which the fast part is used [-]. Returns the signal,
    shape (n_blocks,), and the length of its blocks [s].

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.fleet.block_means import common_clock, make_block_means
    >>> from stiction.records import LoopRecord
    >>> record = LoopRecord("FIC-101", 5.0, op=np.arange(17280.0))
    >>> means = make_block_means(record, common_clock([record]))
    >>> [signal_at(means, period, "op")[1] for period in (60.0, 600.0)]
    [5.0, 25.0]
    """
    clock = means.clock
    if clock.fast_count and period < min_blocks * clock.dt:
        return getattr(means, f"fast_{signal}"), clock.fast_dt
    return getattr(means, signal), clock.dt


def complex_envelope(x: NDArray[np.floating], blocks_per_period: float, *, periods: float = 3.0) -> NDArray:
    """Demodulate a signal: amplitude and phase at one period, in windows that overlap by half.

    `x`, of shape (n_blocks,): the signal [any unit]. `blocks_per_period`: period over the length of a block [-].
    `periods`: length of a window [periods]. Returns amplitude (half peak to peak) times exp(i phase) in each window
    [unit of `x`]; the phase is counted from the first block, shape (n_windows,). Empty where the signal is shorter than
    two windows.

    Each window is weighted with Hann's window, its mean and slope taken off, so that drift and harmonics count little.

    Examples
    --------
    >>> import numpy as np
    >>> wave = 2.0 * np.cos(2 * np.pi * np.arange(1000) / 40 - 0.5)
    >>> envelope = complex_envelope(wave, 40.0)
    >>> abs(envelope).round(2)[:3].tolist(), np.angle(envelope).round(2)[:3].tolist()
    ([2.0, 2.0, 2.0], [-0.5, -0.5, -0.5])
    """
    size = round(periods * blocks_per_period)
    hop = max(1, size // 2)
    if size < 4 or x.size < 2 * size:
        return np.empty(0, dtype=np.complex128)
    k = np.arange(size)
    weight = np.hanning(size + 2)[1:-1]
    kernel = weight * np.exp(-2j * np.pi * k / blocks_per_period)
    for shape in (np.ones(size), k - k.mean()):
        kernel = kernel - weight * shape * (kernel @ shape) / (weight @ shape**2)
    about = x.astype(np.float64) - x.mean(dtype=np.float64)
    windows = np.ascontiguousarray(np.lib.stride_tricks.sliding_window_view(about, size)[::hop])
    real, imaginary = (windows @ np.column_stack([kernel.real, kernel.imag])).T
    turn = np.exp(-2j * np.pi * hop * np.arange(real.size) / blocks_per_period)
    return 2.0 / weight.sum() * (real + 1j * imaginary) * turn
