"""From features to the probability of stiction: one additive model, read from `model.json`.

The model is a sum of step functions, one for each feature, each monotone in the direction of the feature's sign. It is
trained by `calibration/train.py` on simulated loops alone (gradient boosting without interactions, scikit-learn). Its
file is text, thresholds and values that anyone can read. The sum is the log odds of stiction at the training prior.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["Contribution", "StictionModel", "stiction_model"]


@dataclass(frozen=True, slots=True)
class Contribution:
    """What one feature adds to the log odds of stiction."""

    feature: str
    """Its name."""
    value: float
    """Its value; NaN when it could not be computed."""
    log_odds: float
    """What it adds to the log odds, against its average over the training loops [-]."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        value = float(self.value) if math.isfinite(self.value) else None
        return {"feature": self.feature, "value": value, "log_odds": self.log_odds}


@dataclass(frozen=True)
class StictionModel:
    """An additive model of step functions."""

    intercept: float
    """Log odds of stiction of average features, at `training_prior` [-]."""
    training_prior: float
    """Share of sticky valves in training, by the weights of the loops [-]."""
    steps: dict[str, tuple[tuple[float, ...], tuple[float, ...], float]]
    """Feature -> thresholds, values (one more than thresholds: up to the first threshold, between, above the last), and
    the value for a missing feature [log odds]."""
    provenance: dict[str, Any]
    """What it was trained on."""

    def contributions(self, features: Mapping[str, float]) -> tuple[Contribution, ...]:
        """What each feature adds to the log odds, the strongest first."""
        found = []
        for name, (thresholds, values, missing) in self.steps.items():
            x = features.get(name, math.nan)
            part = missing if math.isnan(x) else values[int(np.searchsorted(thresholds, x, side="left"))]
            found.append(Contribution(name, x, part))
        return tuple(sorted(found, key=lambda one: -abs(one.log_odds)))

    def probability(self, features: Mapping[str, float], prior: float = 0.25) -> float:
        """Probability that the valve sticks.

        Parameters
        ----------
        features : mapping
            Feature -> value; NaN or absent is missing.
        prior : float
            Share of sticky valves where the record comes from [-].

        Returns
        -------
        float
            Probability [-].

        Raises
        ------
        ParameterError
            When the prior is not between 0 and 1.
        """
        if not 0.0 < prior < 1.0:
            raise ParameterError(
                f"prior = {prior:g} is no share of sticky valves; give a number between 0 and 1, as 0.25."
            )
        score = self.intercept + sum(one.log_odds for one in self.contributions(features))
        score += log_odds(prior) - log_odds(self.training_prior)
        return 1.0 / (1.0 + math.exp(-score)) if score > -700.0 else 0.0


def log_odds(probability: float) -> float:
    """Log odds of a probability [-].

    Examples
    --------
    >>> log_odds(0.5), round(log_odds(0.8), 3)
    (0.0, 1.386)
    """
    return math.log(probability / (1.0 - probability))


@cache
def stiction_model() -> StictionModel:
    """Read the trained model."""
    stored = json.loads(files("stiction.diagnosis.verdict").joinpath("model.json").read_text("utf-8"))
    steps = {
        name: (tuple(one["thresholds"]), tuple(one["values"]), float(one["missing"]))
        for name, one in stored["features"].items()
    }
    return StictionModel(stored["intercept"], stored["training_prior"], steps, stored["provenance"])
