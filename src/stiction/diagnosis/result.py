"""What a diagnosis says: the oscillation, the evidence, the windows, the verdict; what was identified: `identified`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from stiction.diagnosis.identified import plain
from stiction.diagnosis.loop_state import LoopState, describe_action, describe_state
from stiction.display.number_format import format_probability

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identified import ControllerFit, Identification
    from stiction.records import LoopRecord, Quality
    from stiction.records.quality.storage_rate import StoredMasks

__all__ = [
    "Counted",
    "Diagnosis",
    "Evidence",
    "FurtherOscillation",
    "Oscillation",
    "Verdict",
    "Window",
]

Verdict = Literal["stiction", "no_stiction", "undecided"]


@dataclass(frozen=True, slots=True)
class FurtherOscillation:
    """An oscillation beside the main one, and no harmonic of it."""

    period: float
    """Period [s]."""
    regularity: float
    """Thornhill's regularity r of what is left without the main oscillation [-]."""
    share: float
    """Share of the control error's variance that it carries, harmonics included [-]."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "period_s": plain(self.period),
            "regularity": plain(self.regularity),
            "share": plain(self.share),
        }


@dataclass(frozen=True, slots=True)
class Oscillation:
    """Whether the loop oscillates, how fast and how regularly."""

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

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "oscillating": self.oscillating,
            "period_s": plain(self.period),
            "regularity": plain(self.regularity),
            "amplitude_pv": plain(self.amplitude_pv),
            "amplitude_op": plain(self.amplitude_op),
            "cycles": plain(self.cycles),
            "load_events": self.load_events,
            "share": plain(self.share),
            "others": [other.to_dict() for other in self.others],
            "sp_cycles": self.sp_cycles,
        }


@dataclass(frozen=True, slots=True)
class Evidence:
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

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "method": self.method,
            "index": plain(self.index),
            "threshold": plain(self.threshold),
            "vote": self.vote,
            "valid": self.valid,
            "why": self.why,
            "source": self.source,
        }


@dataclass(frozen=True, slots=True)
class Window:
    """Whether the valve sticks in one window of the record: a stretch, judged by itself."""

    first: int
    """First sample of the window in the whole record."""
    last: int
    """One past its last sample."""
    verdict: Verdict
    """`stiction`, `no_stiction` or `undecided` of this window."""
    S: float
    """Deadband plus stickband found in it [% of span]."""
    J: float
    """Slip jump found in it [% of span]."""
    fit: float
    """Share of the PV's variation that the sticky valve explains in it [%]."""
    fit_linear: float
    """The same for a good valve [%]."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        numbers = {name: plain(getattr(self, name)) for name in ("S", "J", "fit", "fit_linear")}
        return {"first": self.first, "last": self.last, "verdict": self.verdict, **numbers}


@dataclass(frozen=True, slots=True)
class Counted:
    """What one feature of a record did to the probability of stiction."""

    feature: str
    """Its name."""
    value: float
    """Its value [-]."""
    usual: float
    """What it usually is, over the records the weights were found on [-]."""
    log_odds: float
    """What it adds to the log odds of stiction, against its usual value [-]."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {"feature": self.feature, **{k: plain(getattr(self, k)) for k in ("value", "usual", "log_odds")}}


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """The answer to the main question about one loop."""

    record: LoopRecord = field(repr=False)
    """The record as it was looked at; `quality.first` and `quality.last` bound the stretch that was analysed."""
    verdict: Verdict
    """`stiction`, `no_stiction` or `undecided`."""
    probability: float
    """Probability that the valve sticks [-]."""
    probability_before_doubts: float
    """The same by all that was found, before any doubt about the data [-]; of a record that could not be judged the one
    told."""
    cause: str
    """Named cause: stiction, deadband, tight tuning, external disturbance, sensor, saturation, none, unknown."""
    reason: str
    """Why, in a sentence or two."""
    action: str
    """What to do, in a sentence or two."""
    oscillation: Oscillation
    """Whether and how the loop oscillates."""
    evidence: tuple[Evidence, ...]
    """What each method says."""
    quality: Quality
    """What the data are worth."""
    identification: Identification | None = None
    """Stiction and process found; None when the record did not allow a search."""
    settings: dict[str, Any] = field(default_factory=dict)
    """What the diagnosis ran with: the valve model that was fitted, the limits of a call; and what a caller adds."""
    windows: tuple[Window, ...] = ()
    """Where the valve sticks and where not, in order; empty where the record was judged as one."""
    causes: dict[str, float] = field(default_factory=dict)
    """Probability of each cause [-]; empty where the record could not be judged."""
    features: dict[str, float] = field(default_factory=dict)
    """The findings as the tables of weights take them, by name (`verdict.features`) [-]; empty where the record could
    not be judged."""
    counted: tuple[Counted, ...] = ()
    """What each feature did to the probability of stiction before any doubt about the data, the strongest first."""
    controller: ControllerFit | None = None
    """The controller found from OP and error; None when the record did not allow a search."""
    loop_state: LoopState = field(default_factory=lambda: LoopState("in_control", 0.0, 0.0))
    """Whether the controller moves the valve and the process answers; what follows is only judged where it does."""
    stored: StoredMasks | None = field(default=None, repr=False, compare=False)
    """At which samples OP and PV were stored, where what was between is told by the controller's law; else None."""

    def summary(self) -> str:
        """The verdict in a sentence or two."""
        head = f"{self.record.tag}: {self.verdict} (probability {format_probability(self.probability)})."
        return f"{head} {self.reason} {self.action}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form, as `stiction diagnose --json` prints it."""
        found = self.identification
        return {
            "file": self.record.provenance.source,
            "tag": self.record.tag,
            "verdict": self.verdict,
            "probability": round(self.probability, 4),
            "probability_before_doubts": round(self.probability_before_doubts, 4),
            "cause": self.cause,
            "causes": {name: round(share, 4) for name, share in self.causes.items()},
            "reason": self.reason,
            "action": self.action,
            "op_unit": self.record.op_unit,
            "dt_s": self.record.dt,
            "stiction": found.to_dict() if found is not None else None,
            "controller": self.controller.to_dict() if self.controller is not None else None,
            "oscillation": self.oscillation.to_dict(),
            "loop_state": self.loop_state.to_dict()
            | {
                "why": describe_state(self.loop_state, self.record.start, self.record.provenance.pv_unit),
                "action": describe_action(self.loop_state),
            },
            "evidence": [row.to_dict() for row in self.evidence],
            "quality": self.quality.to_dict(),
            "windows": [window.to_dict() for window in self.windows],
            "counted": [one.to_dict() for one in self.counted],
        }
