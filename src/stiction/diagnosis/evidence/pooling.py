r"""Pool the windows of one valve to one probability, by a small trained model read from `pooling.json`.

.. math:: E = \bar e + (n_{eff} - 1) \sum_k b_k x_k, \quad n_{eff} = \frac{n}{1 + (n - 1) \rho}

E is the evidence of all windows, log odds beyond those of the prior; e is that of a window, and x are means over the
windows. Errors of windows of one valve are correlated, so n windows count as n_eff independent ones, at most 1 / rho.
One window keeps its evidence. `calibration/train_pooling.py` trains b and rho on simulated histories (logistic
regression).
"""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.diagnosis.evidence.sizes import PooledSize, pool_estimates
from stiction.diagnosis.verdict.model import log_odds, logistic

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.diagnosis.verdict.history import Window

__all__ = ["POOLED_FEATURES", "Pooled", "WindowTable", "pool_windows", "pooled_features", "pooled_log_odds", "tabulate"]

POOLED_FEATURES = ("constant", "evidence", "over_deadband", "size", "band_to_swing", "spread", "over_closest")
"""Names of the pooled features, in the order of the model's coefficients."""
MAX_SPREAD = 1.5
"""Largest standard deviation of ln S between windows that counts [-]."""
DEADBAND_RANGE = (-1.0, 3.0)
"""Least and largest evidence of a slip jump that is believed of one window [-]."""
SIZE_RANGE = (0.3, 3.0)
"""Sizes S between which a larger one makes stiction more likely [% of span]: below, no stiction matters."""
LEAST_ERROR = 0.05
"""Least standard error of ln S of a window [-]."""
LEAST_RELEVANCE = 0.02
"""Least share of its weight that S of a window keeps [-]."""
NORMAL_RANGE = 3.919928
"""Width of a 95 % interval over the standard error of a normal quantity [-]."""


class WindowTable(NamedTuple):
    """What the model needs of windows in control, one value for each, shape (n_windows,)."""

    evidence: NDArray[np.float64]
    """Log odds of stiction beyond those of the prior [-]."""
    valve_cause: NDArray[np.float64]
    """Probability that the valve makes the loop oscillate [-]."""
    S: NDArray[np.float64]
    """S, lower and upper end of its interval [% of span], shape (n_windows, 3)."""
    J: NDArray[np.float64]
    """The same of J."""
    S_detectable: NDArray[np.float64]
    """Smallest S that would have shown [% of span]; infinite where none would."""
    over_deadband: NDArray[np.float64]
    """Evidence of a slip jump against deadband alone, asinh(LLR / 20) [-]."""
    band_to_swing: NDArray[np.float64]
    """S over the 98 % range of OP [-]."""
    over_closest: NDArray[np.float64]
    """Evidence of stiction against the closest other explanation, asinh(LLR / 20) [-]."""

    def part(self, first: int, last: int | None = None) -> WindowTable:
        """The windows `first` <= k < `last`."""
        return WindowTable(*(values[first:last] for values in self))  # pyright: ignore[reportArgumentType]


class Pooled(NamedTuple):
    """What all windows of one valve say together."""

    evidence: float
    """Log odds of stiction beyond those of the prior [-]."""
    S: PooledSize
    """S with its 95 % interval [% of span]."""
    J: PooledSize
    """J with its 95 % interval [% of span]."""
    S_detectable: float | None
    """Smallest S that the windows would have shown [% of span]; None where none would show."""

    def probability(self, prior: float) -> float:
        """Probability that the valve sticks [-]."""
        return logistic(log_odds(prior) + self.evidence)


def tabulate(windows: Sequence[Window]) -> WindowTable:
    """Table of the windows in control."""
    known = [one for one in windows if one.in_control]
    sizes = [[[one.S, one.S_low, one.S_high], [one.J, one.J_low, one.J_high]] for one in known]
    both = np.array(sizes, dtype=np.float64).reshape(-1, 2, 3)
    return WindowTable(
        np.array([one.evidence for one in known], dtype=np.float64),
        np.array([one.valve_cause for one in known], dtype=np.float64),
        both[:, 0], both[:, 1],
        np.array([np.inf if one.S_detectable is None else one.S_detectable for one in known], dtype=np.float64),
        np.array([one.over_deadband for one in known], dtype=np.float64),
        np.array([one.band_to_swing for one in known], dtype=np.float64),
        np.array([one.over_closest for one in known], dtype=np.float64),
    )  # fmt: skip


def pooled_features(table: WindowTable) -> NDArray[np.float64]:
    """Means over windows that the model takes, shape (n_features,) [-]; see `POOLED_FEATURES`.

    The spread of ln S between windows is small of a valve that sticks; deadband alone needs no slip jump, and an S near
    the swing of OP comes from a stem that hardly moved. Size, spread and slip jump weigh windows by their evidence.
    """
    values, _, relevance = _errors(table)
    share = relevance / relevance.sum()
    size = float(share @ values)
    spread = min(float(np.sqrt(share @ (values - size) ** 2)), MAX_SPREAD)
    over_deadband = float(share @ np.clip(table.over_deadband, *DEADBAND_RANGE))
    size = float(np.clip(size, *np.log(SIZE_RANGE)))
    return np.array([
        1.0, table.evidence.mean(), over_deadband, size, table.band_to_swing.mean(), spread, table.over_closest.mean(),
    ])  # fmt: skip


def effective_windows(n: int, correlation: float) -> float:
    """Number of independent windows that n correlated ones are worth [-].

    Examples
    --------
    >>> effective_windows(1, 0.3), round(effective_windows(1000, 0.25), 1)
    (1.0, 4.0)
    """
    return n / (1.0 + (n - 1) * correlation)


def pooled_log_odds(table: WindowTable, coefficients: NDArray[np.float64], correlation: float) -> float:
    """Evidence of all windows, log odds of stiction beyond those of the prior [-]."""
    further = effective_windows(table.evidence.size, correlation) - 1.0
    return float(table.evidence.mean() + further * (coefficients @ pooled_features(table)))


def pool_windows(table: WindowTable) -> Pooled:
    """Pool the windows of one valve.

    Parameters
    ----------
    table : WindowTable
        At least one window.

    Returns
    -------
    Pooled
        Evidence, S, J and `S_detectable` of all windows; those of one window alone as they are.
    """
    model = pooling_model()
    detectable = float(np.quantile(table.S_detectable, model["detectable_share"], method="higher"))
    shown = round(detectable, 3) if np.isfinite(detectable) else None
    if table.evidence.size == 1:
        return Pooled(float(table.evidence[0]), PooledSize(*table.S[0]), PooledSize(*table.J[0]), shown)
    evidence = pooled_log_odds(table, np.array(model["coefficients"]), model["correlation"])
    return Pooled(evidence, _pool_S(table), _pool_J(table), shown)


def _errors(table: WindowTable) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Log of S, its standard error, and the relevance of each window [-]."""
    S, low, high = np.maximum(table.S, 1e-3).T
    error = np.maximum(np.log(high / low) / NORMAL_RANGE, LEAST_ERROR)
    relevance = np.maximum(1.0 / (1.0 + np.exp(-np.clip(table.evidence, -30.0, 30.0))), LEAST_RELEVANCE)
    return np.log(S), error, relevance


def _pool_S(table: WindowTable) -> PooledSize:
    model, (values, errors, relevance) = pooling_model(), _errors(table)
    pooled = pool_estimates(
        values, errors, relevance, shared_error=model["shared_error"], scale=model["error_scale"]
    )  # fmt: skip
    return PooledSize(*(float(x) for x in np.exp(pooled)))


def _pool_J(table: WindowTable) -> PooledSize:
    """J as a share of S, which lies between 0 and 1."""
    model, (_, _, relevance) = pooling_model(), _errors(table)
    S = np.maximum(table.S[:, 0], 1e-3)
    share = np.clip(table.J / S[:, np.newaxis], 0.0, 1.0)
    errors = np.maximum((share[:, 2] - share[:, 1]) / NORMAL_RANGE, LEAST_ERROR)
    pooled = pool_estimates(
        share[:, 0], errors, relevance, shared_error=model["shared_share_error"], scale=model["error_scale"]
    )
    size = _pool_S(table).value
    return PooledSize(*(float(x) for x in np.clip(pooled, 0.0, 1.0) * size))


@cache
def pooling_model() -> dict[str, Any]:
    """Read the trained model."""
    return json.loads(files("stiction.diagnosis.evidence").joinpath("pooling.json").read_text("utf-8"))
