"""Where a twin begins, so that it moves without the record's disturbances, and how it then oscillates."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.compensation.cycle_measurement import MEASURED_PERIODS, NO_CYCLE, SETTLING_PERIODS, Cycle, measure_cycle
from stiction.compensation.replace_parts import replace_parts
from stiction.models import TransferFunction
from stiction.simulation import simulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Loop
    from stiction.records.record import LoopRecord

__all__ = ["TwinStart", "start_of_twin"]

MIN_MOVE_SHARE = 0.01
"""OP amplitude below which the twin rests, relative to that of the record [-]."""


class TwinStart(NamedTuple):
    """Start values of a twin, and what it does from there without disturbances."""

    pv: float
    """PV before the first sample [PV units]."""
    op: float
    """OP before the first sample [% of span]."""
    position: float
    """Stem position before the first sample [% of span]."""
    duration: float
    """Length of the record [s]."""
    cycle: Cycle
    """Oscillation of the twin without disturbances; a period of NaN where it comes to rest."""


def start_of_twin(
    loop: Loop, level: float, op: float, record: LoopRecord, pv: NDArray[np.float64], measured: Cycle
) -> TwinStart:
    """Return the start values of a twin from the first period of its record.

    A twin that begins with PV at SP stays there. So it begins with PV and OP of the sample of the first period in which
    PV is farthest from SP; its integral action then moves OP until the stem slips. `level`, `op`: operating point
    [PV units, % of span]; `pv`: recorded PV, shape (n_samples,) [PV units]; `measured`: oscillation of the record.
    """
    n = min(max(round(measured.period / record.dt), 2), pv.size)
    deviation = pv[:n] - (level if record.sp is None else record.sp[:n])
    far = int(np.nanargmax(np.where(np.isfinite(record.op[:n]), np.abs(deviation), np.nan)))
    pv_start, op_start = level + float(deviation[far]), float(record.op[far])
    position = op + float(deviation[far] / _gain(loop))
    periods = SETTLING_PERIODS + MEASURED_PERIODS
    quiet = replace_parts(loop, noise=0.0)
    run = simulate(
        quiet, level, max(periods * measured.period, 4.0 * loop.dt), pv_start=pv_start, op_start=op_start,
        mv_start=position,
    )  # fmt: skip
    settled = run.window(run.op.size * SETTLING_PERIODS // periods, run.op.size)
    rests = np.ptp(settled.op) < 2.0 * MIN_MOVE_SHARE * measured.amplitude_op
    cycle = NO_CYCLE if rests else measure_cycle(settled, measured.period)
    return TwinStart(pv_start, op_start, position, record.dt * pv.size, cycle)


def _gain(loop: Loop) -> float:
    """Change of PV at rest over that of the stem position [PV units per % of span]; infinite where there is none."""
    process = loop.process
    if not isinstance(process, TransferFunction) or process.den[-1] == 0.0 or process.num[-1] == 0.0:
        return float("inf")
    return float(process.num[-1] / process.den[-1])
