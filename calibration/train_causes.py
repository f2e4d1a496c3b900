"""Train the models of the causes and of an unseen valve on simulated loops: ``make calibrate``.

One boosted model for each cause, with the signs of its features, written to
`src/stiction/diagnosis/verdict/causes.json`. Loops in which a cause can neither be seen nor excluded, such as a load
beside a stuck valve, do not count for it.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from calibration.train import ROOT, stored_trees
from stiction.diagnosis.identification.loop_response import S_GRID
from stiction.diagnosis.verdict.cause_features import CAUSE_FEATURES
from stiction.diagnosis.verdict.causes import CAUSES
from stiction.diagnosis.verdict.decision import decide
from stiction.diagnosis.verdict.model import read_model

__all__ = ["HIDDEN_KINDS", "cause_labels", "cause_probabilities", "fit_causes"]

HIDDEN_KINDS = ("stuck", "unmoved", "play unmoved")
"""Kinds in which the stem does not move."""
UNKNOWABLE = {
    "external": ("stuck", "random load", "position as OP", "pulsed"),
    "tuning": ("rate limit",),
    "unseen": ("position as OP", "pulsed", "play", "deadband"),
}
"""Cause -> kinds that do not count for it: it is there in part, or another name for what is."""
SINGLE_CAUSES = {
    "stiction": "valve", "deadband": "valve", "tight tuning": "tuning", "external disturbance": "external",
    "sensor": "sensor",
}  # fmt: skip
"""Cause of a loop of `population` -> the one cause that is known of it."""
SINGLE_SETS = ("population", "stored")
"""Sets whose loops count for the cause that is known of them."""
HIDDEN_WEIGHT = 3.0
"""Weight of a loop whose stem does not move in the model of the unseen valve [-]."""
UNSEEN_LIMIT = 0.25
"""Probability of an unseen valve above which nothing is excluded [-]: of simulated loops whose stem does not move, 2 %
are below it."""
MIN_TURNS = 6
"""Turns of the stem below which a sticky loop of another set does not count [-]."""
SHOWN = 0.9
"""Share of the sticky valves with S above `S_detectable` that must not be called good [-]."""
LEAST_EVIDENCE = 2.7
"""Least evidence foretold [-]: the 90 % point of chi-square with one degree of freedom."""


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
    if cause != "unseen":
        of_kind = np.array([text is not None for text in table["causes"].to_list()])
        known = of_kind | (np.isin(kind, list(SINGLE_CAUSES)) & np.isin(table["set"].to_numpy(), SINGLE_SETS))
        if cause in ("external", "set_point"):
            known &= of_kind | (kind == "tight tuning") | ((kind == "external disturbance") & (cause == "external"))
        names = [SINGLE_CAUSES.get(one, "") if text is None else text
                 for one, text in zip(kind, table["causes"].to_list(), strict=True)]  # fmt: skip
        return np.array([cause in name.split("+") for name in names]), np.where(known, weights, 0.0)
    hidden = np.isin(kind, HIDDEN_KINDS)
    return table["sticky"].to_numpy() | hidden, np.where(hidden, HIDDEN_WEIGHT, weights)


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
    if "stem_turns" in table.columns:
        hardly = pl.col("sticky") & (pl.col("stem_turns") < MIN_TURNS) & pl.col("causes").is_null()
        table = table.filter(~hardly)
    models = {cause: fit_one(table, cause) for cause in (*CAUSES, "unseen")}
    unseen = cause_probabilities(models["unseen"], table, "unseen")
    return {
        "unseen_limit": UNSEEN_LIMIT, "min_evidence": _min_evidence(table, unseen), "models": models,
        "provenance": {"loops": table.height, "kinds": table["cause"].n_unique()},
    }  # fmt: skip


def _min_evidence(table: pl.DataFrame, unseen: np.ndarray) -> float:
    """Least evidence foretold at the true S from which enough sticky valves are not called good."""
    known = ~np.isin(table["cause"].to_numpy(), UNKNOWABLE["unseen"])
    sticky = table["sticky"].to_numpy() & np.isfinite(table["true_S"].to_numpy()) & known
    called = np.array([decide(p) == "no_stiction" for p in table["probability"]]) & (unseen <= UNSEEN_LIMIT)
    evidence = np.array([
        np.interp(np.log(max(S, 0.1)), np.log(S_GRID), row) if row is not None and len(row) else 0.0
        for S, row in zip(table["true_S"], table["evidence"], strict=True)
    ])  # fmt: skip
    order = np.argsort(evidence[sticky])
    missed, at = called[sticky][order], evidence[sticky][order]
    above = np.cumsum(missed[::-1])[::-1] / np.arange(missed.size, 0, -1)
    enough = np.flatnonzero(above <= 1.0 - SHOWN)
    return round(max(float(at[enough[0]]) if enough.size else float(at[-1]), LEAST_EVIDENCE), 1)


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
