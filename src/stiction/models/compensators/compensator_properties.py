"""Properties of each compensator: settings, source and effect on the loop. The tests prove every entry.

Examples
--------
>>> from stiction.models.compensators.compensator_properties import COMPENSATOR_PROPERTIES
>>> [name for name, row in COMPENSATOR_PROPERTIES.items() if row.tracks]
['TwoMove', 'FourMove']
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["COMPENSATOR_PROPERTIES", "CompensatorProperties"]

_SPAN = "% of span"
_PV = "PV units"
_TIME = "s"
_NUMBER = "-"
_PULSES = {"amplitude": _SPAN, "width": _TIME, "interval": _TIME}
_MOVE_SETTINGS = {"move": _TIME, "cycles": _NUMBER, "tries": _NUMBER}


@dataclass(frozen=True, slots=True)
class CompensatorProperties:
    """Properties of one compensator."""

    parameters: dict[str, str]
    """Setting -> unit."""
    source: str
    """Key in references.bib."""
    pulses: bool = False
    """Adds pulses to the controller output while the loop is closed."""
    holds: bool = False
    """Asks the controller to hold its integral."""
    tracks: bool = False
    """Opens the loop: asks the controller to track the valve signal."""
    rests: bool = False
    """Can end the cycle with a stem at rest, and then leaves an offset."""
    note: str = ""
    """What a user should know."""


COMPENSATOR_PROPERTIES: dict[str, CompensatorProperties] = {
    "Knocker": CompensatorProperties(
        _PULSES, "haegglund2002", pulses=True, note="pulses as high as S are worse than none"
    ),
    "ConstantReinforcement": CompensatorProperties(
        {"amplitude": _SPAN}, "ivan2009", pulses=True, note="follows the noise: by far the most stem travel"
    ),
    "VariablePulses": CompensatorProperties(
        {**_PULSES, "full": _PV}, "munaro2016", pulses=True,
        note="less stem travel and more PV deviation than the knocker",
    ),
    "IntegralDeadband": CompensatorProperties(
        {"band": _PV}, "kuphaldt2019", holds=True, rests=True, note="no travel at all, an offset of up to the band"
    ),
    "Cuadros": CompensatorProperties(
        {**_PULSES, "band": _PV}, "cuadros2012", pulses=True, holds=True, rests=True,
        note="a knocker that stops, with an offset of up to the band",
    ),
    "TwoMove": CompensatorProperties(
        {"S": _SPAN, "J": _SPAN, "band": _PV, "reach": _NUMBER, **_MOVE_SETTINGS}, "srinivasan2008b",
        tracks=True, rests=True,
        note="needs S and J and a constant set point; too large an S or J does less harm than too small a one",
    ),
    "FourMove": CompensatorProperties(
        {"band": _PV, "reach": _NUMBER, "share": _NUMBER, **_MOVE_SETTINGS}, "cuadros2012b", tracks=True, rests=True,
        note="needs neither S nor J, but a symmetric cycle",
    ),
}  # fmt: skip
"""Class name -> properties."""
