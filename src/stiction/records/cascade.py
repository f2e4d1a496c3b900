"""Cascades in one file: a controller whose OP is the set point of another loop has no valve of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.quality.quantisation import peak_to_peak, quantisation_step

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["with_slaves"]

VALUES = 12
"""Values that OP must take for its likeness to a set point to be no chance."""
COARSE = 0.05
"""Rounding, as a share of the set point's swing, beyond which likeness says nothing [-]."""
PROBE = 64
"""Samples that are looked at first: of many loops in a file most pairs are unlike there."""
BOTH = 0.9
"""Share of the samples in which both must be known [-]."""


def with_slaves(records: list[LoopRecord]) -> list[LoopRecord]:
    """Tell each record of a file whose loop's set point its OP is, where it is one's, as `Provenance.secondary_tag`.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> op, sp = np.arange(40.0) % 17, np.full(40, 50.0)
    >>> master, slave = LoopRecord("TIC-1", 1.0, op=op, sp=sp), LoopRecord("FIC-2", 1.0, op=op[::-1], sp=4.0 + 0.5 * op)
    >>> [record.provenance.secondary_tag for record in with_slaves([master, slave])]
    ['FIC-2', '']
    """
    return [replace(one, provenance=replace(one.provenance, secondary_tag=_slave_of(one, records))) for one in records]


def _slave_of(master: LoopRecord, records: list[LoopRecord]) -> str:
    """Tag of the one loop whose set point is the OP of another, or nothing."""
    if np.unique(master.op[np.isfinite(master.op)]).size < VALUES:
        return ""
    alike = (master.dt, master.start, len(master))
    others = [one for one in records if one is not master and (one.dt, one.start, len(one)) == alike]
    return next((one.tag for one in others if one.sp is not None and _is(one.sp, master.op)), "")


def _is(sp: NDArray[np.float64], op: NDArray[np.float64]) -> bool:
    """Whether a set point is an OP, but for its scale and the rounding of both."""
    probe = slice(None, None, max(1, op.size // PROBE))
    if not _alike(sp[probe], op[probe]):
        return False
    known = np.isfinite(sp) & np.isfinite(op)
    if known.sum() < BOTH * op.size:
        return False
    sp, op = sp[known], op[known]
    left, slope = _left(sp, op)
    rounding = quantisation_step(sp) + abs(slope) * quantisation_step(op)
    return _alike(sp, op) and left <= rounding + 1e-6 * peak_to_peak(sp)


def _alike(sp: NDArray[np.float64], op: NDArray[np.float64]) -> bool:
    """Whether the one lies near a straight line of the other, where both are known."""
    known = np.isfinite(sp) & np.isfinite(op)
    sp, op = sp[known], op[known]
    return sp.size > 2 and _left(sp, op)[0] <= COARSE * float(np.ptp(sp)) > 0.0


def _left(y: NDArray[np.float64], x: NDArray[np.float64]) -> tuple[float, float]:
    """The largest distance from a straight line, and its slope."""
    about = x - x.mean()
    power = float(about @ about)
    if not power > 0.0:
        return np.inf, 0.0
    slope = float(about @ y) / power
    return float(np.abs(y - y.mean() - slope * about).max()), slope
