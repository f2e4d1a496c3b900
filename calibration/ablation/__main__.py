"""Run the ablation, or make its table.

`python -m calibration.ablation run --jobs 16 --out DIR` writes one file a chunk of loops and can be stopped and started
again; `python -m calibration.ablation report --out DIR` refits the model and prints the table.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

OUT = Path(__file__).resolve().parents[1] / "out" / "ablation"


def main() -> None:
    """Read the command line."""
    ask = argparse.ArgumentParser(prog="python -m calibration.ablation", description=__doc__)
    verbs = ask.add_subparsers(dest="verb", required=True)
    run = verbs.add_parser("run", help="diagnose the loops with and without each part")
    run.add_argument("--out", type=Path, default=OUT, help="folder of the results")
    run.add_argument("--jobs", type=int, default=1, help="processes")
    run.add_argument("--loops", type=int, default=2000, help="loops of the first simulator, at least")
    run.add_argument("--second", type=int, default=400, help="loops of the second simulator, about")
    run.add_argument("--recorded", type=Path, help="folder with labels.csv and the recorded loops")
    run.add_argument("--seed", type=int, default=46, help="seed of the simulated loops")
    run.add_argument("--parts", choices=("all", "none"), default="all", help="none: only with all parts")
    run.add_argument("--seconds", type=float, default=float("inf"), help="start no chunk after so many seconds")
    run.add_argument("--pack", type=Path, help="put all results into one compressed file at the end")
    report = verbs.add_parser("report", help="refit the model and print the table")
    report.add_argument("--out", type=Path, default=OUT, help="folder of the results")
    report.add_argument("--resamples", type=int, default=2000, help="resamples of the paired bootstrap")
    report.add_argument("--save", type=Path, help="file for the table")
    asked = ask.parse_args()
    # Each process is one worker: libraries shall not start threads of their own.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    if asked.verb == "run":
        from calibration.ablation.run import run_ablation

        run_ablation(asked)
    else:
        from calibration.ablation.report import write_report

        write_report(asked.out, asked.resamples, asked.save)


if __name__ == "__main__":
    main()
