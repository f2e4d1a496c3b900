"""The weights of a controller's law, by least squares without the moves that are something else."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Law", "fit_law"]

BUMPS, ROUNDS = 6.0, 3
"""Robust deviations beyond which a move has no say in the weights, and how often these are found again [-]."""


class Law(NamedTuple):
    """A law fitted."""

    weights: NDArray[np.float64]
    """Weight of each column [unit of y over that of the column], shape (n_columns,)."""
    left: NDArray[np.float64]
    """What the law leaves of each move [unit of y], shape (n_rows,)."""
    kept: NDArray[np.bool_]
    """Moves that obey it, shape (n_rows,)."""


def fit_law(y: NDArray[np.float64], columns: NDArray[np.float64], usable: NDArray[np.bool_], fewest: int) -> Law | None:
    """Weigh the columns so that they tell y, moves far off the law left out.

    Parameters
    ----------
    y : ndarray, shape (n_rows,)
        Moves to be told; NaN where one is not known.
    columns : ndarray, shape (n_columns, n_rows)
        What tells them; NaN where it is not known.
    usable : ndarray of bool, shape (n_rows,)
        Moves that may be used.
    fewest : int
        Moves below which no law is fitted [-].

    Returns
    -------
    Law or None
        None of too few moves.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.random.default_rng(0).normal(size=(2, 200))
    >>> law = fit_law(3.0 * x[0] - x[1] + 50.0 * (np.arange(200) == 9), x, np.ones(200, dtype=bool), fewest=100)
    >>> law.weights.round(12).tolist(), np.flatnonzero(~law.kept).tolist()
    ([3.0, -1.0], [9])
    """
    usable = usable & np.isfinite(y) & np.isfinite(columns).all(axis=0)
    kept, weights, left = usable, np.zeros(len(columns)), np.abs(y)
    for _ in range(ROUNDS):
        if kept.sum() < fewest:
            return None
        X, told = columns[:, kept], y[kept]
        scale = np.sqrt(np.einsum("ik,ik->i", X, X))
        scale[scale == 0.0] = 1.0
        X = X / scale[:, np.newaxis]
        # Not by `@`: the threads of a linear algebra library take longer to start than so small a product takes.
        products, with_y = np.einsum("ik,jk->ij", X, X), np.einsum("ik,k->i", X, told)
        weights = np.linalg.pinv(products, rcond=1e-13, hermitian=True) @ with_y / scale
        left = np.abs(y - np.einsum("i,ik->k", weights, columns))
        kept = usable & (left <= BUMPS * 1.4826 * np.median(left[usable]))
    return Law(weights, left, kept)
