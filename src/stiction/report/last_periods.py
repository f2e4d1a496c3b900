"""Which periods a plot of one signal against another shows: the last ones that have something to show."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.records.runs import runs
from stiction.report import labels
from stiction.report.downsample import MAX_POINTS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.report.loop_view import LoopView

__all__ = ["LastPeriods", "last_periods", "rests_before_slips"]

PERIODS, FEWEST = 6, 20
"""Periods shown, and fewest samples of them [-]."""
ANALYSED = "the analysed stretch"
"""What the periods are the last of, where nothing else is told."""
SEEN = 0.75
"""Travel of OP in a rest, as a share of S, from which the rest shows S [-]: a stretch may have an S of its own."""
RESTS = 1e-9
"""Move from sample to sample below which an estimated valve position rests [% of span]."""


class LastPeriods(NamedTuple):
    """The periods shown, and what they are."""

    cut: slice
    """Samples of the record."""
    said: str
    """Which they are, as the start of a sentence."""
    slips: bool
    """Whether the estimated valve position is seen in them to rest while OP moves by S, all but, and then to slip."""


def last_periods(view: LoopView) -> LastPeriods:
    """Pick the last periods of what was analysed.

    Where the valve sticks in some windows only these are the last ones of the last window in which it does, as far as
    that was simulated. Where the estimated valve position does not slip in them, they are the latest in which it does.

    Parameters
    ----------
    view : LoopView
        A diagnosis.

    Returns
    -------
    LastPeriods
        The periods.
    """
    first, last = view.window
    dt, period, windows = view.diagnosis.record.dt, view.diagnosis.oscillation.period, view.diagnosis.windows
    within, sticky = ANALYSED, [one for one in windows if one.verdict == "stiction"]
    if 0 < len(sticky) < len(windows):
        first, last = max(first, sticky[-1].first), min(last, sticky[-1].last)
        within = "the last window in which the valve sticks"
        simulated = np.flatnonzero(np.isfinite(view.model[first:last]))
        last = first + int(simulated[-1]) + 1 if simulated.size else last
    n = PERIODS * period / dt if np.isfinite(period) else MAX_POINTS
    n = int(min(max(n, FEWEST), MAX_POINTS))
    found, rest, op = view.diagnosis.identification, n - n // PERIODS, view.diagnosis.record.op[first:last]
    slips = (
        []
        if found is None or not view.valve_is_accepted
        else rests_before_slips(view.stem[first:last], op, found.S, rest)
    )
    latest = first + slips[-1].stop if slips else last
    # A slip in the first period shown would stand without the rest before it.
    earlier = latest <= last - rest
    stop = min(latest + n - rest, last) if earlier else last
    cut = slice(max(first, stop - n), stop)
    length = labels.format_duration((cut.stop - cut.start) * dt)
    when = f"from {view.span_of(cut.start, cut.stop)}"
    said = f"The last {length} of {within}"
    if earlier:
        said = f"The latest {length} that show S in the estimated valve position, {when} in {within}"
    elif within != ANALYSED:
        said += f", {when}"
    return LastPeriods(cut, said, bool(slips))


def rests_before_slips(
    stem: NDArray[np.float64], op: NDArray[np.float64], S: float, longest: int = MAX_POINTS
) -> list[slice]:
    """Rests of an estimated valve position that end in a slip, in which OP moves by `SEEN` of S or more.

    Parameters
    ----------
    stem, op : ndarray, shape (n_samples,)
        Estimated valve position and OP [% of span].
    S : float
        Deadband plus stickband [% of span].
    longest : int
        Samples before the slip that count.

    Returns
    -------
    list of slice
        Samples at which the position rests.

    Examples
    --------
    >>> rests_before_slips(np.array([1.0, 1.0, 1.0, 2.0, 2.5, 2.5]), np.array([1.0, 2.0, 3.0, 4.0, 4.5, 4.0]), S=2.0)
    [slice(0, 3, None)]
    """
    moves = np.abs(np.diff(stem))
    ended = [(start, stop) for start, stop in runs(moves < RESTS) if stop < moves.size and moves[stop] >= RESTS]
    rests = [slice(max(start, stop - longest), stop + 1) for start, stop in ended]
    return [rest for rest in rests if float(np.ptp(op[rest])) >= SEEN * S]
