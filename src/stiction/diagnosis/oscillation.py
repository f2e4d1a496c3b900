"""Is the loop oscillating: how fast, how regularly, how large.

Two published rules are asked, both of the control error about its slow drift:

- Thornhill, Huang and Zhang 2003 (`thornhill2003`): the zero crossings of the autocorrelation are regular,
  r = (1/3) T / sigma_T > 1, which noise cannot imitate because its autocorrelation dies out.
- Haegglund 1995 (`haegglund1995`): ten load events, half periods whose integrated absolute error exceeds that of a
  sine, 2 a / omega. The rule sets a to 1 % of span; records here come in any unit, so a is a share of the signal's
  own deviation and the rule asks for a wave of one size, not for a wave of a known size.

Both have to repeat: noise in a band also has a period, but its autocorrelation one period later falls as one over
the root of the number of periods, and a wave must stand above that.

The period is sought octave by octave, each octave freed of slower drift and faster noise by moving averages.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.result import Oscillation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["about_drift", "autocorrelation", "control_error", "filled", "find_oscillation", "half_cycles", "smooth"]

SHORTEST = 4.0  # samples per period below which a wave cannot be told from noise
FEWEST = 3.0  # periods a record must hold
CHANCE = 1.5  # autocorrelation one period later times sqrt(periods): noise of any colour stays below, see the tests
INTERVALS = 11  # intervals between zero crossings used, the first skipped (Thornhill 2003)
EVENT_SHARE = 0.5  # amplitude a of Haegglund's limit over that of a sine with the signal's deviation
EVENTS, CROSSINGS = 10, 30  # load events that make an oscillation, among so many half periods


class _Rhythm(NamedTuple):
    period: float  # [samples]
    regularity: float
    height: float  # autocorrelation one period later
    cycles: float  # periods in the record
    power: float  # variance of the octave times height: what the wave carries
    acf: NDArray[np.float64]

    @property
    def repeats(self) -> bool:
        return bool(self.height * np.sqrt(self.cycles) > CHANCE)

    @property
    def regular(self) -> bool:
        return self.regularity > 1.0 and self.repeats


_NOTHING = _Rhythm(np.nan, np.nan, np.nan, 0.0, 0.0, np.empty(0))


def find_oscillation(record: LoopRecord) -> Oscillation:
    """Find the dominant oscillation of a loop.

    Parameters
    ----------
    record : LoopRecord
        Control error (SP - PV, or PV where no SP was recorded) and OP are used; missing values are bridged.

    Returns
    -------
    Oscillation
        `oscillating` is False, with the reason, when the record is too short, flat or irregular.

    Notes
    -----
    Regularity: T = 2 (mean interval between zero crossings of the autocorrelation), r = T / (3 sigma_T), first
    interval skipped (`thornhill2003`). Intervals above and below zero are compared with their own mean, because even
    harmonics make the two differ at a perfectly regular period. Load events: `haegglund1995`.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records.record import LoopRecord
    >>> t = np.arange(1000.0)
    >>> wave = np.sin(2 * np.pi * t / 40)
    >>> found = find_oscillation(LoopRecord("FC1", 1.0, op=50 + wave, pv=3 * wave))
    >>> found.oscillating, round(found.period, 1), round(found.amplitude_pv, 1)
    (True, 40.0, 3.0)
    """
    error = control_error(record)
    op = filled(record.op)
    if error is None:
        return _none("PV is missing or does not move, so there is no error to look at.")
    by_error = _strongest(error)
    best, seen = by_error, "the control error"
    if not by_error.regular and op is not None:
        by_op = _strongest(op)
        if by_op.regular:
            best, seen = by_op, "OP, though not the control error,"
    if not best.period > 0.0:
        return _none("The autocorrelation shows no period of at least 4 samples that occurs 3 times.", by_error.acf)

    events, needed = _load_events(error, best.period)
    oscillating = bool(best.regular or (best.repeats and events >= needed))
    period = best.period * record.dt
    text = f"{seen} repeats every {period:.4g} s, {best.cycles:.0f} times, with regularity {best.regularity:.2f}"
    if best.regular:
        reason = f"{text[0].upper()}{text[1:]} (above 1 is regular)."
    elif oscillating:
        reason = f"Irregular ({best.regularity:.2f}), but {events} of {CROSSINGS} half periods are load events."
    else:
        lack = "does not stand out of noise" if not best.repeats else f"has regularity {best.regularity:.2f} (needs 1)"
        reason = f"No regular oscillation: the best candidate, {period:.4g} s, {lack}."
    if best is by_error and best.regular and op is not None:
        agrees = _octave(op, best.period)
        same = agrees.period > 0.0 and abs(agrees.period / best.period - 1.0) < 0.15
        reason += " OP has the same period." if same else " OP does not share it."
    return Oscillation(
        oscillating=oscillating,
        period=period,
        regularity=best.regularity,
        amplitude_pv=_amplitude(error, best.period),
        amplitude_op=_amplitude(op, best.period),
        cycles=best.cycles,
        load_events=events,
        load_events_needed=needed,
        acf=best.acf,
        reason=reason,
    )


def control_error(record: LoopRecord) -> NDArray[np.float64] | None:
    """SP - PV, or -PV without a set point [engineering units], shape (n_samples,); None where PV does not move."""
    if record.pv is None:
        return None
    return filled(-record.pv if record.sp is None else record.sp - record.pv)


def filled(x: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
    """Bridge missing values by straight lines; None when under half of the signal is there or it never moves."""
    if x is None:
        return None
    good = np.isfinite(x)
    count = int(np.count_nonzero(good))
    if count < max(8, x.shape[0] // 2):
        return None
    at = np.arange(x.shape[0])
    whole = x if count == x.shape[0] else np.interp(at, at[good], x[good])
    low, high = float(whole.min()), float(whole.max())
    return whole if high - low > 1e-12 * max(abs(low), abs(high)) else None


def smooth(x: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """Centred moving average over `width` samples, a fractional number, with straight lines beyond the ends."""
    n = x.shape[0]
    half = (min(width, n - 1.0) - 1.0) / 2.0
    if half <= 0.0:
        return x
    whole = int(half)
    pad = whole + 1
    reach = min(n - 1, 2 * pad)
    x0, slope0 = _end(x[: reach + 1])
    x1, slope1 = _end(x[::-1][: reach + 1])
    steps = np.arange(pad, 0.0, -1.0)
    long = np.concatenate((x0 - slope0 * steps, x, x1 - slope1 * steps[::-1]))
    total = np.concatenate(((0.0,), np.cumsum(long)))
    inner = total[pad + whole + 1 : pad + whole + 1 + n] - total[pad - whole : pad - whole + n]
    ends = long[pad - whole - 1 : pad - whole - 1 + n] + long[pad + whole + 1 : pad + whole + 1 + n]
    return (inner + (half - whole) * ends) / (2.0 * half + 1.0)


def _end(x: NDArray[np.float64]) -> tuple[float, float]:
    """Value at the first sample and slope of the least-squares line through `x`."""
    m = x.shape[0]
    t = np.arange(m) - (m - 1) / 2.0
    slope = float(t @ x) / float(t @ t)
    return float(x.mean()) - slope * (m - 1) / 2.0, slope


def about_drift(x: NDArray[np.float64], samples_per_period: float) -> NDArray[np.float64]:
    """Take off the moving average over one period: the wave stays as it is, slower drift goes."""
    return x - smooth(x, samples_per_period)


def half_cycles(x: NDArray[np.float64], samples_per_period: float) -> NDArray[np.intp]:
    """Cut a signal that swings about zero into half periods.

    A half period ends where the signal, smoothed over a tenth of a period, crosses zero on its way through a band of
    a quarter of its deviation on either side; smaller crossings are noise.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        Signal about its drift.
    samples_per_period : float
        Period over sampling period [-].

    Returns
    -------
    ndarray, shape (n_half_periods, 2)
        First sample and the one past the last of each half period; the cut ones at the ends are left out.

    Examples
    --------
    >>> import numpy as np
    >>> half_cycles(np.sin(2 * np.pi * (np.arange(100) + 0.5) / 20), 20.0)[:3].tolist()
    [[10, 20], [20, 30], [30, 40]]
    """
    none = np.empty((0, 2), dtype=np.intp)
    if not samples_per_period > 0.0:
        return none
    calm = smooth(x, samples_per_period / 10.0)
    outside = np.flatnonzero(np.abs(calm) > 0.25 * float(calm.std()))
    if outside.size < 3:
        return none
    side = calm[outside] > 0.0
    turns = np.flatnonzero(side[1:] != side[:-1])
    positive = calm > 0.0
    crossings = np.flatnonzero(positive[1:] != positive[:-1]) + 1
    first = np.searchsorted(crossings, outside[turns], side="right")
    last = np.searchsorted(crossings, outside[turns + 1], side="right") - 1
    cuts = (crossings[first] + crossings[last] + 1) // 2
    segments = np.column_stack((cuts[:-1], cuts[1:]))
    return segments[segments[:, 1] - segments[:, 0] > max(2.0, 0.1 * samples_per_period)]


def autocorrelation(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Autocorrelation at lags 0 .. 3/4 n [-], each lag over the pairs it has (unbiased), 1 at lag 0."""
    n = x.shape[0]
    lags = max(2, (3 * n) // 4)
    size = 1 << (n + lags - 1).bit_length()
    spectrum = np.fft.rfft(x - x.mean(), size)
    acf = np.fft.irfft(spectrum.real**2 + spectrum.imag**2, size)[:lags] / np.arange(n, n - lags, -1.0)
    return acf / acf[0] if acf[0] > 0.0 else np.zeros(lags)


def _strongest(x: NDArray[np.float64]) -> _Rhythm:
    """Find the octave whose wave carries most, regular ones first."""
    best = _NOTHING
    longest = x.shape[0] / FEWEST
    for octave in range(int(np.log2(max(longest / SHORTEST, 1.0))) + 1):
        found = _octave(x, 0.75 * 2.0 * SHORTEST * 2.0**octave)
        if (found.regular, found.power) > (best.regular, best.power):
            best = found
    return best


def _octave(x: NDArray[np.float64], around: float) -> _Rhythm:
    """Find the rhythm with a period between 0.6 and 1.5 of `around` [samples]."""
    band = about_drift(smooth(x, around / 12.0), 4.0 / 3.0 * around)
    acf = autocorrelation(band)
    above = acf > 0.0
    at = np.flatnonzero(above[1:] != above[:-1])[: INTERVALS + 1]
    crossings = at + acf[at] / (acf[at] - acf[at + 1])
    intervals = np.diff(crossings)
    if intervals.size < 3:
        return _NOTHING
    period = 2.0 * float(intervals.mean())
    if not max(SHORTEST, 0.6 * around) <= period <= min(x.shape[0] / FEWEST, 1.5 * around):
        return _NOTHING
    spread = np.concatenate([part - part.mean() for part in (intervals[::2], intervals[1::2])])
    sigma = 2.0 * np.sqrt(float(spread @ spread) / max(1, intervals.size - 2))
    height = float(acf[min(round(period), acf.shape[0] - 1)])
    regularity = period / (3.0 * max(sigma, 1e-3 * period))
    return _Rhythm(period, regularity, height, x.shape[0] / period, float(band.var()) * max(height, 0.0), acf)


def _load_events(error: NDArray[np.float64], samples_per_period: float) -> tuple[int, int]:
    """Most load events among `CROSSINGS` half periods in a row, and how many make an oscillation."""
    wave = about_drift(error, samples_per_period)
    sign = wave > 0.0
    cuts = np.flatnonzero(sign[1:] != sign[:-1]) + 1
    if cuts.size < 2:
        return 0, EVENTS
    area = np.abs(np.add.reduceat(wave, cuts))[:-1]
    limit = 2.0 * EVENT_SHARE * np.sqrt(2.0) * float(wave.std()) * samples_per_period / (2.0 * np.pi)
    counted = np.concatenate(((0,), np.cumsum(area > limit)))
    span = min(CROSSINGS, area.size)
    return int((counted[span:] - counted[:-span]).max()), EVENTS


def _amplitude(x: NDArray[np.float64] | None, samples_per_period: float) -> float:
    """Half peak to peak in each period, median over the periods."""
    if x is None:
        return 0.0
    calm = smooth(x - smooth(x, samples_per_period), samples_per_period / 24.0)
    length = min(max(2, round(samples_per_period)), x.shape[0])
    starts = np.arange(0.0, x.shape[0] - length + 1.0, samples_per_period).astype(np.intp)
    cycles = np.lib.stride_tricks.sliding_window_view(calm, length)[starts]
    return float(np.median(cycles.max(axis=1) - cycles.min(axis=1))) / 2.0


def _none(reason: str, acf: NDArray[np.float64] | None = None) -> Oscillation:
    nan = float("nan")
    lags = np.empty(0) if acf is None else acf
    return Oscillation(False, nan, nan, nan, nan, 0.0, 0, EVENTS, lags, reason)
