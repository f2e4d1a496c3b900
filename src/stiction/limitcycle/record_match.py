"""The predicted limit cycle that matches a record, and the other stable cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.json_form import Result, json_as
from stiction.errors import RecordError
from stiction.limitcycle.continuous_form import require_continuous_form
from stiction.limitcycle.exact.search import exact_limit_cycles
from stiction.models.loop import require_loop
from stiction.records.gaps import interpolate_gaps
from stiction.records.record import require_record

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.limitcycle.result import LimitCycle
    from stiction.models import Loop
    from stiction.records.record import LoopRecord

__all__ = ["CycleMatch", "match_record", "measure_record_cycle"]

_MAX_DISTANCE = 0.25
"""Distance above which a record matches no predicted cycle [-], as in `CycleMatch.distance`."""


@dataclass(frozen=True)
class CycleMatch(Result):
    """The limit cycle that matches a record."""

    cycle: LimitCycle | None
    """The predicted cycle nearest to the record; None when no cycle is near."""
    distance: float
    """Root mean square of the log ratios of period and amplitudes [-]; 0.1 is about 10 % off."""
    period: float = field(metadata=json_as("period_s"))
    """Period measured [s]."""
    amplitude: float
    """OP amplitude measured [% of span]."""
    amplitude_pv: float
    """PV amplitude measured [PV units]."""
    others: tuple[LimitCycle, ...]
    """Other stable cycles, into which a disturbance could move the loop."""

    def summary(self) -> str:
        """Summary in a few sentences."""
        measured = f"The record oscillates with period {self.period:.4g} s and OP amplitude {self.amplitude:.4g} %"
        if self.cycle is None:
            return f"{measured}; no predicted limit cycle of this loop is within {100 * _MAX_DISTANCE:.0f} % of it."
        text = f"{measured}: it is in the {self.cycle.description}."
        if not self.others:
            return f"{text} The loop has no other stable cycle."
        jumps = "; ".join(f"period {c.period:.4g} s, OP amplitude {c.amplitude:.4g} %" for c in self.others)
        return f"{text} It could jump to: {jumps}."


def match_record(loop: Loop, record: LoopRecord, cycles: tuple[LimitCycle, ...] | None = None) -> CycleMatch:
    """Find the predicted limit cycle that matches a record.

    Parameters
    ----------
    loop : Loop
        The loop as identified: controller, valve and process.
    record : LoopRecord
        The record, with `op` and `pv`; with `mv` the rest levels of a staircase valve are taken from it.
    cycles : tuple of LimitCycle, optional
        The cycles to choose from; by default those of `exact_limit_cycles`.

    Returns
    -------
    CycleMatch
        The nearest cycle, its distance, and the other stable cycles.

    Raises
    ------
    RecordError
        When the record has no PV, missing values only, or no oscillation of at least three periods.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.limitcycle import match_record
    >>> loop = st.Loop(st.PID.parallel(0.5, 1.0, 0.1), st.Stenman(0.5), st.TransferFunction([1], [5, 6, 1]), dt=0.01)
    >>> record = st.simulate(loop, sp=0.0, duration=300.0, disturbance=0.25, op_start=0.25)
    >>> len(match_record(loop, record).cycle.levels)
    2
    """
    require_loop(loop)
    period, amplitude, amplitude_pv = measure_record_cycle(record)
    if cycles is None:
        if require_continuous_form(loop.valve).staircase and record.mv is not None:
            recent = record.mv[-max(int(3 * period / record.dt), 2) :]
            set_point = 0.0 if record.sp is None else float(np.nanmedian(record.sp))
            families = [float(np.nanmedian(recent))]
            cycles = exact_limit_cycles(loop, sp=set_point, families=families)
        else:
            cycles = exact_limit_cycles(loop)
    candidates = [cycle for cycle in cycles if cycle.kind == "cycle" and cycle.stable is not False]

    def distance(cycle: LimitCycle) -> float:
        logs = [
            math.log(period / (cycle.period / cycle.turns)),
            math.log(amplitude / cycle.amplitude),
            math.log(amplitude_pv / cycle.amplitude_pv),
        ]
        return math.sqrt(sum(x * x for x in logs) / 3.0)

    ranked = sorted(candidates, key=distance)
    if not ranked or distance(ranked[0]) > _MAX_DISTANCE:
        nearest = distance(ranked[0]) if ranked else math.inf
        return CycleMatch(None, nearest, period, amplitude, amplitude_pv, tuple(ranked))
    return CycleMatch(ranked[0], distance(ranked[0]), period, amplitude, amplitude_pv, tuple(ranked[1:]))


def measure_record_cycle(record: LoopRecord) -> tuple[float, float, float]:
    """Period [s], OP amplitude [% of span] and PV amplitude of the second half of a record.

    The period is the mean distance of upward crossings of the OP through its mid level, with a hysteresis of a
    quarter of its range; amplitudes are medians over whole periods.
    """
    require_record(record)
    if record.pv is None:
        raise RecordError(f"{record.tag} has no PV; give a record of the closed loop.")
    half = slice(len(record) // 2, None)
    op, pv = _fill_gaps(record.op[half]), _fill_gaps(record.pv[half])
    if op.size < 16 or np.ptp(op) == 0.0:
        raise RecordError(
            f"{record.tag} does not oscillate: its OP is constant or too short; give a record with an oscillation."
        )
    high, low = np.percentile(op, [97.0, 3.0])
    middle, guard = (high + low) / 2.0, (high - low) / 8.0
    ups, armed = [], False
    for k in range(1, op.size):
        armed = armed or op[k] < middle - guard
        if armed and op[k] > middle + guard:
            back = k
            while back > 1 and op[back - 1] >= middle:
                back -= 1
            rise = op[back] - op[back - 1]
            ups.append(back - (op[back] - middle) / rise if rise else float(back))
            armed = False
    if len(ups) < 4:
        raise RecordError(
            f"{record.tag} shows {max(len(ups) - 1, 0)} periods in its second half; give a record of at least three."
        )
    edges = np.array(ups)
    spans = [slice(int(a), int(b) + 1) for a, b in pairwise(edges)]
    period = float((edges[-1] - edges[0]) / (edges.size - 1)) * record.dt
    return (
        period,
        float(np.median([np.ptp(op[s]) for s in spans])) / 2.0,
        float(np.median([np.ptp(pv[s]) for s in spans])) / 2.0,
    )


def _fill_gaps(x: NDArray[np.float64]) -> NDArray[np.float64]:
    if not np.isfinite(x).any():
        raise RecordError("the record has no finite value in its second half; give a record with data.")
    return interpolate_gaps(x)
