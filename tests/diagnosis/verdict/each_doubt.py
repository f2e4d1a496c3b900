"""What each doubt about the data and each contradiction is worth: verdicts with all of them, and with one left out.

What is not bound without it is counted, apart by whether it is right: told above 0.9 or below 0.1. So are trials with
the effects of a historian whose confident verdict turns into the opposite without it.

Run as a script: python tests/diagnosis/verdict/each_doubt.py --loops 2000 --seed 10 --trials 100 917 --jobs 2
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from contextlib import contextmanager
from functools import partial
from importlib import import_module

from fault_injection import drawn, spoiled, tasks  # a page beside this script, as the next
from population import each

from calibration.populations import population
from stiction.diagnosis.verdict import contradiction, doubt

page = import_module("stiction.diagnosis.verdict.diagnose")
"""The page, whose name in the package is the function's."""

NAMED = {
    "steps of OP": (doubt, "STEPS", 0.0),
    "much left out": (doubt, "KEPT", 0.0),
    "few samples": (doubt, "FEW", 0),
    "surely, in spite of few": (doubt, "SURELY", 0.0),
    "plainly, of other rows": (doubt, "PLAINLY", 0.0),
    "spikes are the finding": (doubt, "SPIKES", math.inf),
    "nothing is explained": (contradiction, "BY_CHANCE", 0.0),
    "much more is explained": (contradiction, "MUCH_MORE", math.inf),
    "beats every rival": (contradiction, "BEATS_EVERY", math.inf),
    "a jump is plain": (contradiction, "PLAIN_JUMP", math.inf),
    "predicts the PV": (contradiction, "PREDICTS", math.inf),
    "samples not seen to be the controller's": (contradiction, "LIKE_A_PLANTS", math.inf),
    "makes no such cycle": (contradiction, "OWN_CYCLE", -math.inf),
}
"""What is left out, and the limit beyond which nothing lies."""
LEFT_OUT = {
    "nothing": (doubt, "HIDES", doubt.HIDES),
    **{name: (doubt, "HIDES", tuple(one for one in doubt.HIDES if one != name)) for name in doubt.HIDES},
    **{name: (doubt, "BEYOND", {one: x for one, x in doubt.BEYOND.items() if one != name}) for name in doubt.BEYOND},
    **NAMED,
}
"""Page, name and value of what is changed."""


@contextmanager
def changed(module, name, value):
    """A page in which one name has another value."""
    before = getattr(module, name)
    setattr(module, name, value)
    try:
        yield
    finally:
        setattr(module, name, before)


def told(record) -> dict[str, float]:
    """Probability that the valve sticks with each left out [-]; even where the record is refused."""
    seen = page.findings(record)
    if seen.features is None:
        return dict.fromkeys(LEFT_OUT, 0.5)
    weighed, out = page._weigh(seen, seen.features), {}
    for name, what in LEFT_OUT.items():
        with changed(*what):
            out[name] = page._judge(seen, seen.features, weighed).causes["stiction"]
    return out


def surely(p: float) -> int:
    """Whether that is surely sticky (1), surely good (-1), or neither."""
    return int(p > doubt.MOST) - int(p < doubt.LEAST)


def counted(name: str, sticky: bool, p: float) -> Counter:
    """Whether it is surely right or surely wrong."""
    sure = surely(p) * (1 if sticky else -1)
    return Counter({(name, "right"): int(sure > 0), (name, "wrong"): int(sure < 0)})


def of_case(case) -> Counter:
    """What each left out makes of one loop."""
    out: Counter = Counter()
    for name, p in told(case.record).items():
        out += counted(name, case.cause == "stiction", p)
    return out


def of_trials(task) -> Counter:
    """What each left out makes of the trials of one loop."""
    case, seed, pairs = task
    plain, out = told(case.record), Counter()
    for effects, strengths, again in drawn(seed, pairs):
        for name, p in told(spoiled(case.record, effects, strengths, again)).items():
            out += counted(name, case.cause == "stiction", p)
            out[name, "turned"] += surely(p) * surely(plain[name]) < 0
    return out


def table(loops: Counter, trials: Counter) -> str:
    """A row for each left out: how many more are surely right, surely wrong, and turned."""
    columns = [(loops, "right"), (loops, "wrong"), (trials, "right"), (trials, "wrong"), (trials, "turned")]
    head = f"{'left out':28}" + "".join(f"{what:>10}" for _, what in columns)
    out = [f"{'':28}{'loops':>20}{'trials':>30}", head]
    for name in LEFT_OUT:
        base = [0 if name == "nothing" else count["nothing", what] for count, what in columns]
        more = [count[name, what] - none for (count, what), none in zip(columns, base, strict=True)]
        out.append(f"{name:28}" + "".join(f"{n:>10}" if name == "nothing" else f"{n:>+10}" for n in more))
    return "\n".join(out)


def main() -> None:
    ask = argparse.ArgumentParser(description="Judge loops and trials with each doubt and contradiction left out.")
    ask.add_argument("--loops", type=int, default=2000, help="loops of calibration.populations")
    ask.add_argument("--seed", type=int, default=10)
    ask.add_argument("--trials", type=int, nargs=2, default=(100, 917), help="loops of fault_injection, their seed")
    ask.add_argument("--pairs", type=int, default=105, help="pairs of effects for each of these")
    ask.add_argument("--jobs", type=int, default=1, help="processes")
    chosen = ask.parse_args()
    asked = tasks(*chosen.trials, chosen.pairs)
    count = partial(sum, start=Counter())
    loops = count(each(of_case, population(chosen.loops, seed=chosen.seed), chosen.jobs, chosen.loops))
    trials = count(each(of_trials, asked, chosen.jobs, len(asked)))
    print(table(loops, trials))


if __name__ == "__main__":
    main()
