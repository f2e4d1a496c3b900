"""Kano, Maruta, Kugemoto and Shimizu 2004, methods A and C: how long is the valve still while OP moves? (`kano2004`).

Method A takes the flow for the valve, method C the slope of a level. The record is cut into runs in which that signal
stays within a band; rho is the share of time in runs during which OP travels further than a band of its own.
The paper leaves the bands to the plant. Here they are shares of each signal's swing, 10 % and 20 %, and the limit is
derived: of a linear loop's sinusoids the peaks alone can pass, 2 arccos(0.8) / pi = 0.41 of the time at most.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import judge, objections, swing, with_position
from stiction.diagnosis.oscillation.signals import smooth
from stiction.models.numba_compile import kernel
from stiction.records.quantiles import quantiles

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["kano_patterns", "still_time"]

STILL, TRAVEL = 0.1, 0.2
LINEAR = 0.41


def kano_patterns(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Measure the time in which the valve stands still and OP moves (`kano2004`, methods A and C).

    `record`: OP and, in this order, the measured valve position, the slope of an integrating PV, or PV; valid for flow
    and pressure (A) and level (C). If the position has gaps, its longest segment is used. `oscillation`: what
    `find_oscillation` says of the record. `index` is rho [-], the share of time.
    """
    record, lack = with_position(record)
    op, name = swing(record, oscillation, "op"), "error" if record.mv is None else "mv"
    moved = swing(record, oscillation, name)
    index = float("nan")
    if op is not None and moved is not None and oscillation.period > 0.0:
        width = oscillation.period / record.dt / 16.0
        if record.integrating and name == "error":
            moved = np.gradient(smooth(moved, 2.0 * width))
        index = still_time(smooth(op, width), smooth(moved, width))
    seen = "valve position" if name == "mv" else "slope of PV" if record.integrating else "PV"
    why = (
        f"The {seen} is constant while OP moves for {100.0 * index:.0f} % of the time; in a linear loop at most "
        f"{100.0 * LINEAR:.0f} %, at its peaks."
    )
    types = () if record.mv is not None else ("flow", "pressure", "level")
    against = objections(record, oscillation, loop_types=types)
    return judge("kano_patterns", index, 0.5, LINEAR, why, [*against, *lack], source="kano2004")


def still_time(op: NDArray[np.float64], moved: NDArray[np.float64]) -> float:
    """Share of time in runs with `moved` inside its band and `op` beyond its own [-]; NaN where one is flat.

    Examples
    --------
    >>> import numpy as np
    >>> phase = (np.arange(4000) % 100) / 100
    >>> triangle, square = 4 * np.abs(phase - 0.5) - 1, np.where(phase < 0.5, 1.0, -1.0)
    >>> still_time(triangle, square) > 0.95
    True
    """
    swing_op, swing_moved = (high - low for low, high in (quantiles(x, 0.05, 0.95) for x in (op, moved)))
    if not (swing_op > 0.0 and swing_moved > 0.0):
        return float("nan")
    return _still(op, moved, TRAVEL * swing_op, STILL * swing_moved) / op.shape[0]


@kernel
def _still(op, moved, travel, still):
    n = op.shape[0]
    count = 0
    first = 0
    while first < n:
        low = high = moved[first]
        low_op = high_op = op[first]
        last = first + 1
        while last < n:
            low, high = min(low, moved[last]), max(high, moved[last])
            if high - low > still:
                break
            low_op, high_op = min(low_op, op[last]), max(high_op, op[last])
            last += 1
        if high_op - low_op > travel:
            count += last - first
        first = last
    return count
