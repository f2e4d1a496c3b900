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

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.oscillation.further import further_oscillations
from stiction.diagnosis.oscillation.rhythm import MOST_REGULAR, octave, strongest
from stiction.diagnosis.oscillation.signals import about_drift, control_error, error_name, filled, smooth
from stiction.diagnosis.result import Oscillation
from stiction.display.duration_format import format_seconds
from stiction.records.analysis_window import forward_fill_sp

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.oscillation.rhythm import Rhythm
    from stiction.records.record import LoopRecord

__all__ = ["find_oscillation"]

EVENT_SHARE = 0.5  # amplitude a of Haegglund's limit over that of a sine with the signal's deviation
EVENTS, CROSSINGS = 10, 30  # load events that make an oscillation, among so many half periods


def find_oscillation(record: LoopRecord) -> Oscillation:
    """Find the oscillation of a loop, and others beside it.

    Parameters
    ----------
    record : LoopRecord
        Control error (SP - PV, or PV where SP was not recorded, or not before the middle) and OP are used; missing
        values are bridged.

    Returns
    -------
    Oscillation
        `oscillating` is False, with the reason, when the record is too short, flat or irregular.

    Notes
    -----
    Regularity: T = 2 (mean interval between zero crossings of the autocorrelation), r = T / (3 sigma_T), first
    interval skipped (`thornhill2003`). Intervals above and below zero are compared with their own mean, because even
    harmonics make the two differ at a perfectly regular period. A perfect wave's r is infinite; 10, at periods alike
    to 3 %, is the most that is reported. Load events: `haegglund1995`.

    The main oscillation carries most of the control error. Others are looked for in what is left when it has been
    taken off with its harmonics, see `further_oscillations`.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.diagnosis import find_oscillation
    >>> from stiction.records import LoopRecord
    >>> t = np.arange(1000.0)
    >>> wave = np.sin(2 * np.pi * t / 40)
    >>> found = find_oscillation(LoopRecord("FC1", 1.0, op=50 + wave, pv=3 * wave))
    >>> found.oscillating, round(found.period, 1), round(found.amplitude_pv, 1)
    (True, 40.0, 3.0)
    """
    error = control_error(record)
    op = filled(record.op)
    if error is None:
        return _none(_no_error(record))
    by_error = strongest(error)
    best, seen = by_error, error_name(record)
    if not by_error.regular and op is not None:
        by_op = strongest(op)
        if by_op.regular:
            best, seen = by_op, f"OP, but not {seen[0].lower()}{seen[1:]},"
    if not best.period > 0.0:
        return _none("The autocorrelation shows no period of at least 4 samples that occurs 3 times.", by_error.acf)

    events = _load_events(error, best.period)
    oscillating = bool(best.regular or (best.repeats and events >= EVENTS))
    period = best.period * record.dt
    pace = "10 or more" if best.regularity >= MOST_REGULAR else f"{best.regularity:.2f}"
    text = f"{seen} repeats every {format_seconds(period)}, {best.cycles:.0f} times, with regularity {pace}"
    if best.regular:
        reason = f"{text} (above 1 is regular)."
    elif oscillating:
        reason = f"Irregular ({best.regularity:.2f}), but {events} of {CROSSINGS} half periods are load events."
    else:
        reason = f"No regular oscillation: the best candidate, {format_seconds(period)}, {_lack(best)}."
    if best is by_error and best.regular and op is not None:
        agrees = octave(op, best.period)
        reason += " OP has the same period." if _same(agrees, best.period) else " OP has another period, or none."
    if record.sp is not None and forward_fill_sp(record)[0] is None:
        reason += " SP is missing in the first half of the record or more: only PV was examined."
    sp = filled(record.sp) if oscillating else None
    sp_cycles = sp is not None and (rhythm := octave(sp, best.period)).regular and _same(rhythm, best.period)
    if sp_cycles:
        reason += " SP has the same period."
    share, others = float("nan"), ()
    if oscillating and best is by_error:
        share, others = further_oscillations(error, best.period, record.dt)
    if others:
        beside = " and ".join(f"{format_seconds(other.period)} ({other.share:.0%})" for other in others)
        reason += f" It carries {share:.0%} of the error's variance; another oscillation repeats every {beside}."
    return Oscillation(
        oscillating=oscillating,
        period=period,
        regularity=best.regularity,
        amplitude_pv=_amplitude(error, best.period),
        amplitude_op=_amplitude(op, best.period),
        cycles=best.cycles,
        load_events=events,
        load_events_needed=EVENTS,
        acf=best.acf,
        reason=reason,
        share=share,
        others=others,
        sp_cycles=sp_cycles,
    )


def _lack(best: Rhythm) -> str:
    """Say which of the two conditions of an oscillation a candidate does not meet."""
    if best.repeats:
        return f"has regularity {best.regularity:.2f} (needs 1)"
    paced = f"is regular ({best.regularity:.2f}, above 1) but " if best.regularity > 1.0 else ""
    return f"{paced}is not larger than noise would be"


def _same(rhythm: Rhythm, period: float) -> bool:
    """Whether a rhythm has a period [samples], to within what its octave allows."""
    return rhythm.period > 0.0 and abs(rhythm.period / period - 1.0) < 0.15


def _load_events(error: NDArray[np.float64], samples_per_period: float) -> int:
    """Most load events among `CROSSINGS` half periods in a row."""
    wave = about_drift(error, samples_per_period)
    sign = wave > 0.0
    cuts = np.flatnonzero(sign[1:] != sign[:-1]) + 1
    if cuts.size < 2:
        return 0
    area = np.abs(np.add.reduceat(wave, cuts))[:-1]
    limit = 2.0 * EVENT_SHARE * np.sqrt(2.0) * float(wave.std()) * samples_per_period / (2.0 * np.pi)
    counted = np.concatenate(((0,), np.cumsum(area > limit)))
    span = min(CROSSINGS, area.size)
    return int((counted[span:] - counted[:-span]).max())


def _amplitude(x: NDArray[np.float64] | None, samples_per_period: float) -> float:
    """Half peak to peak in each period, median over the periods."""
    if x is None:
        return 0.0
    calm = smooth(x - smooth(x, samples_per_period), samples_per_period / 24.0)
    length = min(max(2, round(samples_per_period)), x.shape[0])
    starts = np.arange(0.0, x.shape[0] - length + 1.0, samples_per_period).astype(np.intp)
    cycles = np.lib.stride_tricks.sliding_window_view(calm, length)[starts]
    return float(np.median(cycles.max(axis=1) - cycles.min(axis=1))) / 2.0


def _no_error(record: LoopRecord) -> str:
    """Say why the control error shows no oscillation."""
    pv = record.pv
    if not len(record):
        return "There are no samples to examine."
    if pv is None or not np.isfinite(pv).any():
        return "PV is missing, so there is no control error to examine."
    if filled(pv) is not None:
        return "PV equals SP, so there is no control error to examine."
    still = f"PV is constant at {np.nanmedian(pv):.4g}"
    if record.sp is None or not np.isfinite(record.sp).any():
        return f"{still}, so there is no control error to examine."
    error = float(np.nanmedian(record.sp - pv))
    return f"{still}, {abs(error):.3g} {'below' if error > 0.0 else 'above'} SP: a steady error is not an oscillation."


def _none(reason: str, acf: NDArray[np.float64] | None = None) -> Oscillation:
    nan = float("nan")
    lags = np.empty(0) if acf is None else acf
    return Oscillation(
        False, nan, nan, nan, nan, 0.0, load_events=0, load_events_needed=EVENTS, acf=lags, reason=reason
    )
