"""Verdicts on simulated loops whose truth is known: what the acceptance tests count, and a table of it.

Run as a script: python tests/diagnosis/verdict/population.py --loops 120 --seed 7 --causes stiction deadband
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from dataclasses import dataclass
from functools import cache
from itertools import islice

import numpy as np

import stiction as st
from stiction.simulation.population import CAUSES, population

OTHERS = ("deadband", "tight tuning", "external disturbance", "sensor")
"""Causes other than stiction for which a loop oscillates."""
CLOSE = 0.15
"""Relative error of S that is still right [-]."""


@dataclass(frozen=True)
class Judged:
    """Truth and verdict of one loop."""

    tag: str
    truth: str
    S: float
    samples: int
    seconds: float
    verdict: str
    cause: str
    probability: float
    S_found: float
    S_low: float
    S_high: float

    @property
    def right(self) -> bool:
        return self.verdict == ("stiction" if self.truth == "stiction" else "no_stiction")

    @property
    def named(self) -> bool:
        return self.right and self.cause == self.truth

    @property
    def S_error(self) -> float:
        """Relative error of S [-]; infinity where none was found."""
        return abs(self.S_found / self.S - 1.0) if np.isfinite(self.S_found) else np.inf

    @property
    def S_close(self) -> bool:
        return self.S_error <= CLOSE

    def __str__(self) -> str:
        found = f"{self.verdict} ({self.cause}) {self.probability:.2f}"
        S = f", S {self.S:.2f} found {self.S_found:.2f}" if self.S else ""
        return f"{self.tag} {self.truth}: {found}{S}, {self.samples} samples"


def judge(case) -> Judged:
    """Diagnose one case of a population."""
    start = time.process_time()
    found = st.diagnose(case.record)
    seconds = time.process_time() - start
    valve = found.identification
    S = (valve.S, valve.S_low, valve.S_high) if valve is not None else (np.nan,) * 3
    truth = getattr(case.loop.valve, "S", 0.0)
    record = case.record
    return Judged(
        record.tag, case.cause, truth, len(record), seconds, found.verdict, found.cause, found.probability, *S
    )


@cache
def judged(n: int, causes: tuple[str, ...], seed: int, longest: int | None = None) -> tuple[Judged, ...]:
    """Diagnose `n` loops of a population, or its first `n` that have at most `longest` samples.

    Causes come in turn, so with `longest` each cause takes its own population: `n` is then dealt out evenly.
    """
    if longest is None:
        return tuple(judge(case) for case in population(n, causes, seed))
    rows = []
    for k, cause in enumerate(causes):
        short = (case for case in population(100 * n, (cause,), seed + k) if len(case.record) <= longest)
        share = n // len(causes) + (k < n % len(causes))
        rows += [judge(case) for case in islice(short, share)]
    return tuple(rows)


def listed(rows) -> str:
    """One row a line, for a test's message."""
    return "".join(f"\n  {row}" for row in rows)


def table(rows) -> str:
    """Verdict and named cause by true cause, errors and intervals of S, calibration."""
    out = [f"{'truth':22}{'n':>5}{'right':>7}{'named':>7}{'undecided':>11}{'wrong >0.9':>12}  causes given"]
    for truth in CAUSES:
        own = [row for row in rows if row.truth == truth]
        if not own:
            continue
        sure = sum(not r.right and r.verdict != "undecided" and abs(r.probability - 0.5) > 0.4 for r in own)
        given = ", ".join(f"{name} {count}" for name, count in Counter(r.cause for r in own).most_common())
        out.append(
            f"{truth:22}{len(own):5}{sum(r.right for r in own):7}{sum(r.named for r in own):7}"
            f"{sum(r.verdict == 'undecided' for r in own):11}{sure:12}  {given}"
        )
    sticky = [row for row in rows if row.truth == "stiction"]
    if sticky:
        errors = 100.0 * np.array([row.S_error for row in sticky])
        quantiles = np.quantile(errors, (0.5, 0.75, 0.9, 0.95), method="inverted_cdf")
        inside = sum(row.S_low <= row.S <= row.S_high for row in sticky)
        out += [
            "",
            "error of S [%]: " + ", ".join(f"{q} {e:.1f}" for q, e in zip((50, 75, 90, 95), quantiles, strict=True)),
            f"S within 15 %: {sum(r.S_close for r in sticky)} of {len(sticky)}, "
            f"and verdict right: {sum(r.S_close and r.right for r in sticky)}",
            f"95 % interval holds S: {inside} of {len(sticky)}",
        ]
    told = np.array([row.probability for row in rows])
    true = np.array([row.truth == "stiction" for row in rows], dtype=float)
    bins = np.minimum((told * 10).astype(int), 9)
    error = sum(abs(float(np.sum(told[bins == b] - true[bins == b]))) for b in range(10)) / len(rows)
    seconds = np.array([row.seconds for row in rows])
    out += [
        f"expected calibration error (10 bins): {error:.3f}",
        f"CPU per diagnosis [s]: median {np.median(seconds):.2f}, longest {seconds.max():.2f}",
    ]
    return "\n".join(out)


def main() -> None:
    parser = argparse.ArgumentParser(description="Diagnose a simulated population and count.")
    parser.add_argument("--loops", type=int, default=60)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--causes", nargs="+", choices=CAUSES, default=CAUSES)
    parser.add_argument("--longest", type=int, help="only records of at most so many samples")
    parser.add_argument("--wrong", action="store_true", help="list what is wrong or S beyond 15 %%")
    chosen = parser.parse_args()
    rows = judged(chosen.loops, tuple(chosen.causes), chosen.seed, chosen.longest)
    print(table(rows))
    if chosen.wrong:
        print(listed(row for row in rows if not row.right or (row.truth == "stiction" and not row.S_close)))


if __name__ == "__main__":
    main()
