"""Train the model of the verdict and the intervals of S and J on simulated loops: ``make calibrate``.

The model is gradient boosting with monotone constraints and without interactions (scikit-learn), so that it is a sum of
step functions of one feature each. It is written as text to `src/stiction/diagnosis/verdict/model.json`; the quantile
regressions of the intervals go to `src/stiction/diagnosis/identification/intervals.json`. Recorded loops are not used.
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

__all__ = ["fit_intervals", "fit_model", "step_functions"]

PRIOR = 0.25
"""Share of sticky valves for which the model is trained [-]."""
NAMES = [feature.name for feature in FEATURES]
ROOT = Path(__file__).resolve().parents[1] / "src" / "stiction" / "diagnosis"


def weights_of(sticky: np.ndarray, prior: float = PRIOR) -> np.ndarray:
    """Weights with which sticky loops make up the share `prior`, shape (n_loops,)."""
    share = float(sticky.mean())
    return np.where(sticky, prior / share, (1.0 - prior) / (1.0 - share))


def make_classifier(seed: int = 0, **settings: Any) -> Any:
    """The classifier, not yet fitted."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    return HistGradientBoostingClassifier(
        max_iter=300, learning_rate=0.05, max_leaf_nodes=4, min_samples_leaf=40, l2_regularization=2.0, max_bins=64,
        monotonic_cst=[feature.sign for feature in FEATURES], interaction_cst="no_interactions", random_state=seed,
        **settings,
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
        Intercept, training prior and step functions of `stiction.diagnosis.verdict.model`.
    """
    table = table.filter(pl.col("state") == "in_control")
    X = features_of(table)
    sticky = table["sticky"].to_numpy()
    model = make_classifier().fit(X, sticky, sample_weight=weights_of(sticky))
    return step_functions(model, X, weights_of(sticky))


def features_of(table: pl.DataFrame) -> np.ndarray:
    """Features of a table, NaN where one is missing, shape (n_loops, n_features)."""
    columns = [
        table[f"x_{name}"] if f"x_{name}" in table.columns else pl.Series([None] * table.height) for name in NAMES
    ]
    values = [column.cast(pl.Float64).fill_null(np.nan).to_numpy() for column in columns]
    # The library cannot bin a column without a value.
    return np.column_stack([np.zeros(table.height) if np.isnan(x).all() else x for x in values])


def step_functions(model: Any, X: np.ndarray, weights: np.ndarray) -> dict[str, Any]:
    """Add the trees of each feature up to one step function, centred on its average over the training loops."""
    trees: dict[int, list[np.ndarray]] = {}
    for (tree,) in model._predictors:
        used = {int(node["feature_idx"]) for node in tree.nodes if not node["is_leaf"]}
        if used:
            trees.setdefault(used.pop(), []).append(tree.nodes)
    intercept = float(model._baseline_prediction.ravel()[0])
    steps: dict[str, Any] = {}
    for i, name in enumerate(NAMES):
        nodes = trees.get(i, [])
        thresholds = sorted({float(n["num_threshold"]) for one in nodes for n in one if not n["is_leaf"]})
        thresholds = [one for one in thresholds if np.isfinite(one)]
        places = [-np.inf, *thresholds]
        middle = [*(0.5 * (a + b) if np.isfinite(a) else b - 1.0 for a, b in zip(places, thresholds, strict=False))]
        middle.append(thresholds[-1] + 1.0 if thresholds else 0.0)
        values = [sum(_leaf(one, x) for one in nodes) for x in middle]
        missing = sum(_leaf(one, np.nan) for one in nodes)
        own = np.where(np.isnan(X[:, i]), missing, np.array(values)[np.searchsorted(thresholds, X[:, i], side="left")])
        centre = float(np.average(own, weights=weights))
        intercept += centre
        if nodes:
            steps[name] = {
                "thresholds": [round(one, 6) for one in thresholds],
                "values": [round(float(one) - centre, 6) for one in values],
                "missing": round(float(missing) - centre, 6),
            }
        else:
            steps[name] = {"thresholds": [], "values": [0.0], "missing": 0.0}
    return {"intercept": round(intercept, 6), "training_prior": PRIOR, "features": steps}


def _leaf(nodes: np.ndarray, x: float) -> float:
    """Value of a tree of one feature."""
    i = 0
    while not nodes[i]["is_leaf"]:
        node = nodes[i]
        left = bool(node["missing_go_to_left"]) if np.isnan(x) else x <= node["num_threshold"]
        i = int(node["left"] if left else node["right"])
    return float(nodes[i]["value"])


def fit_intervals(table: pl.DataFrame, min_probability: float = 0.5) -> dict[str, Any]:
    """Quantile regressions of ln(true S / S found) and of true J / S, over sticky loops that are recognised."""
    from sklearn.linear_model import QuantileRegressor

    known = table.filter(
        pl.col("sticky") & (pl.col("state") == "in_control") & pl.col("S_raw").is_not_null()
        & (pl.col("probability") > min_probability) & (pl.col("true_S") > 0.0)
    )  # fmt: skip
    X = np.column_stack([known[f"i_{name}"].to_numpy() for name in INTERVAL_FEATURES])
    error = np.log(known["true_S"].to_numpy() / known["S_raw"].to_numpy())
    ratio = known["true_J"].to_numpy() / known["true_S"].to_numpy()

    def fit(y: np.ndarray, q: float) -> list[float]:
        one = QuantileRegressor(quantile=q, alpha=1e-3, solver="highs").fit(X, y)
        return [round(float(c), 5) for c in (one.intercept_, *one.coef_)]

    return {
        "ln_S_error": {str(q): fit(error, q) for q in (0.025, 0.5, 0.975)},
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
    (ROOT / "verdict" / "model.json").write_text(json.dumps(model, indent=1) + "\n", encoding="utf-8")
    intervals = fit_intervals(table)
    (ROOT / "identification" / "intervals.json").write_text(json.dumps(intervals, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
