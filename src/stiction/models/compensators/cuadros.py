"""The knocker that stops (after Cuadros, Munaro, Munareto): no pulses and no integration while the error is small."""

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

__all__ = ["Cuadros", "cuadros_step"]


@inline_kernel
def cuadros_step(
    op: float, sp: float, pv: float, s: CompensatorState, amplitude: float, width: float, interval: float, band: float
) -> CompensatorState:
    """One sample; `width` and `interval` in samples."""
    reference, latest, elapsed, phase = advance_pulse_train(op, s, interval)
    pulse = 0.0
    hold = 0.0
    if abs(sp - pv) < band:
        hold = 1.0
    elif phase > 0.0 and elapsed < width:
        pulse = amplitude * sign(op - reference)
    return pulse_state(op, pulse, hold, reference, latest, elapsed, phase)


@dataclass(frozen=True)
class Cuadros(Compensator):
    """Haegglund's knocker with a stop: pulses and integration pause while the error lies within a band.

    Parameters
    ----------
    amplitude : float
        Height of a pulse [% of span].
    width : float
        Length of a pulse [s], rounded to whole samples.
    interval : float
        Time from the start of one pulse to the start of the next [s], rounded to whole samples; above `width`.
    band : float
        Half width of the band about the set point [PV units].

    Raises
    ------
    ParameterError
        When a value is outside its limits.

    Notes
    -----
    The pulses bring the PV nearer to the set point than the bare cycle does, so a narrower band than for an
    integral deadband is enough. Then the valve rests. An offset of up to `band` stays. The paper stops
    the pulses on a small error. Holding the integral meanwhile is an addition of this project, as are the settings:
    those of the knocker, and a band of 0.75 J in PV units.

    References
    ----------
    After cuadros2012.

    Examples
    --------
    >>> import stiction as st
    >>> st.Cuadros.for_stiction(S=3.0, J=1.0, dt=1.0, gain=3.0)
    Cuadros(amplitude=1.5, width=2.0, interval=5.0, band=2.25)
    """

    code: ClassVar[int] = 5

    amplitude: float
    width: float
    interval: float
    band: float

    def __post_init__(self) -> None:
        self._require(
            positive={"width": "s", "interval": "s"}, not_negative={"amplitude": "% of span", "band": "PV units"}
        )
        self._pauses(self.width, self.interval)

    @classmethod
    def _settings(cls, estimate: StictionEstimate) -> Self:
        band = 0.75 * estimate.gain * max(estimate.J, estimate.S / 20.0) + 3.0 * estimate.noise
        return cls(estimate.S / 2.0, 2.0 * estimate.dt, 5.0 * estimate.dt, band)

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Amplitude [% of span], width and interval [samples], band [PV units]."""
        return (self.amplitude, self._samples("width", dt), self._samples("interval", dt), self.band)
