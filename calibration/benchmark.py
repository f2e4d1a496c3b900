"""Score the published detection methods beside the verdict and write docs/benchmark.md: part of ``make validate``."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from calibration.curve_svg import roc_svg
from calibration.train import trainable, weights_of
from calibration.validate import model_probabilities
from stiction.diagnosis.detection import FACTS
from stiction.diagnosis.verdict.decision import decide

if TYPE_CHECKING:
    from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[1]
ALARM_RATES = (1, 2, 5)
"""False alarms at which methods are compared [% of the good loops]."""
README_RATE = 2
"""The one that stands in the README [%]."""
OURS = "verdict"
"""Name of the probability of stiction in tables and pictures."""
HEAD = """# Benchmark

How many sticky valves the [verdict](understand/verdict.md) finds, and how many each of the ten [published
methods](understand/methods.md) finds, on the same loops. `make validate` writes this page (`calibration/benchmark.py`)
from the loops of the [validation](validation.md); none of them was used for training. The methods run as their sources
describe them, and each is scored where its own conditions hold: most need a regular oscillation of four cycles or more
and a certain kind of process.

*Accepted* is the share of the loops that a method accepts. *AUC* is the probability that a sticky loop gets a higher
index than a good one, 0.5 being chance. *Own threshold* gives the sticky loops found and the good loops called sticky
at the threshold that the source recommends. *Found at 1, 2, 5 %* is the share of all sticky loops found when the
threshold is set so that 1, 2 or 5 % of all good loops are called sticky; a loop that a method does not accept is not
called sticky. A good loop with deadband alone counts a fifth, as in the validation.
"""
PUBLISHED = """### Published results on the same data

Results of others on larger parts of the same two collections; the loops are not all those of the table above.

| data | loops | method | right | source |
|---|---|---|---|---|
| International Stiction Data Base | 20 | the best single rule | 17 | [1] |
| International Stiction Data Base | 20 | to answer "stiction" always | 13 | [1] |
| refinery | 80 records of 34 loops | grid search of a vendor's product, index above 0.5 | 73 records | [2] |

The index of the vendor is stored with the refinery records; its AUC over the records is 0.93. 23 of the 35 sticky
records are of one valve.

1. M. Jelali, B. Huang (eds.), *Detection and Diagnosis of Stiction in Control Loops*, Springer, 2010, and the
   benchmark of 20 loops that later work took from its data base.
2. Xue, Shang, Huang, Huang, records and labels published with *StictionGPT*, 2025 (Apache-2.0); counted from the index
   in the names of the files.
"""


@dataclass(frozen=True, slots=True)
class MethodScores:
    """How well an index separates sticky from good loops."""

    accepted: float
    """Share of the loops that the method accepts [-]."""
    auc: float
    """Area under the curve on these loops [-]; NaN when only one kind is among them."""
    found: float
    """Share of the accepted sticky loops above the threshold of the method [-]."""
    alarms: float
    """Share of the accepted good loops above it [-]."""
    curve: NDArray[np.float64]
    """False alarms and sticky loops found, of all loops [-], shape (n_points, 2)."""

    def found_at(self, alarms: float) -> float:
        """Share of all sticky loops found at no more than a share of false alarms [-]."""
        return float(self.curve[self.curve[:, 0] <= alarms + 1e-12, 1].max())


def score_index(sticky: NDArray[np.bool_], index: NDArray[np.float64], weights: NDArray[np.float64]) -> MethodScores:
    """Score an index against the truth.

    Parameters
    ----------
    sticky : ndarray of bool, shape (n_loops,)
        Whether the valve of each loop sticks.
    index : ndarray, shape (n_loops,)
        Index, above 0 for stiction [-]; NaN where the method does not accept the loop.
    weights : ndarray, shape (n_loops,)
        Weights of the loops [-].

    Returns
    -------
    MethodScores
        The scores.

    Examples
    --------
    >>> sticky = np.array([True, True, True, False, False])
    >>> scores = score_index(sticky, np.array([3.0, 1.0, np.nan, 2.0, -1.0]), np.ones(5))
    >>> scores.accepted, scores.auc, scores.found_at(0.0), scores.found_at(0.5)
    (0.8, 0.75, 0.3333333333333333, 0.6666666666666666)
    """
    from sklearn.metrics import roc_auc_score

    accepted = np.isfinite(index)
    bad, good = weights * sticky, weights * ~sticky
    levels = np.unique(index[accepted])[::-1]
    called = index[accepted] >= levels[:, None]
    curve = np.column_stack([called @ good[accepted] / good.sum(), called @ bad[accepted] / bad.sum()])
    has_both = 0 < sticky[accepted].sum() < accepted.sum()
    auc = roc_auc_score(sticky[accepted], index[accepted], sample_weight=weights[accepted]) if has_both else np.nan
    above = accepted & (index >= 0.0)
    return MethodScores(
        float(weights[accepted].sum() / weights.sum()), float(auc), _share(bad[above], bad[accepted]),
        _share(good[above], good[accepted]), np.vstack([np.zeros((1, 2)), curve]),
    )  # fmt: skip


def _share(part: NDArray[np.float64], whole: NDArray[np.float64]) -> float:
    return float(part.sum() / whole.sum()) if whole.sum() > 0.0 else np.nan


def score_methods(table: pl.DataFrame, probability: NDArray[np.float64], weights: NDArray) -> dict[str, MethodScores]:
    """Scores of the verdict, then of every method."""
    sticky = table["sticky"].to_numpy()
    limit = next(p for p in np.linspace(0.0, 1.0, 1001) if decide(p) == "stiction")
    indices = {OURS: probability - limit} | {
        name: table[f"m_{name}"].cast(pl.Float64).fill_null(np.nan).to_numpy() for name in FACTS
    }
    return {name: score_index(sticky, index, weights) for name, index in indices.items()}


def score_ours_where_accepted(table: pl.DataFrame, probability: NDArray, weights: NDArray) -> dict[str, float]:
    """AUC of the verdict on the loops that each method accepts [-]."""
    found: dict[str, float] = {}
    for name in FACTS:
        index = np.where(table[f"m_{name}"].is_not_null().to_numpy(), probability, np.nan)
        found[name] = score_index(table["sticky"].to_numpy(), index, weights).auc
    return found


def simulated_section(title: str, table: pl.DataFrame, prior: float, picture: Path) -> list[str]:
    """Text about a simulated population, with its picture."""
    judged = trainable(table)
    probability, weights = model_probabilities(judged, prior), weights_of(judged, prior)
    scores = score_methods(judged, probability, weights)
    count, rate = int(judged["sticky"].sum()), README_RATE
    best = max(FACTS, key=lambda name: scores[name].found_at(rate / 100.0))
    curves = {name.replace("_", " "): 100.0 * scores[name].curve for name in scores}
    picture.write_text(roc_svg(f"{title}: all loops", curves), encoding="utf-8")
    spread = 100.0 * np.sqrt(0.25 / count)
    return [
        f"## {title}", "",
        f"{judged.height} loops, {count} of them sticky; a share of the sticky loops is good to {spread:.0f} %.", "",
        f"At {rate} % false alarms the verdict finds **{_percent(scores[OURS].found_at(rate / 100.0))}** of the sticky "
        f"loops, the best published method, `{best}`, **{_percent(scores[best].found_at(rate / 100.0))}**.", "",
        *score_table(scores, score_ours_where_accepted(judged, probability, weights)), "",
        f"![Sticky loops found over false alarms: {title}]({picture.relative_to(ROOT / 'docs').as_posix()})", "",
    ]  # fmt: skip


def score_table(
    scores: dict[str, MethodScores], ours: dict[str, float], rates: tuple[int, ...] = ALARM_RATES
) -> list[str]:
    """Scores as a Markdown table, with the sticky loops found at some rates of false alarms [%]."""
    names = ["method", "accepted", "AUC", "AUC of the verdict on these loops", "own threshold: found", "false alarms"]
    names += [f"found at {rate} %" for rate in rates]
    rows = [names, ["---"] * len(names)]
    for name, one in scores.items():
        shares = [one.accepted, one.found, one.alarms, *(one.found_at(rate / 100.0) for rate in rates)]
        accepted, *calls = [f"{100.0 * share:.0f} %" if np.isfinite(share) else "-" for share in shares]
        areas = [f"{area:.2f}" if np.isfinite(area) else "-" for area in (one.auc, ours.get(name, one.auc))]
        rows.append([f"`{name}`" if name in FACTS else f"**{name}**", accepted, *areas, *calls])
    return ["| " + " | ".join(row) + " |" for row in rows]


def recorded_section(table: pl.DataFrame, prior: float) -> list[str]:
    """Text about the recorded loops: every loop counts one, however many records it has."""
    judged = table.filter(pl.col("state") == "in_control")
    weights = judged.select(1.0 / pl.len().over("loop")).to_series().to_numpy()
    probability = model_probabilities(judged, prior)
    scores = score_methods(judged, probability, weights)
    loops = judged.group_by("loop").agg(pl.col("sticky").first())
    return [
        "## Recorded loops", "",
        f"{loops.height} loops of the International Stiction Data Base and of a refinery, {loops['sticky'].sum()} of",
        "them sticky. With so few loops a share is good to about 15 %.", "",
        *score_table(scores, score_ours_where_accepted(judged, probability, weights), rates=()), "", PUBLISHED,
    ]  # fmt: skip


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=Path, required=True, help="feature table of the first simulator, fresh seed")
    parser.add_argument("--second", type=Path, required=True, help="feature table of the second simulator")
    parser.add_argument("--recorded", type=Path, help="feature table of the recorded loops")
    parser.add_argument("--prior", type=float, default=0.25)
    given = parser.parse_args()
    pictures = ROOT / "docs" / "pictures"
    lines = [HEAD]
    for title, path, picture in (
        ("First simulator, fresh seed", given.first, "benchmark-first.svg"),
        ("Second simulator", given.second, "benchmark-second.svg"),
    ):
        lines += simulated_section(title, pl.read_parquet(path), given.prior, pictures / picture)
    if given.recorded and given.recorded.exists():
        lines += recorded_section(pl.read_parquet(given.recorded), given.prior)
    (ROOT / "docs" / "benchmark.md").write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
