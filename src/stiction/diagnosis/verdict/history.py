"""What is said of a valve over time: its windows, and the changes between them."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from datetime import datetime
from typing import TYPE_CHECKING, Any, Literal

from stiction.diagnosis.verdict.causes import CAUSES
from stiction.diagnosis.verdict.decision import DEFAULT_PRIOR
from stiction.diagnosis.verdict.model import Contribution, log_odds
from stiction.display.json_form import FOUR_DECIMALS, Result, json_as

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.diagnosis.loop_state.state import StateName

__all__ = ["Change", "ChangeKind", "Window"]

ChangeKind = Literal["onset", "repair", "growth"]


@dataclass(frozen=True, slots=True)
class Window(Result):
    """One window of a loop, judged by itself."""

    start: datetime | None
    """Time of its first sample; None where the record has no times."""
    start_s: float
    """Its start, from the first sample of the first record [s]."""
    end_s: float
    """Its end, from the first sample of the first record [s]."""
    state: StateName
    """State of the loop."""
    probability: float = field(metadata=FOUR_DECIMALS)
    """Probability that the valve sticks, by this window alone [-]; the prior where it cannot be judged."""
    S: float | None = None
    """Deadband plus stickband [% of span]; None where the window cannot be judged."""
    S_low: float | None = None
    """Lower end of the 95 % interval of S [% of span]."""
    S_high: float | None = None
    """Upper end of the 95 % interval of S [% of span]."""
    J: float | None = None
    """Slip jump [% of span]."""
    J_low: float | None = None
    """Lower end of the 95 % interval of J [% of span]."""
    J_high: float | None = None
    """Upper end of the 95 % interval of J [% of span]."""
    S_detectable: float | None = None
    """Smallest S that this window would have shown [% of span]; None where none would show."""
    causes: tuple[float, ...] = field(default=(), metadata=json_as(omit=True))
    """Probability of each of `CAUSES` [-]; empty where the window cannot be judged."""
    over_deadband: float = field(default=0.0, metadata=json_as(omit=True))
    """Evidence of a slip jump against deadband alone, asinh(LLR / 20) [-]; 0 where it is not known."""
    band_to_swing: float = field(default=0.0, metadata=json_as(omit=True))
    """S over the 98 % range of OP [-]; 0 where it is not known."""
    over_closest: float = field(default=0.0, metadata=json_as(omit=True))
    """Evidence of stiction against the closest other explanation, asinh(LLR / 20) [-]; 0 where it is not known."""
    contributions: tuple[Contribution, ...] = ()
    """What each feature adds to the log odds of stiction, the strongest first; not kept in a ledger."""
    evidence: float = field(default=0.0, metadata=json_as(omit=True))
    """Log odds of stiction beyond those of the prior [-]."""

    @property
    def in_control(self) -> bool:
        """Whether the valve can be judged in it."""
        return self.state == "in_control" and self.S is not None

    @property
    def valve_cause(self) -> float:
        """Probability that the valve makes the loop oscillate, by this window alone [-]."""
        return self.causes[CAUSES.index("valve")] if self.causes else 0.0

    @property
    def duration(self) -> float:
        """Its length [s]."""
        return self.end_s - self.start_s

    def to_row(self) -> dict[str, Any]:
        """JSON-ready form for a ledger, which `from_row` reads exactly."""
        kept = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "contributions"}
        return kept | {"start": self.start and self.start.isoformat()}

    @classmethod
    def from_row(cls, row: Mapping[str, Any]) -> Window:
        """Window of what `to_row` gave."""
        start = row["start"] and datetime.fromisoformat(row["start"])
        return cls(**{**row, "start": start, "causes": tuple(row["causes"])})


@dataclass(frozen=True, slots=True)
class Change(Result):
    """A change of the fault of a valve."""

    _json_keys = ("time", "time_s", "kind", "S_before", "S_after", "probability")

    time: datetime | None
    """When it happened, to a window; the begin of the growth of a growing fault; None without times."""
    time_s: float
    """The same, from the first sample of the first record [s]."""
    kind: ChangeKind
    """`onset` where the valve sticks since, `repair` where it no longer does, `growth` where S grows since."""
    S_before: float | None
    """S before [% of span]; None of a valve in order."""
    S_after: float | None
    """S since, or now [% of span]; of a repaired valve what S is below; None where that is not known."""
    probability: float = field(metadata=FOUR_DECIMALS)
    """Probability that there is a change [-]."""
    first: int = 0
    """Number of the first window after it [-]."""


def evidence_of(probability: float, prior: float = DEFAULT_PRIOR) -> float:
    """Log odds of a probability beyond those of its prior [-].

    Examples
    --------
    >>> evidence_of(0.25), round(evidence_of(0.5), 3)
    (0.0, 1.099)
    """
    return log_odds(probability) - log_odds(prior)
