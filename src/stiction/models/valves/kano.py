"""Kano's two-parameter valve: deadband plus stickband S and slip jump J, with the direction of friction as a state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from stiction.models.component import TIE_TOLERANCE, Valve, ValveState
from stiction.models.numba_compile import inline_kernel

__all__ = ["Kano", "kano_at_rest", "kano_step"]


@inline_kernel
def kano_at_rest(op: float, position: float, lag: float) -> ValveState:
    """Rest in the middle of the band: (S + J) / 2 of input breaks the stem away in either direction."""
    return ValveState(position, op, position + lag, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inline_kernel
def kano_step(op: float, s: ValveState, S: float, J: float, lag: float) -> ValveState:
    """One sample of the flow chart; `lag` is (S - J) / 2."""
    trend = op - s.op
    rest = s.rest
    moving = s.moving
    if moving != 0.0 and trend * s.trend <= 0.0:
        rest = s.op
        moving = 0.0
    direction = s.direction
    travelled = direction * (op - rest)
    if moving == 0.0:
        if -travelled > S:
            direction = -direction
            moving = 1.0
        elif travelled > J:
            moving = 1.0
    position = s.position
    if moving != 0.0:
        position = op - direction * lag
    return ValveState(position, op, rest, direction, moving, trend, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Kano(Valve):
    """Kano's valve: the preferred form of the (S, J) model.

    The stem rests until its input has moved by S after a reversal, or by J in the same direction. Then it slips to
    (S - J) / 2 from the input, and follows until the input stops or reverses.

    Parameters
    ----------
    S : float
        Deadband plus stickband [% of span].
    J : float
        Slip jump [% of span]; J > S overshoots.

    Raises
    ------
    ParameterError
        When `S` or `J` is negative or not a finite number.

    Notes
    -----
    A repeated sample counts as a stop, so the model is not rate independent. For J <= S it is the same valve as
    Choudhury's and as Srinivasan's with r = 0.

    References
    ----------
    kano2004.

    Examples
    --------
    >>> import stiction as st
    >>> st.stroke(st.Kano(S=3.0, J=1.0), [0.0, 2.0, 2.5, 3.0, 1.0, -0.5], dt=1.0).mv.tolist()
    [0.0, 0.0, 1.5, 2.0, 2.0, 0.5]
    """

    code: ClassVar[int] = 2

    S: float
    J: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require_bands("S", "J")

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Bands and lag (S, J, (S - J) / 2) [% of span], the bands widened by a tie."""
        del dt
        return (self.S * (1.0 + TIE_TOLERANCE), self.J * (1.0 + TIE_TOLERANCE), (self.S - self.J) / 2.0)
