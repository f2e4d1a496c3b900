"""Valve not responding: OP has gone far, the error stays, and PV does not answer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.diagnosis.loop_state.wind_up import WindUp, find_wind_up

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["find_valve_not_responding"]


def find_valve_not_responding(
    op: NDArray[np.float64], pv: NDArray[np.float64], sp: NDArray[np.float64]
) -> WindUp | None:
    """Find the travel of OP to which the valve does not respond.

    `op`: controller output [% of span]; NaN is missing. `pv`, `sp`: process variable and set point [unit of PV]. Gives
    the travel and the stay at its end; None when PV answers, or another controller moves PV.

    The deadband plus stickband of a valve in service is a few per cent, rarely above 15 %. A PV that does not answer a
    travel of 15 % and more means a stem that is stuck fast, a closed block valve, or a valve that another controller
    moves. PV then drifts with the loads only. A regular oscillation of PV speaks for another controller: that is
    `not_in_command`.

    Examples
    --------
    >>> import numpy as np
    >>> pv = 150.0 + np.random.default_rng(1).normal(0.0, 0.3, 600)
    >>> sp = np.where(np.arange(600) < 200, 150.0, 154.0)
    >>> found = find_valve_not_responding(40.0 + 0.03 * np.cumsum(sp - pv), pv, sp)
    >>> round(found.mean_error)
    4
    """
    found = find_wind_up(op, pv, sp)
    return found if found is not None and math.isnan(found.period) else None
