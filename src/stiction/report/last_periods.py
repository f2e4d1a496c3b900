"""Choose the periods for plots of one signal against another."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.records.runs import runs
from stiction.report import labels
from stiction.report.downsample import MAX_POINTS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.report.loop_view import LoopView

__all__ = ["PlottedPeriods", "last_periods", "rests_before_slips"]

PERIODS, MIN_SAMPLES = 6, 20
"""Number of periods plotted, and smallest number of samples [-]."""
MIN_TRAVEL_SHARE = 0.75
"""Travel of OP during a rest, as a share of S, from which the rest shows S [-]: a part may have its own S."""
REST_TOLERANCE = 1e-9
"""Change from sample to sample below which the estimated valve position rests [% of span]."""


class PlottedPeriods(NamedTuple):
    """The periods that are plotted."""

    cut: slice
    """Samples of the record."""
    text: str
    """Which periods they are, as the start of a sentence."""
    has_slips: bool
    """Whether the estimated valve position rests while OP moves by about S, and then slips."""


def last_periods(view: LoopView) -> PlottedPeriods:
    """Choose the last periods of the analysed part that show the valve stick, if there are any.

    Where the valve sticks in some parts of the record only, they are taken from the last of these. Where it does not
    slip in the last periods, the latest periods in which it does are taken.
    """
    first, last = view.analysed
    within = "the record" if view.is_analysed_whole else "the analysed part"
    sticky = view.sticky_segments
    if 0 < len(sticky) < len(view.segments):
        first, last = sticky[-1][:2]
        within = "the last part of the record in which the valve sticks"
    dt, period = view.diagnosis.record.dt, view.diagnosis.oscillation.period
    n = PERIODS * period / dt if np.isfinite(period) else MAX_POINTS
    n = int(min(max(n, MIN_SAMPLES), MAX_POINTS))
    identification, longest_rest = view.diagnosis.identification, n - n // PERIODS
    slips: list[slice] = []
    if identification is not None and view.valve_is_accepted:
        op = view.diagnosis.record.op[first:last]
        slips = rests_before_slips(view.valve_position[first:last], op, identification.S, longest_rest)
    latest = first + slips[-1].stop if slips else last
    # A slip in the first of the last periods would be plotted without the rest before it.
    is_earlier = latest <= last - longest_rest
    stop = min(latest + n - longest_rest, last) if is_earlier else last
    cut = slice(max(first, stop - n), stop)
    length = labels.format_duration((cut.stop - cut.start) * dt)
    text = f"The last {length} of {within}"
    if is_earlier:
        times = view.describe_range(cut.start, cut.stop)
        text = f"The latest {length} of {within} in which the valve sticks and slips ({times})"
    return PlottedPeriods(cut, text, bool(slips))


def rests_before_slips(
    position: NDArray[np.float64], op: NDArray[np.float64], S: float, max_samples: int = MAX_POINTS
) -> list[slice]:
    """Find rests of an estimated valve position that end in a slip, in which OP moves by `MIN_TRAVEL_SHARE` of S.

    `position`, `op`: estimated valve position and OP [% of span]. `S`: deadband plus stickband [% of span].
    `max_samples`: samples before the slip that count [-]. Returns samples of each rest.

    Examples
    --------
    >>> rests_before_slips(np.array([1.0, 1.0, 1.0, 2.0, 2.5, 2.5]), np.array([1.0, 2.0, 3.0, 4.0, 4.5, 4.0]), S=2.0)
    [slice(0, 3, None)]
    """
    moves = np.abs(np.diff(position))
    ended = [
        (start, stop)
        for start, stop in runs(moves < REST_TOLERANCE)
        if stop < moves.size and moves[stop] >= REST_TOLERANCE
    ]
    rests = [slice(max(start, stop - max_samples), stop + 1) for start, stop in ended]
    return [rest for rest in rests if float(np.ptp(op[rest])) >= MIN_TRAVEL_SHARE * S]
