"""Find the weights of the verdict again, and judge each real loop by weights found without it.

python tests/diagnosis/verdict/calibrate.py ../shared/data [--loops 150]
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

import stiction as st
from stiction.simulation.population import population

CAUSES = (
    "stiction", "tight tuning", "stiction", "external disturbance", "stiction", "sensor", "none",
    "external disturbance", "stiction", "deadband",
)  # fmt: skip
RIDGE = 0.03


def fit(X, y, weight):
    """Weights of a logistic regression with a small ridge, by Newton's method."""
    b = np.zeros(X.shape[1])
    ridge = RIDGE * np.diag([0.0, *np.ones(X.shape[1] - 1)])
    for _ in range(60):
        p = 1.0 / (1.0 + np.exp(-X @ b))
        slope = X.T @ (weight * (p - y)) + ridge @ b
        curve = (X * (weight * p * (1.0 - p))[:, np.newaxis]).T @ X + RIDGE * np.eye(b.size)
        b -= np.linalg.solve(curve, slope)
    return b


def row(record):
    """Constant and features of one record."""
    return [1.0, *st.diagnose(record).settings["features"].values()]


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("folder", type=Path)
    ask.add_argument("--loops", type=int, default=150, help="loops of each of the two seeds")
    given = ask.parse_args()
    with (given.folder / "labels.csv").open() as file:
        labels = list(csv.DictReader(file))
    kinds = {"concentration": "analyser"}
    X = np.array(
        [row(st.read(given.folder / r["file"], loop_type=kinds.get(r["loop_type"], r["loop_type"]))[0]) for r in labels]
    )
    y = np.array([r["label"] == "stiction" for r in labels], dtype=float)
    group = np.array([r["group"] for r in labels])
    weight = np.array([1.0 / np.sum(group == g) for g in group])
    cases = [case for seed in (31, 32) for case in population(given.loops, CAUSES, seed) if case.cause != "deadband"]
    Z = np.array([row(case.record) for case in cases])
    z = np.array([case.sticky for case in cases], dtype=float)
    share = np.full(z.size, weight.sum() / z.size)
    print("weights", fit(np.r_[X, Z], np.r_[y, z], np.r_[weight, share]).round(2).tolist())
    odds = np.empty(y.size)
    for g in np.unique(group):
        others = group != g
        odds[~others] = X[~others] @ fit(np.r_[X[others], Z], np.r_[y[others], z], np.r_[weight[others], share])
    p = 1.0 / (1.0 + np.exp(-odds))
    right = np.where(y == 1.0, p > 0.6, p < 0.4)
    loops = [right[group == g].mean() > 0.5 for g in np.unique(group)]
    print(f"left out one loop at a time: {right.sum()} of {y.size} records, {sum(loops)} of {len(loops)} loops right")
    for name, chance in zip(np.array([r["file"] for r in labels])[~right], p[~right], strict=True):
        print(f"  wrong or undecided: {name} {chance:.2f}")


if __name__ == "__main__":
    main()
