"""Constant reinforcement (Ivan and Lakshminarayanan): a constant is added in the direction of the controller's move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from stiction.models.compensators.component import Compensator, CompensatorState, StictionEstimate, pulse_state, sign
from stiction.models.numba_compile import inline_kernel

__all__ = ["ConstantReinforcement", "constant_reinforcement_step"]


@inline_kernel
def constant_reinforcement_step(op: float, s: CompensatorState, amplitude: float) -> CompensatorState:
    """One sample: the pulse has the direction of the last change of the controller output."""
    return pulse_state(op, amplitude * sign(op - s.op), 0.0, op, op, 0.0, 0.0)


@dataclass(frozen=True)
class ConstantReinforcement(Compensator):
    r"""A constant in the direction of the controller's move, in each sample.

    .. math:: u(t) = u_c(t) + a\,\mathrm{sgn}(u_c(t) - u_c(t - \Delta t))

    Parameters
    ----------
    amplitude : float
        Height of the constant [% of span].

    Raises
    ------
    ParameterError
        When `amplitude` is negative or not a finite number.

    Notes
    -----
    This compensator has the lowest PV deviation of the pulse compensators and the most stem travel: it drives the valve
    in every sample, and with noise the direction is random.

    `for_stiction` gives amplitude S / 2; the authors advise half to all of the stiction band.

    References
    ----------
    After ivan2009.

    Examples
    --------
    >>> import stiction as st
    >>> st.ConstantReinforcement.for_stiction(S=3.0, J=1.0, dt=1.0)
    ConstantReinforcement(amplitude=1.5)
    """

    code: ClassVar[int] = 2

    amplitude: float

    def __post_init__(self) -> None:
        self._require(positive={}, not_negative={"amplitude": "% of span"})

    @classmethod
    def _settings(cls, estimate: StictionEstimate) -> Self:
        return cls(estimate.S / 2.0)

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Amplitude [% of span]."""
        del dt
        return (self.amplitude,)
