"""Count how often each method's vote agrees with the truth: on labelled records and on a simulated population.

python tests/diagnosis/detection/score.py ../shared/data [--loops 60] [--seed 7]

Every loop weighs one, however many records it has. Votes that are not valid are left out. `area` is the area under the
curve of hits against false alarms as the threshold moves: what the index knows, wherever the threshold stands.
Sources' thresholds are used as they are; nothing here is fitted to the records.
"""

from __future__ import annotations

import argparse
import csv
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import stiction as st
from calibration.populations import population
from stiction.diagnosis.detection import FACTS, detect_all
from stiction.diagnosis.oscillation import find_oscillation

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from stiction.records.record import LoopRecord

LEFT_OUT = "deadband"  # a fault of the valve, yet not what the methods were made for
READ_AS = {"concentration": "analyser"}


class Sample(NamedTuple):
    """A record, whether its valve sticks, and what it weighs."""

    record: LoopRecord
    sticky: bool
    weight: float


class Score(NamedTuple):
    """How a method did."""

    method: str
    valid: float
    """Share of the loops for which its condition is met."""
    hits: float
    """Share of the sticky loops among them that it calls sticky."""
    alarms: float
    """Share of the others among them that it calls sticky."""
    open: float
    """Share among them on which it is undecided."""
    area: float
    """Area under the curve of hits against false alarms; 0.5 is chance."""


def labelled(folder: Path) -> list[Sample]:
    """Records of `labels.csv`."""
    with (folder / "labels.csv").open() as file:
        rows = list(csv.DictReader(file))
    many = Counter(row["group"] for row in rows)
    return [
        Sample(
            st.read(folder / row["file"], loop_type=READ_AS.get(row["loop_type"], row["loop_type"]))[0],
            row["label"] == "stiction",
            1.0 / many[row["group"]],
        )
        for row in rows
    ]


def simulated(loops: int, seed: int) -> list[Sample]:
    """Cases of the population."""
    return [Sample(case.record, case.sticky, 1.0) for case in population(loops, seed=seed) if case.cause != LEFT_OUT]


def score(samples: Sequence[Sample]) -> list[Score]:
    """Every method, and the majority of those that are valid and decided."""
    sticky = np.array([sample.sticky for sample in samples])
    weight = np.array([sample.weight for sample in samples])
    tables = [detect_all(sample.record, find_oscillation(sample.record)) for sample in samples]
    index = np.array([[row.index - row.threshold for row in rows] for rows in tables])
    valid = np.array([[row.valid for row in rows] for rows in tables])
    vote = np.array([[{"stiction": 1, "no_stiction": -1}.get(row.vote, 0) for row in rows] for rows in tables])
    scores = [_one(method, sticky, weight, valid[:, k], vote[:, k], index[:, k]) for k, method in enumerate(FACTS)]
    balance = (vote * valid).sum(axis=1)
    return [*scores, _one("majority", sticky, weight, valid.any(axis=1), np.sign(balance), balance)]


def _one(method, sticky, weight, valid, vote, index) -> Score:
    yes, no = valid & sticky, valid & ~sticky
    return Score(
        method,
        float(weight[valid].sum() / weight.sum()),
        _share(weight, yes, vote > 0),
        _share(weight, no, vote > 0),
        _share(weight, valid, vote == 0),
        _area(index[yes], weight[yes], index[no], weight[no]),
    )


def _share(weight, among, which) -> float:
    return float(weight[among & which].sum() / weight[among].sum()) if among.any() else float("nan")


def _area(yes, of_yes, no, of_no) -> float:
    """Chance that a sticky loop's index is above another's, ties by halves."""
    if not (yes.size and no.size):
        return float("nan")
    above = (yes[:, None] > no[None, :]) + 0.5 * (yes[:, None] == no[None, :])
    return float(of_yes @ above @ of_no / (of_yes.sum() * of_no.sum()))


def table(scores: Iterable[Score]) -> str:
    """As Markdown."""
    lines = ["| method | valid | sticky called sticky | others called sticky | undecided | area |", "|---|---|---|---|---|---|"]  # fmt: skip  # noqa: E501
    for one in scores:
        shares = " | ".join(f"{100.0 * x:.0f} %" if np.isfinite(x) else "-" for x in one[1:5])
        lines.append(f"| `{one.method}` | {shares} | {f'{one.area:.2f}' if np.isfinite(one.area) else '-'} |")
    return "\n".join(lines)


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("folder", type=Path)
    ask.add_argument("--loops", type=int, default=60)
    ask.add_argument("--seed", type=int, default=7)
    given = ask.parse_args()
    for name, samples in (
        ("labelled records", labelled(given.folder)),
        (f"population, {given.loops} loops, seed {given.seed}", simulated(given.loops, given.seed)),
    ):
        loops = sum(sample.weight for sample in samples)
        bad = sum(sample.weight for sample in samples if sample.sticky)
        print(f"\n{name}: {loops:.0f} loops, {bad:.1f} sticky\n\n{table(score(samples))}")


if __name__ == "__main__":
    main()
