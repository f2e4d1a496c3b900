r"""One of OP and PV stored seldom: what was between is told by the other one and the controller's law.

A historian may store PV every second and OP every five, or the other way round. The controller made every move of OP
from what it saw of the PV, so that one of them with every fifth of the other is all that there was:

.. math:: \Delta u_j = -K_p\,\Delta y_j + K_i\,(r_j - y_j) + b\,\Delta r_j - K_d\,\Delta^2 y_j + d

OP held for m samples is the sum of its moves, linear in the gains, and exact for P, PI and PID alike but for a
filter of the derivative part:

.. math:: u_{k+m} - u_k = -K_p\,(y_{k+m} - y_k) + K_i \sum_{j=1}^{m} (r_{k+j} - y_{k+j}) + \dots

PV held for m samples follows from OP where there is no derivative part. The law solved for y is a recursion,

.. math:: y_j = \alpha\,y_{j-1} + \beta\,\Delta u_j + \gamma\,r_j + \delta\,\Delta r_j + \epsilon, \qquad
          \alpha = \frac{K_p}{K_p + K_i}

so that after m samples it is linear in all but :math:`\alpha`, which is looked for. With :math:`\alpha < 1` it forgets
its errors.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.controller import at_limit
from stiction.diagnosis.identification.law import Law, fit_law
from stiction.diagnosis.identification.signals import hold_gaps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["restored"]

FEWEST = 20
"""Stored values below which no law is fitted [-]."""
LEAVES = 0.01
"""Share of what the slower one does between two stored values that the law may leave [-]."""
MISSING = 0.1
"""Share of the samples that may be missing after all [-]: at a limit of OP, in manual and after bumps no law holds."""
SAME = 1e-3
"""The same share up to which what comes out is what was recorded [-]: it was held by an analyser or a transmitter, and
the controller saw it so."""
NO_BUMP = 1e-4
"""Share of the largest move up to which what is left is none [-]: where the law is exact only rounding is left."""
ALPHAS = (*np.linspace(0.0, 0.9, 10).tolist(), *(1.0 - np.geomspace(0.07, 1e-3, 8)).tolist())
"""Where alpha is looked for first [-]."""
PRECISELY = 1e-8
"""How precisely alpha is then found [-]."""


def restored(record: LoopRecord, name: str, stored: NDArray[np.intp]) -> LoopRecord | None:
    """The record with OP or PV as it was between its stored values.

    Parameters
    ----------
    record : LoopRecord
        A record with PV; without SP, a constant one is assumed.
    name : {"OP", "PV"}
        Which of them is stored seldom; the other is at every sample.
    stored : ndarray
        Samples at which it is new, in their order.

    Returns
    -------
    LoopRecord or None
        As many samples, those of OP or PV NaN where the law does not hold and before the first stored value; None where
        no such law is seen, or the controller held the value itself.

    Notes
    -----
    Derived above. What it brings is counted in ``docs/verdict-measured.md``.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> from dataclasses import replace
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> run = st.simulate(loop, sp=10.0, duration=2000.0, seed=1)
    >>> held = replace(run, pv=np.repeat(run.pv[::5], 5))
    >>> found = restored(held, "PV", np.arange(0, 2000, 5))
    >>> bool(np.abs(found.pv - run.pv)[:1996].max() < 1e-6)
    True
    """
    assert record.pv is not None
    op, pv = record.op, record.pv
    sp = np.full_like(pv, np.nanmean(pv)) if record.sp is None else record.sp
    usable = np.isfinite(op) & np.isfinite(pv) & np.isfinite(sp) & ~at_limit(hold_gaps(op))
    if record.auto is not None:
        usable &= record.auto
    middle = float(np.nanmean(sp))
    follow = _op_between if name == "OP" else _pv_between
    whole = follow(op, np.nan_to_num(sp - middle), np.nan_to_num(pv - middle), _Stretches(stored, usable))
    if whole is None or np.isnan(whole).mean() > MISSING:
        return None
    recorded = op if name == "OP" else pv - middle
    if np.nanmean((whole - recorded) ** 2) <= SAME * np.nanmean(np.diff(recorded[stored]) ** 2):
        return None
    return replace(record, op=whole) if name == "OP" else replace(record, pv=whole + middle)


class _Stretches:
    """From each stored value to the next one."""

    def __init__(self, stored: NDArray[np.intp], usable: NDArray[np.bool_]):
        self.first, self.last = stored[:-1], stored[1:]
        self.length = self.last - self.first
        lost = np.cumsum(~usable)
        self.usable = (lost[self.last] == lost[self.first]) & usable[self.first]
        at = np.arange(usable.size)
        self.own = np.searchsorted(stored, at, side="right") - 1
        """Number of the stored value before each sample, shape (n_samples,); -1 before the first."""
        self.since = np.where(self.own >= 0, at - stored[self.own], 0)
        """Samples since then."""
        self.begin = stored[self.own]
        """The sample at which it was stored."""

    def placed(
        self, x: NDArray[np.float64], path: NDArray[np.float64], holds: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """What was stored of x, and the path between where the law holds; NaN where it does not and at first."""
        told = np.append(holds, self.usable[-1:])[self.own] & (self.own >= 0)
        return np.where((self.own >= 0) & (self.since == 0), x, np.where(told, path, np.nan))


def _op_between(
    op: NDArray[np.float64], sp: NDArray[np.float64], pv: NDArray[np.float64], held: _Stretches
) -> NDArray[np.float64] | None:
    """OP at every sample by the moves that the PV asked for; a drift closes each stretch."""
    turns, wished = _moves(pv), _moves(sp)
    asked = np.stack([-turns, sp - pv, -_moves(turns), np.ones_like(pv), wished, _moves(wished)])
    asked = np.cumsum(asked[: 6 if np.any(wished) else 4], axis=1)
    moved = op[held.last] - op[held.first]
    law = fit_law(moved, asked[:, held.last] - asked[:, held.first], held.usable, FEWEST)
    if law is None or not _holds(law, moved) or _left(law) >= _left_by_itself(sp, pv, moved, held):
        return None
    path = np.einsum("i,ik->k", law.weights, asked)
    off = moved - (path[held.last] - path[held.first])
    closed = np.append(off / held.length, 0.0)[held.own] * held.since
    rests = at_limit(hold_gaps(op))[held.first] & (moved == 0.0)
    path = np.where(np.append(rests, False)[held.own], 0.0, path - path[held.begin] + closed)
    return held.placed(op, op[held.begin] + path, _obeyed(law, moved, held) | rests)


def _pv_between(
    op: NDArray[np.float64], sp: NDArray[np.float64], pv: NDArray[np.float64], held: _Stretches
) -> NDArray[np.float64] | None:
    """PV at every sample by the recursion that OP's moves drive."""
    from scipy.optimize import minimize_scalar
    from scipy.signal import lfilter

    wished = _moves(sp)
    drives = np.stack([_moves(hold_gaps(op)), np.ones_like(op), sp, wished])
    drives = drives[: 4 if np.any(wished) else 2]
    moved = pv[held.last] - pv[held.first]

    def law_of(alpha: float) -> tuple[Law | None, NDArray[np.float64]]:
        reached = lfilter([1.0], [1.0, -alpha], drives)
        forgotten = alpha**held.length
        since = reached[:, held.last] - forgotten * reached[:, held.first]
        return fit_law(pv[held.last] - forgotten * pv[held.first], since, held.usable, FEWEST), reached

    def leaves(alpha: float) -> float:
        law, _ = law_of(alpha)
        if law is None or not law.weights[0]:
            return np.inf
        # In units of OP: of the PV a small beta leaves little in any case.
        return float(np.median(law.left[held.usable]) / abs(law.weights[0]))

    least = int(np.argmin([leaves(alpha) for alpha in ALPHAS]))
    near = ALPHAS[max(least - 1, 0)], ALPHAS[min(least + 1, len(ALPHAS) - 1)]
    alpha = float(minimize_scalar(leaves, bounds=near, method="bounded", options={"xatol": PRECISELY}).x)
    law, reached = law_of(alpha)
    if law is None or not _holds(law, moved):
        return None
    driven = np.einsum("i,ik->k", law.weights, reached)
    return held.placed(pv, driven + alpha**held.since * (pv - driven)[held.begin], _obeyed(law, moved, held))


def _moves(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Move from each sample to the next, at the later one; none at the first."""
    return np.diff(x, prepend=x[0])


def _left(law: Law | None) -> float:
    """What the law leaves of a move, its mean square; infinite without a law."""
    return np.inf if law is None else float(np.mean(law.left[law.kept] ** 2))


def _left_by_itself(
    sp: NDArray[np.float64], pv: NDArray[np.float64], moved: NDArray[np.float64], held: _Stretches
) -> float:
    """What is left of OP's moves by a controller that acts as seldom as OP moves: it is then held by the controller."""
    y, r = pv[held.last], sp[held.last]
    turns, wished = y - pv[held.first], r - sp[held.first]
    asked = np.stack([-turns, r - y, -_moves(turns), np.ones_like(y), wished, _moves(wished)])
    return _left(fit_law(moved, asked[: 6 if np.any(wished) else 4], held.usable, FEWEST))


def _holds(law: Law, moved: NDArray[np.float64]) -> bool:
    """Whether the law leaves little of what the slower one does between its stored values."""
    return _left(law) <= LEAVES * float(np.var(moved[law.kept]))


def _obeyed(law: Law, moved: NDArray[np.float64], held: _Stretches) -> NDArray[np.bool_]:
    """Stretches in which the law holds."""
    return law.kept | (held.usable & (law.left <= NO_BUMP * np.nanmax(np.abs(moved))))
