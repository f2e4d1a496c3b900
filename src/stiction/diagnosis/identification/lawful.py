r"""The law of a controller from OP and PV of which a historian left samples out.

The moves of a PI or PID controller are linear in what it sees of PV and set point,

.. math:: \Delta u_j = -K_p\,\Delta y_j + K_i\,(r_j - y_j) - K_d\,\Delta^2 y_j + b\,\Delta r_j + d ,

so that its weights come by least squares from the moves of which OP and PV were stored. Where one of both was stored
too seldom for that, but the other at nearly every sample, they come from what lies between two stored values. Of OP
that is the sum of its moves, linear in the same weights. For the PV the law of a PI controller is solved for it,

.. math:: y_j = \alpha\,y_{j-1} + \beta\,\Delta u_j + \gamma\,r_j + \delta\,\Delta r_j + \epsilon, \qquad
          \alpha = \frac{K_p}{K_p + K_i} ,

a recursion that over any number of samples is linear in all but :math:`\alpha`, which is looked for. The filter of a
derivative part is not fitted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.diagnosis.identification.law import fit_law

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.law import Law
    from stiction.records.quality.storage_rate import StoredMasks

__all__ = ["FEWEST", "Moves", "moves_of"]

FEWEST, COMPLETE = 20, 50
"""Stretches, and complete moves, below which no law is fitted [-]."""
EXACTLY, LEAVES = 1e-3, 0.01
"""Share of the complete moves, and of what a signal does between two stored values, that the law may leave [-]: a law
that is not the controller's explains what moves slowly all but exactly, as one that is does the rest."""
NOISE = 0.3
"""Share of OP's moves from sample to sample that it may leave as well where PV was stored too seldom to see these
[-]."""
ALWAYS = 0.8
"""Share of the samples from which a signal is taken as stored at all of them [-]."""
ALPHAS = (*np.linspace(0.0, 0.9, 10).tolist(), *(1.0 - np.geomspace(0.07, 1e-3, 8)).tolist())
"""Where alpha is looked for first [-]."""
PRECISELY = 1e-8
"""How precisely alpha is then found [-]."""


class Moves(NamedTuple):
    """What a controller makes of the PV, sample by sample."""

    past: tuple[float, float, float]
    """Weights of the PV at the sample of the move, and one and two before it [% of span per PV unit]."""
    drive: NDArray[np.float64]
    """What set point and drift add to each move [% of span], shape (n_samples,)."""
    variance: float
    """Mean square of what the law leaves of a move [% of span squared]."""
    moved: float
    """Mean square of the moves [% of span squared]."""
    largest: float
    """Largest move [% of span]."""


def moves_of(
    u: NDArray[np.float64],
    y: NDArray[np.float64],
    r: NDArray[np.float64],
    kept: StoredMasks,
    usable: NDArray[np.bool_],
) -> Moves | None:
    """Find the law from what was stored.

    Parameters
    ----------
    u, y, r : ndarray, shape (n_samples,)
        OP [% of span], and PV and set point about one level [PV units]; any number where one is missing.
    kept : StoredMasks
        At which samples OP and PV were stored.
    usable : ndarray of bool, shape (n_samples,)
        Samples at which the controller may act: in automatic, off its limits, with a set point.

    Returns
    -------
    Moves or None
        None where no law leaves `LEAVES` or less, or OP is held by a controller that acts as seldom as it moves.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records.quality.storage_rate import StoredMasks
    >>> y = np.random.default_rng(1).normal(size=400)
    >>> u, every, fifth = np.cumsum(-0.5 * y) - 2.0 * y, np.ones(400, dtype=bool), np.arange(400) % 5 == 0
    >>> law = moves_of(u, y, np.zeros(400), StoredMasks(every, fifth), every)
    >>> [round(weight, 6) for weight in law.past]
    [-2.5, 2.0, 0.0]
    """
    whole = kept.op & kept.pv & usable
    complete = np.zeros_like(usable)
    complete[2:] = whole[2:] & whole[1:-1] & kept.pv[:-2]
    seldom_op = kept.pv.mean() >= ALWAYS > kept.op.mean()
    seldom_pv = kept.op.mean() >= ALWAYS > kept.pv.mean()
    if complete.sum() >= COMPLETE:
        return _complete(u, y, r, complete)
    if seldom_op:
        return _of_stored_op(u, y, r, kept, usable)
    return _of_stored_pv(u, y, r, kept, usable) if seldom_pv else None


def _complete(
    u: NDArray[np.float64], y: NDArray[np.float64], r: NDArray[np.float64], complete: NDArray[np.bool_]
) -> Moves | None:
    """The law from the moves of which all was stored."""
    moved, parts = moves(u), asked(y, r)
    return _law(moved, parts, fit_law(moved, parts, complete, COMPLETE), r, 1.0, EXACTLY)


def _of_stored_op(
    u: NDArray[np.float64], y: NDArray[np.float64], r: NDArray[np.float64], kept: StoredMasks, usable: NDArray[np.bool_]
) -> Moves | None:
    """The law from what OP does between two stored values."""
    at = np.flatnonzero(kept.op)
    moved, valid, parts = np.diff(u[at]), _all_between(usable & kept.pv, at), asked(y, r)
    sums = np.diff(np.cumsum(parts, axis=1)[:, at], axis=1)
    law = fit_law(moved, sums, valid, FEWEST)
    alone = fit_law(moved, asked(y[at], r[at])[:, 1:], valid, FEWEST)
    if law is None or (alone is not None and _left(alone) <= _left(law)):
        return None  # the controller acts as seldom as OP moves, and holds it
    return _law(moved, parts, law, r, float(np.mean(np.diff(at))), LEAVES)


def _law(
    moved: NDArray[np.float64],
    parts: NDArray[np.float64],
    law: Law | None,
    r: NDArray[np.float64],
    each: float,
    leaves: float,
) -> Moves | None:
    """The weights as those of the PV's past, where the law leaves little of sums of so many moves `each`."""
    if law is None or not _explains(law, moved, leaves):
        return None
    Kp, Ki, Kd = law.weights[:3].tolist()
    drive = Ki * r + np.einsum("i,ik->k", law.weights[3:], parts[3:])
    usual = float(np.mean(moved[law.kept] ** 2)) / each
    return Moves(
        (-Kp - Ki - Kd, Kp + 2.0 * Kd, -Kd), drive, _left(law) / each, usual, float(np.abs(moved[law.kept]).max())
    )


def _of_stored_pv(
    u: NDArray[np.float64], y: NDArray[np.float64], r: NDArray[np.float64], kept: StoredMasks, usable: NDArray[np.bool_]
) -> Moves | None:
    """The law from what the PV does between two stored values, by the recursion that OP's moves drive."""
    from scipy.optimize import minimize_scalar
    from scipy.signal import lfilter

    at, wished = np.flatnonzero(kept.pv), moves(r)
    drives = np.stack([moves(u), np.ones_like(u), r, wished])[: 4 if np.any(wished) else 2]
    valid, length = _all_between(usable & kept.op, at), np.diff(at)

    def law_of(alpha: float) -> Law | None:
        forgotten, reached = alpha**length, np.asarray(lfilter([1.0], [1.0, -alpha], drives))[:, at]
        return fit_law(y[at[1:]] - forgotten * y[at[:-1]], reached[:, 1:] - forgotten * reached[:, :-1], valid, FEWEST)

    def leaves(alpha: float) -> float:
        law = law_of(alpha)
        if law is None or not law.weights[0]:
            return np.inf
        # In units of OP: of the PV a small beta leaves little in any case.
        return float(np.median(law.left[valid]) / abs(law.weights[0]))

    least = int(np.argmin([leaves(alpha) for alpha in ALPHAS]))
    near = ALPHAS[max(least - 1, 0)], ALPHAS[min(least + 1, len(ALPHAS) - 1)]
    found: Any = minimize_scalar(leaves, bounds=near, method="bounded", options={"xatol": PRECISELY})
    alpha = float(found.x)
    law = law_of(alpha)
    if law is None or not law.weights[0] or not _explains(law, np.diff(y[at]), LEAVES):
        return None
    beta, known = float(law.weights[0]), drives[0][1:][(kept.op & usable)[1:] & kept.op[:-1]]
    if _left(law) > NOISE * beta**2 * float(np.mean(known**2)):
        return None
    drive = -np.einsum("i,ik->k", law.weights[1:], drives[1:]) / beta
    variance = _left(law) / beta**2 * max(1.0 - alpha**2, 1.0 / float(np.mean(length)))
    return Moves(
        (1.0 / beta, -alpha / beta, 0.0), drive, variance, float(np.mean(known**2)), float(np.abs(known).max())
    )


def asked(y: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.float64]:
    """Parts of a move: proportional, integral, derivative, drift, and that of a set point that moves."""
    turns, wished = moves(y), moves(r)
    parts = np.stack([-turns, r - y, -moves(turns), np.ones_like(y), wished])
    return parts[: 5 if np.any(wished) else 4]


def moves(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Move from each sample to the next, at the later one; none at the first."""
    return np.diff(x, prepend=x[0])


def _all_between(good: NDArray[np.bool_], at: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Whether all samples from one to the next of some are good, shape (n_at - 1,)."""
    lost = np.cumsum(~good)
    return (lost[at[1:]] == lost[at[:-1]]) & good[at[:-1]]


def _explains(law: Law, moved: NDArray[np.float64], leaves: float) -> bool:
    """Whether a law leaves no more than a share of the moves where it holds."""
    return bool(law.kept.any()) and _left(law) <= leaves * float(np.var(moved[law.kept])) > 0.0


def _left(law: Law) -> float:
    """Mean square of what a law leaves where it holds; infinite where it holds nowhere."""
    return float(np.mean(law.left[law.kept] ** 2)) if law.kept.any() else np.inf
