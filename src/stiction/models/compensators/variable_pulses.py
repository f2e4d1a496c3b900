"""A knocker whose pulses grow with the error, up to a limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from stiction.models.compensators.component import (
    Compensator,
    CompensatorState,
    StictionEstimate,
    advance_pulse_train,
    pulse_state,
    sign,
)
from stiction.models.numba_compile import inline_kernel

__all__ = ["VariablePulses", "variable_pulses_step"]


@inline_kernel
def variable_pulses_step(
    op: float, sp: float, pv: float, s: CompensatorState, amplitude: float, width: float, interval: float, full: float
) -> CompensatorState:
    """One sample; `width` and `interval` in samples."""
    reference, latest, elapsed, phase = advance_pulse_train(op, s, interval)
    pulse = 0.0
    if phase > 0.0 and elapsed < width:
        pulse = min(amplitude, amplitude * abs(sp - pv) / full) * sign(op - reference)
    return pulse_state(op, pulse, 0.0, reference, latest, elapsed, phase)


@dataclass(frozen=True)
class VariablePulses(Compensator):
    """Haegglund's knocker with pulses of the height amplitude min(1, abs(e) / full).

    Parameters
    ----------
    amplitude : float
        Greatest height of a pulse [% of span].
    width : float
        Length of a pulse [s], rounded to whole samples.
    interval : float
        Time from the start of one pulse to the start of the next [s], rounded to whole samples; above `width`.
    full : float
        Error above which pulses have their greatest height [PV units].

    Raises
    ------
    ParameterError
        When a value is outside its limits.

    Notes
    -----
    The source uses pulses of variable amplitude to reduce wear. The rule here, proportional to the error, is this
    project's. `for_stiction` gives the settings of the knocker, and full pulses above an error of S / 4 in PV units.
    For J < S there is less stem travel and more PV deviation than with the knocker.

    References
    ----------
    After munaro2016.

    Examples
    --------
    >>> import stiction as st
    >>> st.VariablePulses.for_stiction(S=3.0, J=1.0, dt=1.0, gain=3.0)
    VariablePulses(amplitude=1.5, width=2.0, interval=5.0, full=2.25)
    """

    code: ClassVar[int] = 3

    amplitude: float
    width: float
    interval: float
    full: float

    def __post_init__(self) -> None:
        self._require(
            positive={"width": "s", "interval": "s", "full": "PV units"}, not_negative={"amplitude": "% of span"}
        )
        self._pauses(self.width, self.interval)

    @classmethod
    def _settings(cls, estimate: StictionEstimate) -> Self:
        return cls(estimate.S / 2.0, 2.0 * estimate.dt, 5.0 * estimate.dt, estimate.gain * estimate.S / 4.0)

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Amplitude [% of span], width and interval [samples], error of full height [PV units]."""
        return (self.amplitude, self._samples("width", dt), self._samples("interval", dt), self.full)
