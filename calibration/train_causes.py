"""Train the models of the causes and of an unseen valve on simulated loops: ``make calibrate``.

One boosted model for each cause, with the signs of its features, written to
`src/stiction/diagnosis/verdict/causes.json`. A cause that the record cannot show, such as a load beside a stuck
valve, does not count as one.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from calibration.train import ROOT, stored_trees
from stiction.diagnosis.verdict.cause_features import CAUSE_FEATURES
from stiction.diagnosis.verdict.causes import CAUSES, smallest_shown
from stiction.diagnosis.verdict.decision import DEFAULT_SMALLEST_S, decide
from stiction.diagnosis.verdict.model import logistic, read_model

__all__ = ["HIDDEN_KINDS", "cause_labels", "cause_probabilities", "fit_causes"]

HIDDEN_KINDS = ("stuck", "unmoved", "play unmoved")
"""Kinds in which the stem does not move."""
UNKNOWABLE = {
    "external": ("dead zone",),
    "tuning": ("rate limit",),
    "unseen": ("position as OP", "pulsed"),
    "stuck": ("unmoved", "play unmoved", "position as OP"),
    "position": ("pulsed", "pulses logged"),
}
"""Cause -> kinds that do not count for it: it is there in part, or another name for what is."""
MISSED_WEIGHT = 0.3
"""Weight of a valve that sticks or has play and looks good in the model of the unseen valve [-]."""
MISSED = {"unseen": 0.01, "position": 0.1}
"""Share that may be called good, of loops that are not trained on: of valves whose stem does not move, and of sticky
ones whose position is recorded as OP [-]."""
OTHERS = ("unseen", "stuck", "position")
"""Models besides those of the causes."""
NAMES = {"stuck": "stuck", "position": "position as OP"}
"""Model -> the kind that it finds."""
WRONG_COST = 2.5
"""Cost of wrong advice over that of asking; a cause is named from the probability at which both cost the same [-]."""
SHOWN = 0.9
"""Share of the sticky valves with S above `S_detectable` that must not be called good, of loops not trained on [-]."""
EVIDENCE = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 10.0, 20.0)
"""Evidence predicted of a valve of size `S_detectable`, of which the least that is enough is taken [-]."""
FOLDS = 4
"""Parts of the loops; each is judged by models trained on the others [-]."""


def features_for(cause: str) -> list[Any]:
    """Rows of the feature table that a cause has."""
    return [feature for feature in CAUSE_FEATURES if cause in feature.signs]


def matrix(table: pl.DataFrame, cause: str) -> np.ndarray:
    """Features of a cause, shape (n_loops, n_features)."""
    columns = [pl.col(f"y_{feature.name}").cast(pl.Float64).fill_null(np.nan) for feature in features_for(cause)]
    return table.select(columns).to_numpy()


def cause_labels(table: pl.DataFrame, cause: str) -> tuple[np.ndarray, np.ndarray]:
    """Whether a cause is true of each loop, and the weight of the loop; 0 where that cannot be known."""
    kind = table["cause"].to_numpy()
    weights = np.where(np.isin(kind, UNKNOWABLE.get(cause, ())), 0.0, 1.0)
    if cause in NAMES:
        return kind == NAMES[cause], weights
    if cause == "unseen":
        hidden, sticks = np.isin(kind, HIDDEN_KINDS), table["causes"].str.contains("valve").to_numpy()
        missed = sticks & _called_good(table)
        return hidden | missed, np.where(missed, MISSED_WEIGHT, weights)
    return np.array([cause in text.split("+") for text in table["causes"]]), weights


def _called_good(table: pl.DataFrame) -> np.ndarray:
    """Whether the verdict's model alone, of one window, would call the valve of each loop good."""
    return np.array([decide(logistic(x)) == "no_stiction" for x in table["y_log_odds"]])


def fit_one(table: pl.DataFrame, cause: str) -> dict[str, Any]:
    """Fit the model of one cause, as it is stored."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    true, weights = cause_labels(table, cause)
    used = weights > 0.0
    X, signs = matrix(table, cause)[used], [feature.signs[cause] for feature in features_for(cause)]
    model = HistGradientBoostingClassifier(
        max_iter=150, learning_rate=0.05, max_leaf_nodes=6, min_samples_leaf=25, l2_regularization=2.0,
        monotonic_cst=signs, early_stopping=False, random_state=0,
    )  # fmt: skip
    model.fit(X, true[used], sample_weight=weights[used])
    found = stored_trees(model, X, weights[used])
    share = float(np.average(true[used], weights=weights[used]))
    return found | {"features": [one.name for one in features_for(cause)], "training_prior": round(share, 4)}


def cause_probabilities(stored: dict[str, Any], table: pl.DataFrame, cause: str) -> np.ndarray:
    """Probabilities of a stored model, shape (n_loops,)."""
    model, names = read_model(stored), [feature.name for feature in features_for(cause)]
    rows = matrix(table, cause)
    return np.array([model.probability(dict(zip(names, row, strict=True)), model.training_prior) for row in rows])


def fit_causes(table: pl.DataFrame) -> dict[str, Any]:
    """Fit all models.

    Parameters
    ----------
    table : polars.DataFrame
        Rows of `calibration.feature_table` of the set `kinds`.

    Returns
    -------
    dict
        The stored form that `stiction.diagnosis.verdict.causes` reads.
    """
    table = table.filter(pl.col("state") == "in_control")
    models = {cause: fit_one(table, cause) for cause in (*CAUSES, *OTHERS)}
    apart = _predict_apart(table)
    hidden = np.isin(table["cause"].to_numpy(), HIDDEN_KINDS)
    position = table["cause"].to_numpy() == NAMES["position"]
    limits = {
        name: _limit(table, apart[name], of, MISSED[name]) for name, of in (("unseen", hidden), ("position", position))
    }
    seen = np.logical_and.reduce([apart[name] <= limit for name, limit in limits.items()])
    return {
        "named": round(1.0 - 1.0 / WRONG_COST, 3), **{f"{name}_limit": limit for name, limit in limits.items()},
        "min_evidence": _min_evidence(table.filter(pl.Series(seen))), "models": models,
        "provenance": {"loops": table.height, "kinds": table["cause"].n_unique()},
    }  # fmt: skip


def _predict_apart(table: pl.DataFrame) -> dict[str, np.ndarray]:
    """Probabilities of each model for loops that it was not trained on."""
    fold = np.arange(table.height) // table["cause"].n_unique() % FOLDS
    found = {cause: np.empty(table.height) for cause in (*CAUSES, *OTHERS)}
    for k in range(FOLDS):
        train, apart = (table.filter(pl.Series(part)) for part in (fold != k, fold == k))
        for cause, probability in found.items():
            probability[fold == k] = cause_probabilities(fit_one(train, cause), apart, cause)
    return found


def _limit(table: pl.DataFrame, probability: np.ndarray, of: np.ndarray, share: float) -> float:
    """Probability up to which a `share` of some loops is called good."""
    called = np.where(_called_good(table), probability, 1.0)[of]
    return round(float(np.sort(called)[int(share * called.size)]), 3)


def _min_evidence(table: pl.DataFrame) -> float:
    """Least evidence from which sticky valves with S above `S_detectable` are seldom called good."""
    sticky = table.filter(~pl.col("cause").is_in(UNKNOWABLE["unseen"]))
    sticky = sticky.filter(pl.col("sticky") & pl.col("true_S").is_finite() & pl.col("evidence").is_not_null())
    good, true = _called_good(sticky), sticky["true_S"].to_numpy()
    for needed in EVIDENCE:
        least = [smallest_shown(np.array(row), needed) or np.inf for row in sticky["evidence"]]
        shown = true >= least
        if (good & (np.array(least) <= DEFAULT_SMALLEST_S))[shown].mean() <= 1.0 - SHOWN:
            return needed
    return EVIDENCE[-1]


def main() -> None:
    """Train from tables and write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", type=Path, nargs="+", help="tables of the set `kinds` by calibration.feature_table")
    given = parser.parse_args()
    found = fit_causes(pl.concat([pl.read_parquet(path) for path in given.tables], how="diagonal_relaxed"))
    text = json.dumps(found).replace("]], [[", "]],\n [[")
    (ROOT / "verdict" / "causes.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
