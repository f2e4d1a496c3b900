"""Validate the verdict on loops that it was not trained on and write docs/validation.md: ``make validate``."""

from __future__ import annotations

import argparse
import json
from dataclasses import astuple, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from calibration.advice_scores import advice_section
from calibration.curve_svg import curve_svg
from calibration.scores import Scores, interval_coverage, reliability, risk_coverage, scores
from calibration.train import trainable, weights_of
from stiction.diagnosis.verdict.decision import decide
from stiction.diagnosis.verdict.features import FEATURES
from stiction.diagnosis.verdict.model import stiction_model

if TYPE_CHECKING:
    from collections.abc import Iterable

ROOT = Path(__file__).resolve().parents[1]
HEAD = """# Validation

This page is written by `make validate` (`calibration/validate.py`). It says how far the verdict can be trusted: on
simulated loops drawn with a fresh seed, on a second simulator that was written from the literature and never used for
training, and on recorded loops of plants. The tables of the verdict count calls by the probability alone; a diagnosis
says `no_stiction` only where the record excludes stiction of 1 % of span too, and leaves more good valves undecided.
"""
CHOICES = """## Choices made by looking at recorded loops

At most three are allowed. Made so far: {count}.

{choices}
"""


def model_probabilities(table: pl.DataFrame, prior: float) -> np.ndarray:
    """Probabilities of the stored model for the features of a table, shape (n_loops,)."""
    model = stiction_model()
    names = [feature.name for feature in FEATURES]
    rows = table.select([pl.col(f"x_{name}").cast(pl.Float64).fill_null(np.nan) for name in names]).rows()
    return np.array([model.probability(dict(zip(names, row, strict=True)), prior) for row in rows])


def simulated_section(title: str, table: pl.DataFrame, prior: float, picture: Path) -> list[str]:
    """Scores of a simulated population as text, and its reliability picture."""
    judged = trainable(table)
    sticky, probability = judged["sticky"].to_numpy(), model_probabilities(judged, prior)
    weights = weights_of(judged, prior)
    found = [
        ("all", scores(sticky, probability, prior, weights=weights)),
        ("all, deadband in full", scores(sticky, probability, prior)),
    ]
    lines = [
        f"## {title}",
        "",
        f"{table.height} loops, {judged.height} of them judged: in control; the stem of a sticky one turns at least",
        "six times. A loop with deadband alone counts a fifth, as in training, but for the second row.",
        "",
    ]
    lines += score_table([*found, *(_of_set(judged, name, prior) for name in sorted(set(judged["set"])))])
    known = judged.filter(pl.Series(probability > 0.8) & pl.col("sticky") & (pl.col("true_S") > 0.0))
    held, width = interval_coverage(*(known[name].to_numpy() for name in ("true_S", "S_low", "S_high")))
    lines += ["", f"95 % intervals of S of {known.height} sticky loops called so hold the true S in {held:.3f}; their "
              f"median width is {width:.2f} S.", ""]  # fmt: skip
    rows = reliability(sticky, probability, weights)
    curve = risk_coverage(sticky, probability, weights)
    picture.write_text(curve_svg(title, rows[:, :2], curve), encoding="utf-8")
    lines += [f"![Reliability and risk over coverage: {title}]({picture.relative_to(ROOT / 'docs').as_posix()})", ""]
    return lines


def _of_set(judged: pl.DataFrame, name: str, prior: float) -> tuple[str, Scores]:
    own = judged.filter(pl.col("set") == name)
    return name, scores(
        own["sticky"].to_numpy(), model_probabilities(own, prior), prior, weights=weights_of(own, prior)
    )


def score_table(rows: Iterable[tuple[str, Scores]]) -> list[str]:
    """Scores as a Markdown table."""
    names = [field.name.replace("_", " ") for field in fields(Scores)]
    lines = ["| set | " + " | ".join(names) + " |", "|---" * (len(names) + 1) + "|"]
    for name, one in rows:
        values = [f"{value}" if isinstance(value, int) else f"{value:.3f}" for value in astuple(one)]
        lines.append(f"| {name} | " + " | ".join(values) + " |")
    return lines


def recorded_section(table: pl.DataFrame, prior: float) -> list[str]:
    """Recorded loops: one row a loop, the probability being the mean over its records."""
    judged = table.with_columns(
        pl.when(pl.col("state") == "in_control").then(pl.Series(model_probabilities(table, prior))).otherwise(prior)
        .alias("p")
    )  # fmt: skip
    loops = judged.group_by("loop", maintain_order=True).agg(
        pl.col("sticky").first(), pl.col("cause").first(), pl.col("p").mean(), pl.len().alias("records")
    )
    lines = ["## Recorded loops", "", "The model never saw them. A loop is right when the mean probability over its "
             "records gives the call that its label names.", "", "| loop | label | records | probability | call |",
             "|---|---|---|---|---|"]  # fmt: skip
    right = sure_and_wrong = 0
    for loop, sticky, cause, p, records in loops.iter_rows():
        call = decide(p)
        right += call == ("stiction" if sticky else "no_stiction")
        sure_and_wrong += (p > 0.9 and not sticky) or (p < 0.1 and sticky)
        lines.append(f"| {loop} | {cause} | {records} | {p:.2f} | {call} |")
    brier = float(((loops["p"] - loops["sticky"].cast(pl.Float64)) ** 2).mean())  # pyright: ignore
    lines += ["", f"{right} of {loops.height} loops right, {sure_and_wrong} wrong above 0.9 or below 0.1, Brier score "
              f"{brier:.3f}.", ""]  # fmt: skip
    return lines


ADVICE = """## Advice

Loops of every kind that advice is about, in equal shares. Wrong advice names a false cause and no true one, calls a
sticky valve good whose S is above `S_detectable`, or finds nothing in a loop with a fault.
"""


def advice_lines(first: Path | None, second: Path | None) -> list[str]:
    """The section on causes and on what the record could show; empty without tables."""
    titles = ("First simulator, fresh seed", "Second simulator")
    tables = [(title, path) for title, path in zip(titles, (first, second), strict=True) if path and path.exists()]
    lines = [ADVICE] if tables else []
    for title, path in tables:
        lines += advice_section(title, pl.read_parquet(path))
    return lines


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=Path, required=True, help="feature table of the first simulator, fresh seed")
    parser.add_argument("--second", type=Path, required=True, help="feature table of the second simulator")
    parser.add_argument("--recorded", type=Path, help="feature table of the recorded loops")
    parser.add_argument("--kinds", type=Path, help="feature table of the kinds of the first simulator, fresh seed")
    parser.add_argument("--second-kinds", type=Path, help="feature table of the kinds of the second simulator")
    parser.add_argument("--prior", type=float, default=0.25)
    given = parser.parse_args()
    pictures = ROOT / "docs" / "pictures"
    lines = [HEAD]
    lines += simulated_section("First simulator, fresh seed", pl.read_parquet(given.first), given.prior,
                               pictures / "validation-first.svg")  # fmt: skip
    lines += simulated_section("Second simulator", pl.read_parquet(given.second), given.prior,
                               pictures / "validation-second.svg")  # fmt: skip
    if given.recorded and given.recorded.exists():
        lines += recorded_section(pl.read_parquet(given.recorded), given.prior)
    else:
        lines += ["## Recorded loops", "", "Left out: no records were at hand.", ""]
    lines += advice_lines(given.kinds, given.second_kinds)
    choices = json.loads((ROOT / "calibration" / "choices.json").read_text(encoding="utf-8"))
    listed = "\n".join(f"{k}. {text}" for k, text in enumerate(choices, 1)) or "None."
    lines += [CHOICES.format(count=len(choices), choices=listed), model_section()]
    ablation = ROOT / "calibration" / "ablation.md"
    if ablation.exists():
        lines.append(ablation.read_text(encoding="utf-8"))
    (ROOT / "docs" / "validation.md").write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


def model_section() -> str:
    """The model card: features, signs and how much each is used."""
    model = stiction_model()
    used = {name: [0, 0.0] for name in model.features}
    for tree in model.trees:
        for node in tree:
            if node.feature:
                used[node.feature][0] += 1
                used[node.feature][1] += abs(tree[node.left].value - tree[node.right].value)
    lines = ["## The model", "", f"{len(model.trees)} trees, trained on {json.dumps(model.provenance)}.", "",
             "| feature | meaning | formula | sign | splits | sum of steps |", "|---|---|---|---|---|---|"]  # fmt: skip
    for feature in FEATURES:
        count, size = used[feature.name]
        lines.append(
            f"| {feature.name} | {feature.label} | {feature.formula} | {'+' if feature.sign > 0 else '-'} | {count} | "
            f"{size:.2f} |"
        )
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    main()
