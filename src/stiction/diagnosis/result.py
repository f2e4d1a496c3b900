"""Results that several stages of a diagnosis use: the oscillation, and the evidence of one method."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from stiction.display.json_form import Result, json_as

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Evidence", "FurtherOscillation", "Oscillation", "Verdict"]

Verdict = Literal["stiction", "no_stiction", "undecided"]


@dataclass(frozen=True, slots=True)
class FurtherOscillation(Result):
    """An oscillation beside the main one, and no harmonic of it."""

    period: float = field(metadata=json_as("period_s"))
    """Period [s]."""
    regularity: float
    """Thornhill's regularity r of what is left without the main oscillation [-]."""
    share: float
    """Share of the control error's variance that it carries, harmonics included [-]."""


@dataclass(frozen=True, slots=True)
class Oscillation(Result):
    """Whether the loop oscillates, how fast and how regularly."""

    _json_keys = (
        "oscillating", "period as period_s", "regularity", "amplitude_pv", "amplitude_op", "cycles", "load_events",
        "share", "others", "sp_cycles",
    )  # fmt: skip

    oscillating: bool
    """True when the autocorrelation is regular or enough load events were counted."""
    period: float
    """Period [s]; NaN when there is none."""
    regularity: float
    """Thornhill's regularity r = T / (3 sigma_T) of the autocorrelation's zero crossings [-]; above 1 is regular, and
    10, where a perfect wave stands, the most reported."""
    amplitude_pv: float
    """Half peak to peak of the PV over a period, median [engineering units]."""
    amplitude_op: float
    """Half peak to peak of the OP over a period, median [% of span]."""
    cycles: float
    """Number of periods in the record [-]."""
    load_events: int
    """Load events counted by Haegglund's IAE rule [-]."""
    load_events_needed: int
    """Load events that make an oscillation by the same rule [-]."""
    acf: NDArray[np.float64] = field(repr=False, compare=False, default_factory=lambda: np.empty(0))
    """Autocorrelation of the control error, lags 0, dt, 2 dt ... [-]."""
    reason: str = ""
    """The finding in a sentence."""
    share: float = float("nan")
    """Share of the control error's variance that the oscillation carries, harmonics included [-]; NaN when unknown."""
    others: tuple[FurtherOscillation, ...] = ()
    """Further oscillations, which are no harmonics of this one, the larger first."""
    sp_cycles: bool = False
    """Whether the set point repeats with the same period, as where a master controller cycles."""


@dataclass(frozen=True, slots=True)
class Evidence(Result):
    """What one method says about one loop: a row of the evidence table."""

    method: str
    """Name of the method, by its author or the field's term."""
    index: float
    """The method's index [-]; NaN when it could not be computed."""
    threshold: float
    """The index from which the method votes for stiction [-]."""
    vote: Verdict
    """What the method says."""
    valid: bool
    """Whether its condition of validity is met."""
    why: str
    """The signal used, the condition, and what the index means here."""
    source: str = ""
    """Key of the source in references.bib."""
