"""Does the remedy that the twin recommends help the true loop? On simulated loops, identified from their records.

    python tests/compensation/population.py --loops 100 --seed 1 [--plain] [--known]

Each record is diagnosed, the remedies are tried on the twin of what was identified, and the one recommended until the
shutdown is put into the true loop, in the surroundings of its record: the same set point and the same loads, turned
round in time or in sign, with another constant load and other noise. A valve that sticks at times is taken while it
sticks. Counted: loops whose PV standard deviation about the set point falls; loops where it rises by more than 5 %
although no risk of it was told; loops for which the share by which the deviation falls was predicted within 25 % of
the true one. With --plain only loops for which the twin has a model: a Kano valve that always sticks, a PI, a record
sampled as the controller is, nothing from outside, and nothing done to it by a historian. With --known the cause is
taken as known where the record can be judged, so that the advice is tried and not the verdict.
"""

from __future__ import annotations

import argparse
import copy
import time
from collections import Counter
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from calibration.populations import population
from calibration.populations.causes import SCENARIOS
from calibration.populations.draw import _draw
from calibration.populations.scenario import PV_START
from stiction.compensation import compensate
from stiction.compensation.remedies import NO_ACTION
from stiction.diagnosis import diagnose
from stiction.models import Kano, PhysicalValve
from stiction.simulation import simulate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from calibration.populations import Case
    from calibration.populations.scenario import Scenario
    from stiction.compensation.remedies import Remedy
    from stiction.diagnosis import Diagnosis
    from stiction.models import Loop

SEEDS = range(1000, 1010)


class Outcome(NamedTuple):
    """What became of one loop."""

    tag: str
    remedy: str | None
    """Recommended; None where no advice was given."""
    predicted: float
    """Share by which the deviation should fall [-]."""
    true: float
    """Share by which that of the true loop falls [-]."""
    warned: bool
    """Whether the trial said that it may hurt."""
    why: str

    @property
    def treated(self) -> bool:
        """Whether something was recommended to be done."""
        return self.remedy not in (None, NO_ACTION)

    @property
    def falls(self) -> bool:
        return self.treated and self.true > 0.0

    @property
    def close(self) -> bool:
        return self.treated and abs(self.predicted - self.true) <= 0.25 * abs(self.true)

    @property
    def harmed(self) -> bool:
        return self.treated and self.true < -0.05 and not self.warned


def true_improvement(case: Case, plan: Scenario, remedy: Remedy) -> float:
    """Share by which the PV deviation of the true loop falls with the remedy."""
    with_it = remedy.apply(case.loop)
    pairs = [[deviation(loop, case, plan, seed) for loop in (case.loop, with_it)] for seed in SEEDS]
    before, after = np.mean(pairs, axis=0)
    return float(1.0 - after / before)


def deviation(loop: Loop, case: Case, plan: Scenario, seed: int) -> float:
    """Deviation of the PV from the set point in one run [PV units]."""
    rng = np.random.default_rng([seed, 99])
    sign, back = float(rng.choice([-1.0, 1.0])), bool(rng.random() < 0.5)

    def turned(x: np.ndarray) -> np.ndarray:
        return sign * (np.concatenate([x[: plan.burn], x[plan.burn :][::-1]]) if back else x)

    load = turned(plan.load) + rng.uniform(-case.S, case.S)
    load[: max(plan.n // 50, 5)] += 0.7 * case.S
    valve = loop.valve
    rest = valve.gain * (plan.op_start - valve.offset) if isinstance(valve, PhysicalValve) else plan.op_start
    run = simulate(
        loop, PV_START + turned(plan.sp), plan.n * loop.dt, load, seed, pv_disturbance=turned(plan.pv_load),
        pv_start=PV_START, op_start=plan.op_start, mv_start=rest,
    )  # fmt: skip
    assert run.pv is not None
    assert run.sp is not None
    return float((run.pv - run.sp)[max(plan.burn, plan.n // 6) :].std())


def outcome(case: Case, plan: Scenario, found: Diagnosis, *, known: bool = False) -> Outcome:
    if known and found.identification is not None:
        found = replace(found, verdict="stiction")
    trial = compensate(found)
    if trial.recommended is None:
        return Outcome(case.record.tag, None, np.nan, np.nan, False, trial.reason)
    chosen = trial[trial.recommended]
    true = 0.0 if chosen.name == NO_ACTION else true_improvement(case, plan, chosen.remedy)
    return Outcome(case.record.tag, chosen.name, trial.expected, true, chosen.hurts, trial.reason)


def report(outcomes: list[Outcome]) -> str:
    lines = [
        f"{len(outcomes)} loops: a remedy on {sum(one.treated for one in outcomes)}, "
        f"to leave as it is {sum(one.remedy == NO_ACTION for one in outcomes)}, "
        f"no advice on {sum(one.remedy is None for one in outcomes)}",
        f"PV deviation falls: {sum(one.falls for one in outcomes)}",
        f"rises by more than 5 % unsaid: {sum(one.harmed for one in outcomes)}",
        f"predicted within 25 %: {sum(one.close for one in outcomes)}",
        f"recommended: {dict(Counter(one.remedy for one in outcomes))}",
    ]
    return "\n".join(lines)


def drawn(n: int, seed: int, *, plain: bool) -> Iterator[tuple[Case, Scenario]]:
    """Sticky loops of the population, all of them or the plain ones, with what each was put through."""
    cases = population(100 * n, ("stiction",), seed=seed, historian=not plain)
    every = ((case, plan_of(case, seed, i)) for i, case in enumerate(cases))
    yield from islice((both for both in every if not plain or is_plain(both[0])), n)


def plan_of(case: Case, seed: int, i: int) -> Scenario:
    """What a case was put through: drawn again, as the population drew it."""
    rng = np.random.default_rng([seed, i])
    while True:
        again = copy.deepcopy(rng)
        if _draw("stiction", rng, 0.2, "") is not None:
            plan = SCENARIOS["stiction"](again)
            assert plan is not None
            assert (plan.S, plan.J, plan.kind) == (case.S, case.J, case.kind)
            return plan


def is_plain(case: Case) -> bool:
    """Whether the twin has a model for all that the loop does."""
    loop = case.loop
    own = isinstance(loop.valve, Kano) and loop.controller.Td == 0.0
    outside = "load" in case.kind or "sine" in case.kind or "set point" in case.kind
    return own and not outside and not case.sticking and abs(case.record.dt / loop.dt - 1.0) < 1e-6


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--loops", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--plain", action="store_true")
    parser.add_argument("--known", action="store_true")
    asked = parser.parse_args()
    start = time.perf_counter()
    outcomes = []
    for case, plan in drawn(asked.loops, asked.seed, plain=asked.plain):
        one = outcome(case, plan, diagnose(case.record), known=asked.known)
        outcomes.append(one)
        mark = "" if one.falls and one.close else "  <--"
        print(f"{one.tag} {one.remedy} predicted {one.predicted:.2f} true {one.true:.2f}{mark}", flush=True)
        if one.remedy in (None, NO_ACTION):
            print(f"    {one.why}")
    print(f"{report(outcomes)}\n{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
