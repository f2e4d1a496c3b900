"""Train the model of the verdict and the intervals of S and J on simulated loops: ``make calibrate``.

The model is gradient boosting with monotone constraints (scikit-learn), written as text to
`src/stiction/diagnosis/verdict/model.json`; the quantile regressions of the intervals go to
`src/stiction/diagnosis/identification/intervals.json`. Recorded loops are not used.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from stiction.diagnosis.identification.intervals import INTERVAL_FEATURES
from stiction.diagnosis.verdict.features import FEATURES

__all__ = ["fit_intervals", "fit_model", "stored_trees", "trainable"]

PRIOR = 0.25
"""Share of sticky valves for which the model is trained [-]."""
NAMES = [feature.name for feature in FEATURES]
VALIDATION_SETS = ("split_range", "wandering")
"""Sets of the first simulator that only validate."""
ROOT = Path(__file__).resolve().parents[1] / "src" / "stiction" / "diagnosis"


DEADBAND_WEIGHT = 0.2
"""Weight of a loop whose valve has deadband alone [-]: one loop in eight of the populations, far fewer in plants."""


def weights_of(table: pl.DataFrame, prior: float = PRIOR) -> np.ndarray:
    """Weights with which sticky loops make up the share `prior`, shape (n_loops,)."""
    sticky = table["sticky"].to_numpy()
    weights = np.where(table["cause"].to_numpy() == "deadband", DEADBAND_WEIGHT, 1.0)
    share = float(weights[sticky].sum() / weights.sum())
    if share in (0.0, 1.0):
        return weights
    return weights * np.where(sticky, prior / share, (1.0 - prior) / (1.0 - share))


def make_classifier(seed: int = 0, **settings: Any) -> Any:
    """The classifier, not yet fitted."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    return HistGradientBoostingClassifier(
        max_iter=220, learning_rate=0.05, max_leaf_nodes=7, min_samples_leaf=30, l2_regularization=2.0,
        monotonic_cst=[feature.sign for feature in FEATURES], early_stopping=False, random_state=seed, **settings,
    )  # fmt: skip


def fit_model(table: pl.DataFrame) -> dict[str, Any]:
    """Fit the model and give it as it is stored.

    Parameters
    ----------
    table : polars.DataFrame
        Rows of `calibration.feature_table`.

    Returns
    -------
    dict
        Intercept, training prior and trees as `stiction.diagnosis.verdict.model` reads them.
    """
    table = trainable(table.filter(~pl.col("set").is_in(VALIDATION_SETS)))
    X, sticky = features_of(table), table["sticky"].to_numpy()
    model = make_classifier().fit(X, sticky, sample_weight=weights_of(table))
    return stored_trees(model, X, weights_of(table))


def trainable(table: pl.DataFrame, min_turns: int = 6) -> pl.DataFrame:
    """Loops in control, without sticky ones whose stem hardly turns: their stiction cannot show."""
    turns = pl.col("stem_turns").fill_null(min_turns) if "stem_turns" in table.columns else pl.lit(min_turns)
    return table.filter((pl.col("state") == "in_control") & (~pl.col("sticky") | (turns >= min_turns)))


def features_of(table: pl.DataFrame) -> np.ndarray:
    """Features of a table, NaN where one is missing, shape (n_loops, n_features)."""
    columns = [
        table[f"x_{name}"] if f"x_{name}" in table.columns else pl.Series([None] * table.height) for name in NAMES
    ]
    values = [column.cast(pl.Float64).fill_null(np.nan).to_numpy() for column in columns]
    # The library cannot bin a column without a value.
    return np.column_stack([np.zeros(table.height) if np.isnan(x).all() else x for x in values])


def stored_trees(model: Any, X: np.ndarray, weights: np.ndarray) -> dict[str, Any]:
    """The fitted model as it is stored: each node with the average of the training loops that reach it.

    The averages are centred, so that the contributions of the features add up from the intercept, which is the average
    of all loops.
    """
    intercept = float(model._baseline_prediction.ravel()[0])
    trees = []
    for (predictor,) in model._predictors:
        nodes = predictor.nodes
        reached = np.zeros((len(X), len(nodes)), dtype=bool)
        reached[:, 0] = True
        for k, node in enumerate(nodes):
            if node["is_leaf"]:
                continue
            x = X[:, node["feature_idx"]]
            left = np.where(np.isnan(x), bool(node["missing_go_to_left"]), x <= node["num_threshold"])
            reached[:, node["left"]] = reached[:, k] & left
            reached[:, node["right"]] = reached[:, k] & ~left
        leaves = np.array([node["value"] if node["is_leaf"] else 0.0 for node in nodes])
        own = reached @ leaves
        mean = [float(np.average(own[at], weights=weights[at])) if at.any() else float(v)
                for at, v in zip(reached.T, leaves, strict=True)]  # fmt: skip
        intercept += mean[0]
        stored: list[list[Any]] = []
        for node, value in zip(nodes, mean, strict=True):
            row: list[Any] = [round(float(node["value"]) if node["is_leaf"] else value, 6)]
            if not node["is_leaf"]:
                threshold = float(np.clip(node["num_threshold"], -1e9, 1e9))
                row += [int(node["feature_idx"]), round(threshold, 6), bool(node["missing_go_to_left"]),
                        int(node["left"]), int(node["right"])]  # fmt: skip
            stored.append(row)
        trees.append(stored)
    return {"intercept": round(intercept, 6), "training_prior": PRIOR, "features": NAMES, "trees": trees}


def fit_intervals(table: pl.DataFrame, min_probability: float = 0.5) -> dict[str, Any]:
    """Quantile regressions of ln(true S / S found) and of true J / S, over sticky loops that are recognised."""
    from sklearn.linear_model import QuantileRegressor

    known = table.filter(
        pl.col("sticky") & (pl.col("state") == "in_control") & pl.col("S").is_not_null()
        & (pl.col("probability") > min_probability) & (pl.col("true_S") > 0.0)
    )  # fmt: skip
    X = np.column_stack([known[f"i_{name}"].to_numpy() for name in INTERVAL_FEATURES])
    error = np.log(known["true_S"].to_numpy() / known["S"].to_numpy())
    ratio = known["true_J"].to_numpy() / known["true_S"].to_numpy()

    def fit(y: np.ndarray, q: float) -> list[float]:
        one = QuantileRegressor(quantile=q, alpha=1e-3, solver="highs").fit(X, y)
        return [round(float(c), 5) for c in (one.intercept_, *one.coef_)]

    return {
        "ln_S_error": {str(q): fit(error, q) for q in (0.025, 0.975)},
        "J_ratio": {str(q): fit(ratio, q) for q in (0.025, 0.975)},
    }


def main() -> None:
    """Train from a table and write both files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path, help="table written by calibration.feature_table")
    given = parser.parse_args()
    table = pl.read_parquet(given.table)
    model = fit_model(table)
    counts = dict(table.group_by("set").len().sort("set").iter_rows())
    model["provenance"] = {"loops": table.height, "sets": counts, "sticky": round(float(table["sticky"].mean()), 4)}
    text = json.dumps(model).replace("]], [[", "]],\n [[")
    (ROOT / "verdict" / "model.json").write_text(text + "\n", encoding="utf-8")
    intervals = fit_intervals(table)
    (ROOT / "identification" / "intervals.json").write_text(json.dumps(intervals, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
