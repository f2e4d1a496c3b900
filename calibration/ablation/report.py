"""Refit the model without each part and print what that costs."""

from __future__ import annotations

import csv
import gzip
import json
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from calibration.ablation.code_lines import lines_of_part
from calibration.ablation.model import CANDIDATES, FEATURES, RIVALS, Rows, cross_predict, feature_matrix, fit_model
from calibration.ablation.parts import SEARCH_PARTS, TIMED_ONLY
from calibration.loop_sets import FIRST_SIMULATOR

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from calibration.ablation.model import Feature

__all__ = ["brier_by_loop", "paired_interval", "write_report"]

BASE = "all parts"
MIN_GAIN = 0.003
"""Gain of the Brier score from which a part may stay [-]."""
COLUMNS_OF_PARTS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    **{f"rival: {name}": ((), (name,)) for name in RIVALS},
    "rival: beside wave": (("likelihood beside a wave",), ()),
    "all rivals": (("likelihood over the best rival", "likelihood beside a wave"), ()),
    "part of record": (("likelihood in a part",), ()),
    "dense search": (("gain of fit, dense search", "S over OP swing, dense search"), ()),
    "windows of the verdict": (("share of sticky windows",), ()),
}
"""Parts that are columns: features that go with them, and rivals."""


class Sets(NamedTuple):
    """The rows of one variant, a row a loop of the simulators, a row a record of the recorded loops."""

    first: Rows
    second: Rows
    recorded: Rows


class Scores(NamedTuple):
    """What a model is worth."""

    squares: NDArray[np.float64]
    """Squared error of each loop of the first simulator, shape (n_loops,)."""
    second: float
    """Brier score on the second simulator [-]."""
    recorded: float
    """Brier score on the recorded loops, each record of a loop counting alike [-]."""
    probability: NDArray[np.float64]
    """Probability of each loop of the first simulator, shape (n_loops,)."""


def paired_interval(gain: NDArray[np.float64], resamples: int, seed: int = 0) -> tuple[float, float]:
    """95 % interval of a mean by the paired bootstrap.

    Parameters
    ----------
    gain : ndarray, shape (n_loops,)
        Difference of each loop.
    resamples : int
        Resamples [-].
    seed : int
        Seed of the resamples.

    Returns
    -------
    tuple of float
        Ends of the interval.

    Examples
    --------
    >>> low, high = paired_interval(np.array([0.0, 1.0] * 200), 1000)
    >>> abs(low - 0.451) < 0.01, abs(high - 0.549) < 0.01
    (True, True)
    """
    rng = np.random.default_rng(seed)
    means = [gain[rng.integers(0, gain.size, gain.size)].mean() for _ in range(resamples)]
    low, high = np.quantile(means, (0.025, 0.975))
    return float(low), float(high)


def brier_by_loop(probability: NDArray[np.float64], sticky: NDArray[np.bool_], loop: NDArray[np.str_]) -> float:
    """Brier score in which every loop weighs the same, however many records it has.

    Parameters
    ----------
    probability : ndarray, shape (n_records,)
        Probability of stiction.
    sticky : ndarray of bool, shape (n_records,)
        Truth.
    loop : ndarray of str, shape (n_records,)
        Loop of each record.

    Returns
    -------
    float
        Mean over the loops of the mean squared error of their records; NaN of no loop.

    Examples
    --------
    >>> round(brier_by_loop(np.array([1.0, 0.0, 0.5]), np.array([True, True, False]), np.array(["a", "a", "b"])), 3)
    0.375
    """
    squares = (probability - sticky) ** 2
    means = [squares[loop == name].mean() for name in np.unique(loop)]
    return float(np.mean(means)) if means else float("nan")


def write_report(out: Path, resamples: int, save: Path | None) -> None:
    """Print the tables of the ablation.

    Parameters
    ----------
    out : Path
        Folder of the results of `run`.
    resamples : int
        Resamples of the paired bootstrap [-].
    save : Path or None
        File that gets the tables too.
    """
    tables = read_variants(out)
    base_sets = _sets(tables, BASE)
    base = _score(base_sets, FEATURES)
    lines = _heading(base_sets, base)
    time = _Time(tables[BASE])
    head = (
        "| {0} | Brier gain | 95 % interval | stays | processor time [%] | code lines | acts in [% of loops] |"
        " gain, second simulator | gain, recorded loops |"
    )
    rule = "|---|---|---|---|---|---|---|---|---|"

    def add(name: str, score: Scores, about: str, sign: float = 1.0) -> None:
        gain = sign * (score.squares - base.squares)
        low, high = paired_interval(gain, resamples)
        stays = "yes" if low > 0.0 and gain.mean() >= MIN_GAIN else "no"
        others = (f"{sign * (other - own):+.4f}" for other, own in zip(score[1:3], base[1:3], strict=True))
        lines.append(
            f"| {name} | {gain.mean():+.4f} | {low:+.4f} to {high:+.4f} | {stays} | {about} | {' | '.join(others)} |"
        )
        print(lines[-1], flush=True)

    lines += [head.format("part"), rule]
    for name, part in SEARCH_PARTS.items():
        if name in tables:
            acts = 100.0 * sum(row["set"] in FIRST_SIMULATOR for row in tables[name].values()) / len(base_sets.first)
            about = f"{time.share(name):.1f} | {lines_of_part(part.code) or ''} | {acts:.0f}"
            add(name, _score(_sets(tables, name), FEATURES), about)
    for name, (features, rivals) in COLUMNS_OF_PARTS.items():
        left = {key: feature for key, feature in FEATURES.items() if key not in features}
        code = TIMED_ONLY[name][2] if name in TIMED_ONLY else ()
        share = f"{time.share(name):.1f}" if name in TIMED_ONLY else ""
        add(name, _score(base_sets, left, rivals), f"{share} | {lines_of_part(code) or ''} | ")
    lines += ["", head.format("feature of the base model"), rule]
    for name in FEATURES:
        left = {key: feature for key, feature in FEATURES.items() if key != name}
        add(name, _score(base_sets, left), " |  | ")
    lines += ["", head.format("feature that could be added"), rule]
    for name, feature in CANDIDATES.items():
        add(name, _score(base_sets, FEATURES | {name: feature}), " |  | ", -1.0)
    text = "\n".join(lines) + "\n"
    print(text)
    if save is not None:
        save.write_text(text, encoding="utf-8")


def read_variants(out: Path) -> dict[str, dict[str, dict[str, str]]]:
    """Read the results of all runs.

    Parameters
    ----------
    out : Path
        Folder of the results: the file of each chunk, or files of `run --pack` (`*.json.gz`).

    Returns
    -------
    dict
        Variant -> record -> its row; `set` names where the record comes from.
    """
    tables: dict[str, dict[str, dict[str, str]]] = {}
    for rows in (*map(_chunk_rows, sorted(out.glob("*.csv"))), *map(_packed_rows, sorted(out.glob("*.json.gz")))):
        records: dict[tuple[str, str], int] = {}
        record = ""
        for row in rows:
            if row["variant"] == BASE:
                own = row["set"], row["loop"]
                records[own] = records.get(own, -1) + 1
                record = f"{row['loop']}#{records[own]}"
            tables.setdefault(row["variant"], {})[record] = row
    return tables


def _chunk_rows(file: Path) -> Iterator[dict[str, str]]:
    """Rows of the file of one chunk."""
    with file.open(newline="") as rows:
        for row in csv.DictReader(rows):
            yield {**row, "set": file.stem.rsplit("-", 1)[0]}


def _packed_rows(file: Path) -> Iterator[dict[str, str]]:
    """Rows of a file with all chunks."""
    with gzip.open(file, "rt", encoding="utf-8") as rows:
        for line in rows:
            yield json.loads(line)


def _sets(tables: Mapping[str, Mapping[str, dict[str, str]]], variant: str) -> Sets:
    """The rows of a variant; where the part does not act, and so has no row, those with all parts."""
    rows = [tables[variant].get(record, row) for record, row in tables[BASE].items()]
    first, second, recorded = (
        Rows([row for row in rows if row["set"] in names]) for names in (FIRST_SIMULATOR, ("second",), ("recorded",))
    )
    return Sets(first, second, recorded)


def _score(sets: Sets, features: Mapping[str, Feature], dropped_rivals: tuple[str, ...] = ()) -> Scores:
    """Fit on the first simulator, by loops kept apart; then on all of it for the others."""
    signs = [feature.sign for feature in features.values()]
    X, second, recorded = (feature_matrix(rows, features, dropped_rivals) if len(rows) else None for rows in sets)
    assert X is not None
    sticky = sets.first["sticky"] == 1.0
    probability = cross_predict(X, sticky, signs)
    model = fit_model(X, sticky, signs)
    briers = [
        brier_by_loop(model(x), rows["sticky"] == 1.0, rows.text("loop"))
        if x is not None else float("nan")
        for x, rows in ((second, sets.second), (recorded, sets.recorded))
    ]  # fmt: skip
    return Scores((probability - sticky) ** 2, briers[0], briers[1], probability)


def _heading(sets: Sets, base: Scores) -> list[str]:
    """What was counted, and what the model with all parts is worth beside the package's own probability."""
    from sklearn.metrics import roc_auc_score

    sticky = sets.first["sticky"] == 1.0
    stored = float(np.mean(sets.first.text("storage") != "raw"))
    counts = len(sets.second), len(np.unique(sets.recorded.text("loop")))
    lines = [
        f"{len(sticky)} loops of the first simulator, {100.0 * sticky.mean():.0f} % sticky, {100.0 * stored:.0f} % "
        f"stored by a historian; {counts[0]} loops of the second simulator; {counts[1]} recorded loops.",
        "",
        "| | Brier, first | AUC, first | Brier, second | Brier, recorded |",
        "|---|---|---|---|---|",
        f"| new model, all parts | {base.squares.mean():.4f} | {roc_auc_score(sticky, base.probability):.3f} |"
        f" {base.second:.4f} | {base.recorded:.4f} |",
    ]
    own = [rows["package_probability"] for rows in sets]
    truth = [rows["sticky"] == 1.0 for rows in sets]
    briers = [brier_by_loop(p, t, rows.text("loop")) for p, t, rows in zip(own, truth, sets, strict=True)]
    lines.append(
        f"| the package's probability | {briers[0]:.4f} | {roc_auc_score(truth[0], own[0]):.3f} | {briers[1]:.4f} |"
        f" {briers[2]:.4f} |"
    )
    return [*lines, ""]


class _Time:
    """Share of the processor time of a diagnosis."""

    def __init__(self, rows: Mapping[str, dict[str, str]]) -> None:
        self.rows = [row for row in rows.values() if row["set"] in FIRST_SIMULATOR]
        self.total = sum(float(row["seconds"]) for row in self.rows)

    def share(self, name: str) -> float:
        """Of one part, in percent."""
        return 100.0 * sum(float(row.get(f"seconds_{name}") or 0.0) for row in self.rows) / self.total
