"""Base class and state of all compensators, which act between controller and valve.

A compensator reads controller output, set point and PV, and computes the signal to the valve. For the next sample it
can also make the controller hold its integral, or track the signal to the valve (as in manual), which opens the loop.
``X_step(op, ..., state, parameters...) -> state`` as for valves.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np

from stiction.errors import ParameterError, require_finite, require_not_negative, require_positive
from stiction.models.numba_compile import inline_kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "Compensator",
    "CompensatorState",
    "StictionEstimate",
    "advance_pulse_train",
    "compensator_at_rest",
    "pulse_state",
    "sign",
]


class CompensatorState(NamedTuple):
    """Output and state of a compensator between two samples; each compensator uses the fields it needs."""

    valve_signal: float
    """Signal to the valve, before the output limits of the controller [% of span]."""
    hold: float
    """1 while the controller must hold its integral [-]."""
    track: float
    """1 while the controller must track the valve signal: the loop is open [-]."""
    op: float
    """Controller output of the last sample [% of span]."""
    sp: float
    """Set point of the last sample [PV units]."""
    reference: float
    """Controller output at the onset of the previous pulse [% of span]."""
    latest: float
    """Controller output at the onset of the latest pulse [% of span]."""
    elapsed: float
    """Samples since the latest pulse, the last cycle or the last move began [-]."""
    phase: float
    """0 before the first pulse or during observation; then 1, 2, ... [-]."""
    side: float
    """Side of the band on which the error was last outside: -1, 0 or 1 [-]."""
    position: float
    """Estimated stem position [% of span]."""
    cycle_count: float
    """Cycles that began since the start of the observation [-]."""
    samples: float
    """Samples in the observed cycles, without the first cycle [-]."""
    total: float
    """Sum of `position` over them [% of span]."""
    low: float
    """Lowest controller output in the observed cycles [% of span]."""
    high: float
    """Highest controller output in the observed cycles [% of span]."""
    failed_moves: float
    """Successive moves after which the error did not settle within the band [-]."""


@inline_kernel
def sign(x: float) -> float:
    """Sign of x: -1, 0 or 1; 0 for NaN."""
    if x > 0.0:
        return 1.0
    if x < 0.0:
        return -1.0
    return 0.0


@inline_kernel
def compensator_at_rest(op: float, sp: float) -> CompensatorState:
    """State of a compensator before its first sample, which passes `op` on."""
    return CompensatorState(op, 0.0, 0.0, op, sp, op, op, 0.0, 0.0, 0.0, op, 0.0, 0.0, 0.0, op, op, 0.0)


@inline_kernel
def pulse_state(
    op: float, pulse: float, hold: float, reference: float, latest: float, elapsed: float, phase: float
) -> CompensatorState:
    """State of a compensator that adds `pulse` to the controller output."""
    return CompensatorState(
        op + pulse, hold, 0.0, op, 0.0, reference, latest, elapsed, phase, 0.0, op, 0.0, 0.0, 0.0, op, op, 0.0
    )


@inline_kernel
def advance_pulse_train(op: float, s: CompensatorState, interval: float) -> tuple[float, float, float, float]:
    """Advance a train of pulses by a sample: `reference`, `latest`, `elapsed`, `phase`."""
    elapsed = s.elapsed + 1.0
    if elapsed >= interval:
        return s.latest, op, 0.0, 1.0
    return s.reference, s.latest, elapsed, s.phase


class StictionEstimate(NamedTuple):
    """Identified stiction, process gain and noise, from which settings are computed."""

    S: float
    """Deadband plus stickband [% of span]."""
    J: float
    """Slip jump [% of span]."""
    dt: float
    """Sampling period of the controller [s]."""
    gain: float
    """Absolute static gain of the process [PV units per % of span]."""
    noise: float
    """Standard deviation of the measurement noise [PV units]."""


@dataclass(frozen=True)
class Compensator:
    """Base class of all compensators."""

    code: ClassVar[int]

    @classmethod
    def for_stiction(cls, S: float, J: float, dt: float, *, gain: float = 1.0, noise: float = 0.0) -> Self:
        """Settings from identified stiction.

        Parameters
        ----------
        S : float
            Deadband plus stickband, above 0 [% of span].
        J : float
            Slip jump [% of span].
        dt : float
            Sampling period of the controller [s].
        gain : float
            Static gain of the process, not 0 [PV units per % of span]; used where a setting is in PV units.
        noise : float
            Standard deviation of the measurement noise [PV units]; used where a band must stand above it.

        Raises
        ------
        ParameterError
            When a value is outside its limits.
        """
        gain = abs(require_finite("gain", gain, "PV units per % of span"))
        return cls._settings(
            StictionEstimate(
                require_positive("S", S, "% of span"),
                require_not_negative("J", J, "% of span"),
                require_positive("dt", dt, "s"),
                require_positive("gain", gain, "PV units per % of span"),
                require_not_negative("noise", noise, "PV units"),
            )
        )

    @classmethod
    def _settings(cls, estimate: StictionEstimate) -> Self:
        raise NotImplementedError

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Parameters of the step for the sampling period `dt` [s], in the order of its arguments."""
        raise NotImplementedError

    def pack(self, dt: float) -> NDArray[np.float64]:
        """Parameters as the kernels take them for the sampling period `dt` [s], shape (n_parameters,)."""
        return np.array(self.parameters(dt), dtype=np.float64)

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form: the name of the compensator and its settings."""
        return {"compensator": type(self).__name__, **asdict(self)}

    def _require(self, *, positive: dict[str, str], not_negative: dict[str, str]) -> None:
        """Convert the named settings (-> unit) to floats; raise when one is outside its limits."""
        for name, unit in positive.items():
            object.__setattr__(self, name, require_positive(name, getattr(self, name), unit))
        for name, unit in not_negative.items():
            object.__setattr__(self, name, require_not_negative(name, getattr(self, name), unit))

    @staticmethod
    def _pauses(width: float, interval: float) -> None:
        """Raise when there is no pause between pulses [s]."""
        if width >= interval:
            raise ParameterError(
                f"width = {width:g} s leaves no pause in interval = {interval:g} s; give width < interval."
            )

    def _at_least(self, name: str, lowest: float) -> None:
        """Convert the setting to the type of `lowest`; raise when it is below that or not a number."""
        value = require_finite(name, getattr(self, name), "-")
        if value < lowest or (isinstance(lowest, int) and value % 1.0 != 0.0):
            kind = "a whole number" if isinstance(lowest, int) else "a number"
            raise ParameterError(f"{name} = {value:g} is not allowed; give {kind} of {lowest:g} or more.")
        object.__setattr__(self, name, type(lowest)(value))

    def _samples(self, name: str, dt: float) -> float:
        """Whole samples in the time called `name`."""
        time = getattr(self, name)
        samples = round(time / dt)
        if samples < 1:
            raise ParameterError(f"{name} = {time:g} s is shorter than one sample of {dt:g} s; make it longer.")
        return float(samples)
