"""The protocol of all parts of a loop, and the state that a valve step passes on.

A component is two scalar functions on its page, ``X_at_rest(...) -> state`` and
``X_step(input, state, parameters...) -> state``: floats in, one named tuple of floats out, no arrays,
no exceptions. A frozen dataclass checks the parameters and packs them for the kernels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from stiction.errors import require_not_negative, require_range

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["TIE_TOLERANCE", "Valve", "ValveState", "at_rest"]

TIE_TOLERANCE = 1e-9
"""Relative tolerance of a band [-]: an input that equals a band to within rounding has not crossed it."""


class ValveState(NamedTuple):
    """State of a valve between two samples; each model uses the fields it needs."""

    position: float
    """Stem position [% of span]."""
    op: float
    """Input of the last sample [% of span]."""
    rest: float
    """Input at which the stem came to rest [% of span]."""
    direction: float
    """Direction of the friction or of the motion: -1, 0 or 1 [-]."""
    moving: float
    """1 while the stem follows its input, 0 while it rests [-]."""
    trend: float
    """Change of the input in the last sample [% of span]."""
    velocity: float
    """Stem velocity, physical valves only [m/s]; change of position in the last sample, eq. 5 as printed [%]."""
    force: float
    """Internal state of the friction law, physical valves only [m]."""
    pressure: float
    """Actuator pressure after its lag, physical valves only [Pa]."""
    integral: float
    """Integral of the positioner, physical valves only [% of span]."""


def at_rest(op: float, position: float) -> ValveState:
    """Return the state of a data-driven valve whose stem rests at `position` while its input is `op`."""
    return ValveState(position, op, position, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Valve:
    """Base class of all valve models.

    Parameters
    ----------
    travel : tuple of float
        End stops of the stem [% of span]; by default there are none, so that a loop can be written in
        deviations about an operating point.
    """

    code: ClassVar[int]

    travel: tuple[float, float] = field(default=(-math.inf, math.inf), kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "travel", require_range("travel", self.travel))

    def _require_bands(self, *names: str) -> None:
        """Convert the named bands to floats; raise when one is not a number of 0 or more [% of span]."""
        for name in names:
            object.__setattr__(self, name, require_not_negative(name, getattr(self, name), "% of span"))

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Parameters of the step for the sampling period `dt` [s], in the order of its arguments."""
        raise NotImplementedError

    def pack(self, dt: float) -> NDArray[np.float64]:
        """End stops and parameters as the kernels take them, shape (2 + n_parameters,)."""
        return np.array([*self.travel, *self.parameters(dt)], dtype=np.float64)
