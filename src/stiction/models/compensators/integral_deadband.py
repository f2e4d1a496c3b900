"""Integral deadband: the integral of the controller is held while the error is small."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from stiction.models.compensators.component import Compensator, CompensatorState, StictionEstimate, pulse_state
from stiction.models.numba_compile import inline_kernel

__all__ = ["IntegralDeadband", "integral_deadband_step"]


@inline_kernel
def integral_deadband_step(op: float, sp: float, pv: float, band: float) -> CompensatorState:
    """One sample; `hold` applies to the next sample."""
    hold = 0.0
    if abs(sp - pv) < band:
        hold = 1.0
    return pulse_state(op, 0.0, hold, op, op, 0.0, 0.0)


@dataclass(frozen=True)
class IntegralDeadband(Compensator):
    """Integration stops while the error lies within a band; the signal to the valve is the controller's own.

    Parameters
    ----------
    band : float
        Half width of the band about the set point [PV units].

    Raises
    ------
    ParameterError
        When `band` is negative or not a finite number.

    Notes
    -----
    The cheapest remedy, built into many controllers. If the band is wider than the error that stiction causes, the
    cycle ends without added stem travel, and an offset of up to `band` remains. A band that is too narrow slows the
    cycle and does not end it. The integral is held from the sample after the error enters the band.

    `for_stiction` gives a band of J in PV units (at least S / 20) plus three standard deviations of the noise.

    References
    ----------
    kuphaldt2019, footnote on the integral deadband.

    Examples
    --------
    >>> import stiction as st
    >>> st.IntegralDeadband.for_stiction(S=3.0, J=1.0, dt=1.0, gain=3.0)
    IntegralDeadband(band=3.0)
    """

    code: ClassVar[int] = 4

    band: float

    def __post_init__(self) -> None:
        self._require(positive={}, not_negative={"band": "PV units"})

    @classmethod
    def _settings(cls, estimate: StictionEstimate) -> Self:
        return cls(estimate.gain * max(estimate.J, estimate.S / 20.0) + 3.0 * estimate.noise)

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Band [PV units]."""
        del dt
        return (self.band,)
