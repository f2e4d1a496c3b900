"""What the transmitter and the set point put into the PV."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.oscillation import control_error
from stiction.diagnosis.verdict.held import held
from stiction.records.quality.quantisation import robust_range

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["Sensor", "sensor_of"]

SPIKE, LEAST_SPIKE = 6.0, 0.3
"""Distance of a spike from its neighbours: so many robust standard deviations of such distances [-], and on top so
much of the PV's swing [-]."""
MANY = 4.0
"""Spikes from which on more say nothing new [-]."""
LEVELS, STEP = 0.5, 5.0
"""Values over samples from which on the PV is not coarse [-], and the percentile of the distances of neighbouring
values that is taken for its resolution [%]."""
FEWEST = 10
"""Samples below which nothing is said."""


class Sensor(NamedTuple):
    """What is seen of the transmitter; the field names are those of `Features`."""

    coarse: float
    still: float
    spikes: float
    set_point: float


def sensor_of(record: LoopRecord) -> Sensor:
    """Measure coarseness, stillness and spikes of the PV, and what the set point moves.

    Parameters
    ----------
    record : LoopRecord
        The stretch that was analysed.

    Returns
    -------
    Sensor
        The measures; 0 where the PV has too few values.
    """
    assert record.pv is not None
    pv = record.pv[np.isfinite(record.pv)]
    if pv.size < FEWEST:
        return Sensor(0.0, 0.0, 0.0, 0.0)
    swing = robust_range(pv) or float(np.ptp(pv))
    values = np.unique(pv)
    coarse = 0.0
    if 1 < values.size < LEVELS * pv.size and swing > 0.0:
        coarse = held("coarse", float(np.percentile(np.diff(values), STEP)) / swing)
    still = float(np.mean((np.diff(record.pv) == 0.0) & (np.diff(record.op) != 0.0)))
    return Sensor(coarse, still, held("spikes", _spikes(record.pv, swing) / MANY), _set_point(record))


def _spikes(pv: NDArray[np.float64], swing: float) -> int:
    """Samples far from both neighbours; those beside a gap have but one."""
    before, at, after = pv[:-2], pv[1:-1], pv[2:]
    away = np.abs(at - 0.5 * (before + after))
    if not np.isfinite(away).any():
        return 0
    limit = SPIKE * 1.4826 * float(np.nanmedian(away)) + LEAST_SPIKE * swing
    return int(np.count_nonzero((away > limit) & ((at - before) * (at - after) > 0.0)))


def _set_point(record: LoopRecord) -> float:
    """Power of the set point over that of it and the error."""
    error = control_error(record)
    if record.sp is None or error is None:
        return 0.0
    sp = record.sp[np.isfinite(record.sp)]
    power, rest = float(np.var(sp)) if sp.size else 0.0, float(np.var(error))
    return power / (power + rest) if power + rest > 0.0 else 0.0
