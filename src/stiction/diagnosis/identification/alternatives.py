"""Other explanations of what a sticky valve seems to do: a good valve with something else that predicts the PV.

Each is compared with the most likely sticky valve by twice the log likelihood ratio of the same regression. A sticky
valve that is only as good as one of them is no evidence of stiction.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.dead_zone import search_dead_zone
from stiction.diagnosis.identification.periodic_load import fundamental_period, remove_harmonics
from stiction.diagnosis.identification.regression import PV_LAGS, build_regression, orthonormal_rows, standardise
from stiction.diagnosis.identification.stems import relay_signals

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.regression import Regression

__all__ = ["ALTERNATIVES", "alternative_costs", "good_valve_cost", "process_gains"]

ALTERNATIVES = ("good", "dead_zone", "relay_load", "periodic_load")
"""Explanations without stiction; `periodic_load` only where the loop oscillates."""


def good_valve_cost(regression: Regression) -> float:
    """Cost of a valve that follows OP, with what the lags of OP beside a sticky valve are worth by chance [-]."""
    return float(regression.cost_of_positions(_op_means(regression))[0]) - regression.op_lags


def alternative_costs(
    regression: Regression, period: float | None, sticky: NDArray[np.float64], gaps: NDArray[np.bool_] | None = None
) -> tuple[dict[str, float], float, tuple[float, float]]:
    """Compare the explanations without stiction.

    `period` is that of the oscillation [blocks], `sticky` the position of the most likely sticky valve [% of span].
    Returns for each name in `ALTERNATIVES` minus twice its log likelihood [-]; twice the log likelihood ratio of the
    sticky valve over a good one with the same periodic load added to both [-], NaN where there is no period; and the
    ends of the most likely dead zone [% of span].
    """
    free = regression.op_lags
    costs = {"good": good_valve_cost(regression)}
    dead_zone, *ends = search_dead_zone(regression)
    costs["dead_zone"] = dead_zone - free
    costs["relay_load"] = _best_relay(regression) - free
    periodic, both = _periodic_load(regression, period, sticky, gaps)
    if np.isfinite(periodic):
        costs["periodic_load"] = periodic - free
    return costs, both - free, (ends[0], ends[1])


def _op_means(regression: Regression) -> NDArray[np.float64]:
    """OP as the position of a good valve, shape (1, n_blocks)."""
    return regression.op.reshape(1, -1, regression.per_block).mean(axis=2)


def process_gains(regression: Regression, stem: NDArray[np.float64]) -> dict[str, float]:
    """Gain from a valve position [% of span] to the PV over its standard error [-]: alone, and beside a good valve.

    A valve position that only seems to explain the PV has no gain, or one of the wrong sign; beside OP, through which
    a good valve acts, a sticky valve keeps its gain.
    """
    alone, beside_op = _with_shared(regression, []), _with_good_valve(regression)
    return {"stem": alone.gain_over_error(stem), "stem_beside_op": beside_op.gain_over_error(stem)}


def _with_good_valve(regression: Regression) -> Regression:
    """The regression with the lags of a good valve's position among the shared regressors, in place of those of OP."""
    return _with_shared(regression, regression._lag_sums(standardise(_op_means(regression)[0])[np.newaxis])[0])


def _with_shared(regression: Regression, rows: Iterable[NDArray[np.float64]]) -> Regression:
    """The regression with given regressors beside the earlier PVs, for `cost_of_regressors` and `gain_over_error`."""
    n, first = regression.pv.size, regression.first
    shared = [np.ones(n - first), *(regression.pv[first - lag : n - lag] for lag in range(1, min(PV_LAGS, n // 8) + 1))]
    basis, _ = orthonormal_rows(np.array([*regression.choose(np.array(shared)), *rows]))
    y = regression.choose(regression.pv[first:])
    return replace(regression, basis=basis, target=y - (y @ basis.T) @ basis)


def _lagged(regression: Regression, signals: NDArray[np.float64]) -> NDArray[np.float64]:
    """A few lags of each signal as regressors, as many as OP has beside a sticky valve."""
    n, first = regression.pv.size, regression.first
    x = signals - signals.mean(axis=1, keepdims=True)
    lagged = np.stack([x[:, first - lag : n - lag] for lag in range(1, regression.op_lags + 1)], axis=1)
    return regression.choose(lagged)


def _best_relay(regression: Regression) -> float:
    """Cost of a load that switches where the PV comes to a level, as a pump or a neighbouring sticky loop does."""
    pv, shifted = regression.pv, _with_good_valve(regression)
    low, high = np.quantile(pv, (0.01, 0.99))
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    levels = half * np.array([-0.4, -0.1, 0.2, 0.5, 0.7, 0.85, 0.95])
    lows, highs = (axis.ravel() for axis in np.meshgrid(middle - levels, middle + levels))
    best = np.inf
    for step in (0.1, 0.04, 0.016, 0.0):
        ordered = lows <= highs
        lows, highs = lows[ordered], highs[ordered]
        out = np.empty((lows.size, pv.size))
        relay_signals(pv, lows, highs, out)
        cost = shifted.cost_of_regressors(_lagged(regression, out))
        i = int(np.argmin(np.round(cost, 5)))
        best = min(best, float(cost[i]))
        around = step * half * np.array([-1.0, 0.0, 1.0])
        lows, highs = (axis.ravel() for axis in np.meshgrid(lows[i] + around, highs[i] + around))
    return best


def _periodic_load(
    regression: Regression,
    period: float | None,
    sticky: NDArray[np.float64],
    gaps: NDArray[np.bool_] | None,
    *,
    min_periods: float = 5.0,
) -> tuple[float, float]:
    """Cost of a good valve beside a load that is the same in every period, and the gain of a sticky valve beside it."""
    n = regression.pv.size
    harmonics = 0 if period is None else min(24, int(period / 3.0))
    if period is None or harmonics < 1 or n < min_periods * period:
        return np.nan, np.nan
    exact = fundamental_period(regression.pv, period, harmonics)
    signals = np.stack([regression.pv, _op_means(regression)[0], sticky])
    pv, op, stem = remove_harmonics(signals, exact, harmonics)
    scale = float(pv.std())
    rest = build_regression(op, pv, 1, period, gaps=gaps)
    cost = rest.cost_of_positions(np.stack([op, stem])) + 2.0 * rest.n_predicted * np.log(max(scale, 1e-12))
    return float(cost[0]) + 2.0 * harmonics, float(cost[0] - cost[1])
