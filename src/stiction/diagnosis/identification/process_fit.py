"""The process behind a valve: gain, lags and dead time, by the error of its simulation from the valve position."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.result import ProcessFit
from stiction.diagnosis.identification.simplex_search import simplex_search
from stiction.diagnosis.identification.stems import first_order_lags, process_products
from stiction.records.correlation import next_fast_length

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.signals import BlockSignals

__all__ = ["FittedProcess", "fit_process", "in_seconds", "pv_on_record", "remove_local_mean", "simulate_process"]


class FittedProcess(NamedTuple):
    """A process in units of blocks."""

    gain: float
    """Steady gain [PV units per % of span]; of an integrating process per % of span and block."""
    slow: float
    """Larger time constant [blocks]; infinite of an integrating process."""
    fast: float
    """Smaller time constant [blocks]; 0 where one is enough."""
    dead_time: float
    """Dead time [blocks]."""
    error: float
    """Sum of squared simulation errors over that of the PV, both about their local means [-]."""


def simulate_process(
    position: NDArray[np.float64], process: FittedProcess, period: float | None
) -> NDArray[np.float64]:
    """Simulate the PV about its local mean from a valve position.

    The position is in % of span, the period of its local mean in blocks; the PV comes in engineering units.
    """
    answer = _lagged(remove_local_mean(position, period), process.slow, process.fast)
    return process.gain * _delayed(answer - answer.mean(), process.dead_time)


def fit_process(
    position: NDArray[np.float64],
    pv: NDArray[np.float64],
    period: float | None,
    sign: float = 0.0,
    integrating: bool | None = None,
) -> FittedProcess:
    """Fit a process of one or two lags, or an integrator, with dead time.

    Position [% of span] and PV [engineering units] are compared about their moving averages over the period [blocks].
    The gain must have the `sign`, 0 for any; it is 0 where no process explains anything. `integrating` None tries both.

    Notes
    -----
    A grid over time constants and all dead times up to a period (a third of the record without one), with the gain by
    least squares in closed form, then a simplex search (Nelder and Mead) over time constants and dead time.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> u = np.repeat(rng.normal(size=60), 10)
    >>> truth = FittedProcess(2.0, 8.0, 0.0, 3.0, 0.0)
    >>> found = fit_process(u, simulate_process(u, truth, None), None)
    >>> round(found.gain, 2), round(found.slow, 1), round(found.dead_time, 1)
    (2.0, 8.0, 3.0)
    """
    target = remove_local_mean(pv, period)
    u = remove_local_mean(position, period)
    scale = 36.0 if period is None else period
    max_delay = int(min(scale, target.size // 3))
    compared = compared_part(target.size, period)
    energy = float(target[compared] @ target[compared])
    if not energy > 0.0 or not float(u @ u) > 0.0:
        return FittedProcess(0.0, scale, 0.0, 0.0, 1.0)
    slow = [] if integrating else list(scale * np.geomspace(0.03, 2.0, 10))
    pairs = [(a, b * a) for a in slow for b in (0.0, 0.5)]
    if integrating is not False:
        pairs += [(np.inf, b * scale) for b in (0.0, 0.05, 0.2)]
    answers = np.array([_lagged(u, a, b) for a, b in pairs])
    answers -= answers.mean(axis=1, keepdims=True)
    error, delay = _best_delays(answers, target, compared, max_delay, sign)
    best = int(np.argmin(error))
    integrates = math.isinf(pairs[best][0])

    def of(x: NDArray[np.float64]) -> FittedProcess:
        ratio = min(max(float(x[1]), 0.0), 1.0)
        a = math.inf if integrates else math.exp(min(max(x[0], -3.0), math.log(20.0 * scale)))
        b = ratio * (scale if integrates else a)
        d = min(max(float(x[2]), 0.0), float(max_delay))
        keep = 1.0 if integrates else math.exp(-1.0 / a), math.exp(-1.0 / max(b, 1e-3))
        power, cross = process_products(u, *keep, d, target, compared.start, compared.stop)
        gain = cross / power if power > 0.0 and cross * sign >= 0.0 else 0.0
        return FittedProcess(gain, a, b, d, 1.0 - gain * (2.0 * cross - gain * power) / energy)

    a, b = pairs[best]
    start = np.array([0.0 if integrates else np.log(a), b / (scale if integrates else a), float(delay[best])])
    steps = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 1.5]])
    point, _ = simplex_search(lambda x: of(x).error, start + steps, 50, 1e-3, 1e-6)
    return of(point)


def _lagged(u: NDArray[np.float64], slow: float, fast: float) -> NDArray[np.float64]:
    """Answer of one or two lags of unit gain, or of an integrator, to a signal."""
    y = np.cumsum(u) if np.isinf(slow) else first_order_lags(u, slow, settled=False)
    return first_order_lags(y, fast, settled=False)


def _delayed(y: NDArray[np.float64], delay: float) -> NDArray[np.float64]:
    """A signal later by a delay that need not be whole [samples]; the first value stands before it."""
    whole = int(delay)
    part = delay - whole
    later = np.concatenate([np.full(whole, y[0]), y[: y.size - whole]])
    return later if part == 0.0 else (1.0 - part) * later + part * np.concatenate([later[:1], later[:-1]])


def compared_part(n: int, period: float | None) -> slice:
    """Samples whose local mean is that of a whole period, which are compared."""
    half = 0 if period is None else min(round(period / 2.0), n // 4)
    return slice(half, n - half)


def _best_delays(
    answers: NDArray[np.float64], target: NDArray[np.float64], compared: slice, max_delay: int, sign: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Smallest error of each answer over all dead times, with the gain by least squares, and that dead time."""
    n = target.size
    wanted = np.zeros(n)
    wanted[compared] = target[compared]
    size = next_fast_length(n + max_delay)
    spectrum = np.fft.rfft(answers, size, axis=1).conj() * np.fft.rfft(wanted, size)
    cross = np.fft.irfft(spectrum, size, axis=1)[:, : max_delay + 1]
    total = np.cumsum(np.pad(answers**2, ((0, 0), (1, 0))), axis=1)
    delays = np.arange(max_delay + 1)
    power = total[:, np.maximum(compared.stop - delays, 0)] - total[:, np.maximum(compared.start - delays, 0)]
    gain = cross / np.maximum(power, 1e-300)
    explained = np.where(gain * sign < 0.0, 0.0, cross * gain)
    delay = np.argmax(explained, axis=1)
    return 1.0 - explained[np.arange(len(answers)), delay] / float(wanted @ wanted), delay


def in_seconds(process: FittedProcess, dt: float) -> ProcessFit:
    """A process in units of blocks of `dt` [s] as one in seconds."""
    integrating = bool(np.isinf(process.slow))
    slow = 0.0 if integrating else process.slow
    return ProcessFit(
        gain=process.gain / dt if integrating else process.gain,
        time_constant=(slow + process.fast) * dt,
        dead_time=process.dead_time * dt,
        integrating=integrating,
        lag=0.0 if integrating else process.fast * dt,
    )


def pv_on_record(
    signals: BlockSignals, position: NDArray[np.float64], process: FittedProcess, n_samples: int
) -> NDArray[np.float64]:
    """Simulated PV at the samples of the record [engineering units]; NaN where it was not compared."""
    drift = signals.pv - remove_local_mean(signals.pv, signals.period)
    pv = drift + simulate_process(position, process, signals.period)
    compared = compared_part(pv.size, signals.period)
    out = np.full(n_samples, np.nan)
    samples = np.arange(compared.start * signals.samples, compared.stop * signals.samples)
    centres = (np.arange(pv.size) + 0.5) * signals.samples - 0.5
    out[signals.first + samples] = np.interp(samples, centres, pv)
    return out


def remove_local_mean(x: NDArray[np.float64], period: float | None) -> NDArray[np.float64]:
    """Take the moving average over one period off a signal, or its mean where there is no period.

    An oscillation of that period passes unchanged; constants and ramps vanish, so that a slow load does not matter.

    The period is in samples. At the ends, where no whole period is centred, the nearest average is taken off.
    """
    n = x.shape[-1]
    half = 0 if period is None else min(max(round(period / 2.0), 2), max((n - 1) // 4, 1))
    if half == 0:
        return x - x.mean(axis=-1, keepdims=True)
    total = np.cumsum(np.concatenate([np.zeros((*x.shape[:-1], 1)), x], axis=-1), axis=-1)
    width = 2 * half
    # Half weight at both ends of the window, so that it is as long as the period.
    mean = 0.5 * (total[..., width:-1] - total[..., : -width - 1] + total[..., width + 1 :] - total[..., 1:-width])
    mean = np.concatenate([mean[..., :1].repeat(half, -1), mean, mean[..., -1:].repeat(half, -1)], axis=-1) / width
    return x - mean
