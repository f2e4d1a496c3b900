"""Verdicts on loops drawn to be hard: good valves that could pass for sticky ones, and sticky ones that hide it.

The loops are simulated without anything of stiction.simulation. A sticky valve counts a second time where its stiction
can be seen: where the true stem predicts the PV far better than the OP does, and jumps often enough.

Run as a script: python tests/diagnosis/verdict/adverse.py --loops 40 --seed 1 --jobs 2
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from zlib import crc32

import numpy as np
from adverse_good import GOOD  # a page beside this script, as the next
from adverse_sticky import STICKY
from population import SURE, Called, each

import stiction as st

if TYPE_CHECKING:
    from adverse_draws import Adverse

KINDS = {**GOOD, **STICKY}
SPACING = 1000
"""Loops to a seed: another one would be the first loop of the next seed."""
DELAYS = (1, 3, 6, 10, 16, 25, 36)
"""Dead times of which the best predicts [samples]."""
N_PV, N_INPUT = 8, 6
"""Samples of the PV and of the input from which a sample of the PV is predicted."""
ROUNDING = 1e-14
"""Share of the PV's variance below which nothing is left to predict [-]."""
BETTER = 60.0
"""Twice the log likelihood by which the stem predicts the PV better where its stiction can be seen [-]."""
JUMPS = 6
"""Jumps that must be there to be seen."""
JUMP = 0.3
"""Share of J that is a jump when the stem moves by it within a row [-]."""


def drawn(kind: str, seed: int, i: int) -> Adverse:
    """Loop `i` of a seed and a kind."""
    return KINDS[kind](np.random.default_rng([SPACING * seed + i, crc32(kind.encode())]))


def left_over(pv: np.ndarray, u: np.ndarray, delay: int) -> float:
    """Mean square that an ARX model from `u` leaves of the PV, both about 0."""
    begin, end = max(N_PV, delay + N_INPUT) + 1, pv.size
    past = [pv[begin - i : end - i] for i in range(1, N_PV + 1)]
    past += [u[begin - i : end - i] for i in range(delay, delay + N_INPUT)]
    known = np.stack([*past, np.ones(end - begin)], 1)
    rest = pv[begin:] - known @ np.linalg.lstsq(known, pv[begin:], rcond=None)[0]
    return float(rest @ rest) / rest.size


def likelier_by_stem(loop: Adverse) -> float:
    """Twice the log likelihood by which the stem predicts the PV better than the OP does, each at its best delay."""
    op, pv = loop.record.op, (loop.record.pv - loop.record.pv.mean()) / loop.record.pv.std()
    inputs = ((u - u.mean()) / op.std() for u in (op, loop.mv))
    by_op, by_stem = (max(min(left_over(pv, u, delay) for delay in DELAYS), ROUNDING) for u in inputs)
    return pv.size * float(np.log(by_op / by_stem))


def can_be_seen(loop: Adverse) -> bool:
    """Whether someone who knows the stem would say that it sticks; never of st_slow, whose stem ramps."""
    jumps = int(np.sum(np.abs(np.diff(loop.mv)) > JUMP * loop.J))
    return loop.sticky and jumps >= JUMPS and likelier_by_stem(loop) > BETTER


@dataclass(frozen=True)
class Told(Called):
    """Truth and verdict of one loop."""

    kind: str
    loop: int
    sticky: bool
    seen: bool
    S: float
    J: float
    verdict: str
    cause: str
    probability: float

    @property
    def wrong(self) -> bool:
        return not self.right and not self.undecided

    @property
    def sure(self) -> bool:
        """Whether it is surely told what it is not."""
        return self.probability < 1.0 - SURE if self.sticky else self.probability > SURE


def tell(task: tuple[str, int, int]) -> Told:
    """Draw and diagnose one loop of a kind and a seed."""
    kind, _, i = task
    loop = drawn(*task)
    found = st.diagnose(loop.record)
    truth = loop.sticky, can_be_seen(loop), loop.S, loop.J
    return Told(kind, i, *truth, found.verdict, found.cause, found.probability)


def run(kinds, loops: int, seed: int, jobs: int) -> list[Told]:
    """Diagnose so many loops of each kind."""
    tasks = [(kind, seed, i) for kind in kinds for i in range(loops)]
    return list(each(tell, tasks, jobs, len(tasks)))


def counted(rows) -> dict[str, int]:
    """Loops and how they are told."""
    return {
        "loops": len(rows),
        "right": sum(row.right for row in rows),
        "undecided": sum(row.undecided for row in rows),
        "wrong": sum(row.wrong for row in rows),
        "sure": sum(row.sure for row in rows),
    }


def groups(rows) -> dict[str, list[Told]]:
    """The loops of each kind, and all good and all sticky ones."""
    own: dict[str, list[Told]] = {}
    for row in rows:
        own.setdefault(row.kind, []).append(row)
    both = {"all good": [row for row in rows if not row.sticky], "all sticky": [row for row in rows if row.sticky]}
    return own | {name: some for name, some in both.items() if some}


def counts(rows) -> dict[str, dict[str, dict[str, int]]]:
    """Each group counted: all its loops, and of sticky ones those whose stiction can be seen."""
    return {
        name: {"all": counted(some)} | ({"seen": counted([row for row in some if row.seen])} if some[0].sticky else {})
        for name, some in groups(rows).items()
    }


def table(rows) -> str:
    """One row a group: all its loops, then those whose stiction can be seen. `sure` are surely wrong."""
    names = list(counted([]))
    out = [f"{'kind':15}" + "".join(f"{name:>10}" for name in (*names, "seen", *names[1:]))]
    for name, found in counts(rows).items():
        out.append(f"{name:15}" + "".join(f"{n:10}" for count in found.values() for n in count.values()))
    return "\n".join(out)


def main() -> None:
    parser = argparse.ArgumentParser(description="Diagnose loops drawn to be hard and count.")
    parser.add_argument("--loops", type=int, default=40, help="loops of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), metavar="KIND")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--json", type=Path, help="write counts and rows to this file")
    chosen = parser.parse_args()
    rows = run(chosen.kinds, chosen.loops, chosen.seed, chosen.jobs)
    print(table(rows))
    if chosen.json:
        told = {"seed": chosen.seed, "counts": counts(rows), "rows": [asdict(row) for row in rows]}
        chosen.json.write_text(json.dumps(told, indent=1))


if __name__ == "__main__":
    main()
