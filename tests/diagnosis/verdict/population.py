"""Verdicts on simulated loops whose truth is known: what the acceptance tests count, and a table of it.

Run as a script: python tests/diagnosis/verdict/population.py --loops 140 --seed 7 --causes stiction deadband --jobs 2
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from dataclasses import asdict, dataclass
from functools import cache
from itertools import islice
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import stiction as st
from calibration.populations import (
    CAUSES,
    plant_population,
    population,
    two_fault_population,
    upset_population,
    wandering_population,
)
from stiction.diagnosis.verdict.cause import HIDING

OTHERS = ("deadband", "tight tuning", "external disturbance", "sensor", "saturation")
"""Causes other than stiction for which a loop oscillates or moves."""
CLOSE = 0.10
"""Relative error of S that is still right [-]."""
SURE = 0.9
"""Probability beyond which a verdict is confident [-]."""
BINS = 10


class Called:
    """How a verdict stands to the truth."""

    sticky: bool
    verdict: str

    @property
    def right(self) -> bool:
        return self.verdict == ("stiction" if self.sticky else "no_stiction")

    @property
    def undecided(self) -> bool:
        return self.verdict == "undecided"


@dataclass(frozen=True)
class Judged(Called):
    """Truth and verdict of one loop."""

    tag: str
    truth: str
    kind: str
    effects: tuple[str, ...]
    S: float
    visible: bool
    samples: int
    seconds: float
    verdict: str
    cause: str
    probability: float
    refused: bool
    S_found: float
    S_low: float
    S_high: float
    own_samples: bool
    rebuilt: bool
    position: str
    position_used: bool
    S_detectable: float

    @property
    def sticky(self) -> bool:
        return self.truth == "stiction"

    @property
    def named(self) -> bool:
        return self.cause == self.truth

    @property
    def S_error(self) -> float:
        """Relative error of S [-]; infinity where none was found."""
        return abs(self.S_found / self.S - 1.0) if np.isfinite(self.S_found) else np.inf

    @property
    def denied(self) -> bool:
        """Whether it is said that a valve with this S would have shown."""
        return self.verdict == "no_stiction" and self.cause not in HIDING and self.S_detectable <= self.S

    @property
    def S_close(self) -> bool:
        return self.S_error <= CLOSE

    def __str__(self) -> str:
        found = f"{self.verdict} ({self.cause}) {self.probability:.2f}"
        S = f", S {self.S:.2f} found {self.S_found:.2f} ({self.S_low:.2f} to {self.S_high:.2f})" if self.S else ""
        truth = ", ".join(filter(None, (self.truth, self.kind, *self.effects)))
        return f"{self.tag} {truth}: {found}{S}, {self.samples} samples"


def jump_shows(case) -> bool:
    """Whether the slip jump stands out of the noise: J above the random load, and its PV above the noise of the PV."""
    if not case.J > 0.0 or not np.isfinite(case.period):
        return False
    gain = abs(complex(case.loop.process.at(2j * np.pi / case.period)))
    return case.load < case.J and case.J * gain > case.noise


def judge(case) -> Judged:
    """Diagnose one case of a population."""
    start = time.process_time()
    found = st.diagnose(case.record)
    seconds = time.process_time() - start
    valve = found.identification
    S = (valve.S, valve.S_low, valve.S_high) if valve is not None else (np.nan,) * 3
    return Judged(
        case.record.tag, case.cause, case.kind, case.effects, case.S, jump_shows(case), len(case.record), seconds,
        found.verdict, found.cause, found.probability, valve is None, *S, valve is not None and valve.own_samples,
        valve is not None and valve.rebuilt, case.position,
        any(row.method == "stem" and row.valid for row in found.evidence),
        valve.S_detectable if valve is not None else np.nan,
    )  # fmt: skip


@cache
def judged(
    n: int,
    causes: tuple[str, ...],
    seed: int,
    longest: int | None = None,
    jobs: int = 1,
    *,
    position: bool = False,
    samples: tuple[int, int] | None = None,
) -> tuple[Judged, ...]:
    """Diagnose `n` loops of a population, or its first `n` that have at most `longest` samples.

    Causes come in turn, so with `longest` each cause takes its own population: `n` is then dealt out evenly.
    """
    if longest is None:
        return tuple(each(judge, population(n, causes, seed, position=position, samples=samples), jobs, n))
    rows: list[Judged] = []
    for k, cause in enumerate(causes):
        drawn = population(100 * n, (cause,), seed + k, position=position, samples=samples)
        short = (case for case in drawn if len(case.record) <= longest)
        share = n // len(causes) + (k < n % len(causes))
        rows += each(judge, islice(short, share), jobs, share)
    return tuple(rows)


APART = {
    "plant": plant_population, "upsets": upset_population, "wandering": wandering_population,
    "two-faults": two_fault_population,
}  # fmt: skip
"""Populations that draw all by themselves."""


def judged_apart(kind: str, n: int, seed: int, jobs: int = 1) -> tuple[Judged, ...]:
    """Diagnose `n` loops of one of these."""
    return tuple(each(judge, APART[kind](n, seed), jobs, n))


def each(work, things, jobs: int, n: int):
    """`work` on each thing, in their order, by `jobs` processes; says how far it is on a terminal."""
    import sys

    pool = get_context("fork").Pool(jobs) if jobs > 1 else None
    try:
        for k, row in enumerate(pool.imap(work, things, chunksize=4) if pool else map(work, things)):
            if sys.stderr.isatty():
                print(f"\r{k + 1} of {n}", end="", file=sys.stderr)
            yield row
    finally:
        if pool:
            pool.terminate()


def listed(rows) -> str:
    """One row a line, for a test's message."""
    return "".join(f"\n  {row}" for row in rows)


def confusion(rows) -> dict[str, dict[str, int]]:
    """True cause -> cause named -> loops; where the data do not decide that is `unknown`."""
    return {
        truth: dict(Counter(r.cause for r in rows if r.truth == truth))
        for truth in CAUSES
        if any(r.truth == truth for r in rows)
    }


def balanced_accuracy(rows) -> float:
    """Mean over the true causes of the share that is named right [-]; `unknown` counts as wrong."""
    return float(np.mean([found.get(truth, 0) / sum(found.values()) for truth, found in confusion(rows).items()]))


def reliability(rows) -> list[dict[str, float]]:
    """For each tenth of probability: loops, mean probability told, share that is sticky."""
    told, true = np.array([r.probability for r in rows]), np.array([r.sticky for r in rows], dtype=float)
    bins = np.minimum((told * BINS).astype(int), BINS - 1)
    return [
        {"from": b / BINS, "loops": int(own.sum()), "told": float(told[own].mean()), "sticky": float(true[own].mean())}
        for b in range(BINS)
        if (own := bins == b).any()
    ]


def calibration_error(rows) -> float:
    """Mean distance of the probability told from the share that is sticky, over ten bins weighted by loops [-]."""
    return sum(b["loops"] * abs(b["told"] - b["sticky"]) for b in reliability(rows)) / len(rows) if rows else np.nan


def share(flags) -> float:
    """Share of True [-]; NaN of nothing."""
    flags = list(flags)
    return sum(flags) / len(flags) if flags else np.nan


def measures(rows) -> dict[str, object]:
    """Everything that issue 5 asks of the population."""
    sticky, rest = [r for r in rows if r.sticky], [r for r in rows if not r.sticky]
    found = [r for r in sticky if np.isfinite(r.S_found)]
    visible = [r for r in sticky if r.visible]
    alarms = [r for r in rest if r.probability > SURE]
    seconds = np.array([r.seconds for r in rows])
    return {
        "loops": len(rows),
        "balanced_accuracy": balanced_accuracy(rows),
        "calibration_error": calibration_error(rows),
        "calibration_error_of_the_judged": calibration_error([r for r in rows if not r.refused]),
        "S_close_of_the_visible": share(r.S_close for r in visible),
        "S_close_of_the_visible_and_judged": share(r.S_close for r in visible if not r.refused),
        "visible": len(visible),
        "interval_holds_S": share(r.S_low <= r.S <= r.S_high for r in found),
        "confident_false_alarms": share(r.probability > SURE for r in rest),
        "confident_false_alarms_by_cause": dict(Counter(r.truth for r in alarms)),
        "confident_misses": share(r.probability < 1.0 - SURE for r in sticky),
        "sticky_told": share(r.right for r in sticky),
        "others_told": share(r.right for r in rest),
        "detectable": sum(r.S_detectable <= r.S for r in sticky),
        "detectable_and_told": sum(r.right for r in sticky if r.S_detectable <= r.S),
        "detectable_and_denied": sum(r.denied for r in sticky),
        "undecided": share(r.undecided for r in rows),
        "refused": share(r.refused for r in rows),
        "wrong_verdict": share(not r.right and not r.undecided for r in rows),
        "seconds_median": float(np.median(seconds)),
        "seconds_longest": float(seconds.max()),
        "confusion": confusion(rows),
        "reliability": reliability(rows),
    }


def table(rows) -> str:
    """The measures in words and columns."""
    found = measures(rows)
    given = [*CAUSES, "unknown"]
    out = [f"{'truth':22}{'n':>5}" + "".join(f"{name[:9]:>11}" for name in given)]
    for truth, counts in confusion(rows).items():
        out.append(f"{truth:22}{sum(counts.values()):5}" + "".join(f"{counts.get(name, 0):11}" for name in given))
    out += ["", f"{'probability':>12}{'loops':>7}{'told':>7}{'sticky':>8}"]
    out += [f"{b['from']:>12.1f}{b['loops']:>7}{b['told']:>7.2f}{b['sticky']:>8.2f}" for b in reliability(rows)]
    errors = 100.0 * np.array([r.S_error for r in rows if r.sticky and r.visible])
    if errors.size:
        quantiles = np.quantile(errors, (0.5, 0.75, 0.9, 0.95), method="inverted_cdf")
        steps = ", ".join(f"{q} {e:.1f}" for q, e in zip((50, 75, 90, 95), quantiles, strict=True))
        out += ["", f"error of S where J shows [%]: {steps}", "", by_sampling(rows)]
    out += ["", *(f"{name}: {x:.3f}" if isinstance(x, float) else f"{name}: {x}" for name, x in found.items())][:-2]
    return "\n".join(out)


def by_position(rows) -> str:
    """What recorded positions do: each kind of them, and S by whether the record shows the controller's samples."""
    out = ["", f"{'position':14}{'loops':>7}{'used':>7}{'right':>7}"]
    for kind in sorted({r.position for r in rows}):
        own = [r for r in rows if r.position == kind]
        out.append(f"{kind:14}{len(own):7}{sum(r.position_used for r in own):7}{sum(r.right for r in own):7}")
    used = [r for r in rows if r.sticky and r.position_used and not r.refused]
    groups = {"own samples": True, "slower": False}
    named = {name: [r for r in used if r.own_samples is own] for name, own in groups.items()}
    return "\n".join([*out, "", sizes("sticky, used", named)])


def by_sampling(rows) -> str:
    """S where J shows, by whether the record shows the controller's own samples and whether a historian touched it."""
    groups: dict[str, list[Judged]] = {
        "own samples": [], "own, touched": [], "rebuilt": [], "slower": [], "refused": [],
    }  # fmt: skip
    for r in rows:
        if r.sticky and r.visible:
            own = "own, touched" if r.effects else "own samples"
            slower = "rebuilt" if r.rebuilt else "slower"
            groups["refused" if r.refused else own if r.own_samples else slower].append(r)
    return sizes("J shows", groups)


def sizes(title: str, groups: dict[str, list[Judged]]) -> str:
    """How near S is in each group, and how often its interval holds the true one."""
    out = [f"{title:14}{'loops':>7}{'found':>7}{'S 5 %':>7}{'S 10 %':>7}{'held':>7}"]
    for name, own in groups.items():
        held = (r.S_low <= r.S <= r.S_high for r in own)
        counts = (r.right for r in own), (r.S_error <= 0.05 for r in own), (r.S_close for r in own), held
        out.append(f"{name:14}{len(own):7}" + "".join(f"{sum(count):7}" for count in counts))
    return "\n".join(out)


def main() -> None:
    parser = argparse.ArgumentParser(description="Diagnose a simulated population and count.")
    parser.add_argument("--loops", type=int, default=70)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--causes", nargs="+", choices=CAUSES, default=CAUSES)
    parser.add_argument("--longest", type=int, help="only records of at most so many samples")
    parser.add_argument("--samples", type=int, nargs=2, help="fewest and most samples cut out of each record")
    parser.add_argument("--position", action="store_true", help="with the valve's position as it is reported")
    apart = parser.add_mutually_exclusive_group()
    for kind, what in {
        "plant": "loops as a plant's historian keeps them",
        "upsets": "loops that rest until something upsets them",
        "wandering": "loops that a wave of a wandering period moves",
        "two-faults": "loops with a sticky valve and a second fault",
    }.items():
        apart.add_argument(f"--{kind}", action="store_const", dest="apart", const=kind, help=what)
    parser.add_argument("--wrong", action="store_true", help="list what is wrong, or S beyond 10 %% though J shows")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--json", type=Path, help="write measures and rows to this file")
    chosen = parser.parse_args()
    causes = tuple(chosen.causes)
    if chosen.apart and (causes != CAUSES or chosen.longest or chosen.position or chosen.samples):
        parser.error(f"--{chosen.apart} draws all by itself: leave out --causes, --longest, --position, --samples")
    samples = tuple(chosen.samples) if chosen.samples else None
    if chosen.apart:
        rows = judged_apart(chosen.apart, chosen.loops, chosen.seed, chosen.jobs)
    else:
        rows = judged(
            chosen.loops, causes, chosen.seed, chosen.longest, chosen.jobs, position=chosen.position, samples=samples
        )
    print(table(rows))
    if chosen.position:
        print(by_position(rows))
    if chosen.wrong:
        print(listed(row for row in rows if not row.named or (row.visible and row.sticky and not row.S_close)))
    if chosen.json:
        told = {"seed": chosen.seed, **measures(rows), "rows": [asdict(row) for row in rows]}
        chosen.json.write_text(json.dumps(told, indent=1))


if __name__ == "__main__":
    main()
