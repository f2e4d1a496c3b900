"""Published physical valves, by name.

`table1_reading_a` and `table1_reading_b` are Table I of the paper, which prints pounds and slopes without a unit. Two
readings of the units give its Fig. 2 (erratum E7). The other sets are the valve of Garcia's comparison, nominal and as
fitted to records with graphite packing, as public code of that group gives them; the numbers of its Teflon fits are not
published. Each function takes parameters of `PhysicalValve` to change.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError
from stiction.models.valves.physical import PhysicalValve

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = [
    "PUBLISHED_VALVES",
    "graphite_karnopp",
    "graphite_lugre",
    "nominal",
    "nominal_lugre",
    "published_valve",
    "table1_reading_a",
    "table1_reading_b",
]

_TABLE1 = {
    "spring_rate": "300 lbf/in", "viscous": "3.5 lbf*s/in", "coulomb": "320 lbf", "static": "384 lbf",
    "stribeck_velocity": "0.01 in/s", "area": "100 in**2", "stroke": "6 in", "pressure_range": ("0 psi", "18 psi"),
    "velocity_tolerance": "1e-3 in/s",
}  # fmt: skip
_BODY = {"mass": 1.6, "area": 0.0445, "stroke": 0.029, "pressure_range": (41368.0, 180000.0), "lag": 3.571}


def table1_reading_a(**changes: Any) -> PhysicalValve:
    """Table I as a consistent set of inch, second and pound force: mass 3 lbf s2/in, slopes of Fig. 2 in psi/s.

    0 to 100 % OP are 0 to 18 psi, the stroke is 6 in.

    References
    ----------
    srinivasan2008, Table I.
    """
    return PhysicalValve(**{**_TABLE1, "mass": "3 lbf*s**2/in", **changes})


def table1_reading_b(**changes: Any) -> PhysicalValve:
    """Table I with a mass of 3 pounds mass, slopes of Fig. 2 in psi/min: the physically consistent reading.

    0 to 100 % OP are 0 to 18 psi, the stroke is 6 in.

    References
    ----------
    srinivasan2008, Table I.
    """
    return PhysicalValve(**{**_TABLE1, "mass": "3 lbm", **changes})


def nominal(**changes: Any) -> PhysicalValve:
    """Nominal valve of Garcia's comparison, with Karnopp friction and the lag of its I/P converter.

    References
    ----------
    After garcia2008; the numbers are those of public code of the same group.
    """
    friction = {"viscous": 125000.0, "coulomb": 700.0, "static": 780.0, "stribeck_velocity": 5e-4}
    return PhysicalValve(**{**_BODY, "spring_rate": 210490.0, "preload": 2550.0, **friction, **changes})


def nominal_lugre(**changes: Any) -> PhysicalValve:
    """Nominal valve with LuGre friction.

    References
    ----------
    After garcia2008; the numbers are those of public code of the same group.
    """
    bristles = {"friction": "lugre", "bristle_stiffness": 2.6e7, "bristle_damping": 2.039607805437114e4}
    return nominal(**{**bristles, **changes})


def graphite_karnopp(**changes: Any) -> PhysicalValve:
    """Valve of `nominal` with graphite packing, Karnopp friction fitted to its record.

    References
    ----------
    After garcia2008; the numbers are those of public code of the same group.
    """
    friction = {"viscous": 70501.0, "coulomb": 665.4, "static": 942.4, "stribeck_velocity": 3.26e-3}
    return PhysicalValve(**{**_BODY, "spring_rate": 206941.0, "preload": 2571.4, **friction, **changes})


def graphite_lugre(**changes: Any) -> PhysicalValve:
    """Valve of `nominal` with graphite packing, LuGre friction fitted to its record.

    References
    ----------
    After garcia2008; the numbers are those of public code of the same group.
    """
    friction = {"viscous": 70481.0, "coulomb": 669.9, "static": 942.1, "stribeck_velocity": 3.22e-3}
    bristles = {"friction": "lugre", "bristle_stiffness": 1.04e9, "bristle_damping": 2.44e5}
    return PhysicalValve(**{**_BODY, "spring_rate": 206916.0, "preload": 2572.1, **friction, **bristles, **changes})


PUBLISHED_VALVES: dict[str, Callable[..., PhysicalValve]] = {
    make.__name__: make
    for make in (table1_reading_a, table1_reading_b, nominal, nominal_lugre, graphite_karnopp, graphite_lugre)
}


def published_valve(name: str, **changes: Any) -> PhysicalValve:
    """Make a published valve by its name.

    `changes`: parameters of `PhysicalValve` to change. Raises ParameterError when there is no such set.

    Examples
    --------
    >>> from stiction.models.parameter_sets import published_valve
    >>> published_valve("nominal").static
    780.0
    """
    if name not in PUBLISHED_VALVES:
        raise ParameterError(f"There is no parameter set {name!r}; use one of {', '.join(PUBLISHED_VALVES)}.")
    return PUBLISHED_VALVES[name](**changes)
