"""The PI controller behind the OP, by least squares from OP and error."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.signals import hold_gaps

if TYPE_CHECKING:
    from stiction.records.record import LoopRecord

__all__ = ["ControllerFit", "fit_controller"]


class ControllerFit(NamedTuple):
    """A PI controller that explains the OP."""

    Kc: float
    """Proportional gain [% of span per PV unit]."""
    Ti: float
    """Integral time [s]; may come out negative where the record does not show a PI."""
    fit: float
    """Share of the OP's variation that it explains [-]."""
    action: float
    """Sign of the process gain that makes the loop stable: that of Kc; 0 when the record does not tell."""


def fit_controller(record: LoopRecord) -> ControllerFit:
    """Fit OP = Kc (e + int e dt / Ti) + drift over the record.

    Parameters
    ----------
    record : LoopRecord
        A record with PV; without SP, a constant one is assumed.

    Returns
    -------
    ControllerFit
        The controller and how much of the OP it explains.
    """
    assert record.pv is not None
    op, pv = hold_gaps(record.op), hold_gaps(record.pv)
    error = -pv if record.sp is None else hold_gaps(record.sp) - pv
    error = error - (error.mean() if record.sp is None else 0.0)
    t = np.linspace(-1.0, 1.0, op.size)
    basis = np.stack([error, np.cumsum(error) * record.dt, t, np.ones_like(t)], axis=1)
    size = np.linalg.norm(basis, axis=0)
    size[size == 0.0] = 1.0
    weights, *_ = np.linalg.lstsq(basis / size, op, rcond=None)
    Kc, Ki = (weights / size)[:2]
    left = op - (basis / size) @ weights
    drift = np.stack([t, np.ones_like(t)], axis=1)
    trend, *_ = np.linalg.lstsq(drift, op, rcond=None)
    energy = float(np.sum((op - drift @ trend) ** 2))
    fit = 1.0 - float(np.sum(left**2)) / energy if energy > 0.0 else 0.0
    action = float(np.sign(Ki)) if fit > 0.5 and Ki != 0.0 else 0.0
    return ControllerFit(float(Kc), float(Kc / Ki) if Ki != 0.0 else float("inf"), fit, action)
