"""Processes from other packages: systems of `control` and `scipy.signal`, recognised by their attributes."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction.errors import ParameterError, require_not_negative
from stiction.models.processes.transfer_function import StateSpace, TransferFunction

__all__ = ["as_process"]


def as_process(process: Any, dead_time: float = 0.0) -> StateSpace | TransferFunction:
    """Convert a continuous single-input single-output system to a process of this package.

    `process`: `TransferFunction`, `StateSpace`, `control.TransferFunction`, `control.StateSpace`, `scipy.signal.lti` or
    a tuple (num, den) or (num, den, dead_time). `dead_time`: dead time to add [s]; the other packages have no attribute
    for it. Raises ParameterError when `dead_time` is negative, or the system is sampled, has several inputs or outputs,
    or is none of these.

    Examples
    --------
    >>> from scipy.signal import lti
    >>> from stiction.models.processes import as_process
    >>> as_process(lti([3.0], [10.0, 1.0]), dead_time=10.0).dead_time
    10.0
    """
    dead_time = require_not_negative("dead_time", dead_time, "s")
    if isinstance(process, TransferFunction | StateSpace):
        if not dead_time:
            return process
        from dataclasses import replace

        return replace(process, dead_time=process.dead_time + dead_time)
    if isinstance(process, tuple) and len(process) in (2, 3):
        extra = require_not_negative("dead_time", process[2], "s") if len(process) == 3 else 0.0
        return TransferFunction(process[0], process[1], dead_time + extra)
    system: Any = process
    if getattr(system, "dt", None) not in (None, 0, 0.0):
        raise ParameterError(f"process is sampled (dt = {system.dt}); give its continuous form.")
    if all(hasattr(system, name) for name in "ABCD"):
        D = np.asarray(system.D, dtype=np.float64)
        if D.size != 1:
            raise ParameterError(f"process has {D.shape} outputs and inputs; give one of each.")
        return StateSpace(system.A, system.B, system.C, float(D.ravel()[0]), dead_time)
    if hasattr(system, "num") and hasattr(system, "den"):
        num, den = _single_polynomial(system.num), _single_polynomial(system.den)
        return TransferFunction(num, den, dead_time)
    raise ParameterError(
        f"process is a {type(process).__name__}; give a TransferFunction, a StateSpace, (num, den), "
        "or a system of `control` or `scipy.signal`."
    )


def _single_polynomial(polynomial: Any) -> np.ndarray:
    """Coefficients of a single-input single-output polynomial, however it is nested."""
    while isinstance(polynomial, list | tuple) and len(polynomial) == 1 and np.ndim(polynomial[0]):
        polynomial = polynomial[0]
    array = np.asarray(polynomial, dtype=object)
    if array.ndim == 2 and array.shape[0] == 1 and array.shape[1] == 1 and np.ndim(array[0, 0]):
        array = np.asarray(array[0, 0])
    array = np.asarray(array.tolist(), dtype=np.float64)
    if array.ndim > 1 and array.size != array.shape[-1]:
        raise ParameterError(f"process has coefficients of shape {array.shape}; give one input and one output.")
    return array.ravel()
