"""Table I: the valve of the paper in two readings of its units, and the derived numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stiction.display.json_form import Result
from stiction.models.parameter_sets import table1_reading_a, table1_reading_b
from stiction.simulation.critical_rates import CriticalRate, critical_rate

if TYPE_CHECKING:
    from stiction.models import PhysicalValve

__all__ = ["PSI_PER_PERCENT", "READINGS", "SLOPE_UNITS", "Parameter", "Reading", "Table1", "table1"]

PSI_PER_PERCENT = 0.18
"""Fig. 2 ramps the pressure from 0 to 18 psi, so 1 % OP is 0.18 psi."""
READINGS = {"A": table1_reading_a, "B": table1_reading_b}
"""Readings of the units: A the raw numbers as one consistent set, B a mass of 3 pounds."""
SLOPE_UNITS = {"A": ("psi/s", 1.0), "B": ("psi/min", 60.0)}
"""Unit of the slopes 4 and 9 in each reading, and its seconds."""


@dataclass(frozen=True)
class Parameter:
    """One line of Table I."""

    symbol: str
    """Symbol of the paper."""
    meaning: str
    """Meaning, in the words of the paper."""
    printed: str
    """Value as printed."""
    readings: dict[str, str]
    """Value with its unit, by reading."""


@dataclass(frozen=True)
class Reading:
    """Numbers derived from Table I in one reading."""

    name: str
    """A or B."""
    slope_unit: str
    """Unit of the slopes 4 and 9 of Fig. 2."""
    mass: float
    """Mass of stem and plug [kg]."""
    viscous: float
    """Viscous coefficient [N s/m]."""
    fs: float
    """Static friction band, 100 F_s / (A dP) [% of span]."""
    fd: float
    """Dynamic friction band, 100 F_c / (A dP) [% of span]."""
    S: float
    """Deadband plus stickband, fs + fd [% of span]."""
    J: float
    """Slip jump, fs - fd [% of span]."""
    first_break: float
    """Pressure at which the stem first breaks loose, F_s / A [psi]."""
    damping_ratio: float
    """b / (2 sqrt(K m)) [-]."""
    natural_frequency: float
    """sqrt(K / m) [rad/s]."""
    critical: CriticalRate
    """Ramp rate that separates stairs from stick-jump-follow, and why."""
    critical_pressure: float
    """Critical rate as a rate of the pressure [psi/s]."""
    critical_speed: float
    """Speed of the stem there [in/s]."""
    slide_pressure: float
    """Rate of the pressure below which a steady slide is unstable, in closed form [psi/s]."""


@dataclass(frozen=True)
class Table1(Result):
    """Table I as printed and in both readings of its units."""

    parameters: tuple[Parameter, ...]
    """The lines of the table."""
    readings: tuple[Reading, ...]
    """Derived numbers in reading A and in reading B."""

    def summary(self) -> str:
        """Summary in a sentence per reading."""
        return " ".join(
            f"Reading {r.name} (slopes in {r.slope_unit}): S = {r.S:.2f} %, J = {r.J:.2f} %, damping ratio "
            f"{r.damping_ratio:.3g}, stairs below {r.critical_pressure:.3g} psi/s ({r.critical.mechanism}), a steady "
            f"slide unstable below {r.slide_pressure:.3g} psi/s."
            for r in self.readings
        )


def table1() -> Table1:
    """Read Table I with explicit units and derive the parameters of the simple models.

    Returns "3 lb" and "3.5 lb/s" have no unit that fits the equations (erratum E7). Reading A takes the numbers as one
    consistent set of pound force, inch and second, with slopes in psi/s; reading B takes a mass of 3 pounds and slopes
    in psi/min. Both give Figs. 2b and 2c.

    References
    ----------
    srinivasan2008, Table I.

    Examples
    --------
    >>> from stiction.paper import table1
    >>> for reading in table1().readings:
    ...     print(reading.name, round(reading.damping_ratio, 3), round(reading.S, 2), round(reading.J, 2))
    A 0.058 39.11 3.56
    B 1.146 39.11 3.56
    """
    both = ("300 lbf/in", "320 lbf", "384 lbf", "0.01 in/s", "100 in²", "0 to 18 psi")
    stiffness, coulomb, static, stribeck, area, pressure = ({"A": text, "B": text} for text in both)
    parameters = (
        Parameter("P", "Applied actuator pressure", "psi", pressure),
        Parameter("A", "Effective diaphragm surface area", "100 in²", area),
        Parameter("m", "Mass of stem and plug", "3 lb", {"A": "3 lbf s²/in", "B": "3 lbm"}),
        Parameter("K", "Spring rate", "300 lbf/in", stiffness),
        Parameter("b", "Viscous coefficient", "3.5 lb/s", {"A": "3.5 lbf s/in", "B": "3.5 lbf s/in"}),
        Parameter("Fc", "Coulomb friction", "320 lbf", coulomb),
        Parameter("Fs", "Static friction", "384 lbf", static),
        Parameter("vs", "Stribeck constant", "0.01 in/s", stribeck),
        Parameter("", "Slopes 4 and 9 of Fig. 2", "no unit", {name: unit for name, (unit, _) in SLOPE_UNITS.items()}),
        Parameter("", "Velocity tolerance", "1e-3", {"A": "1e-3 in/s", "B": "1e-3 in/s"}),
    )
    return Table1(parameters, tuple(_reading(name, make()) for name, make in READINGS.items()))


def _reading(name: str, valve: PhysicalValve) -> Reading:
    fs, fd = (100.0 * force / valve.force_span for force in (valve.static, valve.coulomb))
    critical = critical_rate(valve)
    return Reading(
        name=name,
        slope_unit=SLOPE_UNITS[name][0],
        mass=valve.mass,
        viscous=valve.viscous,
        fs=fs,
        fd=fd,
        S=fs + fd,
        J=fs - fd,
        first_break=fs * PSI_PER_PERCENT,
        damping_ratio=valve.damping_ratio,
        natural_frequency=valve.natural_frequency,
        critical=critical,
        critical_pressure=critical.rate * PSI_PER_PERCENT,
        critical_speed=critical.velocity / 0.0254,
        slide_pressure=critical.stribeck * PSI_PER_PERCENT,
    )
