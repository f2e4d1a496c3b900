"""What a diagnosis says: the oscillation, the evidence, the identified valve and process, the verdict."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records import LoopRecord, Quality

__all__ = [
    "Counted",
    "Diagnosis",
    "ErrorSurface",
    "Evidence",
    "FurtherOscillation",
    "Identification",
    "Oscillation",
    "ProcessFit",
    "Stretch",
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
            "period_s": _number(self.period),
            "regularity": _number(self.regularity),
            "share": _number(self.share),
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

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "oscillating": self.oscillating,
            "period_s": _number(self.period),
            "regularity": _number(self.regularity),
            "amplitude_pv": _number(self.amplitude_pv),
            "amplitude_op": _number(self.amplitude_op),
            "cycles": _number(self.cycles),
            "load_events": self.load_events,
            "share": _number(self.share),
            "others": [other.to_dict() for other in self.others],
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
            "index": _number(self.index),
            "threshold": _number(self.threshold),
            "vote": self.vote,
            "valid": self.valid,
            "why": self.why,
            "source": self.source,
        }


@dataclass(frozen=True, slots=True)
class ProcessFit:
    """The linear process found together with the valve."""

    gain: float
    """Steady gain [PV units per % of span]; for an integrating process [PV units per % per second]."""
    time_constant: float
    """Time constant [s]."""
    dead_time: float
    """Dead time [s]."""
    integrating: bool
    """True when the process integrates."""
    lag: float = 0.0
    """The smaller of two lags in series, part of `time_constant` [s]; 0 where one was enough."""


@dataclass(frozen=True, slots=True)
class ErrorSurface:
    """Simulation error of the best process for each (S, J): the floor on which the search ran."""

    S: NDArray[np.float64]
    """Values of S tried [% of span], shape (n_S,)."""
    J: NDArray[np.float64]
    """Ratios J / S tried [-], shape (n_J,)."""
    error: NDArray[np.float64]
    """Sum of squared simulation error over that of the PV about its drift [-], shape (n_S, n_J)."""
    limit: float
    """Error below which (S, J) lies in the 95 % region [-]."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """What one stretch of the record says by itself: drift of S, and stiction that comes and goes."""

    first: int
    """First sample of the stretch in the record as analysed."""
    last: int
    """One past its last sample."""
    S: float
    """Deadband plus stickband [% of span]."""
    J: float
    """Slip jump [% of span]."""
    fit: float
    """Share of the PV's variation that a sticky valve explains in it [%]: the record's, or the stretch's own where its
    S is another."""
    fit_linear: float
    """The same for a good valve [%]."""
    gain: float = float("nan")
    """Twice the log likelihood by which a sticky valve foretells it better than a good one [-]; NaN where not asked."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        numbers = {name: _number(getattr(self, name)) for name in ("S", "J", "fit", "fit_linear", "gain")}
        return {"first": self.first, "last": self.last, **numbers}


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
        numbers = {name: _number(getattr(self, name)) for name in ("S", "J", "fit", "fit_linear")}
        return {"first": self.first, "last": self.last, "verdict": self.verdict, **numbers}


@dataclass(frozen=True, slots=True)
class Identification:
    """Stiction and process found together from OP and PV."""

    model: str
    """Valve model fitted."""
    S: float
    """Deadband plus stickband [% of span]."""
    J: float
    """Slip jump [% of span]."""
    S_low: float
    """Lower end of the 95 % interval of S [% of span]."""
    S_high: float
    """Upper end of the 95 % interval of S [% of span]."""
    J_low: float
    """Lower end of the 95 % interval of J [% of span]."""
    J_high: float
    """Upper end of the 95 % interval of J [% of span]."""
    process: ProcessFit
    """The process found with the sticky valve."""
    fit: float
    """Share of the PV's variation that the sticky valve and process explain in simulation [%]."""
    fit_linear: float
    """The same for the best linear process with a good valve [%]."""
    surface: ErrorSurface = field(repr=False, compare=False)
    """The whole error surface."""
    mv: NDArray[np.float64] = field(repr=False, compare=False)
    """Estimated valve position [% of span], shape (n_samples,) of the stretch analysed."""
    pv: NDArray[np.float64] = field(repr=False, compare=False)
    """PV simulated from the OP with the fitted valve and process [engineering units], same shape; NaN where it was not
    compared: of an oscillation half a period at both ends, and what lies between stretches that do not meet."""
    reason: str = ""
    """What limits the estimate, in a sentence; empty when nothing does."""
    linear: ProcessFit | None = None
    """The process found with a good valve."""
    lag: float = 0.0
    """Lag of the actuator, which holds the air behind OP [s]; 0 where none stands out."""
    stretches: tuple[Stretch, ...] = ()
    """What each stretch of the record says by itself, in order."""
    S_bootstrap: tuple[float, float] = (float("nan"), float("nan"))
    """Ends between which the likeliest S lies in 95 of 100 draws of the record's half cycles [% of span]: how far S
    hangs on single cycles. The interval of S is wider, since no (S, J) valve is the true one."""
    drift: float = float("nan")
    """Change of S over the record [% of span per h]; NaN of fewer than four stretches in which the valve sticks."""
    drift_error: float = float("nan")
    """Standard error of the drift [% of span per h]."""
    beats_good: float = float("nan")
    """Vuong's statistic by which the sticky valve foretells the PV better than a good one, cycle by cycle [-]; NaN
    where only the dense search was made."""
    gain: float = float("nan")
    """Twice the log likelihood by which it does [-]."""
    gain_in_part: float = float("nan")
    """The same in the third of the record where it is largest [-]."""
    jump_gain: float = float("nan")
    """Twice the log likelihood by which it beats a valve that hardly jumps [-]."""
    own_samples: bool = False
    """Whether the record shows the controller's own samples, so that nothing trips the valve unseen."""
    rough: Identification | None = field(default=None, repr=False, compare=False)
    """What the dense search by simulation error found by itself; None where this is it."""
    parameters: dict[str, float] = field(default_factory=dict)
    """The model's own parameters where they are not S and J: d, or sb and sj [% of span] and r [% of span / s]."""
    parameter_intervals: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Their 95 % intervals [as above]; r may reach infinity: then a stem that never follows explains the record too."""

    def summary(self) -> str:
        """The finding in a line."""
        own = ", ".join(
            f"{name} = {value:.3g} (95 % {low:.3g} to {high:.3g})"
            for (name, value), (low, high) in zip(
                self.parameters.items(), self.parameter_intervals.values(), strict=True
            )
        )
        return (own + "; " if own else "") + (
            f"S = {self.S:.2f} % (95 % {self.S_low:.2f} to {self.S_high:.2f}), "
            f"J = {self.J:.2f} % (95 % {self.J_low:.2f} to {self.J_high:.2f})"
            f"{f', behind a lag of {self.lag:.3g} s' if self.lag > 0.0 else ''}; "
            f"simulation explains {self.fit:.0f} % of the PV, a good valve {self.fit_linear:.0f} %."
        )

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "S": _number(self.S),
            "J": _number(self.J),
            "S_low": _number(self.S_low),
            "S_high": _number(self.S_high),
            "J_low": _number(self.J_low),
            "J_high": _number(self.J_high),
            "S_bootstrap": [_number(end) for end in self.S_bootstrap],
            "lag": _number(self.lag),
            "model": self.model,
            "fit": _number(self.fit),
            "fit_linear": _number(self.fit_linear),
            "process": {
                "gain": _number(self.process.gain),
                "time_constant": _number(self.process.time_constant),
                "dead_time": _number(self.process.dead_time),
                "integrating": self.process.integrating,
                "lag": _number(self.process.lag),
            },
            "stretches": [stretch.to_dict() for stretch in self.stretches],
            "drift_per_h": _number(self.drift),
            "drift_error_per_h": _number(self.drift_error),
            "beats_good": _number(self.beats_good),
            "gain": _number(self.gain),
            "gain_in_part": _number(self.gain_in_part),
            "jump_gain": _number(self.jump_gain),
            "own_samples": self.own_samples,
            "parameters": {name: _number(value) for name, value in self.parameters.items()},
            "parameter_intervals": {
                name: [_number(end) for end in ends] for name, ends in self.parameter_intervals.items()
            },
        }


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
        return {"feature": self.feature, **{k: _number(getattr(self, k)) for k in ("value", "usual", "log_odds")}}


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """The answer to the main question about one loop."""

    record: LoopRecord = field(repr=False)
    """The record; `quality.first` and `quality.last` bound the stretch that was analysed."""
    verdict: Verdict
    """`stiction`, `no_stiction` or `undecided`."""
    probability: float
    """Probability that the valve sticks [-]."""
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
    """Settings the diagnosis ran with."""
    windows: tuple[Window, ...] = ()
    """Where the valve sticks and where not, in order; empty where the record was judged as one."""
    causes: dict[str, float] = field(default_factory=dict)
    """Probability of each cause [-]; empty where the record could not be judged."""
    counted: tuple[Counted, ...] = ()
    """What each feature did to the probability of stiction before any doubt about the data, the strongest first."""

    def summary(self) -> str:
        """The verdict in a sentence or two."""
        return f"{self.record.tag}: {self.verdict} (probability {self.probability:.2f}). {self.reason} {self.action}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form, as `stiction diagnose --json` prints it."""
        found = self.identification
        return {
            "file": self.record.provenance.source,
            "tag": self.record.tag,
            "verdict": self.verdict,
            "probability": round(self.probability, 4),
            "cause": self.cause,
            "causes": {name: round(share, 4) for name, share in self.causes.items()},
            "reason": self.reason,
            "action": self.action,
            "stiction": found.to_dict() if found is not None else None,
            "oscillation": self.oscillation.to_dict(),
            "evidence": [row.to_dict() for row in self.evidence],
            "quality": self.quality.to_dict(),
            "windows": [window.to_dict() for window in self.windows],
            "counted": [one.to_dict() for one in self.counted],
        }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
