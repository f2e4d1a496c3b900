"""Whether OP and PV stand in each other's columns: the law of a controller then holds the other way round.

A controller computes OP from the PV, noise and all, so that its law leaves next to nothing of OP's moves. The process
makes the PV from OP late, smoothed and with loads and noise of its own: that law leaves much of the PV's moves, but
for a process that only integrates, at once and without noise, which is no PI controller either (its Ti is a sample).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.controller import fit_controller
from stiction.errors import RecordError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identified import ControllerFit
    from stiction.records.record import LoopRecord

__all__ = ["are_swapped"]

LEFT, TIMES = 1e-4, 300.0
"""Share of the moves that a law leaves up to which it is a controller's [-], and how many times that the law as the
columns are named must leave [-]."""
ROUGHLY = 30.0
"""The same by a quick fit, from which on it is looked at closer [-]."""
SHORTEST_TI = 1.5
"""Integral time over sampling period up to which a law may be that of a process that integrates [-]."""
FEWEST = 60
"""Samples below which a law of five weights and more may fit by chance [-]."""


def are_swapped(record: LoopRecord, controller: ControllerFit) -> bool:
    """Whether the column named PV is surely the OP that a controller made of the one named OP.

    Parameters
    ----------
    record : LoopRecord
        A record with PV.
    controller : ControllerFit
        The controller behind it, as its columns are named.

    Returns
    -------
    bool
        True where a law with a proportional and an integral part holds the other way round as for a controller's own
        samples, and not this way; False where both hold, as for a P controller with a constant set point, or neither.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import stiction as st
    >>> from stiction.diagnosis.identification import fit_controller
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> run = st.simulate(loop, sp=10.0, duration=1000.0, seed=1)
    >>> [are_swapped(one, fit_controller(one)) for one in (run, replace(run, op=run.pv, pv=run.op))]
    [False, True]
    """
    if record.pv is None or len(record) < FEWEST or controller.own_samples or not controller.left > LEFT:
        return False
    if not controller.left > ROUGHLY * _left_roughly(record.pv, record.op, record.sp):
        return False
    try:
        other = fit_controller(replace(record, op=record.pv, pv=record.op))
    except RecordError:
        return False
    surely = other.own_samples or other.left <= LEFT
    a_law = other.Kc * other.Ki > 0.0 and other.Ti > SHORTEST_TI * record.dt
    return surely and a_law and controller.left > max(TIMES * other.left, LEFT)


def _left_roughly(op: NDArray[np.float64], pv: NDArray[np.float64], sp: NDArray[np.float64] | None) -> float:
    """Share of OP's moves that a PID law leaves, by the median, which gaps and single bumps do not pull [-]."""
    seen = pv if sp is None else pv - sp
    parts = [np.diff(seen)[1:], seen[2:], np.diff(seen, 2), np.ones(op.size - 2)]
    if sp is not None and np.ptp(sp[np.isfinite(sp)]) > 0.0:
        parts += [np.diff(pv)[1:], np.diff(pv, 2)]
    columns, y = np.stack(parts), np.diff(op)[1:]
    valid = np.isfinite(y) & np.isfinite(columns).all(axis=0)
    columns, y = columns[:, valid], y[valid]
    if y.size < FEWEST or not np.any(y):
        return 1.0
    products = np.einsum("ik,jk->ij", columns, columns)
    weights = np.linalg.pinv(products, hermitian=True) @ np.einsum("ik,k->i", columns, y)
    left = np.abs(y - np.einsum("i,ik->k", weights, columns))
    return float((1.4826 * np.median(left)) ** 2 / y.var())
