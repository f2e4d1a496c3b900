"""Whether a record shows the controller's own samples, or OP moved between them unseen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.controller import COMPUTED
from stiction.diagnosis.identification.signals import hold_gaps
from stiction.records.quality.moving_average import detect_averaging_window

if TYPE_CHECKING:
    from stiction.diagnosis.identified import ControllerFit
    from stiction.records.record import LoopRecord

__all__ = ["are_own_samples", "shows_own_samples"]

APART, MOST_APART = 8.0, 0.1
"""Median residuals beyond which a move is left out (a gap, a bump, a limit), and the largest share of them [-]."""
FEWEST_ROWS = 30
"""Moves below which nothing is said."""


def shows_own_samples(record: LoopRecord) -> bool:
    r"""Whether a linear controller that moves once a sample explains the moves of OP to the last digit, unsmoothed.

    .. math:: \Delta u_k = a\,\Delta u_{k-1} + \sum_{i=0}^{2} (b_i\,y_{k-i} + c_i\,r_{k-i}) + d

    Parameters
    ----------
    record : LoopRecord
        A record with PV; without SP, a constant one is assumed.

    Returns
    -------
    bool
        False also where the record is too short, more than a tenth of the moves are something else, or OP and PV are
        moving averages: what is linear obeys the equation after the same filter as well.

    Notes
    -----
    Derived: with u = Kc (e + integral + filtered derivative), each a recursion over the controller's samples, the
    moves obey this equation exactly, P, PI, and PID with a derivative filter alike. In a record that is slower, or
    that a historian has averaged or interpolated, PV acts on OP between the samples. Of 826 simulated sticky loops
    (`simulation.population`, seeds 41, 51 and 77) 448 pass, none of them slower than its controller; what is left is
    below 1e-20 of the moves in these, above 1e-8 in the slower ones. A controller without integral and derivative
    obeys its equation at every rate, so that a slower record of one passes too.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.simulation.historian import sampled
    >>> controller = st.PID(0.2, 10.0, Td=2.0, N=8.0)
    >>> loop = st.Loop(controller, st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> run = st.simulate(loop, sp=10.0, duration=2000.0, seed=1)
    >>> shows_own_samples(run), shows_own_samples(sampled(run, 3.0))
    (True, False)
    """
    assert record.pv is not None
    moves, n = np.diff(record.op), record.op.size
    signals = [record.pv] if record.sp is None else [record.pv, record.sp]
    columns = [np.ones(n - 2), moves[:-1]] + [x[2 - lag : n - lag] for x in signals for lag in range(3)]
    A, y = np.stack(columns, axis=1), moves[1:]
    known = np.isfinite(A).all(axis=1) & np.isfinite(y)
    A, y = A[known], y[known]
    if y.size < FEWEST_ROWS:
        return False
    A[:, 1:] -= A[:, 1:].mean(axis=0)
    A /= np.maximum(np.abs(A).max(axis=0), 1e-300)
    kept = np.ones(y.size, dtype=bool)
    # Again and again, because a fit that gaps have pulled away leaves much of the good moves too.
    for _ in range(3):
        left = np.abs(y - A @ np.linalg.lstsq(A[kept], y[kept], rcond=None)[0])
        if left[kept] @ left[kept] <= COMPUTED * (y[kept] @ y[kept]):
            own = kept.mean() >= 1.0 - MOST_APART
            return bool(own) and not detect_averaging_window(hold_gaps(record.op), hold_gaps(record.pv))
        kept = left <= APART * np.median(left)
    return False


def are_own_samples(record: LoopRecord, controller: ControllerFit) -> bool:
    """Whether a record shows the controller's own samples, by the controller found or by `shows_own_samples`.

    Parameters
    ----------
    record : LoopRecord
        A record with PV.
    controller : ControllerFit
        The controller found, which leaves out limits and bumps.

    Returns
    -------
    bool
        True where the controller explains the moves of OP to the last digit, or to the rounding of OP and PV where a
        slower record would leave more.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.diagnosis.identification.controller import fit_controller
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> run = st.simulate(loop, sp=10.0, duration=2000.0, seed=1)
    >>> are_own_samples(run, fit_controller(run))
    True
    """
    return controller.own_samples or shows_own_samples(record)
