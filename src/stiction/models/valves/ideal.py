"""The ideal valve: the stem follows its input."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from stiction.models.component import Valve, ValveState
from stiction.models.numba_compile import inline_kernel

__all__ = ["Ideal", "ideal_step"]


@inline_kernel
def ideal_step(op: float, s: ValveState) -> ValveState:
    """x(t) = u(t)."""
    return ValveState(op, op, op, 0.0, 1.0, op - s.op, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Ideal(Valve):
    """A valve without friction.

    Raises
    ------
    ParameterError
        When the travel is not two ascending positions.

    Examples
    --------
    >>> import stiction as st
    >>> st.stroke(st.Ideal(), [0.0, 1.0, 0.5], dt=1.0).mv.tolist()
    [0.0, 1.0, 0.5]
    """

    code: ClassVar[int] = 0

    def parameters(self, dt: float) -> tuple[float, ...]:
        """None: the ideal valve has no parameters."""
        del dt
        return ()
