"""The new kind of model on few features with fixed signs, and predictions that never saw their own loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from numpy.typing import NDArray

__all__ = ["CANDIDATES", "FEATURES", "RIVALS", "Feature", "Rows", "cross_predict", "feature_matrix", "fit_model"]

LIKELIHOOD_SCALE = 20.0
"""Twice the log likelihood at which a likelihood ratio begins to count by its logarithm [-]."""
RIVALS = ("bent", "gated", "relaxation", "wave")
"""Good valves beside what looks like stiction."""
FOLDS, REPEATS = 5, 3
"""Parts of a cross-fit, and how often it is repeated with other parts [-]."""


class Rows:
    """Rows of a table as columns of numbers; what is missing is NaN."""

    def __init__(self, rows: list[Mapping[str, str]]) -> None:
        self.rows = rows

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return np.array([float(row.get(name) or "nan") for row in self.rows])

    def text(self, name: str) -> NDArray[np.str_]:
        """A column of text."""
        return np.array([row.get(name) or "" for row in self.rows])


class Feature(NamedTuple):
    """A number that the model may use."""

    sign: int
    """1 where a larger number speaks for stiction, -1 against, 0 where either may be."""
    of: Callable[[Rows, frozenset[str]], NDArray[np.float64]]
    """The number of each row, without the rivals named."""


def _likelihood(name: str) -> Feature:
    """Twice a log likelihood ratio, by its logarithm where it is large."""
    return Feature(1, lambda rows, dropped: np.arcsinh(rows[name] / LIKELIHOOD_SCALE))


def _ratio(sign: int, above: str, below: str, most: float) -> Feature:
    """A ratio of two columns, clipped."""
    return Feature(sign, lambda rows, dropped: np.clip(rows[above] / np.maximum(rows[below], 1e-9), 0.0, most))


def _gain(better: str, worse: str) -> Feature:
    """Share of the PV that one explains beyond another."""
    return Feature(1, lambda rows, dropped: np.clip((rows[better] - rows[worse]) / 100.0, -1.0, 1.0))


def _column(sign: int, name: str) -> Feature:
    """A column as it is."""
    return Feature(sign, lambda rows, dropped: rows[name])


def _over_rivals(rows: Rows, dropped: frozenset[str]) -> NDArray[np.float64]:
    """The likelihood over the rival that comes nearest."""
    left = [f"likelier_{name}" for name in ("good", *RIVALS) if name not in dropped]
    return np.arcsinh(np.fmin.reduce([rows[name] for name in left]) / LIKELIHOOD_SCALE)


def _width(rows: Rows, dropped: frozenset[str]) -> NDArray[np.float64]:
    """Width of the interval of S over S, by its logarithm."""
    return np.log(np.maximum(rows["S_high"] - rows["S_low"], 1e-9) / np.maximum(rows["S"], 1e-9))


FEATURES: dict[str, Feature] = {
    "likelihood over a good valve": _likelihood("likelier_good"),
    "likelihood over the best rival": Feature(1, _over_rivals),
    "likelihood beside a wave": _likelihood("likelier_beside_wave"),
    "likelihood over play": _likelihood("likelier_than_play"),
    "likelihood in the best third": _likelihood("likelier_in_part"),
    "likelihood in a part": _likelihood("part_likelier_any"),
    "S over OP swing": _ratio(1, "S", "swing", 1.5),
    "width of S interval": Feature(-1, _width),
    "J over S": _ratio(1, "J", "S", 1.0),
    "gain of fit": _gain("fit", "fit_linear"),
    "fit": Feature(1, lambda rows, dropped: np.clip(rows["fit"] / 100.0, 0.0, 1.0)),
    "gain of fit, dense search": _gain("rough_fit", "rough_fit_linear"),
    "S over OP swing, dense search": _ratio(1, "rough_S", "swing", 1.5),
    "share of sticky windows": _column(1, "sticky_windows"),
    "OP at a limit": _column(-1, "at_limit"),
}
"""The features of the base model."""

CANDIDATES: dict[str, Feature] = {
    "own samples": _column(0, "own_samples"),
    "regularity of the oscillation": _column(0, "regularity"),
    "share of the oscillation": _column(0, "oscillation_share"),
    "samples of a period": _column(0, "samples_per_period"),
    "periods": _column(0, "periods"),
    "OP noise": _column(0, "op_noise"),
    "PV noise": _column(0, "pv_noise"),
    "Vuong's statistic over a good valve": _column(1, "beats_good"),
    "lower end of S over OP swing": _ratio(1, "S_low", "swing", 1.5),
    "lower end of J over S": _ratio(1, "J_low", "S", 1.5),
    "spread of S over the stretches": _column(-1, "S_spread"),
    "period near the limit of stability": _column(-1, "row_own_limit"),
    "period of the identified loop": _column(1, "row_own_period"),
    "amplitude of the identified loop": _column(1, "row_own_amplitude"),
    "gain margin with a good valve": _column(-1, "row_margin"),
    "spikes": _column(-1, "row_spikes"),
    "PV resolution": _column(0, "row_coarse"),
    "PV at rest while OP moves": _column(0, "row_still"),
    "share moved by the set point": _column(0, "row_set_point"),
    "change of amplitude": _column(0, "row_wander"),
    "decay": _column(0, "row_decay"),
    "He curve fit": _column(1, "row_shape_op"),
    "Haegglund shape": _column(1, "row_shape_pv"),
    "votes of the shape methods": _column(1, "row_votes"),
    "likelihood in the best stretch": _likelihood("stretch_likelier"),
    "controller found": _column(0, "controller_explains"),
}
"""Numbers that could be added."""


def feature_matrix(
    rows: Rows, features: Mapping[str, Feature], dropped_rivals: Iterable[str] = ()
) -> NDArray[np.float64]:
    """Compute the features of all rows.

    Parameters
    ----------
    rows : Rows
        The rows.
    features : mapping
        Names and features.
    dropped_rivals : iterable of str
        Rivals that are not looked at.

    Returns
    -------
    ndarray, shape (n_rows, n_features)
        The features; NaN where one cannot be computed.
    """
    dropped = frozenset(dropped_rivals)
    columns = [feature.of(rows, dropped) for feature in features.values()]
    return np.where(np.isfinite(np.column_stack(columns)), np.column_stack(columns), np.nan)


def fit_model(
    X: NDArray[np.float64], sticky: NDArray[np.bool_], signs: list[int]
) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Fit a monotone gradient boosting.

    Parameters
    ----------
    X : ndarray, shape (n_rows, n_features)
        Features; one that has fewer than two values is left out.
    sticky : ndarray of bool, shape (n_rows,)
        Truth.
    signs : list of int
        Sign of each feature.

    Returns
    -------
    callable
        From features to the probability of stiction.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier

    used = [i for i in range(X.shape[1]) if np.unique(X[np.isfinite(X[:, i]), i]).size > 1]
    model = HistGradientBoostingClassifier(
        learning_rate=0.06, max_iter=120, max_leaf_nodes=8, min_samples_leaf=30, l2_regularization=5.0,
        monotonic_cst=[signs[i] for i in used], early_stopping=False, random_state=0,
    )  # fmt: skip
    model.fit(X[:, used], sticky)
    return lambda other: model.predict_proba(other[:, used])[:, 1]


def cross_predict(X: NDArray[np.float64], sticky: NDArray[np.bool_], signs: list[int]) -> NDArray[np.float64]:
    """Probability of stiction of each row by models that were fitted without it, mean of `REPEATS` partitions.

    Parameters
    ----------
    X : ndarray, shape (n_rows, n_features)
        Features, one row a loop.
    sticky : ndarray of bool, shape (n_rows,)
        Truth.
    signs : list of int
        Sign of each feature.

    Returns
    -------
    ndarray, shape (n_rows,)
        Probabilities.
    """
    from sklearn.model_selection import StratifiedKFold

    total = np.zeros(len(X))
    for repeat in range(REPEATS):
        for train, test in StratifiedKFold(FOLDS, shuffle=True, random_state=repeat).split(X, sticky):
            total[test] += fit_model(X[train], sticky[train], signs)(X[test])
    return total / REPEATS
