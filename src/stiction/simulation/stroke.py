"""Simulation of a valve alone, for any input."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, RecordError, require_finite, require_positive
from stiction.records.record import LoopRecord, Provenance
from stiction.simulation.drivers import stroke_one

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from stiction.models import Valve

__all__ = ["stroke"]


def stroke(
    valve: Valve, op: ArrayLike, dt: float, mv_start: float | None = None, out: NDArray[np.float64] | None = None
) -> LoopRecord:
    """Drive a valve over a series of inputs.

    Parameters
    ----------
    valve : Valve
        Any valve model.
    op : array_like, shape (n_samples,)
        Controller output [% of span].
    dt : float
        Sampling period [s].
    mv_start : float, optional
        Stem position before the first sample [% of span]; by default the first input.
    out : ndarray, shape (n_samples,), optional
        Array for the valve position; `op` itself is allowed and is overwritten.

    Returns
    -------
    LoopRecord
        `op` and the valve position `mv` [% of span].

    Raises
    ------
    ParameterError
        When `dt` is not positive, or `out` cannot be written or has another shape or type than `op`.
    RecordError
        When `op` is not a series of numbers, or has missing values.

    Examples
    --------
    >>> import stiction as st
    >>> st.stroke(st.Kano(S=2.0, J=1.0), [0.0, 1.0, 2.0, 3.0], dt=1.0).mv.tolist()
    [0.0, 0.0, 1.5, 2.5]
    """
    dt = require_positive("dt", dt, "s")
    if not hasattr(valve, "pack"):
        raise ParameterError(f"valve is a {type(valve).__name__}; give a valve model such as Kano(S, J).")
    record = LoopRecord("stroke", dt, op=op, provenance=Provenance(source=repr(valve)))  # type: ignore[arg-type]
    if missing := int(np.isnan(record.op).sum()):
        raise RecordError(f"op has {missing} missing values; fill them first.")
    mv = np.empty_like(record.op) if out is None else _require_writable(out, record.op.shape)
    if np.may_share_memory(mv, record.op):
        record = replace(record, op=record.op.copy())
    if len(record):
        rest = record.op[0] if mv_start is None else require_finite("mv_start", mv_start, "% of span")
        stroke_one(valve.code, valve.pack(dt), record.op, float(rest), mv)
    return LoopRecord("stroke", dt, op=record.op, mv=mv, provenance=record.provenance)


def _require_writable(out: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return `out`, or raise when positions cannot be written to it."""
    if not isinstance(out, np.ndarray):
        raise ParameterError(f"out is a {type(out).__name__}; give an array of float64 of shape {shape}.")
    if out.shape != shape or out.dtype != np.float64:
        raise ParameterError(f"out has shape {out.shape} and type {out.dtype}; give float64 of shape {shape}.")
    if not out.flags.writeable:
        raise ParameterError("out is read-only; give an array that can be written to, such as out.copy().")
    return out
