"""Stretches of a record: in manual, frozen, torn, not reached, and the longest one that can be analysed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.hand import stepped
from stiction.records.limits import clipped, saturated, shut
from stiction.records.missing_values import missing
from stiction.records.rests import (
    BRIDGE,
    FROZEN,
    MOST_RESTS,
    SELDOM,
    bridged,
    filled,
    hardly_rests,
    lengths_of,
    moves_in,
    repeats,
    runs,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["analysis_window", "frozen", "held_set_point", "in_manual", "torn", "unreached", "usable_part"]

MANUAL = 60
"""Samples for which OP must rest, PV moving, to count as in manual when the mode was not recorded; PV, to be frozen."""
UNREACHED = 6
"""Samples for which OP and PV must rest together where they hardly ever rest, for the historian not to be reached."""
LEAP = 3.0
"""Usual moves from sample to sample, the median, beyond which a signal leaps [-]."""
TEAR = 3.0
"""Bend of OP and PV at once, over one that 95 % of the samples stay below, beyond which they break off together [-].
Noise that the controller passes on bends both by up to 2.5."""
TEARS = 20
"""Clock jumps above which no more are looked for."""


def in_manual(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where the mode says so, or OP rests for long or is `stepped` while PV moves, shape (n_samples,).

    Long is less where OP hardly ever rests: no controller that moves at every sample forgets to for a dozen. One that
    is slower than the record rests again and again, and is not meant.
    """
    mask = np.zeros(len(record), dtype=bool) if record.auto is None else ~record.auto
    at_limit, steps = saturated(record), stepped(record)
    for first, last in runs(steps):
        mask[first:last] |= moves_in(record.pv, first, last) & ~at_limit[first:last]
    known = at_limit | steps
    rests = [(start - 1, last) for start, last in runs(repeats(record.op)) if not known[start - 1 : last].all()]
    enough = FROZEN if hardly_rests(lengths_of(rests), len(record)) else max(MANUAL, len(record) // 20)
    for first, last in rests:
        if last - first >= enough and moves_in(record.pv, first, last):
            mask[first:last] = True
    return mask


def frozen(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where PV stands still for long as it does only a few times in the record, shape (n_samples,).

    A valve that sticks without noise, or a coarse transmitter, lets PV rest again and again, and is not meant.
    """
    if record.pv is None:
        return np.zeros(len(record), dtype=bool)
    still = repeats(record.pv)
    return _long_rests(still, runs(still), FROZEN)


def unreached(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where OP and PV stand still together as they do only a few times in the record, shape (n_samples,).

    There the historian was not reached, and then one of them leaps at least. A loop at rest before it is first moved,
    or an interpolated stretch between equal values, is not meant.
    """
    if record.pv is None or len(record) < MANUAL:
        return np.zeros(len(record), dtype=bool)
    still = repeats(record.op), repeats(record.pv)
    moves = [np.abs(np.diff(bridged(x), append=x[-1])) for x in (record.op, record.pv)]
    leaps = np.any([move > LEAP * np.nanmedian(move) for move in moves], axis=0)
    together = [(first, last) for first, last in runs(still[0] & still[1]) if first > 1 and leaps[last - 1]]
    return _long_rests(still[0] | still[1], together, UNREACHED)


def _long_rests(still: NDArray[np.bool_], rests: list[tuple[int, int]], least: int) -> NDArray[np.bool_]:
    """Mark the long ones of some rests, where they are few and all others far shorter.

    `least` samples are long where hardly any other one is `still`; elsewhere `MANUAL` or a twentieth of the record are.
    """
    mask = np.zeros(still.size, dtype=bool)
    lengths = lengths_of(rests)
    seldom = np.count_nonzero(still) - lengths[lengths >= least].sum() < SELDOM * still.size
    long = lengths >= (least if seldom else max(MANUAL, still.size // 20))
    others = lengths[~long]
    if not 1 <= long.sum() <= MOST_RESTS or (others.size and 4 * others.max() > lengths[long].min()):
        return mask
    for (first, last), is_long in zip(rests, long, strict=True):
        mask[first - 1 : last] |= is_long
    return mask


def torn(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where OP and PV break off together, as often as the clock jumped at most, shape (n_samples,)."""
    mask = np.zeros(len(record), dtype=bool)
    jumps = record.provenance.clock_jumps
    if not jumps or record.pv is None or len(record) < MANUAL:
        return mask
    size = np.full(len(record), np.inf)
    for x in (record.op, record.pv):
        bend = np.abs(np.diff(x, 2, prepend=(x[0], x[0])))
        usual = float(np.nanpercentile(bend, 95.0)) if np.isfinite(bend).any() else 0.0
        size = np.fmin(size, bend / usual if usual > 0.0 else 0.0)
    for _ in range(min(jumps, TEARS)):
        k = int(np.argmax(size))
        if not size[k] > TEAR:
            break
        mask[k] = True
        size[max(k - 2, 0) : k + 3] = 0.0
    return mask


def analysis_window(record: LoopRecord) -> tuple[int, int]:
    """Find the longest stretch in automatic, OP not clipped or shut, PV not frozen, no clock jump or long gap.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.

    Returns
    -------
    first, last : int
        The samples ``first <= k < last``; equal when there is none.

    Examples
    --------
    >>> from stiction.records import LoopRecord, analysis_window
    >>> op = [50.0, 51.0, float("nan"), 52.0] + 9 * [float("nan")] + [50.0, 51.0]
    >>> analysis_window(LoopRecord("FIC-101", 1.0, op=op, pv=op))
    (0, 4)
    """
    gone = missing(record)
    blocked = clipped(record) | shut(record) | in_manual(record) | frozen(record) | torn(record)
    good = ~(gone | blocked)
    for first, last in runs(gone):
        inside = first > 0 and last < len(gone) and good[first - 1] and good[last]
        if inside and last - first <= BRIDGE and not blocked[first:last].any():
            good[first:last] = True
    return max(runs(good), key=lambda run: run[1] - run[0], default=(0, 0))


def usable_part(record: LoopRecord) -> LoopRecord:
    """Cut the analysis window as a record of its own, what is missing of its signals bridged, and said so.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.

    Returns
    -------
    LoopRecord
        The samples of `analysis_window`; empty when there is no such stretch. OP, PV, valve position and valve signal
        hold the last value over at most `BRIDGE` samples, and are NaN in longer gaps; the set point is held over any
        gap, see `held_set_point`. `start` is that of the window, `bad` of the provenance counts the samples that were
        bridged, and its guesses say what was done.

    Examples
    --------
    >>> from stiction.records import LoopRecord, usable_part
    >>> op = 7 * [float("nan")] + [50.0, 51.0, float("nan"), 52.0]
    >>> part = usable_part(LoopRecord("FIC-101", 1.0, op=op, pv=op))
    >>> part.op.tolist(), part.provenance.bad, part.provenance.guesses
    ([50.0, 51.0, 51.0, 52.0], 1, ('1 missing samples were bridged by holding the last value.',))
    """
    first, last = analysis_window(record)
    part = record.window(first, last)
    if not len(part):
        return part
    sp, about_sp = held_set_point(record, first, last)
    signals = {name: getattr(part, name) for name in ("op", "pv", "mv", "valve_signal")}
    held = {name: bridged(x) for name, x in signals.items() if x is not None}
    count = int(missing(part).sum())
    about_gaps = f"{count} missing samples were bridged by holding the last value." if count else ""
    told = tuple(text for text in (about_gaps, about_sp) if text)
    if not told:
        return replace(part, **held, sp=sp)
    origin = replace(part.provenance, guesses=(*part.provenance.guesses, *told))
    return replace(part, **held, sp=sp, provenance=origin)


def held_set_point(
    record: LoopRecord, first: int = 0, last: int | None = None
) -> tuple[NDArray[np.float64] | None, str]:
    """Hold a set point over what is missing of it: what is stored on change only did not change.

    Parameters
    ----------
    record : LoopRecord
        The record.
    first, last : int, optional
        The samples ``first <= k < last`` that are asked for; all by default.

    Returns
    -------
    sp : ndarray, shape (last - first,), or None
        The set point of these without gaps [engineering units]; before the first value stored it is taken to have been
        that one. None where none is known in their first half.
    told : str
        What was guessed, in a sentence; empty where nothing was.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records import LoopRecord
    >>> op, sp = np.arange(4.0), np.array([np.nan, 3.0, np.nan, 4.0])
    >>> held, told = held_set_point(LoopRecord("FIC-101", 1.0, op=op, sp=sp))
    >>> held.tolist(), told
    ([3.0, 3.0, 3.0, 4.0], 'The set point of the first 1 of 4 samples is taken to be the first stored.')
    """
    if record.sp is None:
        return None, ""
    sp = filled(record.sp)[first:last]
    unknown = int(np.count_nonzero(~np.isfinite(sp)))
    which = f"The set point of the first {unknown} of {sp.size} samples"
    if 2 * unknown > sp.size:
        return None, f"{which} is not known, and it is left out."
    if not unknown:
        return sp, ""
    return np.concatenate([np.repeat(sp[unknown], unknown), sp[unknown:]]), f"{which} is taken to be the first stored."
