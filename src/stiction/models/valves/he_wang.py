"""He and Wang's semi-physical valve: He's bands, and a slip that overshoots the balance of forces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from stiction.errors import ParameterError, require_finite, require_not_negative
from stiction.models.component import TIE_TOLERANCE, Valve, ValveState
from stiction.models.numba_compile import inline_kernel

__all__ = ["HeWang", "he_wang_step", "overshoot_factor"]


@inline_kernel
def he_wang_step(op: float, s: ValveState, fs: float, fd: float, K: float) -> ValveState:
    """Break away when the residual force op - position exceeds fs, and slip K times the distance to fd."""
    force = op - s.position
    if abs(force) > fs:
        direction = math.copysign(1.0, force)
        position = s.position + K * (force - direction * fd)
        return ValveState(position, op, op, direction, 1.0, op - s.op, 0.0, 0.0, 0.0, 0.0)
    return ValveState(s.position, op, s.rest, s.direction, 0.0, op - s.op, 0.0, 0.0, 0.0, 0.0)


def overshoot_factor(damping_ratio: float) -> float:
    r"""K of a stem whose damping ratio is known [-].

    A mass that slips against constant friction overshoots its balance as the step response of mass, spring and
    damper does: :math:`K = 1 + \exp(-\pi\zeta / \sqrt{1 - \zeta^2})`, and 1 where :math:`\zeta \ge 1`.

    `damping_ratio`: damping ratio of mass, spring and viscous friction [-]. Returns K [-], from 1 to 2.

    Examples
    --------
    >>> from stiction.models.valves.he_wang import overshoot_factor
    >>> round(overshoot_factor(0.0583), 3)
    1.832
    """
    zeta = require_not_negative("damping_ratio", damping_ratio, "-")
    return 1.0 if zeta >= 1.0 else 1.0 + math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))


@dataclass(frozen=True)
class HeWang(Valve):
    r"""He and Wang's semi-physical valve.

    .. math:: x \leftarrow x + K\,(e - \operatorname{sgn}(e)\, fd) \text{ if } |e| > fs, \quad e = u - x

    Parameters
    ----------
    fs : float
        Static friction band [% of span].
    fd : float
        Dynamic friction band [% of span], at most `fs`.
    K : float
        Length of the slip over the distance to the balance of forces [-], from 1 (He's valve, a well damped stem)
        to 2 (no damping).

    Raises
    ------
    ParameterError
        When a band is negative or not finite, `fd` exceeds `fs`, or K is outside 1 to 2.

    Notes
    -----
    K follows from the damping ratio of the stem (`overshoot_factor`). K = 1.99, the published value, needs a
    damping ratio of 0.003; heavily packed valves have K = 1.

    References
    ----------
    After hewang2014; K from the damping ratio is derived in this project.

    Examples
    --------
    >>> import stiction as st
    >>> st.stroke(st.HeWang(fs=2.0, fd=1.0, K=1.5), [0.0, 2.0, 3.0], dt=1.0).mv.tolist()
    [0.0, 0.0, 3.0]
    """

    code: ClassVar[int] = 11

    fs: float
    fd: float
    K: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require_bands("fs", "fd")
        object.__setattr__(self, "K", require_finite("K", self.K, "-"))
        if self.fd > self.fs:
            raise ParameterError(
                f"fd = {self.fd:g} % exceeds fs = {self.fs:g} %; give fd <= fs, because dynamic friction is at most "
                "static friction."
            )
        if not 1.0 <= self.K <= 2.0:
            raise ParameterError(
                f"K = {self.K:g} is outside 1 to 2; give 1 (the slip ends where the forces balance) to 2 (full "
                "rebound)."
            )

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Bands (fs, fd) [% of span], fs widened by a tie, and K [-]."""
        del dt
        return (self.fs * (1.0 + TIE_TOLERANCE), self.fd, self.K)
