"""Nelder and Mead's simplex search, as SciPy has it: the import of `scipy.optimize` takes longer than a diagnosis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

__all__ = ["simplex_search"]


def simplex_search(
    error: Callable[[NDArray[np.float64]], float],
    simplex: NDArray[np.float64],
    evaluations: int,
    point_tolerance: float,
    error_tolerance: float,
) -> tuple[NDArray[np.float64], float]:
    """Search the minimum of a function from a simplex.

    `error`: the function, of a point of shape (n_parameters,). `simplex`, of shape (n_parameters + 1, n_parameters):
    points to start from. `evaluations`: largest number of evaluations of the function [-]. `point_tolerance`,
    `error_tolerance`: the search ends when all points and errors are as near to those of the best point. Returns the
    best point, shape (n_parameters,), and its error.

    References
    ----------
    neldermead1965, with the coefficients 1, 2, 0.5 and 0.5.

    Examples
    --------
    >>> point, error = simplex_search(
    ...     lambda x: (x[0] - 1.0) ** 2 + x[1] ** 2, np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]]), 200, 1e-6, 1e-9)
    >>> (point.round(4) + 0.0).tolist(), round(error, 6)
    ([1.0, 0.0], 0.0)
    """
    points, n = simplex.astype(np.float64), simplex.shape[1]
    errors = np.array([error(point) for point in points])
    calls = n + 1
    while True:
        order = np.argsort(errors)
        points, errors = points[order], errors[order]
        near = np.abs(points[1:] - points[0]).max() <= point_tolerance
        if calls >= evaluations or (near and np.abs(errors[1:] - errors[0]).max() <= error_tolerance):
            return points[0], float(errors[0])
        centre, worst = points[:-1].sum(axis=0) / n, points[-1]
        trial = 2.0 * centre - worst
        found = error(trial)
        calls += 1
        if not errors[0] <= found < errors[-2]:
            if calls >= evaluations:
                continue
            expands, outside = found < errors[0], found < errors[-1]
            near_weight, worst_weight = (3.0, -2.0) if expands else (1.5, -0.5) if outside else (0.5, 0.5)
            second = near_weight * centre + worst_weight * worst
            other = error(second)
            calls += 1
            if other < found if expands else other <= found if outside else other < errors[-1]:
                trial, found = second, other
            elif not expands:
                for k in range(1, n + 1):
                    points[k] = points[0] + 0.5 * (points[k] - points[0])
                    if calls < evaluations:
                        errors[k] = error(points[k])
                        calls += 1
                continue
        points[-1], errors[-1] = trial, found
