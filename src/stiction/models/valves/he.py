"""He's two-parameter valve: static and dynamic friction bands fs and fd."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign
from typing import ClassVar

from stiction.errors import ParameterError
from stiction.models.component import TIE_TOLERANCE, Valve, ValveState
from stiction.models.numba_compile import inline_kernel

__all__ = ["He", "he_step"]


@inline_kernel
def he_step(op: float, s: ValveState, fs: float, fd: float) -> ValveState:
    """A residual force op - position above fs breaks the stem away; afterwards the force is fd."""
    force = op - s.position
    if abs(force) > fs:
        return ValveState(op - copysign(fd, force), op, op, copysign(1.0, force), 1.0, op - s.op, 0.0, 0.0, 0.0, 0.0)
    return ValveState(s.position, op, s.rest, s.direction, 0.0, op - s.op, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class He(Valve):
    """He's valve: it rests again after every sample.

    Parameters
    ----------
    fs : float
        Static friction band [% of span].
    fd : float
        Dynamic friction band [% of span], at most `fs`.

    Raises
    ------
    ParameterError
        When a band is negative or not finite, or when `fd` exceeds `fs`.

    Notes
    -----
    The stem follows its input only where that moves by more than fs - fd in one sample: a hidden rate
    threshold (fs - fd) / dt that changes with the sampling period. It equals Srinivasan's valve with
    sb = fs, sj = fs - fd and r just above sj / dt (at exactly r Srinivasan's valve follows), and differs from
    Kano's by at most J at any instant.

    References
    ----------
    he2007.

    Examples
    --------
    >>> import stiction as st
    >>> st.stroke(st.He(fs=2.0, fd=1.0), [0.0, 2.0, 2.5, 3.0, 4.0, 1.0], dt=1.0).mv.tolist()
    [0.0, 0.0, 1.5, 1.5, 3.0, 3.0]
    """

    code: ClassVar[int] = 4

    fs: float
    fd: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require_bands("fs", "fd")
        if self.fd > self.fs:
            raise ParameterError(
                f"fd = {self.fd:g} % exceeds fs = {self.fs:g} %; give fd <= fs, because dynamic friction is at most "
                "static friction."
            )

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Bands (fs, fd) [% of span], fs widened by a tie."""
        del dt
        return (self.fs * (1.0 + TIE_TOLERANCE), self.fd)
