"""What identification finds: valve, process and controller, how sure they are, and the error surface."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np

from stiction.display.number_format import format_interval

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = [
    "GOOD_VALVES",
    "J_OPEN",
    "J_ROUGH",
    "J_UNKNOWN",
    "PLAY",
    "RIVALS",
    "ControllerFit",
    "ErrorSurface",
    "Explanation",
    "Identification",
    "ProcessFit",
    "Rival",
    "Stretch",
    "leaves_open",
    "plain",
    "told_of_J",
]

J_OPEN = 0.6
"""Length of the interval of J, as a share of S, beyond which it leaves J open [-]."""
PLAY = 0.12
"""J over S below which a valve has play and does not jump [-]: simulated loops with J = 0 stay below 0.03."""
J_UNKNOWN = "J cannot be told from this record."
"""What `Identification.reason` says where the interval of J leaves it open."""
J_ROUGH = "J is told only roughly: the valve jumps, by how much is open."
"""The same where the interval lies above that of play."""

Explanation = Literal["good", "bent", "gated", "relaxation", "wave", "beside_wave"]
"""What else than a valve that sticks may move the PV as it moves (see `Identification.rivals`)."""
RIVALS: tuple[Explanation, ...] = get_args(Explanation)
"""All of them."""
GOOD_VALVES: tuple[Explanation, ...] = tuple(name for name in RIVALS if name != "beside_wave")
"""All but the one in which the valve that sticks has a wave from outside beside it too."""


@dataclass(frozen=True, slots=True)
class ProcessFit:
    """The linear process found together with the valve."""

    gain: float
    """Steady gain [PV units per % of span]; for an integrating process [PV units per % per second]."""
    time_constant: float
    """Time constant [s]: the sum of both lags, where there are two."""
    dead_time: float
    """Dead time [s]."""
    integrating: bool
    """True when the process integrates."""
    lag: float = 0.0
    """The smaller of two lags in series, part of `time_constant` [s]; 0 where one was enough."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        numbers = {name: plain(getattr(self, name)) for name in ("gain", "time_constant", "dead_time", "lag")}
        return {**numbers, "integrating": self.integrating}


class ControllerFit(NamedTuple):
    """A controller that explains the OP."""

    Kc: float
    """Proportional gain [% of span per PV unit]; 0 for a controller that only integrates."""
    Ti: float
    """Integral time [s]: Kc / Ki; inf without an integral part, 0 for a controller that only integrates."""
    explained: float
    """Share that it explains of the OP's variation [-], or of its moves where `why` says moves."""
    action: float
    """Sign of the process gain that makes the loop stable: that of Ki; 0 when the record does not tell."""
    form: str = "unknown"
    """P, I, PI, PID, or I-P, PI-D, I-PD with the part behind the hyphen on the PV alone; or unknown."""
    Td: float = 0.0
    """Derivative time [s]."""
    Ki: float = math.nan
    """Integral gain [% of span per PV unit and s]."""
    Kc_error: float = math.nan
    """Standard error of Kc [% of span per PV unit]."""
    Ti_error: float = math.nan
    """Standard error of Ti [s]."""
    exact: bool = False
    """Whether all but rounding of the moves is explained, as of the controller's own samples."""
    why: str = ""
    """Which comparison was made, what was left out, and why no form is named where none is."""
    own_samples: bool = False
    """Whether the record shows the controller's own samples: nothing is left of the moves, or no more than rounding
    leaves and a slower record would leave more."""
    left: float = math.nan
    """Share of the OP's moves that no form of controller explains [-]."""
    samples_late: int = 0
    """Samples that PV was stored late, by the controller's law; a diagnosis takes it as much earlier."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {name: plain(value) if isinstance(value, float) else value for name, value in self._asdict().items()}


@dataclass(frozen=True, slots=True)
class ErrorSurface:
    """Simulation error of the best process for each (S, J), and for each S and dead time: where the search ran."""

    S: NDArray[np.float64]
    """Values of S tried [% of span], shape (n_S,)."""
    J: NDArray[np.float64]
    """Ratios J / S tried [-], shape (n_J,)."""
    error: NDArray[np.float64]
    """Sum of squared simulation error over that of the PV about its drift [-], shape (n_S, n_J)."""
    limit: float
    """Error below which (S, J) lies in the 95 % region [-]."""
    dead_time: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    """Dead times tried [s], shape (n_dead_times,); none where only a stem was looked at."""
    error_late: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0)))
    """The error of the best J and lag for each S and dead time [-], shape (n_S, n_dead_times)."""


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
    likelier_than_good: float = math.nan
    """Twice the log likelihood by which a sticky valve predicts it better than a good one [-]; NaN where not asked."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        numbers = {name: plain(getattr(self, name)) for name in ("S", "J", "fit", "fit_linear", "likelier_than_good")}
        return {"first": self.first, "last": self.last, **numbers}


class Rival(NamedTuple):
    """By how much the likeliest sticky valve predicts the PV better than another explanation."""

    beats: float = math.nan
    """Vuong's statistic, half cycle by half cycle [-]."""
    likelier: float = math.nan
    """Twice the log likelihood ratio [-]."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {"beats": plain(self.beats), "likelier": plain(self.likelier)}


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
    pv_linear: NDArray[np.float64] = field(default_factory=lambda: np.empty(0), repr=False, compare=False)
    """PV simulated with that process behind a good valve, shape and gaps of `pv`."""
    actuator_lag: float = 0.0
    """Lag of the actuator, which holds the air behind OP [s]; 0 where none stands out."""
    stretches: tuple[Stretch, ...] = ()
    """What each stretch of the record says by itself, in order."""
    S_bootstrap: tuple[float, float] = (math.nan, math.nan)
    """Ends between which the likeliest S lies in 95 of 100 draws of the record's half cycles [% of span]: how far S
    hangs on single cycles. The interval of S is wider, since no (S, J) valve is the true one."""
    drift: float = math.nan
    """Change of S over the record [% of span per h]; NaN of fewer than four stretches in which the valve sticks."""
    drift_error: float = math.nan
    """Standard error of the drift [% of span per h]."""
    S_detectable: float = math.nan
    """Smallest S with which a valve that sticks would most likely have shown [% of span]; infinite where that cannot be
    told of any, NaN where the record does not show the controller's own samples or only the dense search was made."""
    rivals: Mapping[Explanation, Rival] = field(default_factory=dict)
    """By how much the likeliest sticky valve predicts the PV better than each other explanation; none where only the
    dense search was made. That valve's actuator may lag where the one told has none, since the record does not show the
    controller's own samples; so in the likelihoods that follow.

    `good`: a good valve, straight and alone. `bent`: one whose characteristic is bent. `gated`: one that is also told
    the past of the PV without its noise. `relaxation`: one beside a relaxation oscillation from outside, which turns
    where the PV comes to a level. `wave`: one beside a wave from outside, the same in every period but for one change;
    not there where the loop does not oscillate, or too short for a wave to be told. `beside_wave`: one with such a wave
    beside both it and the sticky valve, which may stick in a loop that something else moves as well."""
    likelier_in_part: float = math.nan
    """Twice the log likelihood ratio over a good valve in the third of the record where it is largest [-]."""
    likelier_than_play: float = math.nan
    """Twice the log likelihood ratio of the likeliest sticky valve over the likeliest one that hardly jumps [-]."""
    bent: str = ""
    """The bent characteristic that is the likeliest of those tried."""
    left_out: int = 0
    """Samples left out of the likelihood, since neither a sticky valve nor a good one predicts them [-]: a step of the
    load, or another upset."""
    own_samples: bool = False
    """Whether the record shows the controller's own samples, so that nothing trips the valve unseen."""
    rebuilt: bool = False
    """Whether the record does not show the controller's own samples, but its integral tells one between each two."""
    rough: Identification | None = field(default=None, repr=False, compare=False)
    """What the dense search by simulation error found by itself; None where this is it."""
    parameters: dict[str, float] = field(default_factory=dict)
    """The model's own parameters where they are not S and J: d, or sb and sj [% of span] and r [% of span / s]."""
    parameter_intervals: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Their 95 % intervals [as above]; r may reach infinity: then a stem that never follows explains the record too."""

    @property
    def J_open(self) -> bool:
        """Whether the interval of J is so long that it leaves J open (`J_OPEN`)."""
        return leaves_open(self.J_low, self.J_high, self.S)

    @property
    def J_told(self) -> str:
        """What is said of a J that is open, in a sentence; empty where it is not."""
        return told_of_J(self.J_low, self.J_high, self.S)

    def over(self, name: Explanation) -> Rival:
        """By how much the likeliest sticky valve beats one of its `rivals`; NaN where it was not compared."""
        return self.rivals.get(name, Rival())

    def nearest(self, *names: Explanation) -> Rival:
        """The same of the rival that comes nearest of several, in either number by itself."""
        beats, likelier = np.fmin.reduce([self.over(name) for name in names]).tolist()
        return Rival(beats, likelier)

    @property
    def beats_any(self) -> float:
        """Vuong's statistic over the good valve that comes nearest: straight, or with one of those helps [-]."""
        return self.nearest(*GOOD_VALVES).beats

    @property
    def likelier_than_any(self) -> float:
        """Twice the log likelihood ratio over that good valve [-]."""
        return self.nearest(*GOOD_VALVES).likelier

    def summary(self, unit: str = "%") -> str:
        """The finding in a line, S and J with the unit that stands behind a number; an open J by its interval alone."""
        own = ", ".join(
            f"{name} = {value:.3g} (95 % {low:.3g} to {high:.3g})"
            for (name, value), (low, high) in zip(
                self.parameters.items(), self.parameter_intervals.values(), strict=True
            )
        )
        S, S_low, S_high = format_interval(self.S, self.S_low, self.S_high)
        J, J_low, J_high = format_interval(self.J, self.J_low, self.J_high)
        jump = f"= {J} {unit} (95 % {J_low} to {J_high})"
        if self.J_told == J_UNKNOWN:
            jump = f"open ({J_low} to {J_high} {unit})"
        return (own + "; " if own else "") + (
            f"S = {S} {unit} (95 % {S_low} to {S_high}), J {jump}"
            f"{f', behind a lag of {self.actuator_lag:.3g} s' if self.actuator_lag > 0.0 else ''}; "
            f"simulation explains {self.fit:.0f} % of the PV, a good valve {self.fit_linear:.0f} %."
        )

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "S": plain(self.S),
            "J": plain(self.J),
            "S_low": plain(self.S_low),
            "S_high": plain(self.S_high),
            "J_low": plain(self.J_low),
            "J_high": plain(self.J_high),
            "S_bootstrap": [plain(end) for end in self.S_bootstrap],
            "S_detectable": plain(self.S_detectable),
            "actuator_lag": plain(self.actuator_lag),
            "model": self.model,
            "fit": plain(self.fit),
            "fit_linear": plain(self.fit_linear),
            "process": self.process.to_dict(),
            "linear": self.linear.to_dict() if self.linear is not None else None,
            "stretches": [stretch.to_dict() for stretch in self.stretches],
            "drift_per_h": plain(self.drift),
            "drift_error_per_h": plain(self.drift_error),
            "rivals": {name: self.over(name).to_dict() for name in RIVALS},
            "likelier_in_part": plain(self.likelier_in_part),
            "likelier_than_play": plain(self.likelier_than_play),
            "bent": self.bent,
            "left_out": self.left_out,
            "own_samples": self.own_samples,
            "rebuilt": self.rebuilt,
            "parameters": {name: plain(value) for name, value in self.parameters.items()},
            "parameter_intervals": {
                name: [plain(end) for end in ends] for name, ends in self.parameter_intervals.items()
            },
        }


def leaves_open(low: float, high: float, S: float) -> bool:
    """Whether an interval of the slip jump is so long that it leaves it open (`J_OPEN`).

    Parameters
    ----------
    low, high : float
        Ends of the interval [% of span].
    S : float
        Deadband plus stickband [% of span].

    Returns
    -------
    bool
        True where it is.
    """
    return high - low > J_OPEN * S


def told_of_J(low: float, high: float, S: float) -> str:
    """Say of an interval of the slip jump that it leaves it open.

    Parameters
    ----------
    low, high : float
        Ends of the interval [% of span].
    S : float
        Deadband plus stickband [% of span].

    Returns
    -------
    str
        A sentence; empty where it does not.

    Examples
    --------
    >>> told_of_J(0.1, 4.0, 4.1), told_of_J(1.6, 4.3, 4.1), told_of_J(1.6, 2.0, 4.1)
    ('J cannot be told from this record.', 'J is told only roughly: the valve jumps, by how much is open.', '')
    """
    if not leaves_open(low, high, S):
        return ""
    return J_ROUGH if low > PLAY * S else J_UNKNOWN


def plain(value: float) -> float | None:
    """Give a number for JSON, which knows neither NaN nor infinity [unit of `value`]."""
    return float(value) if np.isfinite(value) else None
