"""Tables of features: one row for each loop of known truth, computed by the package as it is.

Run as a script: ``python -m calibration.feature_table --sets population stored --chunks 40 --out t.parquet``. Chunks
that stand in the folder of parts already are not computed again.
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from calibration.loop_sets import FIRST_SIMULATOR, SETS, KnownLoop, draw_chunk, read_recorded_loops

__all__ = ["feature_row", "feature_table"]


def feature_row(loop: KnownLoop) -> dict[str, Any]:
    """Truth and features of one loop.

    Parameters
    ----------
    loop : KnownLoop
        A record with its truth.

    Returns
    -------
    dict
        Columns of the table; features are missing where the record cannot be judged.
    """
    from stiction.diagnosis import diagnose
    from stiction.diagnosis.identification.intervals import INTERVAL_FEATURES

    started = time.process_time()
    found = diagnose(loop.record)
    one = found.identification
    row: dict[str, Any] = {
        "loop": loop.loop, "sticky": loop.sticky, **loop.truth, "samples": len(loop.record),
        "cpu_s": time.process_time() - started, "state": found.loop_state.state, "probability": found.probability,
        "verdict": found.verdict, "oscillating": found.oscillation.oscillating,
        "S": None if one is None else one.S, "S_low": None if one is None else one.S_low,
        "S_high": None if one is None else one.S_high,
        "J": None if one is None else one.J,
        **{f"cause_{name}": value for name, value in found.oscillation_cause.to_dict().items()},
        **{f"x_{name}": value for name, value in found.features.items()},
        **{f"y_{name}": value for name, value in found.cause_features.items()},
        "finding": found.finding, "S_detectable": found.S_detectable,
        "op_range": float(np.ptp(found.segment.op)) if found.segment.op.size else 0.0,
        "amplitude_op": found.oscillation.amplitude_op,
        "evidence": None if found.response is None or found.response.evidence is None
        else found.response.evidence.tolist(),
        # Distance of each published method's index from its threshold; missing where the method does not apply.
        **{f"m_{method.method}": method.index - method.threshold for method in found.evidence if method.valid},
    }  # fmt: skip
    if one is not None:
        row |= {f"i_{name}": value for name, value in zip(INTERVAL_FEATURES, one.interval_features, strict=True)}
    return row


def _chunk_rows(task: tuple[str, int, int]) -> list[dict[str, Any]]:
    name, number, seed = task
    return [{"set": name, **feature_row(loop)} for loop in draw_chunk(name, number, seed)]


def feature_table(tasks: list[tuple[str, int, int]], jobs: int, parts: Path) -> pl.DataFrame:
    """Compute the rows of numbered chunks, each kept as a part so that a run goes on where it ended.

    Parameters
    ----------
    tasks : list of (str, int, int)
        Name of the set, number of the chunk, seed.
    jobs : int
        Processes.
    parts : Path
        Folder of the parts.

    Returns
    -------
    polars.DataFrame
        One row a loop.
    """
    parts.mkdir(parents=True, exist_ok=True)
    files = {task: parts / f"{task[0]}-{task[2]}-{task[1]:04d}.parquet" for task in tasks}
    todo = [task for task in tasks if not files[task].exists()]
    with ProcessPoolExecutor(jobs) as pool:
        for task, rows in zip(todo, pool.map(_chunk_rows, todo), strict=True):
            pl.DataFrame(rows, infer_schema_length=None).write_parquet(files[task])
    return pl.concat([pl.read_parquet(files[task]) for task in tasks], how="diagonal_relaxed")


def recorded_table(folder: Path) -> pl.DataFrame:
    """Rows of the recorded loops of a folder with labels."""
    rows = [{"set": "recorded", **feature_row(loop)} for loop in read_recorded_loops(folder)]
    return pl.DataFrame(rows, infer_schema_length=None)


def first_simulator_tasks(chunks: int, seed: int) -> list[tuple[str, int, int]]:
    """Chunks of all sets of the first simulator, half of the loops as a historian stores them."""
    return [(FIRST_SIMULATOR[k % len(FIRST_SIMULATOR)], k, seed) for k in range(chunks)]


def main() -> None:
    """Write a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", nargs="+", choices=SETS, help="sets to draw; all of the first simulator by default")
    parser.add_argument(
        "--recorded", type=Path, help="folder of recorded loops with labels.csv, instead of simulated ones"
    )
    parser.add_argument("--chunks", type=int, default=40, help="chunks of each set, or of the mixture")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    given.out.parent.mkdir(parents=True, exist_ok=True)
    if given.recorded:
        table = recorded_table(given.recorded)
    else:
        tasks = first_simulator_tasks(given.chunks, given.seed)
        if given.sets:
            tasks = [(name, k, given.seed) for name in given.sets for k in range(given.chunks)]
        table = feature_table(tasks, given.jobs, given.out.parent / "parts")
    table.write_parquet(given.out)
    print(f"{table.height} loops in {given.out}")


if __name__ == "__main__":
    main()
