"""Constant reinforcement (Ivan and Lakshminarayanan): a constant is added in the direction of the controller's move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from stiction.models.compensators.component import Compensator, CompensatorState, StictionEstimate, pulse_state, sign
from stiction.models.numba_compile import inline_kernel

__all__ = ["ConstantReinforcement", "constant_reinforcement_step"]


@inline_kernel
def constant_reinforcement_step(op: float, s: CompensatorState, amplitude: float) -> CompensatorState:
    """One sample: the direction is that of the last change of the controller's output."""
    return pulse_state(op, amplitude * sign(op - s.op), 0.0, op, op, 0.0, 0.0)


@dataclass(frozen=True)
class ConstantReinforcement(Compensator):
    r"""A constant in the direction of the controller's move, in each sample.

    .. math:: u(t) = u_c(t) + a\,\mathrm{sgn}(u_c(t) - u_c(t - \Delta t))

    Parameters
    ----------
    amplitude : float
        What is added [% of span].

    Raises
    ------
    ParameterError
        When `amplitude` is negative or not a finite number.

    Notes
    -----
    Lowest PV deviation of the pulse compensators, highest price: the valve is driven in every sample, and the direction
    is that of the noise where there is any. Simulated here, stem travel rises 3 to 7 times without noise, and 14 to 40
    times with it.

    `for_stiction` gives amplitude S / 2; half to all of the stiction band is recalled as the authors' advice.

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
    def _settings(cls, given: StictionEstimate) -> Self:
        return cls(given.S / 2.0)

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Amplitude [% of span]."""
        del dt
        return (self.amplitude,)
