"""Fig. 2: the stem of Table I on ramps of the pressure, without friction and at two slopes, in both readings."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.display.json_form import Result
from stiction.paper.table1 import PSI_PER_PERCENT, READINGS, SLOPE_UNITS
from stiction.simulation.stroke import stroke

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import PhysicalValve

__all__ = ["Figure2", "Panel", "figure2", "find_slips", "pressure_ramp", "read_ramp"]

MAX_PRESSURE_PSI = 18.0
"""End of the ramp [psi]."""
PRESSURE_STEP_PSI = 0.002
"""Pressure between two samples [psi]."""
STROKE_IN = 6.0
"""Stem travel from 0 to 18 psi without friction, A P / K [in]."""
PANELS = (("2a", 4.0, False), ("2b", 4.0, True), ("2c", 9.0, True))
"""Panel, slope, and whether there is friction."""


@dataclass(frozen=True)
class Panel:
    """One panel of Fig. 2 in one reading of the units."""

    name: str
    """2a, 2b or 2c."""
    reading: str
    """A or B."""
    slope: float
    """Slope of the pressure [psi per unit of time of the reading]."""
    slope_unit: str
    """psi/s or psi/min."""
    time: NDArray[np.float64] = field(repr=False)
    """Time [s], shape (n_samples,)."""
    pressure: NDArray[np.float64] = field(repr=False)
    """Pressure on the diaphragm [psi], shape (n_samples,)."""
    position: NDArray[np.float64] = field(repr=False)
    """Stem position [in], shape (n_samples,)."""
    behaviour: str
    """What the stem does after it first moves: "staircase" or "follow"."""
    first_break: float
    """Pressure at which the stem first moves [psi]."""
    slips: int
    """Slips between two rests [-]; 0 where the stem never rests again."""
    slip: float
    """Median slip [in]; NaN without one."""
    spacing: float
    """Median pressure between the starts of two slips [psi]; NaN without two."""
    at_rest: float
    """Share of the time at rest after the first start [-]."""
    slowest: float
    """Lowest speed after the first peak of the speed [in/s]."""


@dataclass(frozen=True)
class Figure2(Result):
    """Fig. 2 a to c in both readings of Table I."""

    panels: tuple[Panel, ...]
    """2a, 2b, 2c in reading A, then in reading B."""

    def panel(self, name: str, reading: str) -> Panel:
        """One panel by its name (2a, 2b, 2c) and reading (A, B)."""
        return next(panel for panel in self.panels if (panel.name, panel.reading) == (name, reading))

    def summary(self) -> str:
        """Summary in a sentence per panel with friction."""
        sentences = []
        for p in self.panels:
            if p.slips:
                sentences.append(f"{p.name} in reading {p.reading}: {p.slips} slips of {p.slip:.3g} in.")
            elif p.name != "2a":
                sentences.append(
                    f"{p.name} in reading {p.reading}: one break at {p.first_break:.3g} psi, then it follows."
                )
        return " ".join(sentences)


def figure2() -> Figure2:
    """Ramp the valve of Table I from 0 to 18 psi.

    Returns simulated, as in the paper: 2a without friction at slope 4, 2b with friction at slope 4 (stairs), 2c with
    friction at slope 9 (stick, jump, follow), eqs. 1 to 3 with errata E1 and E2 corrected.

    Reading A gives 5 stairs in Fig. 2b and reading B gives 22; the text of the paper gives no number.

    References
    ----------
    srinivasan2008, Fig. 2 and section II.

    Examples
    --------
    >>> from stiction.paper import figure2
    >>> [(p.reading, p.slips, p.behaviour) for p in figure2().panels if p.name == "2b"]
    [('A', 5, 'staircase'), ('B', 22, 'staircase')]
    """
    return Figure2(tuple(_panel(*panel, reading) for reading in READINGS for panel in PANELS))


def pressure_ramp(
    valve: PhysicalValve, slope: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Time [s], pressure [psi] and stem [in], each of shape (n_samples,), of a ramp to 18 psi at `slope` [psi/s]."""
    pressure = PRESSURE_STEP_PSI * np.arange(round(MAX_PRESSURE_PSI / PRESSURE_STEP_PSI) + 1, dtype=np.float64)
    mv = stroke(valve, pressure / PSI_PER_PERCENT, PRESSURE_STEP_PSI / slope).mv
    assert mv is not None
    return pressure / slope, pressure, 0.01 * STROKE_IN * mv


def read_ramp(
    time: NDArray[np.float64], pressure: NDArray[np.float64], position: NDArray[np.float64]
) -> dict[str, Any]:
    """Read the numbers of a `Panel` off a ramp, all arrays of shape (n_samples,)."""
    moving = np.diff(position) != 0.0
    starts, slips = find_slips(position)
    speed = np.diff(position)[starts[0] :] / (time[1] - time[0])
    return {
        "behaviour": "staircase" if slips.size > 1 else "follow",
        "first_break": float(pressure[starts[0]]),
        "slips": int(slips.size),
        "slip": float(np.median(slips)) if slips.size else math.nan,
        "spacing": float(np.median(np.diff(pressure[starts]))) if starts.size > 1 else math.nan,
        "at_rest": float(1.0 - moving[starts[0] :].mean()),
        "slowest": float(speed[int(speed.argmax()) :].min()),
    }


def find_slips(position: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Samples at which a stem, shape (n_samples,), starts from rest, and how far it goes each time it rests again.

    The last start may be cut off by the end of the record, so there may be one slip fewer than starts.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.paper.fig2 import find_slips
    >>> [found.tolist() for found in find_slips(np.array([0.0, 0.0, 1.0, 1.5, 1.5, 2.0]))]
    [[1, 4], [1.5]]
    """
    edge = np.diff((np.diff(position) != 0.0).astype(np.int8), prepend=0)
    starts, rests = np.flatnonzero(edge > 0), np.flatnonzero(edge < 0)
    return starts, position[rests] - position[starts[: rests.size]]


def _panel(name: str, slope: float, friction: bool, reading: str) -> Panel:
    unit, seconds = SLOPE_UNITS[reading]
    none = {} if friction else {"coulomb": 0.0, "static": 0.0}
    # The paper has no end stop; a stop at 100 % would cut off a slip that overshoots there.
    valve = READINGS[reading](hold="linear", travel=(-math.inf, math.inf), **none)
    time, pressure, position = pressure_ramp(valve, slope / seconds)
    read = read_ramp(time, pressure, position)
    return Panel(name, reading, slope, unit, time, pressure, position, **read)
