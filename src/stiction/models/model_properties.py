"""Properties of each valve model: parameters, invariants, overshoot, source. The tests prove every entry.

Examples
--------
>>> from stiction.models.model_properties import VALVE_PROPERTIES
>>> VALVE_PROPERTIES["Kano"].hold, VALVE_PROPERTIES["He"].hold
(False, True)
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["VALVE_PROPERTIES", "ValveProperties"]

_BAND = "% of span"


@dataclass(frozen=True, slots=True)
class ValveProperties:
    """Properties of a valve model without end stops, with numbers as parameters."""

    parameters: dict[str, str]
    """Parameter -> unit."""
    source: str
    """Key in references.bib; empty for the ideal valve."""
    shift: bool = True
    """Input plus a constant gives position plus that constant."""
    scale: bool = True
    """Input and all parameters in % of span times a constant give position times that constant."""
    odd: bool = True
    """The negative input gives the negative position."""
    hold: bool = False
    """Repeating a sample changes nothing."""
    refine: bool = False
    """Inserting a sample between two others, with a value between theirs, changes no other sample."""
    overshoot: bool = False
    """The stem may slip beyond its input (J > S)."""
    note: str = ""
    """What a user should know."""

    @property
    def rate_independent(self) -> bool:
        """Whether only the path of the input counts, not its speed."""
        return self.hold and self.refine


VALVE_PROPERTIES: dict[str, ValveProperties] = {
    "Ideal": ValveProperties({}, "", hold=True, refine=True, note="no friction"),
    "Stenman": ValveProperties(
        {"d": _BAND},
        "stenman2003",
        hold=True,
        note="S = J = d: a slow ramp always gives a staircase, never stick-jump-follow",
    ),
    "Kano": ValveProperties(
        {"S": _BAND, "J": _BAND},
        "kano2004",
        refine=True,
        overshoot=True,
        note="a repeated sample is a stop, and the next move in the same direction must exceed J",
    ),
    "Choudhury": ValveProperties(
        {"S": _BAND, "J": _BAND},
        "choudhury2005",
        overshoot=True,
        note="equal to Kano for J <= S (then `refine` holds too); for J > S it contradicts its own describing function",
    ),
    "He": ValveProperties(
        {"fs": _BAND, "fd": _BAND},
        "he2007",
        hold=True,
        note="follows only moves of more than fs - fd in one sample: a rate threshold that changes with dt",
    ),
    "HeWang": ValveProperties(
        {"fs": _BAND, "fd": _BAND, "K": "-"},
        "hewang2014",
        overshoot=True,
        note="K = 1 is He's valve; K > 1 rebounds, and may slip again in the next sample of a held input",
    ),
    "Srinivasan": ValveProperties(
        {"sb": _BAND, "sj": _BAND, "r": "% of span / s"},
        "srinivasan2008",
        overshoot=True,
        note="r = 0 is Kano's valve, r infinite with sj = sb is Stenman's; sb and sj may be tables",
    ),
    "PhysicalValve": ValveProperties(
        {
            "mass": "kg",
            "spring_rate": "N/m",
            "viscous": "N s/m",
            "coulomb": "N",
            "static": "N",
            "stribeck_velocity": "m/s",
            "area": "m^2",
            "stroke": "m",
        },
        "srinivasan2008",
        shift=False,
        scale=False,
        odd=False,
        overshoot=True,
        note="has dynamics and end stops: the position depends on the speed of the input and on the operating point",
    ),
}
"""Class name -> properties."""
