"""What a trial of remedies says: each remedy with its bill, the one to take until the shutdown, and the risk."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.compensation.remedies import NOTHING
from stiction.display.result_display import ResultDisplay

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.compensation.remedies import Remedy
    from stiction.compensation.retune import Retuning
    from stiction.compensation.twin import Twin

__all__ = ["Behaviour", "CompensationTrial", "RemedyTrial"]


@dataclass(frozen=True)
class Behaviour:
    """How a loop behaves: means over the seeds."""

    pv_std: float
    """Standard deviation of the PV [PV units]."""
    iae: float
    """Integral of the absolute control error over the time it was taken [PV units]."""
    offset: float
    """Size of the mean control error [PV units]."""
    travel: float
    """Stem travel [% of span per h]."""
    reversals: float
    """Reversals of the stem [1/h]."""
    op_travel: float
    """Movement of the OP [% of span per h]."""
    sp_step: float
    """IAE after a step of the set point, over the time it was taken [PV units]."""
    load_step: float
    """IAE after a step of the load, over the time it was taken [PV units]."""

    def to_dict(self) -> dict[str, float]:
        """JSON-ready form."""
        return {
            "pv_std": self.pv_std, "iae": self.iae, "offset": self.offset, "travel_per_h": self.travel,
            "reversals_per_h": self.reversals, "op_travel_per_h": self.op_travel, "sp_step": self.sp_step,
            "load_step": self.load_step,
        }  # fmt: skip


@dataclass(frozen=True)
class RemedyTrial:
    """One remedy on the twin."""

    remedy: Remedy
    """What was done."""
    behaviour: Behaviour
    """What came of it."""
    improvement: float
    """Share by which the PV's standard deviation falls against doing nothing [-]; negative where it rises."""
    improvement_low: float
    """The same for the seed at the 5 % point [-]."""
    with_errors: tuple[float, ...]
    """PV deviation over that of doing nothing with S and J off by 30 %: both larger, both smaller, S larger and J
    smaller, S smaller and J larger [-]."""
    cost: float
    """Weighted sum of what it costs; doing nothing costs 1 [-]."""
    at_hand: bool
    """Whether it can be done before the shutdown."""

    @property
    def name(self) -> str:
        """Name of the remedy."""
        return self.remedy.name

    @property
    def worst(self) -> float:
        """Largest PV deviation over that of doing nothing with S and J off by 30 % either way [-]."""
        return max(self.with_errors)

    @property
    def hurts(self) -> bool:
        """Whether it makes the PV worse by more than 5 % where S and J are off by 30 %."""
        return self.worst > 1.05

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "name": self.name, "words": self.remedy.words, "settings": self.remedy.settings,
            "behaviour": self.behaviour.to_dict(), "improvement": self.improvement,
            "improvement_low": self.improvement_low,
            "with_30_percent_error": list(self.with_errors),
            "worst_with_30_percent_error": self.worst, "cost": self.cost, "at_hand": self.at_hand,
        }  # fmt: skip


@dataclass(frozen=True)
class CompensationTrial(ResultDisplay, kind="trial"):
    """Every remedy of a sticky loop, tried on its twin and ranked."""

    tag: str
    """Name of the loop."""
    remedies: tuple[RemedyTrial, ...]
    """The trials, the cheapest first; empty where no advice is given."""
    recommended: str | None
    """Name of the remedy to take until the shutdown; None where no advice is given."""
    reason: str
    """Why this one, or why none."""
    risk: str
    """What can go wrong with it."""
    S: float
    """Deadband plus stickband the trial rests on [% of span]; NaN where there is none."""
    J: float
    """Slip jump [% of span]; NaN where there is none."""
    twin: Twin | None = None
    """The twin; None where there is none."""
    retuning: Retuning | None = None
    """The settings found and the trade-off; None where there is none."""
    weights: dict[str, float] = field(default_factory=dict)
    """Weights of the cost [-]."""
    seeds: int = 0
    """Runs of each remedy [-]."""
    trends: dict[str, dict[str, NDArray[np.float64]]] = field(default_factory=dict, repr=False, compare=False)
    """Remedy -> time [s], sp, pv, op, mv of its first run, shape (n_samples,) each: nothing, recommended, repair."""

    expected: float = float("nan")
    """Share by which the remedy recommended is expected to lower the PV's deviation on the plant, a little less than on
    the twin of a record [-]; NaN where no advice is given."""

    @property
    def refused(self) -> bool:
        """Whether no advice is given; `reason` says why."""
        return self.recommended is None

    def __getitem__(self, name: str) -> RemedyTrial:
        """Trial of the remedy called `name`."""
        for one in self.remedies:
            if one.name == name:
                return one
        raise KeyError(f"{name!r} was not tried; there are {', '.join(one.name for one in self.remedies) or 'none'}.")

    def summary(self) -> str:
        """The recommendation, its risk, and a table of what each remedy gives and costs."""
        if self.refused:
            return f"{self.tag}: no advice. {self.reason}"
        head = f"{self.tag}: {self.reason} {self.risk}".rstrip()
        now = self[NOTHING].behaviour
        rows = [f"{'remedy':<24}{'PV std':>9}{'offset':>9}{'travel':>9}{'reversals':>11}{'worst':>7}{'cost':>7}"]
        for one in self.remedies:
            b = one.behaviour
            rows.append(
                f"{one.name:<24}{b.pv_std / max(now.pv_std, 1e-300):>9.2f}{b.offset / max(now.pv_std, 1e-300):>9.2f}"
                f"{b.travel / max(now.travel, 1e-300):>9.2f}{b.reversals / max(now.reversals, 1e-300):>11.2f}"
                f"{one.worst:>7.2f}{one.cost:>7.2f}"
            )
        return "\n".join([head, *rows, "(over doing nothing; offset over its PV std)"])

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "tag": self.tag,
            "recommended": self.recommended,
            "refused": self.refused,
            "expected_improvement": self.expected if np.isfinite(self.expected) else None,
            "reason": self.reason,
            "risk": self.risk,
            "S": self.S if np.isfinite(self.S) else None,
            "J": self.J if np.isfinite(self.J) else None,
            "weights": dict(self.weights),
            "seeds": self.seeds,
            "remedies": [one.to_dict() for one in self.remedies],
            "twin": None if self.twin is None else self.twin.to_dict(),
            "retuning": None if self.retuning is None else self.retuning.to_dict(),
            "trends": {
                name: {signal: [float(x) for x in series] for signal, series in run.items()}
                for name, run in self.trends.items()
            },
        }  # fmt: skip
