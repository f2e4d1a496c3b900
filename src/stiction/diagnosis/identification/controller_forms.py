"""The forms a PID controller takes, as linear regressions of OP on what the controller saw."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "FLOOR",
    "FORMS",
    "INTEGRAL",
    "PARTS",
    "FormFit",
    "Regression",
    "best_form",
    "energy_of",
    "moves",
    "neighbour_correlation",
    "positions",
]

P, INTEGRAL, D, P_PV, D_PV = range(5)
"""Columns of a regression: parts of the error, and those of the PV alone."""
FORMS: dict[str, tuple[int, ...]] = {
    "P": (P,),
    "I": (INTEGRAL,),
    "PI": (P, INTEGRAL),
    "PID": (P, INTEGRAL, D),
    "I-P": (P_PV, INTEGRAL),
    "PI-D": (P, INTEGRAL, D_PV),
    "I-PD": (P_PV, INTEGRAL, D_PV),
}
"""Form -> its columns; what stands behind the hyphen acts on the PV alone."""
PARTS: tuple[tuple[int, ...], ...] = ((P, P_PV), (INTEGRAL,), (D, D_PV))
"""Columns of the proportional, the integral and the derivative part."""

SHORTEST_STRETCH = 16
"""Samples [-]: a shorter stretch between gaps says little beside its own offset and drift."""
FLOOR = 1e-10
"""Unexplained share [-] below which rounding errors of the computation decide."""


class Regression(NamedTuple):
    """OP and what may explain it, offset and drift taken off."""

    y: NDArray[np.float64]
    """OP or its moves [% of span], shape (n,)."""
    columns: NDArray[np.float64]
    """Proportional, integral and derivative part of the error, then P and D of the PV, shape (5, n); without the last
    two, shape (3, n), where the set point is constant."""
    taken: int
    """Offsets and drifts already fitted [-]."""

    def sums(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Products of the columns with one another, shape (n_columns, n_columns), and with y, shape (n_columns,)."""
        # Not by @: the threads of a BLAS cost more than these sums where other work shares the cores.
        rows = (*self.columns, self.y)
        products = np.empty((len(rows), len(rows)))
        for i, row in enumerate(rows):
            for j in range(i + 1):
                products[i, j] = products[j, i] = np.einsum("k,k->", row, rows[j])
        return products[:-1, :-1], products[:-1, -1]

    def unexplained(self, moving: bool, fitted: Regression | None = None) -> NDArray[np.float64]:
        """What all columns together leave [% of span], shape (n,); those of the PV only for a moving set point.

        The weights are those of `fitted`, which may be a part of these samples.
        """
        uses = (P, INTEGRAL, D, P_PV, D_PV) if moving else (P, INTEGRAL, D)
        weights, _ = _solve(*(fitted or self).sums(), uses)
        left = self.y.copy()
        for weight, use in zip(weights, uses, strict=True):
            left -= weight * self.columns[use]
        return left


class FormFit(NamedTuple):
    """One form fitted."""

    form: str
    """Key of `FORMS`."""
    weights: dict[int, float]
    """Column -> its weight."""
    covariance: NDArray[np.float64]
    """Covariance of the weights in the order of the form's columns."""
    share: float
    """Share of the variation that it explains [-]."""
    bic: float
    """Schwarz's criterion [-]; the smallest wins."""


def energy_of(x: NDArray[np.float64]) -> float:
    """Sum of squares."""
    return float(np.einsum("i,i->", x, x))


def neighbour_correlation(x: NDArray[np.float64]) -> float:
    """Correlation of neighbouring residuals [-]."""
    energy = energy_of(x)
    return float(np.einsum("i,i->", x[1:], x[:-1])) / energy if energy > 0.0 else 0.0


def moves(
    op: NDArray[np.float64],
    error: NDArray[np.float64],
    pv: NDArray[np.float64],
    valid: NDArray[np.bool_],
    dt: float,
    trapezoid: float,
    moving: bool = True,
) -> Regression:
    """Velocity form: the moves of OP from sample to sample.

    Parameters
    ----------
    op, error, pv : ndarray, shape (n_samples,)
        Signals without NaN [% of span], [PV units], [PV units].
    valid : ndarray of bool, shape (n_samples,)
        Samples that may be used; a move needs three in a row.
    dt : float
        Sampling period [s].
    trapezoid : float
        0.0 adds the new error to the integral as a controller does, 0.5 the mean of old and new.
    moving : bool
        Whether the set point moves; else no column of the PV is made.
    """
    rows = valid[2:] & valid[1:-1] & valid[:-2]
    de, dy = np.diff(error), -np.diff(pv)
    parts = (de[1:], dt * (error[2:] - trapezoid * de[1:]), np.diff(de) / dt, dy[1:], np.diff(dy) / dt)
    everywhere = bool(rows.all())
    columns = np.stack([part if everywhere else part[rows] for part in parts[: None if moving else P_PV]])
    y = np.diff(op)[1:][rows]
    if y.size:
        y = y - y.mean()
        columns -= columns.mean(axis=1, keepdims=True)
    return Regression(y, columns, 1)


def positions(
    op: NDArray[np.float64],
    error: NDArray[np.float64],
    pv: NDArray[np.float64],
    valid: NDArray[np.bool_],
    dt: float,
    trapezoid: float,
    moving: bool,
) -> Regression:
    """Position form: OP itself; each stretch between gaps has an offset and a drift of its own.

    The drift stands for the mean error, which a set point that was not recorded leaves unknown. Parameters as
    in `moves`.
    """
    usable = valid.copy()
    usable[0] = False
    usable[1:] &= valid[:-1]
    starts = usable & ~np.concatenate([[False], usable[:-1]])
    stretch = np.cumsum(starts) - 1
    length = np.bincount(stretch[usable], minlength=1)
    rows = usable.copy()
    rows[usable] = length[stretch[usable]] >= SHORTEST_STRETCH
    de, dy = np.diff(error, prepend=error[:1]), -np.diff(pv, prepend=pv[:1])
    parts = (error, dt * (np.cumsum(error) - trapezoid * error), de / dt, -pv, dy / dt)
    signals = np.stack([part[rows] for part in (op, *parts[: None if moving else P_PV])])
    kept = stretch[rows]
    member = np.cumsum(np.diff(kept, prepend=kept[:1]) != 0)
    count = int(member[-1]) + 1 if member.size else 0
    straight = _straightened(signals, np.flatnonzero(rows).astype(np.float64), member, count)
    return Regression(straight[0], straight[1:], 2 * count)


def _straightened(
    x: NDArray[np.float64], t: NDArray[np.float64], member: NDArray[np.intp], count: int
) -> NDArray[np.float64]:
    """Take each stretch's own straight line off every row of x."""
    if count == 0:
        return x
    if count == 1:
        t = t - t.mean()
        x = x - x.mean(axis=1, keepdims=True)
        return x - np.einsum("ik,k->i", x, t)[:, np.newaxis] / energy_of(t) * t
    size = np.bincount(member, minlength=count)

    def sums(row: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.bincount(member, row, minlength=count).astype(np.float64)

    t = t - (sums(t) / size)[member]
    spread = sums(t * t)
    out = np.empty_like(x)
    for i, row in enumerate(x):
        level = row - (sums(row) / size)[member]
        out[i] = level - (sums(level * t) / spread)[member] * t
    return out


def _solve(
    products: NDArray[np.float64], with_y: NDArray[np.float64], uses: tuple[int, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Weights by the normal equations, and the inverse of the information."""
    chosen = products[np.ix_(uses, uses)]
    size = np.sqrt(np.diag(chosen))
    size[size == 0.0] = 1.0
    inverse = np.linalg.pinv(chosen / np.outer(size, size), rcond=1e-13, hermitian=True) / np.outer(size, size)
    return inverse @ with_y[list(uses)], inverse


def best_form(data: Regression, moving: bool, rho: float, dt: float, exact: bool) -> FormFit:
    """Fit every form and take the one with the smallest criterion of Schwarz.

    Parameters
    ----------
    data : Regression
        What `moves` or `positions` made.
    moving : bool
        Whether the set point moves; at a constant one a part on the PV is the same as one on the error.
    rho : float
        Correlation of neighbouring residuals [-]: that many samples fewer speak for themselves.
    dt : float
        Sampling period [s].
    exact : bool
        Whether the record shows the controller's own samples; otherwise a part must stand out of what the
        sampling hides: Kc above Ki dt / 4, Td above dt / 4.

    Returns
    -------
    FormFit
        The best form, all of whose parts have one sign.
    """
    products, with_y = data.sums()
    energy = energy_of(data.y)
    shrink = (1.0 - rho) / (1.0 + rho)
    n = max(data.y.size * shrink, 2.0)
    hidden = 0.0 if exact else 0.25 * dt
    best = FormFit("P", {P: 0.0}, np.zeros((1, 1)), 0.0, math.inf)
    for form, uses in FORMS.items():
        if not moving and "-" in form:
            continue
        weights, inverse = _solve(products, with_y, uses)
        if len(uses) > 1 and not _exceeds(weights[0], weights[1], hidden):
            continue
        if len(uses) > 2 and not _exceeds(weights[2], weights[0], hidden):
            continue
        rest = max(energy - float(weights @ with_y[list(uses)]), 0.0)
        bic = n * math.log(rest / energy + FLOOR) + len(uses) * math.log(n)
        if bic < best.bic:
            free = max(data.y.size - len(uses) - data.taken, 1)
            by_column = dict(zip(uses, weights.tolist(), strict=True))
            best = FormFit(form, by_column, inverse * (rest / free / shrink), 1.0 - rest / energy, bic)
    return best


def _exceeds(part: float, other: float, times: float) -> bool:
    """Whether two parts have one sign and the first is more than so many times the other."""
    return bool(part * other > 0.0 and abs(part) > times * abs(other))
