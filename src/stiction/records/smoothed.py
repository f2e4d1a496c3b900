"""Whether OP and PV went through a moving average, sample after sample: read back from what it takes out of the noise.

Every number here keeps its meaning under shift and scale of the signals.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.storage import EXACT, ROUNDING, swing

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["averaging_window"]

WIDEST, PER_SAMPLE = 20, 30
"""Longest window whose notches are looked for, and how many times as long the record must be [samples]."""
MIDDLE, BESIDE, REACH = 0.05, 0.15, 0.4
"""How far the middle of a notch reaches, where beside it begins, and how far that reaches [1 / window]."""
DEEP = 0.2
"""Power in the middle of a notch beside that about it up to which it is one [-]: see `averaging_window`."""
FLAT = 0.8
"""Power near half the sampling rate beside that about a quarter, of what a mean of two was taken of, from which it
is a mean and no filter of the first order by Tustin's rule before the controller [-]: 0.45 to 0.79 in 20 loops behind
such a filter, and above this in 38 of 40 loops with white noise whose OP and PV were averaged."""
AT_HALF, AT_QUARTER = (0.40, 0.48), (0.22, 0.32)
"""What is near half the sampling rate and a quarter of it [1 / sample]."""
DRAWN = 0.2
"""Share of the samples that may repeat the last value or lie halfway between their neighbours [-]: a signal held or
drawn in lines between fewer samples has such notches too."""


def averaging_window(op: NDArray[np.float64], pv: NDArray[np.float64]) -> int:
    """Samples of the moving average through which both signals went; 0 when the noise does not tell.

    A moving average of W samples takes out what has the frequencies 1/W, 2/W, ... of the sampling rate: where there is
    noise it leaves notches at all of them. Wide windows show in the third differences too: their autocorrelation about
    the lag W is that about 0, halved and negative, and there is none about 2 W, as there would be of an oscillation.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Signals in any unit, without NaN.

    Notes
    -----
    Chosen on 700 loops of `simulation.population` (seed 9700, before any historian); counted on seed 9701. Of 100
    sticky loops there whose OP and PV were averaged over 3 to 10 samples 95 to 100 are told with their window, over 2
    samples 42: what falls off towards half the sampling rate by itself passes for a filter. A window of 31 is found in
    one of the 700 as they were, and none in 150 loops each of `plant_population` and `upset_population`, in 40 loops
    behind a transmitter with a first-order lag, and in 34 records of plants. A lag of OP and PV cannot be told.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(size=(2, 900))
    >>> [averaging_window(*(np.convolve(x, np.ones(W) / W, "valid") for x in noise)) for W in (3, 12, 50)]
    [3, 12, 50]
    >>> averaging_window(*noise)
    0
    """
    seen = min(WIDEST, (len(op) - 2) // PER_SAMPLE)
    window = _by_echo(op, pv)
    # A window has the notches of its divisors too.
    return window if window > seen else _by_notches(op, pv, seen)


def _by_notches(op: NDArray[np.float64], pv: NDArray[np.float64], widest: int) -> int:
    """Longest window of at most `widest` samples all of whose notches both signals have; 0 where there is none."""
    n = len(op) - 2
    if widest < 2 or _drawn(op) or _drawn(pv):
        return 0
    taper = np.hanning(n + 2)[1:-1]
    powers = [np.abs(np.fft.rfft((z - z.mean()) * taper)) ** 2 for z in (np.diff(op, 2), np.diff(pv, 2))]
    return next((window for window in range(widest, 1, -1) if _notched(powers, n, window)), 0)


def _drawn(x: NDArray[np.float64]) -> bool:
    """Whether a signal rests, is held, or is drawn in straight lines."""
    size, moved = swing(x), np.diff(x)
    held, bent = np.abs(moved) <= ROUNDING * size, np.abs(np.diff(moved)) > EXACT * size
    return bool(np.mean(held) > DRAWN or np.mean(bent) < 1.0 - DRAWN)


def _notched(powers: Sequence[NDArray[np.float64]], n: int, window: int) -> bool:
    """Whether each spectrum has a notch at each multiple of 1 / window, of the shape that a moving average gives it."""
    likelier, per = 0.0, n / window
    for k in range(1, window // 2 + 1):
        inner = slice(int(np.ceil((k - MIDDLE) * per)), int((k + MIDDLE) * per) + 1)
        first, last = int(np.ceil((k - REACH) * per)), int((k + REACH) * per) + 1
        left, right = int((k - BESIDE) * per) + 1, int(np.ceil((k + BESIDE) * per))
        for power in powers:
            middle = power[inner].mean()
            # The mean first, which is hardly ever below the median and found in a tenth of the time.
            if middle > DEEP * power[first:last].mean():
                return False
            if not middle <= DEEP * np.median(np.concatenate([power[first:left], power[right:last]])):
                return False
        f = np.arange(first, min(last, powers[0].size)) / per
        # What leaks in from beside and what rounding adds fill a notch.
        shape = np.sin(np.pi * f) ** 2 + (np.pi / per) ** 2 + 1e-3
        for power in powers:
            part = power[first:last]
            likelier += part.size * np.log(part.mean() / np.mean(part / shape)) - np.log(shape).sum()
    return likelier > 0.0 and (window > 2 or _flat(powers, n) > FLAT)


def _flat(powers: Sequence[NDArray[np.float64]], n: int) -> float:
    """Power of what a mean of two was taken of, near half the sampling rate beside that about a quarter of it."""
    ratios = []
    for power in powers:
        f = np.arange(1, (n + 1) // 2) / n
        before = power[1 : f.size + 1] / (np.cos(np.pi * f) ** 2 * np.sin(np.pi * f) ** 4)
        half, quarter = (before[(f > low) & (f < high)].mean() for low, high in (AT_HALF, AT_QUARTER))
        ratios.append(half / quarter)
    return float(np.sqrt(np.prod(ratios)))


def _by_echo(op: NDArray[np.float64], pv: NDArray[np.float64]) -> int:
    """Window by the autocorrelation of the third differences."""
    n = len(op) - 3
    if n < 100:
        return 0
    echo = np.zeros(n // 4 + 1)
    for x in (op, pv):
        z = np.diff(x, 3)
        if swing(z) == 0.0 or np.median(np.abs(z)) < 0.3 * z.std():
            return 0
        spectrum = np.fft.rfft(z - z.mean(), 1 << (2 * n - 1).bit_length())
        acf = np.fft.irfft(np.abs(spectrum) ** 2)[: echo.size]
        echo += 0.5 * acf / acf[0]
    if echo.size < 13:
        return 0
    window = 4 + int(np.argmin(echo[4 : echo.size // 2 - 1]))
    about = np.arange(-2, 3)
    alike = np.abs(echo[window + about] + 0.5 * echo[np.abs(about)]).max() < 0.15
    return window if alike and np.abs(echo[2 * window + about]).max() < 0.15 else 0
