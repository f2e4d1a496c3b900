"""Does the remedy that the twin recommends help the true loop? On simulated loops, identified from their records.

    python tests/compensation/population.py --loops 100 --seed 1 [--plain]

Each record is diagnosed, the remedies are tried on the twin of what was identified, and the one recommended until the
shutdown is put into the true loop, with seeds that the twin has not seen. Counted: loops whose PV standard deviation
falls; loops where it rises by more than 5 % although no risk of it was told; loops whose gain, the share by which
the deviation falls, was predicted within 25 % of the true one. With --plain only loops for which the twin has a model:
a Kano valve that always sticks, a PI, a record sampled as the controller is, and nothing done to it by a historian.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.compensation import compensate
from stiction.compensation.remedies import NOTHING
from stiction.compensation.trials import measure, programme_for, run
from stiction.diagnosis import diagnose
from stiction.models import Kano
from stiction.simulation.population import population

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stiction.compensation import CompensationTrial
    from stiction.diagnosis import Diagnosis
    from stiction.simulation.population import Case

SEEDS = range(1000, 1010)


class Outcome(NamedTuple):
    """What became of one loop."""

    tag: str
    remedy: str | None
    """Recommended; None where no advice was given."""
    predicted: float
    """Gain on the twin [-]."""
    true: float
    """Gain of the true loop [-]."""
    warned: bool
    """Whether the trial said that it may hurt."""
    why: str

    @property
    def falls(self) -> bool:
        return self.remedy is not None and self.true > 0.0

    @property
    def close(self) -> bool:
        return self.remedy is not None and abs(self.predicted - self.true) <= 0.25 * abs(self.true)

    @property
    def harmed(self) -> bool:
        return self.remedy is not None and self.true < -0.05 and not self.warned


def true_gain(case: Case, trial: CompensationTrial, name: str) -> float:
    """Share by which the PV deviation of the true loop falls with the remedy called `name`, under its own load."""
    assert trial.twin is not None
    loop = case.loop
    plan = programme_for(trial.twin, case.S, None, loop.dt)
    plan = plan._replace(op=50.0, sp=50.0, load=case.load, load_samples=max(case.period / loop.dt, 1.0))
    before = np.mean([measure(run(loop, plan, seed), plan)[0] for seed in SEEDS])
    other = trial[name].remedy.apply(loop)
    after = np.mean([measure(run(other, plan, seed), plan)[0] for seed in SEEDS])
    return float(1.0 - after / before)


def outcome(case: Case, found: Diagnosis) -> Outcome:
    trial = compensate(found)
    if trial.recommended is None:
        return Outcome(case.record.tag, None, np.nan, np.nan, False, trial.reason)
    chosen = trial[trial.recommended]
    gain = 0.0 if chosen.name == NOTHING else true_gain(case, trial, chosen.name)
    return Outcome(case.record.tag, chosen.name, chosen.gain, gain, chosen.hurts, trial.reason)


def report(outcomes: list[Outcome]) -> str:
    advised = [one for one in outcomes if one.remedy is not None]
    lines = [
        f"{len(outcomes)} loops, advice on {len(advised)}",
        f"PV deviation falls: {sum(one.falls for one in outcomes)}",
        f"rises by more than 5 % unsaid: {sum(one.harmed for one in outcomes)}",
        f"gain predicted within 25 %: {sum(one.close for one in outcomes)}",
        f"recommended: {dict(Counter(one.remedy for one in outcomes))}",
    ]
    return "\n".join(lines)


def drawn(n: int, seed: int, *, plain: bool) -> Iterator[Case]:
    """Sticky loops of the population, all of them or the plain ones."""
    if not plain:
        yield from population(n, ("stiction",), seed=seed)
        return
    every = population(100 * n, ("stiction",), seed=seed, historian=False)
    yield from islice((case for case in every if is_plain(case)), n)


def is_plain(case: Case) -> bool:
    """Whether the twin has a model for all that the loop does."""
    loop = case.loop
    own = isinstance(loop.valve, Kano) and loop.controller.Td == 0.0
    return own and not case.sticking and abs(case.record.dt / loop.dt - 1.0) < 1e-6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--loops", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--plain", action="store_true")
    asked = parser.parse_args()
    start = time.perf_counter()
    outcomes = []
    for case in drawn(asked.loops, asked.seed, plain=asked.plain):
        one = outcome(case, diagnose(case.record))
        outcomes.append(one)
        mark = "" if one.falls and one.close else "  <--"
        print(f"{one.tag} {one.remedy} predicted {one.predicted:.2f} true {one.true:.2f}{mark}", flush=True)
        if one.remedy in (None, NOTHING):
            print(f"    {one.why}")
    print(f"{report(outcomes)}\n{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
