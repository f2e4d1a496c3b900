"""Results of a trial of remedies: performance and cost of each, the recommended one, and its risk."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from stiction.compensation.remedies import NO_ACTION
from stiction.display.json_form import Result, json_as
from stiction.display.result_display import ResultDisplay

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from stiction.compensation.remedies import Remedy
    from stiction.compensation.retune import Retuning
    from stiction.compensation.twin import Twin

__all__ = ["CompensationTrial", "LoopPerformance", "RemedyTrial"]


@dataclass(frozen=True)
class LoopPerformance(Result):
    """Control performance and wear of a loop, means over the seeds."""

    pv_std: float
    """Standard deviation of the control error [PV units]."""
    iae: float
    """Integral of the absolute control error, divided by its time [PV units]."""
    offset: float
    """Absolute value of the mean control error [PV units]."""
    travel: float = field(metadata=json_as("travel_per_h"))
    """Stem travel [% of span per h]."""
    reversals: float = field(metadata=json_as("reversals_per_h"))
    """Reversals of the stem [1/h]."""
    op_travel: float = field(metadata=json_as("op_travel_per_h"))
    """Travel of OP [% of span per h]."""
    sp_step: float
    """IAE after a set point step, divided by its time [PV units]."""
    load_step: float
    """IAE after a load step, divided by its time [PV units]."""


@dataclass(frozen=True)
class RemedyTrial(Result):
    """One remedy on the twin, and its effect."""

    _json_keys = (
        "name", "remedy.words as words", "remedy.settings as settings", "behaviour", "improvement", "improvement_low",
        "with_errors as with_30_percent_error", "worst as worst_with_30_percent_error", "cost", "at_hand",
    )  # fmt: skip

    remedy: Remedy
    """The remedy."""
    behaviour: LoopPerformance
    """Performance of the twin with it."""
    improvement: float
    """Share by which it lowers the PV deviation relative to doing nothing [-]; negative when it raises it."""
    improvement_low: float
    """The same share, 5 % point over the seeds [-]."""
    with_errors: tuple[float, ...]
    """PV deviation relative to doing nothing with S and J wrong by 30 %: both larger, both smaller, S larger and J
    smaller, S smaller and J larger [-]."""
    cost: float
    """Weighted cost; doing nothing costs 1 [-]."""
    at_hand: bool
    """Whether it can be done before the next shutdown."""

    @property
    def name(self) -> str:
        """Name of the remedy."""
        return self.remedy.name

    @property
    def worst(self) -> float:
        """Largest PV deviation relative to doing nothing with S and J wrong by 30 % [-]."""
        return max(self.with_errors)

    @property
    def hurts(self) -> bool:
        """Whether it raises the PV deviation by more than 5 % when S and J are wrong by 30 %."""
        return self.worst > 1.05


@dataclass(frozen=True)
class CompensationTrial(ResultDisplay, kind="trial"):
    """All remedies for a sticky valve, tried on the loop's twin and ranked.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> trial = st.compensate(loop, seeds=1)
    >>> isinstance(trial, st.CompensationTrial), trial.recommended in [one.name for one in trial.remedies]
    (True, True)
    """

    _json_keys = (
        "tag", "recommended", "refused", "expected as expected_improvement", "reason", "risk", "S", "J", "weights",
        "seeds", "max_travel", "remedies", "twin", "retuning", "trends",
    )  # fmt: skip

    tag: str
    """Name of the loop."""
    remedies: tuple[RemedyTrial, ...]
    """The trials, the cheapest first; empty when no advice is given."""
    recommended: str | None
    """Name of the remedy to use until the next shutdown; None when no advice is given."""
    reason: str
    """Why this remedy, or why none."""
    risk: str
    """Drawbacks of the recommended remedy."""
    S: float
    """Deadband plus stickband of the twin [% of span]; NaN without a twin."""
    J: float
    """Slip jump of the twin [% of span]; NaN without a twin."""
    twin: Twin | None = None
    """The simulated copy of the loop; None when there is none."""
    retuning: Retuning | None = None
    """Other controller settings and their trade-off; None when they were not searched."""
    weights: dict[str, float] = field(default_factory=dict)
    """Weights of the cost [-]."""
    seeds: int = 0
    """Runs of each remedy [-]."""
    trends: dict[str, dict[str, NDArray[np.float64]]] = field(default_factory=dict, repr=False, compare=False)
    """Remedy -> time [s], sp, pv, op, mv of its first run, shape (n_samples,) each: no action, recommended, repair."""
    expected: float = float("nan")
    """Share by which the recommended remedy is expected to lower the PV deviation on the plant [-]; slightly less than
    on the twin of a record; NaN when no advice is given."""

    max_travel: float = float("nan")
    """Largest stem travel of a recommended remedy over the present one [-]."""

    @property
    def refused(self) -> bool:
        """Whether no advice is given; then `reason` says why."""
        return self.recommended is None

    def __getitem__(self, name: str) -> RemedyTrial:
        """Return the trial of the remedy `name`."""
        for one in self.remedies:
            if one.name == name:
                return one
        raise KeyError(f"{name!r} was not tried; use one of {', '.join(one.name for one in self.remedies) or 'none'}.")

    def summary(self) -> str:
        """Return the recommendation, its risk, and a table of all remedies as text."""
        if self.refused:
            return f"{self.tag}: no advice. {self.reason}"
        head = f"{self.tag}: {self.reason} {self.risk}".rstrip()
        now = self[NO_ACTION].behaviour
        rows = [f"{'remedy':<24}{'PV std':>9}{'offset':>9}{'travel':>9}{'reversals':>11}{'worst':>7}{'cost':>7}"]
        for one in self.remedies:
            b = one.behaviour
            rows.append(
                f"{one.name:<24}{b.pv_std / max(now.pv_std, 1e-300):>9.2f}{b.offset / max(now.pv_std, 1e-300):>9.2f}"
                f"{b.travel / max(now.travel, 1e-300):>9.2f}{b.reversals / max(now.reversals, 1e-300):>11.2f}"
                f"{one.worst:>7.2f}{one.cost:>7.2f}"
            )
        return "\n".join([head, *rows, "(relative to doing nothing; offset relative to the PV std of doing nothing)"])
