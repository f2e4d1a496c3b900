"""What identification finds: valve, process and controller, and how sure they are."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from stiction.display.json_form import Result
from stiction.display.number_format import format_interval
from stiction.display.result_display import ResultDisplay

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.dead_zone import DeadZone

__all__ = ["ControllerFit", "Identification", "LikelihoodSurface", "ProcessFit", "Segment"]

MAX_J_INTERVAL = 0.6
"""Length of the interval of J, as a share of S, from which J is called undetermined [-]."""
MAX_PLAY_RATIO = 0.12
"""J over S up to which a valve has a deadband and no slip jump [-]."""


@dataclass(frozen=True, slots=True)
class ProcessFit(Result):
    """The linear process found together with the valve."""

    _json_keys = ("gain", "time_constant", "dead_time", "lag", "integrating")

    gain: float
    """Steady gain [PV units per % of span]; of an integrating process [PV units per % of span and second]."""
    time_constant: float
    """Time constant [s]: the sum of both lags where there are two."""
    dead_time: float
    """Dead time [s]."""
    integrating: bool
    """True when the process integrates."""
    lag: float = 0.0
    """The smaller of two lags in series, part of `time_constant` [s]; 0 where one was enough."""


@dataclass(frozen=True, slots=True)
class ControllerFit(Result):
    """A controller that explains the OP."""

    Kc: float
    """Proportional gain [% of span per PV unit]; 0 for a controller that only integrates."""
    Ti: float
    """Integral time [s]: Kc / Ki; inf without an integral part, 0 for a controller that only integrates."""
    explained: float
    """Share of the OP's variation that it explains [-], or of its moves where `why` says moves."""
    action: float
    """Sign of the process gain that makes the loop stable: the sign of Ki; 0 when unknown [-]."""
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
    """Whether all but rounding of the moves of OP is explained, so that no move between samples is missing."""
    why: str = ""
    """Which comparison was made, what was left out, and why no form is named where none is."""
    unexplained: float = math.nan
    """Share of the OP's moves that no form of controller explains [-]."""


@dataclass(frozen=True, slots=True)
class LikelihoodSurface:
    """Twice the log likelihood ratio over a good valve for each (S, J / S) of the first search."""

    S: NDArray[np.float64]
    """Values of S [% of span], shape (n_S,)."""
    ratio: NDArray[np.float64]
    """Values of J / S [-], shape (n_ratio,)."""
    likelihood_ratio: NDArray[np.float64]
    """Twice the log likelihood ratio of the better rule of motion [-], shape (n_S, n_ratio)."""


@dataclass(frozen=True, slots=True)
class Segment(Result):
    """What one part of the record says by itself: drift of S, and stiction that comes and goes."""

    first: int
    """First sample of the part in the record as analysed."""
    last: int
    """One past its last sample."""
    S: float
    """Deadband plus stickband [% of span]."""
    J: float
    """Slip jump [% of span]."""
    likelihood_ratio: float
    """Twice the log likelihood ratio of a sticky valve over a good one in this part [-]."""


@dataclass(frozen=True, slots=True)
class Identification(ResultDisplay, kind="identification"):
    """Stiction and process found together from OP and PV, or from OP and the valve position."""

    _json_keys = (
        "S", "J", "S_low", "S_high", "J_low", "J_high", "fit", "fit_linear", "model", "by_position", "process",
        "linear", "segments", "drift as drift_per_h", "drift_error as drift_error_per_h", "likelihood_ratios",
        "process_gains", "reason", "parameters", "parameter_intervals",
    )  # fmt: skip

    model: str
    """Valve model fitted: kano, stenman or three_parameter."""
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
    linear: ProcessFit
    """The process found with a good valve."""
    fit: float
    """Share of the PV's variation that the sticky valve and its process explain in simulation [%]."""
    fit_linear: float
    """The same for a good valve and its process [%]."""
    mv: NDArray[np.float64] = field(repr=False, compare=False)
    """Estimated valve position [% of span], shape (n_samples,) of the part analysed."""
    pv: NDArray[np.float64] = field(repr=False, compare=False)
    """PV simulated from the OP with the fitted valve and process [engineering units], same shape; NaN where it was not
    compared: half a period at both ends of an oscillation."""
    pv_linear: NDArray[np.float64] = field(repr=False, compare=False)
    """PV simulated with a good valve, shape and gaps of `pv`."""
    likelihood_ratios: Mapping[str, float] = field(default_factory=dict)
    """Twice the log likelihood ratio of the sticky valve over each other explanation [-]: `good`, `deadband` (a sticky
    valve without slip jump), `dead_zone`, `relay_load`, `periodic_load`, and
    `beside_periodic_load` (the same load added to both). A name is missing where the comparison was not possible."""
    process_gains: Mapping[str, float] = field(default_factory=dict)
    """Process gain from the valve position to the PV over its standard error [-]: of the `stem` alone, and of the
    `stem_beside_op`, where a good valve may act as well."""
    dead_zone: DeadZone | None = None
    """The most likely dead zone at fixed OP, in place of a sticky valve; None where it was not searched for."""
    surface: LikelihoodSurface | None = field(default=None, repr=False, compare=False)
    """The first search over S and J / S."""
    segments: tuple[Segment, ...] = ()
    """What each part of the record says by itself, in order."""
    drift: float = math.nan
    """Change of S over the record [% of span per h]; NaN of fewer than four parts in which the valve sticks."""
    drift_error: float = math.nan
    """Standard error of the drift [% of span per h]."""
    reason: str = ""
    """What limits the estimate, in a sentence; empty when nothing does."""
    by_position: bool = False
    """Whether the recorded valve position was compared, not the PV."""
    interval_features: tuple[float, ...] = ()
    """What the intervals were computed from (`intervals.INTERVAL_FEATURES`) [-]."""
    parameters: dict[str, float] = field(default_factory=dict)
    """The model's own parameters where they are not S and J: d, or sb and sj [% of span] and r [% of span / s]."""
    parameter_intervals: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Their 95 % intervals [units of `parameters`]; r may reach infinity."""

    @property
    def is_play(self) -> bool:
        """Whether the valve found has a deadband and no slip jump: play, not stiction."""
        return self.J <= MAX_PLAY_RATIO * self.S

    @property
    def J_undetermined(self) -> bool:
        """Whether the interval of J is longer than `MAX_J_INTERVAL` of S."""
        return self.J_high - self.J_low > MAX_J_INTERVAL * self.S

    @property
    def J_remark(self) -> str:
        """What to say about J where its interval is long; empty where it is not."""
        if not self.J_undetermined:
            return ""
        if self.J_low > MAX_PLAY_RATIO * self.S:
            return "J is known only roughly: the valve jumps, but the size of the jump is uncertain."
        return "J cannot be determined from this record."

    def summary(self, unit: str = "%") -> str:
        """The finding in a line; `unit` stands behind S and J."""
        own = "".join(
            f"{name} = {value:.3g} (95 % {low:.3g} to {high:.3g}), "
            for (name, value), (low, high) in zip(
                self.parameters.items(), self.parameter_intervals.values(), strict=True
            )
        )
        S, S_low, S_high = format_interval(self.S, self.S_low, self.S_high)
        J, J_low, J_high = format_interval(self.J, self.J_low, self.J_high)
        unknown = self.J_undetermined and self.J_low <= MAX_PLAY_RATIO * self.S
        jump = f"unknown ({J_low} to {J_high} {unit})" if unknown else f"= {J} {unit} (95 % {J_low} to {J_high})"
        return (
            f"{own}S = {S} {unit} (95 % {S_low} to {S_high}), J {jump}; the simulation explains {self.fit:.0f} % of "
            f"the {'valve position' if self.by_position else 'PV'}, with a good valve {self.fit_linear:.0f} %."
        )
