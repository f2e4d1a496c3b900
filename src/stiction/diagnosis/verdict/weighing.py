"""Weights found by `tests/diagnosis/verdict/calibrate.py`: what each feature adds to the log odds of an outcome.

A feature x, held between `low` and `high`, adds slope (x - usual) + bend (max(x - knot, 0) - max(usual - knot, 0)): a
straight line with one bend, nothing where the feature has its usual value, the mean over the records it was found on.
The first line of each file says which these were, and when.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["COLUMNS", "CONSTANT", "Weighing", "found_on", "weighing"]

CONSTANT = "constant"
"""Name of the row that holds the log odds where each feature has its usual value."""
COLUMNS = ("outcome", "feature", "low", "high", "usual", "knot", "slope", "bend")
"""Columns of a file of weights."""


@dataclass(frozen=True)
class Weighing:
    """A table of weights, ready to be used on rows of features."""

    outcomes: tuple[str, ...]
    """What it gives log odds of, shape (n_outcomes,)."""
    features: tuple[str, ...]
    """Which features it weighs, shape (n_features,)."""
    constant: NDArray[np.float64]
    """Log odds where each feature has its usual value, shape (n_outcomes,)."""
    low: NDArray[np.float64]
    """Least value of each feature, shape (n_features,)."""
    high: NDArray[np.float64]
    """Largest value of each feature, same shape."""
    usual: NDArray[np.float64]
    """Usual value of each feature, same shape."""
    knot: NDArray[np.float64]
    """Where the line bends, same shape."""
    slope: NDArray[np.float64]
    """Slope below the bend, shape (n_features, n_outcomes)."""
    bend: NDArray[np.float64]
    """What is added to the slope beyond it, same shape."""

    def added(self, row: Sequence[float]) -> NDArray[np.float64]:
        """What each feature of a row adds to the log odds.

        Parameters
        ----------
        row : sequence of float
            Values of `features`, in that order.

        Returns
        -------
        ndarray, shape (n_features, n_outcomes)
            Log odds [-].
        """
        x = np.clip(np.asarray(row, dtype=np.float64), self.low, self.high)
        beyond = np.maximum(x - self.knot, 0.0) - np.maximum(self.usual - self.knot, 0.0)
        return (x - self.usual)[:, np.newaxis] * self.slope + beyond[:, np.newaxis] * self.bend


@cache
def weighing(name: str) -> Weighing:
    """Read a table of weights that comes with the package.

    Parameters
    ----------
    name : str
        "sticks", "causes", "jumps" or "plant".

    Returns
    -------
    Weighing
        The table.

    Examples
    --------
    >>> weighing("sticks").outcomes, "band" in weighing("sticks").features
    (('stiction',), True)
    """
    rows = list(csv.DictReader(_text(name).splitlines()[1:]))
    outcomes = tuple(dict.fromkeys(row["outcome"] for row in rows))
    features = tuple(dict.fromkeys(row["feature"] for row in rows if row["feature"] != CONSTANT))
    told = {(row["feature"], row["outcome"]): row for row in rows}

    def column(key: str) -> NDArray[np.float64]:
        return np.array([float(told[feature, outcomes[0]][key]) for feature in features])

    def table(key: str) -> NDArray[np.float64]:
        return np.array([[float(told[feature, outcome][key]) for outcome in outcomes] for feature in features])

    constant = np.array([float(told[CONSTANT, outcome]["slope"]) for outcome in outcomes])
    low, high, usual, knot = (column(key) for key in ("low", "high", "usual", "knot"))
    return Weighing(outcomes, features, constant, low, high, usual, knot, table("slope"), table("bend"))


def found_on(name: str) -> str:
    """Say by what a table of weights was found, when, and on which loops.

    Parameters
    ----------
    name : str
        "sticks", "causes", "jumps" or "plant".

    Returns
    -------
    str
        A sentence.

    Examples
    --------
    >>> found_on("causes").startswith("Found by tests/diagnosis/verdict/calibrate.py on 20")
    True
    """
    return _text(name).partition("\n")[0].removeprefix("# ")


def _text(name: str) -> str:
    return files("stiction.diagnosis.verdict").joinpath(f"{name}.csv").read_text(encoding="utf-8")
