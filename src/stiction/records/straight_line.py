"""Straight line through points, by least squares."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["FittedLine", "fit_line"]


class FittedLine(NamedTuple):
    """A straight line by its slope and the means of the points."""

    slope: float
    """Slope [unit of y per unit of x]."""
    x_mean: float
    """Mean of x."""
    y_mean: float
    """Mean of y, through which the line passes at `x_mean`."""

    def at(self, x: NDArray) -> NDArray[np.float64]:
        """Value of the line at `x` [unit of y]."""
        return self.y_mean + self.slope * (x - self.x_mean)


def fit_line(x: NDArray, y: NDArray) -> FittedLine:
    """Fit a line by least squares in `y`; at least two values of `x` differ [any units], and none is missing."""
    x_mean = x.mean()
    centred = x - x_mean
    return FittedLine(float(centred @ y / (centred @ centred)), float(x_mean), float(y.mean()))
