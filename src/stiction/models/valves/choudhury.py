"""Choudhury's two-parameter valve: deadband plus stickband S and slip jump J, by the flow chart of 2005."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from stiction.models.component import TIE_TOLERANCE, Valve, ValveState
from stiction.models.numba_compile import inline_kernel

__all__ = ["Choudhury", "choudhury_step"]


@inline_kernel
def _sign(value: float) -> float:
    return 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)


@inline_kernel
def choudhury_step(op: float, s: ValveState, S: float, J: float, lag: float) -> ValveState:
    """One sample of the flow chart; `lag` is (S - J) / 2; after a reversal (S + J) / 2 breaks the stem away."""
    trend = op - s.op
    sign = _sign(trend)
    rest = s.rest
    moves = False
    if sign == s.direction:
        if s.moving != 0.0:
            moves = True
        elif _sign(op - rest) * _sign(rest - s.position) == 1.0:
            moves = abs(op - rest) > J
        else:
            moves = abs(op - s.position) > (S + J) / 2.0
    else:
        if s.moving != 0.0:
            rest = s.op
        moves = sign != 0.0 and abs(op - s.position) > (S + J) / 2.0
    if moves:
        side = sign if sign != 0.0 else _sign(op - s.position)
        return ValveState(op - side * lag, op, rest, sign, 1.0, trend, 0.0, 0.0, 0.0, 0.0)
    return ValveState(s.position, op, rest, sign, 0.0, trend, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Choudhury(Valve):
    """Choudhury's valve, the (S, J) model by its first authors.

    Parameters
    ----------
    S : float
        Deadband plus stickband [% of span].
    J : float
        Slip jump [% of span]. J = 0 is pure deadband, J < S undershoots, J = S has no offset, J > S
        overshoots.

    Raises
    ------
    ParameterError
        When `S` or `J` is negative or not a finite number.

    Notes
    -----
    After a slip the stem follows a monotone input, so the model has no staircase (srinivasan2008, section V). A single
    noisy sample that reverses the input brings the stem to rest. For J <= S the model equals Kano's; for J > S it
    equals neither Kano's model nor its own describing function. A stem that rests beyond OP (J > S) breaks away again
    when OP is (S + J) / 2 from it, in either direction.

    References
    ----------
    choudhury2005.

    Examples
    --------
    >>> import stiction as st
    >>> st.stroke(st.Choudhury(S=3.0, J=1.0), [0.0, 2.0, 2.5, 3.0, 1.0, -0.5], dt=1.0).mv.tolist()
    [0.0, 0.0, 1.5, 2.0, 2.0, 0.5]
    """

    code: ClassVar[int] = 3

    S: float
    J: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require_bands("S", "J")

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Bands and lag (S, J, (S - J) / 2) [% of span], the bands widened by a tie."""
        del dt
        return (self.S * (1.0 + TIE_TOLERANCE), self.J * (1.0 + TIE_TOLERANCE), (self.S - self.J) / 2.0)
