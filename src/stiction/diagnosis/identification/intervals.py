"""Intervals of S and J, and S of each part of the record.

No (S, J) valve is the true one, and what OP does between two samples is not recorded. The curvature of the likelihood
therefore says too little of the error. The intervals come from quantile regression on simulated loops: the quantiles of
ln(true S / estimated S), and of J / S, as linear functions of what makes S uncertain (`interval_features`).
"""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.candidates import Valve
    from stiction.diagnosis.identification.regression import Regression

__all__ = ["INTERVAL_FEATURES", "interval_features", "intervals", "segment_estimates", "trend"]

INTERVAL_FEATURES = ("op_step_to_S", "op_noise_to_S", "weak_evidence", "few_half_cycles", "not_exact", "jump_ratio")
"""Names of `interval_features`, in order."""


def interval_features(
    op: NDArray[np.float64], valve: Valve, likelihood_ratio: float, half_cycles: int, *, exact: bool
) -> NDArray[np.float64]:
    """What makes S and J uncertain, shape (6,) [-].

    ln(1 + median move of OP from sample to sample / S), ln(1 + standard deviation of OP's noise / S), a number that
    falls from 1 to 0 as the evidence grows, 1 / sqrt(half cycles), 1 where not exact, and J / S. Exact is a record in
    which a controller equation explains every move of OP, so that no OP between the samples is missing.
    """
    moves = np.abs(np.diff(op))
    third = np.diff(op, 3)
    noise = float(np.median(np.abs(third - np.median(third)))) / (0.6745 * np.sqrt(20.0)) if third.size else 0.0
    step = float(np.median(moves)) if moves.size else 0.0
    return np.array(
        [
            np.log1p(step / valve.S),
            np.log1p(noise / valve.S),
            1.0 / (1.0 + max(likelihood_ratio, 0.0) / 20.0),
            1.0 / np.sqrt(max(half_cycles, 1)),
            0.0 if exact else 1.0,
            valve.ratio,
        ]
    )


def intervals(
    valve: Valve, features: NDArray[np.float64], max_S: float
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """S and J, each with the lower and the upper end of its 95 % interval [% of span]; S is `max_S` at most."""
    model = _model()
    x = np.concatenate([[1.0], features])
    S = valve.S
    low, high = (float(x @ np.array(model["ln_S_error"][q])) for q in ("0.025", "0.975"))
    S_low, S_high = S * float(np.exp(min(low, 0.0))), S * float(np.exp(max(high, 0.0)))
    J_low, J_high = (float(np.clip(x @ np.array(model["J_ratio"][q]), 0.0, 1.0)) for q in ("0.025", "0.975"))
    ratio = valve.ratio
    limit = max(max_S, S)
    return ((S, S_low, min(S_high, limit)), (ratio * S, min(J_low, ratio) * S, max(J_high, ratio) * S))


@cache
def _model() -> dict[str, Any]:
    return json.loads(files("stiction.diagnosis.identification").joinpath("intervals.json").read_text("utf-8"))


def segment_estimates(
    regression: Regression, valve: Valve, count: int, *, reach: float = 0.4, steps: int = 17
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """S and evidence in `count` parts of the record, the rule and J / S being those of the whole record's `valve`.

    ln S is tried up to `reach` either way. Returns the most likely S of each part [% of span], twice its log likelihood
    ratio over a good valve [-], and the first predicted block of each part with the end of the last.
    """
    sizes = valve.S * np.exp(np.linspace(-reach, reach, steps))
    rows = np.column_stack([sizes, *(np.full(steps, x) for x in valve[1:])])
    good = regression.op.reshape(1, -1, regression.per_block).mean(axis=2)
    residuals = regression.residuals(np.concatenate([regression.positions(rows), good]))
    ends = np.linspace(0, regression.n_predicted, count + 1).round().astype(np.int64)
    total = np.concatenate([np.zeros((steps + 1, 1)), np.cumsum(residuals**2, axis=1)], axis=1)
    error = np.diff(total[:, ends], axis=1)
    best = error[:-1].argmin(axis=0)
    variance = total[:-1, -1].min() / regression.n_predicted
    ratio = (error[-1] - error[:-1].min(axis=0)) / variance
    return sizes[best], ratio, regression.first + ends


def trend(hours: NDArray[np.float64], S: NDArray[np.float64], min_points: int = 4) -> tuple[float, float]:
    """Slope of S over time and its standard error [% of span per h], by least squares; NaN of too few points.

    Examples
    --------
    >>> slope, error = trend(np.arange(5.0), 2.0 + 0.5 * np.arange(5.0))
    >>> slope, error < 1e-12
    (0.5, True)
    """
    if hours.size < min_points:
        return float("nan"), float("nan")
    away = hours - hours.mean()
    square = float(away @ away)
    slope = float(away @ S) / square
    rest = S - S.mean() - slope * away
    return slope, float(np.sqrt(rest @ rest / ((S.size - 2) * square)))
