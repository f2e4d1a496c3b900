"""Tables of histories: one row for each window, with its truth and what the diagnosis of the window alone gives.

Run as a script: ``python -m calibration.history_table --simulator first --histories 600 --seed 31 --out h.parquet``.
Histories that stand in the folder of parts already are not computed again.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from calibration.histories import draw_history
from calibration.loop_sets import count_stem_turns

__all__ = ["history_rows", "history_table"]


def history_rows(task: tuple[str, int, int]) -> list[dict[str, Any]]:
    """Rows of one history, one for each window.

    Parameters
    ----------
    task : tuple of (str, int, int)
        Simulator, number of the history, seed.

    Returns
    -------
    list of dict
        Columns of the table; features are missing where the window cannot be judged.
    """
    from stiction.diagnosis import diagnose

    simulator, number, seed = task
    rows = []
    for k, (plan, window) in enumerate(draw_history(simulator, number, seed)):
        found = diagnose(window.record, methods=False)
        one = found.identification
        names = ("S", "S_low", "S_high", "J", "J_low", "J_high")
        evidence = None if found.response is None else found.response.evidence
        rows.append({
            "history": f"{simulator}-{seed}-{number}", "window": k, "fault": plan.fault, "course": plan.course,
            "stored": plan.stored, "sticky": window.sticky, "true_S": window.S, "true_J": window.J,
            "stem_turns": count_stem_turns(window.record.op, window.S, window.J), "samples": len(window.record),
            "state": found.loop_state.state, "probability": found.probability, "verdict": found.verdict,
            "S_detectable": found.S_detectable, "finding": found.finding,
            "op_range": float(np.ptp(found.segment.op)) if found.segment.op.size else 0.0,
            "oscillating": found.oscillation.oscillating, "amplitude_op": found.oscillation.amplitude_op,
            "evidence": None if evidence is None else evidence.tolist(),
            **{name: None if one is None else getattr(one, name) for name in names},
            **{f"x_{name}": value for name, value in found.features.items()},
            **{f"y_{name}": value for name, value in found.cause_features.items()},
            **{f"cause_{name}": value for name, value in found.oscillation_cause.to_dict().items()},
        })  # fmt: skip
    return rows


def history_table(simulator: str, numbers: range, seed: int, jobs: int, parts: Path) -> pl.DataFrame:
    """Compute the rows of numbered histories, each kept as a part so that a run goes on where it ended."""
    parts.mkdir(parents=True, exist_ok=True)
    tasks = [(simulator, number, seed) for number in numbers]
    files = {task: parts / f"{task[0]}-{task[2]}-{task[1]:04d}.parquet" for task in tasks}
    todo = [task for task in tasks if not files[task].exists()]
    with ProcessPoolExecutor(jobs) as pool:
        for task, rows in zip(todo, pool.map(history_rows, todo), strict=True):
            pl.DataFrame(rows, infer_schema_length=None).write_parquet(files[task])
    return pl.concat([pl.read_parquet(files[task]) for task in tasks], how="diagonal_relaxed")


def main() -> None:
    """Write a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--simulator", choices=("first", "second"), required=True)
    parser.add_argument("--histories", type=int, default=400)
    parser.add_argument("--seed", type=int, default=31)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    given.out.parent.mkdir(parents=True, exist_ok=True)
    parts = given.out.parent / "history-parts"
    table = history_table(given.simulator, range(given.histories), given.seed, given.jobs, parts)
    table.write_parquet(given.out)
    print(f"{table.height} windows of {given.histories} histories in {given.out}")


if __name__ == "__main__":
    main()
