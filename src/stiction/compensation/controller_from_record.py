"""The controller behind a record, as the twin runs it: PI or PID, with set point weights and the derivative's filter.

`fit_controller` names the form from an unfiltered derivative. Where derivative action shows, or no form explains the
OP, the moves of OP are compared once more with a derivative behind the lag Tf,

    d(k) = a d(k-1) + (1 - a) (x(k) - x(k-1)) / dt,   a = Tf / (Tf + dt),

for several Tf, its input x and that of the proportional part being the error or the PV; least squares each.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.controller_forms import energy_of, moves
from stiction.errors import RecordError
from stiction.models import PID
from stiction.records.gaps import forward_fill

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["controller_from_record"]

LEAST = 0.9
"""Share of the OP that a controller found from the record must explain [-]."""
LAGS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Lags of the derivative tried, over the sampling period [-]."""
PURE = 1e-6
"""Integral time that stands for a controller without a proportional part, over the sampling period [-]."""
CLEARER = 0.7
"""What a derivative behind a lag must leave, over what one without leaves, to be taken [-]."""


def controller_from_record(record: LoopRecord) -> tuple[PID, bool]:
    """Find the controller of a record.

    Parameters
    ----------
    record : LoopRecord
        The part of the record that is judged.

    Returns
    -------
    tuple
        The controller, limited to 0..100 % where the OP keeps within; and whether the record shows its own samples.

    Raises
    ------
    RecordError
        When no controller explains the OP.
    """
    found = fit_controller(record)
    exact = found.exact
    options = {"op_limits": _limits(record.op)}
    behind = {"b": 0.0 if found.form.startswith("I-P") else 1.0, "c": 0.0 if "-" in found.form else 1.0}
    pid, share = None, found.explained
    if found.form == "I":
        pid = PID(PURE * found.Ki * record.dt, PURE * record.dt, **options)  # type: ignore[arg-type]
    elif found.Kc and found.Ti > 0.0 and found.Td >= 0.0:
        pid = PID(found.Kc, found.Ti, found.Td, **behind, **options)  # type: ignore[arg-type]
    if "D" in found.form or share < LEAST:
        lagged, better, plain = _with_lag(record, options)
        if lagged is not None and better >= LEAST and 1.0 - better < CLEARER * (1.0 - plain):
            pid, share, exact = lagged, better, True
    if pid is None or share < LEAST:
        unknown = "; its set point was not recorded" if record.sp is None else ""
        raise RecordError(
            f"{record.tag}: no controller explains the OP ({100.0 * share:.0f} % of its movement, {100.0 * LEAST:.0f} "
            f"% needed{unknown}); give controller=PID(Kc, Ti), or check that it is in automatic."
        )
    return pid, exact


def _limits(op: NDArray[np.float64]) -> tuple[float, float]:
    """0 and 100 %; none where the OP is written in deviations or another unit."""
    inside = float(np.nanmin(op)) >= 0.0 and float(np.nanmax(op)) <= 100.0
    return (0.0, 100.0) if inside else (-np.inf, np.inf)


def _with_lag(record: LoopRecord, options: dict) -> tuple[PID | None, float, float]:
    """Best controller with a derivative; shares of the moves of OP that it and the best without a lag explain."""
    from scipy.signal import lfilter

    assert record.pv is not None
    op, pv = forward_fill(record.op, fill_start=True), forward_fill(record.pv, fill_start=True)
    sp = np.full_like(pv, pv.mean()) if record.sp is None else forward_fill(record.sp, fill_start=True)
    valid = np.isfinite(record.op) & np.isfinite(record.pv)
    valid &= True if record.auto is None else record.auto
    data = moves(op, sp - pv, pv - pv.mean(), valid, record.dt, 0.0)
    best, most, plain = None, 0.0, 0.0
    if data.y.size < 20 or not np.any(data.y):
        return best, most, plain
    moving = bool(np.ptp(sp) > 0.0)
    energy = energy_of(data.y)
    for on_error, acts_on_error, lag in product((True, False)[: 1 + moving], (True, False)[: 1 + moving], LAGS):
        keep = lag / (lag + 1.0)
        d = np.asarray(lfilter([1.0 - keep], [1.0, -keep], data.columns[2 if acts_on_error else 4]))
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
