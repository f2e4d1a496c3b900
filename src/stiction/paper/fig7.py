"""Fig. 7: the Nyquist plot of the example loop against -1/N(A), as printed and corrected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.limitcycle import describing_function, harmonic_balance, predict_limit_cycles
from stiction.limitcycle.linear import linear_part
from stiction.models import PID, Loop, Stenman, TransferFunction

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.limitcycle import LimitCycle

__all__ = ["EXAMPLE_LOOP", "Curve", "Figure7", "figure7"]

EXAMPLE_LOOP = Loop(
    PID.parallel(Kp=0.5, Ki=1.0, Kd=0.1), Stenman(0.5), TransferFunction(np.array([1.0]), np.array([5.0, 6.0, 1.0])),
    dt=0.01,
)  # fmt: skip
"""srinivasan2008, section V.C: Gp = 1 / (5 s^2 + 6 s + 1), Gc = (0.1 s^2 + 0.5 s + 1) / s, d = 0.5."""


@dataclass(frozen=True)
class Curve:
    """One branch of -1/N(A)."""

    family: str
    """"half" or "integer"."""
    source: str
    """"corrected", "printed" (eqs. 6-7 letter by letter) or "roots repaired" (only the first misprint corrected)."""
    amplitude: NDArray[np.float64]
    """Amplitudes [% of span], shape (n,)."""
    value: NDArray[np.complex128]
    """-1/N there, shape (n,)."""


@dataclass(frozen=True)
class Figure7:
    """Data of Fig. 7."""

    omega: NDArray[np.float64]
    """Frequencies [rad/s], shape (n,)."""
    response: NDArray[np.complex128]
    """L(j omega) there, shape (n,)."""
    curves: tuple[Curve, ...]
    """-1/N(A), branch by branch."""
    corrected: tuple[LimitCycle, ...]
    """Crossings of the corrected describing function, both families, each with its exact cycle."""
    printed: tuple[LimitCycle, ...]
    """Crossings of eqs. 6-7 with the roots repaired: C is wrong, because a factor 2 is missing."""


@dataclass(frozen=True)
class _Printed:
    """Eqs. 6-7 with the roots repaired, as a nonlinearity."""

    d: float

    def describing_function(self, amplitude: Any) -> NDArray[np.complex128]:
        return describing_function(Stenman(self.d), amplitude, as_printed="roots repaired")

    def jumps(self, largest: float) -> list[float]:
        del largest
        return [0.5 * self.d, 1.5 * self.d, 2.5 * self.d]


def figure7() -> Figure7:
    """Cross L(j omega) of the paper's example with -1/N(A).

    Returns the Nyquist curve, the branches of -1/N(A) printed and corrected, and all crossings by kind.

    A and C are stable, B is the boundary at the jump of N(A) at A = 3d/2. The printed eq. 6 gives C with
    A = 0.987, T = 20.7 s; the corrected one A = 0.945, T = 16.28 s; the loop itself 0.939 and 16.24 s. The paper
    shows one of two families of rest levels: the levels 0, +-d, ... give two more stable cycles.

    References
    ----------
    srinivasan2008, Fig. 7, eqs. 6, 7.

    Examples
    --------
    >>> from stiction.paper.fig7 import figure7
    >>> data = figure7()
    >>> [(c.kind, round(c.amplitude, 3), round(c.period, 2)) for c in data.corrected if c.family == "half"]
    [('cycle', 0.573, 21.11), ('boundary', 0.75, 20.12), ('cycle', 0.945, 16.28)]
    """
    valve = EXAMPLE_LOOP.valve
    assert isinstance(valve, Stenman)
    linear = linear_part(EXAMPLE_LOOP)
    omega = np.geomspace(0.02, 3.0, 600)
    curves = []
    for family, first in (("half", 0.5), ("integer", 1.0)):
        for k in range(3):
            a = (first + k + np.linspace(1e-6, 1.0 - 1e-6, 200)) * valve.d
            curves.append(Curve(family, "corrected", a, -1.0 / describing_function(valve, a, family=family)))
    for k in range(2):
        a = (0.5 + k + np.linspace(1e-6, 1.0 - 1e-6, 200)) * valve.d
        for source, printed in (("printed", True), ("roots repaired", "roots repaired")):
            with np.errstate(divide="ignore"):
                curves.append(Curve("half", source, a, -1.0 / describing_function(valve, a, as_printed=printed)))
    return Figure7(
        omega, linear.at(1j * omega), tuple(curves), predict_limit_cycles(EXAMPLE_LOOP),
        harmonic_balance(linear, _Printed(valve.d)),
    )  # fmt: skip
