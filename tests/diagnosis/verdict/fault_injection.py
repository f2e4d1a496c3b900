"""Put sticky and not sticky loops through every effect of a historian, alone and in pairs, and diagnose them again.

A flip is a confident verdict turned into the confident opposite: none is allowed. A refusal is right when a gate that
the reason shows belongs to an effect put in.

Run as a script: python tests/diagnosis/verdict/fault_injection.py --loops 200 --pairs 105 --jobs 2
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from dataclasses import asdict, dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np
from population import each  # a page beside this script

import stiction as st
from stiction.display import describe_check
from stiction.simulation.historian import spoil
from calibration.populations import CAUSES, population

SURE = 0.9
"""Probability beyond which a verdict is confident [-]."""
SEEN_AS_HELD = {
    "exception reporting",
    "held values",
    "compression",
    "manual",
    "frozen pv",
    "op movement",
    "pv movement",
}
"""Gates that a signal at rest falls to: which of them depends on how long it rests, and whether the other does."""
GATES = {
    "sampling": {"sampling", "resampled", "cycles", "length"},
    "averaging": {"moving average", "sampling", "resampled", "cycles", "length"},
    "interpolation": {"compression", "sampling"},
    "exception": SEEN_AS_HELD | {"resampled", "op resolution", "pv resolution"},
    "swinging door": {"compression", "op movement", "pv movement"},
    "quantisation": {"op resolution", "pv resolution", "op movement", "pv movement"},
    "gaps": {"missing values", "resampled", "length", "cycles"},
    "missing": {"missing values", "resampled", "length", "cycles"},
    "held": SEEN_AS_HELD | {"length", "cycles"},
    "clock": {"clock jumps", "resampled", "length", "cycles"},
    "replay": {"copied data"},
    "manual": {"manual", "length", "cycles"},
    "saturation": {"saturation", "length", "cycles"},
    "units": {"op scale"},
    "bad values": {"outliers", "missing values"},
}  # fmt: skip
"""Effect -> gates that may refuse for it. A stretch that is lost or left out leaves a shorter one: too few samples or
cycles are its reason too."""


NAMES = tuple(GATES)
"""Effects: those of `EFFECTS`, and codes for bad values."""
CODES = (0.0, 100.0, 110.0, -9999.0, 32767.0, 1e38)
"""What historians write in the place of a bad value."""


def with_bad_values(record, strength, seed):
    """The record with up to five codes for bad values in OP or in PV."""
    rng = np.random.default_rng(seed)
    name, code = str(rng.choice(["op", "pv"])), float(rng.choice(CODES))
    x = getattr(record, name).copy()
    x[rng.choice(x.size, 1 + round(4.0 * strength), replace=False)] = code
    return replace(record, **{name: x})


@dataclass(frozen=True)
class Trial:
    """One loop, spoiled and diagnosed again."""

    tag: str
    truth: str
    effects: tuple[str, ...]
    strengths: tuple[float, ...]
    seed: int
    """Seed of the effects: `spoiled` makes the record again."""
    before: float
    after: float
    undoubted: float
    """Probability before the doubts: other rules for these can be tried on the same trials."""
    refused: bool
    gates: tuple[str, ...]
    """Gates that the reason of the refusal shows."""
    doubts: tuple[str, ...]
    """Gates that lower the confidence."""

    @property
    def flipped(self) -> bool:
        """A confident verdict turned into the confident opposite."""
        low, high = sorted((self.before, self.after))
        return low < 1.0 - SURE and high > SURE

    @property
    def wrong(self) -> bool:
        """Confident, and not the truth."""
        return self.after < 1.0 - SURE if self.truth == "stiction" else self.after > SURE

    @property
    def right_reason(self) -> bool:
        return any(set(self.checks) & GATES[effect] for effect in self.effects)


def spoiled(record, effects, strengths, seed):
    """The record after the effects, one after the other."""
    for effect, strength in zip(effects, strengths, strict=True):
        bad = effect == "bad values"
        record = with_bad_values(record, strength, seed) if bad else spoil(record, effect, strength, seed)
    return record


def drawn(seed, pairs: int):
    """Each effect, then `pairs` of the pairs, with strengths and a seed of their own."""
    rng = np.random.default_rng(seed)
    both = list(combinations(NAMES, 2))
    chosen = [both[k] for k in np.sort(rng.permutation(len(both))[:pairs])]
    for effects in [*((name,) for name in NAMES), *chosen]:
        strengths = tuple(float(s) for s in rng.random(len(effects)))
        yield effects, strengths, int(rng.integers(2**31))


def trials(task) -> list[Trial]:
    """Diagnose a loop as it is, then with each effect and with `pairs` of the pairs; refused as it is: none."""
    case, seed, pairs = task
    plain = st.diagnose(case.record)
    if plain.identification is None:
        return []
    out = []
    for effects, strengths, again in drawn(seed, pairs):
        found = st.diagnose(spoiled(case.record, effects, strengths, again))
        refused = found.verdict == "undecided" and not found.quality.usable
        gates = (
            tuple(gate.name for gate in found.quality.rejections if describe_check(gate) in found.reason)
            if refused
            else ()
        )
        doubts = tuple(gate.name for gate in found.quality.warnings)
        out.append(
            Trial(
                case.record.tag, case.cause, effects, strengths, again, plain.probability, found.probability,
                found.probability_before_doubts, refused, gates, doubts,
            )
        )  # fmt: skip
    return out


def counted(rows) -> dict[str, float]:
    """Flips, confident errors, refusals and refusals for the right reason of some trials."""
    refused = [row for row in rows if row.refused]
    sure = [row for row in rows if abs(row.before - 0.5) > SURE - 0.5]
    return {
        "trials": len(rows),
        "confident_before": len(sure),
        "flips": sum(row.flipped for row in rows),
        "confident_errors": sum(row.wrong for row in rows),
        "still_confident": sum(abs(row.after - 0.5) > SURE - 0.5 for row in sure),
        "refused": len(refused),
        "right_reason": sum(row.right_reason for row in refused),
    }


def table(rows) -> str:
    """Counts by effect, alone and in pairs."""
    names = list(counted([]))
    out = [f"{'effect':16}" + "".join(f"{name.replace('_', ' '):>18}" for name in names)]
    for head, size in (("alone", 1), ("in pairs", 2)):
        own = [row for row in rows if len(row.effects) == size]
        if own:
            by = {name: [row for row in own if name in row.effects] for name in NAMES}
            for name, some in {f"{head}, all": own, **by}.items():
                out.append(f"{name:16}" + "".join(f"{n:>18}" for n in counted(some).values()))
    wrong = Counter((row.effects, row.checks) for row in rows if row.refused and not row.right_reason)
    out += [f"refused for another reason: {' + '.join(e)} by {', '.join(g)} {n}" for (e, g), n in wrong.most_common(20)]
    for row in rows:
        if row.flipped:
            how = ", ".join(f"{name} {s:.2f}" for name, s in zip(row.effects, row.strengths, strict=True))
            out.append(f"flipped: {row.tag} {row.truth} {row.before:.2f} to {row.after:.2f} by {how}")
    return "\n".join(out)


def tasks(loops: int, seed: int, pairs: int):
    """A task for each of `loops` loops, half of them sticky: the case, the seed of its effects, how many pairs."""
    half = loops // 2
    others = tuple(cause for cause in CAUSES if cause != "stiction")
    cases = [
        *population(half, ("stiction",), seed, historian=False),
        *population(loops - half, others, seed + 1, historian=False),
    ]
    return [(case, [seed, k], pairs) for k, case in enumerate(cases)]


def run(loops: int, seed: int, pairs: int, jobs: int) -> list[Trial]:
    """Trials of `loops` loops, half of them sticky."""
    return [row for own in each(trials, tasks(loops, seed, pairs), jobs, loops) for row in own]


def main() -> None:
    parser = argparse.ArgumentParser(description="Spoil loops and see whether a confident verdict flips.")
    parser.add_argument("--loops", type=int, default=200, help="loops, half of them sticky")
    parser.add_argument("--seed", type=int, default=55)
    parser.add_argument("--pairs", type=int, default=105, help="pairs of effects for each loop, out of 105")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--json", type=Path, help="write counts and trials to this file")
    chosen = parser.parse_args()
    rows = run(chosen.loops, chosen.seed, chosen.pairs, chosen.jobs)
    print(table(rows))
    if chosen.json:
        alone, pairs = ([row for row in rows if len(row.effects) == size] for size in (1, 2))
        told = {"alone": counted(alone), "pairs": counted(pairs), "trials": [asdict(row) for row in rows]}
        chosen.json.write_text(json.dumps(told, indent=1))


if __name__ == "__main__":
    main()
