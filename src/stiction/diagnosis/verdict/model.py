"""From features to the probability of stiction: one trained model, read from `model.json`.

The model is gradient boosting (Friedman 2001): a sum of small decision trees whose values are log odds of stiction.
It is monotone in each feature, in the direction of the feature's sign. `calibration/train.py` trains it on simulated
loops alone (scikit-learn); its file is text.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib.resources import files
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.diagnosis.verdict.features import FEATURES
from stiction.display.json_form import FOUR_DECIMALS, Result
from stiction.errors import require_probability
from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

__all__ = ["Contribution", "TreeModel", "TreeNode", "logistic", "read_model", "read_stored", "stiction_model"]


class TreeNode(NamedTuple):
    """One node of a decision tree."""

    value: float
    """Average log odds of the training loops in the node; at a leaf what the tree gives."""
    feature: str = ""
    """Feature that is compared; empty at a leaf."""
    threshold: float = 0.0
    """Values up to it go left [unit of the feature]."""
    missing_left: bool = False
    """Whether a missing value goes left."""
    left: int = 0
    """Index of the left child."""
    right: int = 0
    """Index of the right child."""


@dataclass(frozen=True, slots=True)
class Contribution(Result):
    """What one feature adds to the log odds of stiction."""

    feature: str
    """Its name."""
    value: float
    """Its value; NaN when it could not be computed."""
    log_odds: float = field(metadata=FOUR_DECIMALS)
    """What it adds to the log odds [-]: the changes of the average along the paths of all trees (Saabas 2014). The
    contributions and the intercept add up to the log odds of the verdict at the training prior."""

    @property
    def label(self) -> str:
        """Name of the feature on screens."""
        return {feature.name: feature.label for feature in FEATURES}.get(self.feature, self.feature.replace("_", " "))


@kernel
def add_parts(roots, values, children, known, parts):
    """Add to `parts` (n_features,) the changes of the value along the paths of `known` features through all trees.

    The nodes are those of `TreeModel`; a NaN in `known` (n_features,) is missing.
    """
    for root in roots:
        node = root
        while children[node, 0] >= 0:
            feature = children[node, 0]
            x = known[feature]
            if x == x:
                below = children[node, 2] if x <= values[node, 1] else children[node, 3]
            else:
                below = children[node, 1]
            parts[feature] += values[below, 0] - values[node, 0]
            node = below


@dataclass(frozen=True)
class TreeModel:
    """A sum of decision trees."""

    intercept: float
    """Log odds over all training loops, at `training_prior` [-]."""
    training_prior: float
    """Share of positive loops in training, by the weights of the loops [-]."""
    features: tuple[str, ...]
    """Names of the features."""
    trees: tuple[tuple[TreeNode, ...], ...]
    """The trees; node 0 is the root."""
    provenance: dict[str, Any]
    """What the model was trained on."""

    def contributions(self, features: Mapping[str, float]) -> tuple[Contribution, ...]:
        """What each feature adds to the log odds, the strongest first.

        Parameters
        ----------
        features : mapping
            Feature -> value; NaN or absent is missing.

        Returns
        -------
        tuple of Contribution
            One for each feature.
        """
        found = [Contribution(name, features.get(name, math.nan), part) for name, part in self._parts(features)]
        return tuple(sorted(found, key=lambda one: -abs(one.log_odds)))

    def _parts(self, features: Mapping[str, float]) -> Iterable[tuple[str, float]]:
        """What each feature adds to the log odds [-], in the order of the features."""
        known = np.array([features.get(name, math.nan) for name in self.features], dtype=np.float64)
        parts = np.zeros(len(self.features))
        add_parts(*self._nodes, known, parts)
        return zip(self.features, parts.tolist(), strict=True)

    @cached_property
    def _nodes(self) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
        """First node of each tree; value and threshold of each node; its feature, child of missing, left and right.

        The feature of a leaf is -1.
        """
        places = {name: k for k, name in enumerate(self.features)}
        starts = np.cumsum([0, *map(len, self.trees)])
        nodes = [(node, start) for start, tree in zip(starts.tolist(), self.trees, strict=False) for node in tree]
        children = [
            (places.get(node.feature, -1), start + (node.left if node.missing_left else node.right),
             start + node.left, start + node.right)
            for node, start in nodes
        ]  # fmt: skip
        values = np.array([(node.value, node.threshold) for node, _ in nodes], dtype=np.float64)
        return starts[:-1], values, np.array(children, dtype=np.int64)

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
        require_probability("prior", prior)
        return self._from_parts([part for _, part in self._parts(features)], prior)

    def sum_up(self, contributions: Iterable[Contribution], prior: float) -> float:
        """Probability [-] of what the features add to the log odds."""
        return self._from_parts([one.log_odds for one in contributions], prior)

    def _from_parts(self, parts: list[float], prior: float) -> float:
        """Probability [-] of parts that add up to the log odds; the largest first, so that their order is the same."""
        score = self.intercept + sum(sorted(parts, key=lambda part: -abs(part)))
        return logistic(score + (log_odds(prior) - log_odds(self.training_prior)))


def logistic(x: float) -> float:
    """Probability of log odds `x` [-]; limited to 1e-26 from 0 and 1.

    Examples
    --------
    >>> logistic(0.0), round(logistic(1.386), 3)
    (0.5, 0.8)
    """
    return 1.0 / (1.0 + math.exp(-min(max(x, -60.0), 60.0)))


def log_odds(probability: float) -> float:
    """Log odds of a probability [-].

    Examples
    --------
    >>> log_odds(0.5), round(log_odds(0.8), 3)
    (0.0, 1.386)
    """
    return math.log(probability / (1.0 - probability))


def read_model(stored: Mapping[str, Any]) -> TreeModel:
    """Make a model of its stored form."""
    names = tuple(stored["features"])
    trees = tuple(
        tuple(TreeNode(node[0]) if len(node) == 1 else TreeNode(node[0], names[node[1]], *node[2:]) for node in tree)
        for tree in stored["trees"]
    )
    return TreeModel(stored["intercept"], stored["training_prior"], names, trees, stored.get("provenance", {}))


def read_stored(name: str) -> dict[str, Any]:
    """Read a file of this room."""
    return json.loads(files("stiction.diagnosis.verdict").joinpath(name).read_text("utf-8"))


@cache
def stiction_model() -> TreeModel:
    """Read the trained model of the verdict."""
    return read_model(read_stored("model.json"))
