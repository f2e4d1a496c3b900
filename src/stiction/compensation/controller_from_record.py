"""Identify the controller of a record: PI or PID, with set point weights and a filtered derivative.

The diagnosis finds the form with an unfiltered derivative. If it finds derivative action, or explains too little of
OP, the moves of OP are fitted again by least squares with a filtered derivative,

    d(k) = a d(k-1) + (1 - a) (x(k) - x(k-1)) / dt,   a = Tf / (Tf + dt),

for several Tf. The input x is the control error or the PV; so is the input of the proportional part.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.controller_forms import energy_of, moves
from stiction.errors import RecordError
from stiction.models import PID
from stiction.models.processes.first_order_lag import first_order_lag

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification import ControllerFit
    from stiction.diagnosis.segment import JudgedSegment

__all__ = ["controller_from_record"]

MIN_EXPLAINED_SHARE = 0.9
"""Share of the OP movement that an identified controller must explain [-]."""
DERIVATIVE_LAGS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Time constants of the derivative filter that are tried, relative to the sampling period [-]."""
INTEGRAL_ONLY_TIME = 1e-6
"""Integral time of a controller without a proportional part, relative to the sampling period [-]."""
MAX_RESIDUAL_RATIO = 0.7
"""Largest unexplained share with a filtered derivative, relative to that with an unfiltered one, to be accepted [-]."""


def controller_from_record(segment: JudgedSegment, fit: ControllerFit) -> tuple[PID, bool]:
    """Identify the controller of a record.

    `segment`: the judged part of the record. `fit`: the controller fitted to it, without a filtered derivative. Gives
    the controller, limited to 0..100 % if the OP stays within; and whether the record has the controller's own sampling
    period. Raises RecordError when no controller explains the OP.
    """
    record, exact = segment.part, fit.exact
    options = {"op_limits": _op_limits(record.op)}
    set_point_weights = {"b": 0.0 if fit.form.startswith("I-P") else 1.0, "c": 0.0 if "-" in fit.form else 1.0}
    pid, share = None, fit.explained
    if fit.form == "I":
        pid = PID(INTEGRAL_ONLY_TIME * fit.Ki * record.dt, INTEGRAL_ONLY_TIME * record.dt, **options)  # type: ignore[arg-type]
    elif fit.Kc and fit.Ti > 0.0 and fit.Td >= 0.0:
        pid = PID(fit.Kc, fit.Ti, fit.Td, **set_point_weights, **options)  # type: ignore[arg-type]
    if "D" in fit.form or share < MIN_EXPLAINED_SHARE:
        lagged, better, plain = _fit_filtered_derivative(segment, options)
        if lagged is not None and better >= MIN_EXPLAINED_SHARE and 1.0 - better < MAX_RESIDUAL_RATIO * (1.0 - plain):
            pid, share, exact = lagged, better, True
    if pid is None or share < MIN_EXPLAINED_SHARE:
        unknown = "; its set point was not recorded" if record.sp is None else ""
        raise RecordError(
            f"no controller explains OP (the best explains {100.0 * share:.0f} % of its movement, "
            f"{100.0 * MIN_EXPLAINED_SHARE:.0f} % are needed{unknown})",
            remedy="give the controller with its Kc and Ti, or check that the loop is in automatic",
            where=record.tag,
        )
    return pid, exact


def _op_limits(op: NDArray[np.float64]) -> tuple[float, float]:
    """Return 0 and 100 %, or infinite limits when OP is a deviation or in another unit."""
    inside = float(np.nanmin(op)) >= 0.0 and float(np.nanmax(op)) <= 100.0
    return (0.0, 100.0) if inside else (-np.inf, np.inf)


def _fit_filtered_derivative(segment: JudgedSegment, options: dict) -> tuple[PID | None, float, float]:
    """Return the best controller with a derivative, and the explained shares with and without a filter."""
    record, op, pv = segment.part, segment.op, segment.pv
    sp = np.full_like(pv, pv.mean()) if record.sp is None else record.sp
    valid = ~segment.signals.missing
    valid &= True if record.auto is None else record.auto
    data = moves(op, sp - pv, pv - pv.mean(), valid, record.dt, 0.0)
    best, most, plain = None, 0.0, 0.0
    if data.y.size < 20 or not np.any(data.y):
        return best, most, plain
    moving = bool(np.ptp(sp) > 0.0)
    energy = energy_of(data.y)
    for on_error, acts_on_error, lag in product(
        (True, False)[: 1 + moving], (True, False)[: 1 + moving], DERIVATIVE_LAGS
    ):
        keep = lag / (lag + 1.0)
        d = first_order_lag(data.columns[2 if acts_on_error else 4], keep)
        x = np.column_stack([data.columns[0 if on_error else 3], data.columns[1], d - d.mean()])
        weights = np.linalg.lstsq(x, data.y, rcond=None)[0]
        Kc, Ki, Kd = (float(w) for w in weights)
        share = 1.0 - float(np.sum((data.y - x @ weights) ** 2)) / energy
        plain = max(plain, share) if lag == 0.0 else plain
        if share <= most or not (Kc * Ki > 0.0 and Kc * Kd > 0.0):
            continue
        Td, Tf = Kd / Kc, lag * record.dt
        b, c = (1.0 if on_error else 0.0), (1.0 if acts_on_error else 0.0)
        best, most = PID(Kc, Kc / Ki, Td, N=Td / Tf if Tf else np.inf, b=b, c=c, **options), share
    return best, most, plain
