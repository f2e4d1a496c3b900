"""Moving average: OP and PV were averaged over several samples, which leaves notches in the spectrum of their noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.records.check_result import CheckResult, check_maximum
from stiction.records.correlation import lagged_products, next_fast_length
from stiction.records.quality.compression import EXACT
from stiction.records.quality.quantisation import ROUNDING, peak_to_peak

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["check_moving_average", "detect_averaging_window"]

MIDDLE, BESIDE, REACH = 0.05, 0.15, 0.4
"""Half width of a notch, and distances from its middle between which its surroundings lie [1 / window]."""
MIN_FLATNESS = 0.8
"""Power at half over a quarter of the sampling rate, above which a window of 2 is an average and no filter [-]."""


def detect_averaging_window(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    *,
    max_window: int = 20,
    min_samples_per_window: int = 30,
    max_notch_power: float = 0.2,
    max_drawn_share: float = 0.2,
) -> int:
    """Find the window of the moving average that both OP and PV went through.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span] and process variable [engineering units], without NaN.
    max_window : int
        Longest window that is found by notches [samples]; longer ones are found by their echo.
    min_samples_per_window : int
        Fewest samples of the record for each sample of the window [-].
    max_notch_power : float
        Largest power in a notch, as a share of the power around it [-].
    max_drawn_share : float
        Share of the samples that may repeat the last value or lie halfway between their neighbours [-]; held and
        interpolated signals have notches too.

    Returns
    -------
    int
        The window [samples]; 0 when there is none, or too little noise to see it.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(size=(2, 900))
    >>> [detect_averaging_window(*(np.convolve(x, np.ones(W) / W, "valid") for x in noise)) for W in (3, 12, 50)]
    [3, 12, 50]
    >>> detect_averaging_window(*noise)
    0
    """
    longest = min(max_window, (len(op) - 2) // min_samples_per_window)
    window = _window_from_echo(op, pv)
    if window > longest or longest < 2 or any(_drawn_share_exceeds(x, max_drawn_share) for x in (op, pv)):
        return window if window > longest else 0
    n, taper = next_fast_length(len(op) - 2), np.hanning(len(op))[1:-1]
    powers = [_power((z - z.mean()) * taper, n) for z in (np.diff(op, 2), np.diff(pv, 2))]
    # A window has the notches of its divisors too: the longest one counts.
    return next((w for w in range(longest, 1, -1) if _has_notches(powers, n, w, max_notch_power)), 0)


def check_moving_average(
    op: NDArray[np.float64], pv: NDArray[np.float64], dt: float, period: float | None
) -> CheckResult | None:
    """OP and PV, sampled every `dt` [s], averaged over several samples of an oscillation with `period` [s]."""
    window = detect_averaging_window(op, pv)
    if not window:
        return None
    # In a short record notches may be there by chance.
    seem = "are" if len(op) >= 150 else "look like"
    finding, remedy = f"OP and PV {seem} moving averages over {format_seconds(window * dt)}", "export raw values"
    if period is None:
        return CheckResult("moving average", "warn", window, 1, "samples", finding, remedy)
    share = window * dt / period
    finding += f", {100.0 * share:.3g} % of a cycle"
    return check_maximum("moving average", share, "cycles", warn=0.0, reject=1 / 3, finding=finding, remedy=remedy)


def _drawn_share_exceeds(x: NDArray[np.float64], limit: float) -> bool:
    """Whether a signal is constant, held, or drawn as straight lines in more than a share of its samples."""
    width, moved = peak_to_peak(x), np.diff(x)
    held, bent = np.abs(moved) <= ROUNDING * width, np.abs(np.diff(moved)) > EXACT * width
    return bool(np.mean(held) > limit or np.mean(bent) < 1.0 - limit)


def _has_notches(powers: Sequence[NDArray[np.float64]], n: int, window: int, max_power: float) -> bool:
    """Whether each spectrum has a notch at each multiple of 1 / window, with the shape that an average gives it."""
    log_likelihood, per = 0.0, n / window
    for k in range(1, window // 2 + 1):
        inner = slice(int(np.ceil((k - MIDDLE) * per)), int((k + MIDDLE) * per) + 1)
        first, last = int(np.ceil((k - REACH) * per)), int((k + REACH) * per) + 1
        left, right = int((k - BESIDE) * per) + 1, int(np.ceil((k + BESIDE) * per))
        for power in powers:
            middle = power[inner].mean()
            # The mean first: it is rarely below the median, and much faster.
            if middle > max_power * power[first:last].mean():
                return False
            if not middle <= max_power * np.median(np.concatenate([power[first:left], power[right:last]])):
                return False
        f = np.arange(first, min(last, powers[0].size)) / per
        # Leakage from beside the notch, and rounding, fill it a little.
        shape = np.sin(np.pi * f) ** 2 + (np.pi / per) ** 2 + 1e-3
        for power in powers:
            part = power[first:last]
            log_likelihood += part.size * np.log(part.mean() / np.mean(part / shape)) - np.log(shape).sum()
    return log_likelihood > 0.0 and (window > 2 or _flatness(powers, n) > MIN_FLATNESS)


def _power(x: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """Power spectrum of a signal, zeros added up to so many samples."""
    spectrum = np.fft.rfft(x, size)
    return spectrum.real**2 + spectrum.imag**2


def _flatness(powers: Sequence[NDArray[np.float64]], n: int) -> float:
    """Power before an average of two, near half the sampling rate over near a quarter of it [-]."""
    ratios = []
    for power in powers:
        f = np.arange(1, (n + 1) // 2) / n
        before = power[1 : f.size + 1] / (np.cos(np.pi * f) ** 2 * np.sin(np.pi * f) ** 4)
        half, quarter = (before[(f > low) & (f < high)].mean() for low, high in ((0.40, 0.48), (0.22, 0.32)))
        ratios.append(half / quarter)
    return float(np.sqrt(np.prod(ratios)))


def _window_from_echo(op: NDArray[np.float64], pv: NDArray[np.float64]) -> int:
    """Window from the autocorrelation of the third differences [samples]; 0 when there is none."""
    n = len(op) - 3
    if n < 100:
        return 0
    differences = [np.diff(x, 3) for x in (op, pv)]
    if any(peak_to_peak(z) == 0.0 or np.median(np.abs(z)) < 0.3 * z.std() for z in differences):
        return 0
    centred = [z - z.mean() for z in differences]
    echo = np.sum([lagged_products(z, z, n // 4 + 1) / (2.0 * n * z.var()) for z in centred], axis=0)
    if echo.size < 13:
        return 0
    window = 4 + int(np.argmin(echo[4 : echo.size // 2 - 1]))
    lags = np.arange(-2, 3)
    is_echo = np.abs(echo[window + lags] + 0.5 * echo[np.abs(lags)]).max() < 0.15
    return window if is_echo and np.abs(echo[2 * window + lags]).max() < 0.15 else 0
