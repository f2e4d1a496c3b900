"""The paper's three-parameter valve: stick band sb, stick jump sj and the rate r below which it moves in stairs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, require_number
from stiction.models.component import TIE_TOLERANCE, Valve, ValveState
from stiction.models.lookup_table import Table
from stiction.models.numba_compile import inline_kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Srinivasan", "srinivasan_printed_step", "srinivasan_step"]


@inline_kernel
def srinivasan_step(op: float, s: ValveState, sb: float, lag: float, slow: float) -> ValveState:
    """Eq. 5 repaired: follow when fast, else slip when |op - position| > sb, else rest; `lag` is sb - sj."""
    trend = op - s.op
    force = op - s.position
    if s.direction * trend > 0.0 and abs(trend) >= slow:
        return ValveState(op - s.direction * lag, op, op, s.direction, 1.0, trend, 0.0, 0.0, 0.0, 0.0)
    if abs(force) > sb:
        direction = math.copysign(1.0, force)
        return ValveState(op - direction * lag, op, op, direction, 1.0, trend, 0.0, 0.0, 0.0, 0.0)
    return ValveState(s.position, op, s.rest, 0.0, 0.0, trend, 0.0, 0.0, 0.0, 0.0)


@inline_kernel
def srinivasan_printed_step(op: float, s: ValveState, sb: float, sj: float, slow: float) -> ValveState:
    """Eq. 5 as printed; the field `velocity` holds the last change of position."""
    trend = op - s.op
    change = 0.0
    if s.velocity == 0.0:
        if abs(op - s.position) > sb and trend != 0.0:
            change = math.copysign(sj, trend)
    elif trend * s.trend > 0.0 and abs(trend) >= slow:
        change = trend
    moving = 1.0 if change != 0.0 else 0.0
    return ValveState(s.position + change, op, s.rest, 0.0, moving, trend, change, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Srinivasan(Valve):
    r"""The three-parameter valve of the paper, whose behaviour depends on the rate of its input.

    With :math:`e = u(t) - x(t-1)` and the stem moving in direction :math:`m` (0 at rest),

    .. math::

        x(t) = \begin{cases}
        u(t) - m\,(sb - sj) & m\,\Delta u(t) > 0 \text{ and } |\Delta u(t)| \ge r\,\Delta t \\
        u(t) - \operatorname{sgn}(e)\,(sb - sj) & \text{else, if } |e| > sb \\
        x(t-1) & \text{otherwise}
        \end{cases}

    Parameters
    ----------
    sb : float or Table
        Stick band: input away from the stem that breaks it loose [% of span].
    sj : float or Table
        Stick jump [% of span], at most 2 sb.
    r : float
        Rate of the input below which a moving stem sticks again [% of span / s]; 0 always follows, infinity
        never does.
    as_printed : bool
        Use eq. 5 as the paper prints it. It has an error of up to one input increment per jump. After a step
        sgn(du) is 0 in the sample after the jump, and the stem never moves again.

    Raises
    ------
    ParameterError
        When a band is negative or not finite, `r` is negative or not a number, or sj exceeds 2 sb.

    Notes
    -----
    One model covers four: r = 0 is Kano's and Choudhury's valve with S = 2 sb - sj, J = sj; r just above
    sj / dt is He's; r infinite with sj = sb is Stenman's. They differ on ramps, not on held steps.

    References
    ----------
    srinivasan2008, eq. 5. The repair (jump by the sign of e, to a lag of sb - sj behind the input) is this
    project's; see the errata in the documentation.

    Examples
    --------
    >>> import stiction as st
    >>> fast, slow = [0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 2.25, 2.5, 2.75, 3.0]
    >>> valve = st.Srinivasan(sb=2.0, sj=1.0, r=0.5)
    >>> st.stroke(valve, fast, dt=1.0).mv.tolist()
    [0.0, 0.0, 0.0, 2.0, 3.0]
    >>> st.stroke(valve, slow, dt=1.0).mv.tolist()
    [0.0, 1.25, 1.25, 1.25, 1.25]
    """

    sb: float | Table
    sj: float | Table
    r: float
    as_printed: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require_bands(*(name for name in ("sb", "sj") if not isinstance(getattr(self, name), Table)))
        rate = require_number("r", self.r, "% of span / s")
        if rate < 0.0:
            raise ParameterError(
                f"r = {rate:g} %/s is negative; give 0 or more (with infinity the stem never follows)."
            )
        object.__setattr__(self, "r", rate)
        if isinstance(self.sb, Table) or isinstance(self.sj, Table):
            band, jump = self.tables()
            for x in np.union1d(band.position, jump.position):
                for speed in np.union1d(_rates(band), _rates(jump)):
                    _require_jump(band.at(x, speed), jump.at(x, speed))
        else:
            _require_jump(self.sb, self.sj)

    @property
    def code(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Code of the step in the switch."""
        if isinstance(self.sb, Table) or isinstance(self.sj, Table):
            return 8 if self.as_printed else 7
        return 6 if self.as_printed else 5

    def tables(self) -> tuple[Table, Table]:
        """(sb, sj) as tables, a number being a table with one entry."""
        band, jump = (v if isinstance(v, Table) else Table(np.zeros(1), np.array([v])) for v in (self.sb, self.sj))
        return band, jump

    def parameters(self, dt: float) -> tuple[float, ...]:
        """(sb, sb - sj, r dt), as printed (sb, sj, r dt) [% of span]; sb widened and r dt narrowed by a tie."""
        slow = self.r * dt * (1.0 - TIE_TOLERANCE)
        if isinstance(self.sb, Table) or isinstance(self.sj, Table):
            band, jump = (table.pack() for table in self.tables())
            return (slow, dt, float(5 + band.size), *band, *jump)
        sj = self.sj if self.as_printed else self.sb - self.sj
        return (self.sb * (1.0 + TIE_TOLERANCE), sj, slow)


def _require_jump(sb: float, sj: float) -> None:
    """Refuse a stick jump beyond twice the stick band [% of span]."""
    if sj > 2.0 * sb * (1.0 + TIE_TOLERANCE):
        raise ParameterError(
            f"sj = {sj:g} % exceeds 2 sb = {2.0 * sb:g} %: the stem would jump back and forth; give sj <= 2 sb."
        )


def _rates(table: Table) -> NDArray[np.float64]:
    assert table.rate is not None
    return table.rate
