"""Train the pooling of windows and the detection of changes on histories of the first simulator.

Run as a script: ``python -m calibration.train_pooling TABLE``; it writes `pooling.json` of the evidence.
"""

from __future__ import annotations

import argparse
import json
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import polars as pl

from stiction.diagnosis.evidence.pool_diagnoses import DEADBAND_FEATURES
from stiction.diagnosis.evidence.pooling import (
    POOLED_FEATURES,
    WindowTable,
    pooled_features,
    tabulate,
)
from stiction.diagnosis.verdict.causes import CAUSES
from stiction.diagnosis.verdict.decision import DEFAULT_PRIOR
from stiction.diagnosis.verdict.history import Window, evidence_of
from stiction.diagnosis.verdict.model import log_odds

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["History", "history_windows", "read_histories"]

TARGET = Path(__file__).resolve().parents[1] / "src" / "stiction" / "diagnosis" / "evidence" / "pooling.json"
CORRELATIONS = (0.1, 0.15, 0.2, 0.3, 0.4, 0.5)
"""Correlations of the errors of windows that are tried [-]."""
PENALTY = 2.0
"""Weight of the squared coefficients [-]."""
FOLDS = 8
"""Folds of the cross-validation [-]."""
SIGNS = {"spread": -1.0, "over_deadband": 1.0, "size": 1.0, "band_to_swing": -1.0}
"""Features whose coefficient may have one sign only."""
LEAST_WEIGHT = 0.2
"""Weight that the mean evidence of however many windows keeps at least [-]: more evidence never counts against."""


def is_known(value: float | None) -> bool:
    """Whether a number of a table is there."""
    return value is not None and bool(np.isfinite(value))


class History(NamedTuple):
    """Windows of one valve, and what is true in each."""

    name: str
    """Name of the history."""
    fault: str
    """Its fault."""
    course: str
    """How the fault runs."""
    windows: list[Window]
    """The windows, those out of control too."""
    sticky: NDArray[np.bool_]
    """Whether the valve sticks in each window."""
    S: NDArray[np.float64]
    """True S of each window [% of span]."""


def history_windows(rows: pl.DataFrame) -> list[Window]:
    """Windows of the rows of one history."""
    found = []
    for row in rows.iter_rows(named=True):
        known = row["state"] == "in_control" and row["S"] is not None
        sizes = {name: row[name] for name in ("S", "S_low", "S_high", "J", "J_low", "J_high")} if known else {}
        found.append(
            Window(
                None, float(row["window"]), row["window"] + 1.0, row["state"], row["probability"], **sizes,
                S_detectable=row["S_detectable"],
                causes=tuple(row[f"cause_{name}"] for name in CAUSES) if known else (),
                **{name: row[f"x_{name}"] if is_known(row[f"x_{name}"]) else 0.0
                   for name in ("band_to_swing", "over_closest")},
                over_deadband=float(sum(row[f"x_{name}"] for name in DEADBAND_FEATURES if is_known(row[f"x_{name}"]))),
                evidence=evidence_of(min(max(row["probability"], 1e-6), 1.0 - 1e-6), DEFAULT_PRIOR) if known else 0.0,
            )
        )  # fmt: skip
    return found


def read_histories(path: Path) -> list[History]:
    """Histories of a table of `history_table`."""
    found = []
    for (name,), rows in pl.read_parquet(path).group_by("history", maintain_order=True):
        sticky, S = rows["sticky"].to_numpy(), rows["true_S"].to_numpy()
        found.append(History(str(name), rows["fault"][0], rows["course"][0], history_windows(rows), sticky, S))
    return found


class Examples(NamedTuple):
    """Beginnings of histories whose valve does not change within them."""

    history: NDArray[np.int64]
    """Number of the history."""
    n: NDArray[np.int64]
    """Windows in control [-]."""
    offset: NDArray[np.float64]
    """Log odds of the mean evidence, prior included [-]."""
    features: NDArray[np.float64]
    """Pooled features, shape (n_examples, n_features)."""
    sticky: NDArray[np.bool_]
    """Whether the valve sticks."""
    weight: NDArray[np.float64]
    """Weight: sticky ones make up the prior, and each history counts once."""


def make_examples(histories: list[History]) -> Examples:
    """All beginnings of the stretches of constant truth, of two windows or more."""
    rows: list[tuple[Any, ...]] = []
    for k, one in enumerate(histories):
        for first, last in constant_stretches(one):
            known = [w for w in one.windows[first:last] if w.in_control]
            for n in range(2, len(known) + 1):
                table = tabulate(known[:n])
                offset = log_odds(DEFAULT_PRIOR) + float(table.evidence.mean())
                rows.append((k, n, offset, pooled_features(table), one.sticky[first], 1.0 / (len(known) - 1)))
    history, n, offset, features, sticky, weight = (np.array(column) for column in zip(*rows, strict=True))
    share = float(weight[sticky].sum() / weight.sum())
    weight = weight * np.where(sticky, DEFAULT_PRIOR / share, (1.0 - DEFAULT_PRIOR) / (1.0 - share))
    return Examples(history, n, offset, features, sticky, weight / weight.mean())


def constant_stretches(one: History) -> list[tuple[int, int]]:
    """Stretches of windows in which the valve sticks or does not; all of an intermittent fault is left out."""
    if one.course == "intermittent":
        return []
    ends = [0, *(np.flatnonzero(np.diff(one.sticky.astype(int))) + 1).tolist(), one.sticky.size]
    return list(pairwise(ends))


def independent_windows(n: NDArray[np.int64], correlation: float) -> NDArray[np.float64]:
    """What `effective_windows` gives, for many numbers of windows [-]."""
    return n / (1.0 + (n - 1) * correlation)


def fit(examples: Examples, correlation: float) -> NDArray[np.float64]:
    """Coefficients by logistic regression with an offset, small ones of standardised features preferred."""
    from scipy.optimize import minimize

    further = independent_windows(examples.n, correlation) - 1.0
    scale = examples.features.std(axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    X = further[:, np.newaxis] * examples.features / scale
    sign = np.where(examples.sticky, 1.0, -1.0)

    def cost(b: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        z = sign * (examples.offset + X @ b)
        loss = float(examples.weight @ np.logaddexp(0.0, -z)) + PENALTY * float(b @ b)
        return loss, X.T @ (-examples.weight * sign / (1.0 + np.exp(z))) + 2.0 * PENALTY * b

    limits = {1.0: (0.0, None), -1.0: (None, 0.0), 0.0: (None, None)}
    bounds = [limits[SIGNS.get(name, 0.0)] for name in POOLED_FEATURES]
    k = POOLED_FEATURES.index("evidence")
    bounds[k] = (scale[k] * (LEAST_WEIGHT - 1.0) / (1.0 / correlation - 1.0), None)
    return minimize(cost, np.zeros(len(POOLED_FEATURES)), jac=True, bounds=bounds).x / scale


def loss(examples: Examples, b: NDArray[np.float64], correlation: float) -> float:
    """Mean log loss [-]."""
    z = examples.offset + (independent_windows(examples.n, correlation) - 1.0) * (examples.features @ b)
    return float(np.average(np.logaddexp(0.0, np.where(examples.sticky, -z, z)), weights=examples.weight))


def take(examples: Examples, chosen: NDArray[np.bool_]) -> Examples:
    """Some of the examples."""
    return Examples(*(column[chosen] for column in examples))  # pyright: ignore[reportArgumentType]


def choose_correlation(examples: Examples) -> tuple[float, float]:
    """Correlation with the least loss in cross-validation, and that loss."""
    fold = examples.history % FOLDS
    losses = {}
    for correlation in CORRELATIONS:
        parts = [(take(examples, fold != k), take(examples, fold == k)) for k in range(FOLDS)]
        losses[correlation] = float(np.mean([loss(b, fit(a, correlation), correlation) for a, b in parts]))
    best = min(losses, key=lambda one: losses[one])
    return best, losses[best]


def levels(histories: list[History], column: str) -> list[list[float]]:
    """Mean, spread between stretches and spread within them of a quantity, in order and sticky."""
    found: list[list[float]] = []
    for sticky in (False, True):
        groups = []
        for one in histories:
            for first, last in constant_stretches(one):
                table = tabulate(one.windows[first:last])
                if one.sticky[first] == sticky and table.evidence.size > 1:
                    groups.append(change_series(table)[column])
        within = float(np.sqrt(np.mean(np.concatenate([(x - x.mean()) ** 2 * x.size / (x.size - 1) for x in groups]))))
        means = np.array([x.mean() for x in groups])
        inner = float(np.mean([within**2 / x.size for x in groups]))
        between = float(np.sqrt(max(means.var() - inner, 0.01)))
        found.append([round(float(means.mean()), 4), round(between, 4), round(within, 4)])
    return found


def change_series(table: WindowTable) -> dict[str, NDArray[np.float64]]:
    """The quantities in which changes are looked for."""
    from stiction.diagnosis.evidence.changes import change_quantities

    return change_quantities(table)


def main() -> None:
    """Write the model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    given = parser.parse_args()
    stored = json.loads(TARGET.read_text(encoding="utf-8"))
    histories = read_histories(given.table)
    examples = make_examples(histories)
    correlation, found = choose_correlation(examples)
    b = fit(examples, correlation)
    stored |= {"coefficients": [round(float(x), 5) for x in b], "correlation": correlation}
    stored["changes"] |= {name: levels(histories, name) for name in ("evidence", "valve_cause", "ln_S")}
    stored["provenance"] = {"histories": len(histories), "loss": round(found, 4)}
    TARGET.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(stored, indent=1))


if __name__ == "__main__":
    main()
