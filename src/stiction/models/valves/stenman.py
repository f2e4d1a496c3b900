"""Stenman's one-parameter valve: the stem stays, or jumps to its input."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from stiction.models.component import TIE_TOLERANCE, Valve, ValveState
from stiction.models.numba_compile import inline_kernel

__all__ = ["Stenman", "stenman_step"]


@inline_kernel
def stenman_step(op: float, s: ValveState, d: float) -> ValveState:
    """Eq. 4: x(t) = x(t-1) if |u(t) - x(t-1)| <= d, else u(t)."""
    if abs(op - s.position) > d:
        return ValveState(op, op, op, 0.0, 1.0, op - s.op, 0.0, 0.0, 0.0, 0.0)
    return ValveState(s.position, op, s.rest, 0.0, 0.0, op - s.op, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Stenman(Valve):
    r"""Stenman's relay with memory, the simplest model of a sticky valve.

    .. math:: x(t) = x(t-1) \text{ if } |u(t) - x(t-1)| \le d, \text{ else } u(t)

    Parameters
    ----------
    d : float
        Stiction band [% of span].

    Raises
    ------
    ParameterError
        When `d` is negative or not a finite number.

    Notes
    -----
    Deadband and slip jump are tied together (S = J = d), and any slow input gives a staircase: the
    model never follows a fast ramp.

    References
    ----------
    stenman2003; srinivasan2008, eq. 4.

    Examples
    --------
    >>> import stiction as st
    >>> st.stroke(st.Stenman(d=2.0), [0.0, 1.5, 2.5, 4.0, 5.0], dt=1.0).mv.tolist()
    [0.0, 0.0, 2.5, 2.5, 5.0]
    """

    code: ClassVar[int] = 1

    d: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require_bands("d")

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Band (d,) [% of span], widened by a tie."""
        del dt
        return (self.d * (1.0 + TIE_TOLERANCE),)
