"""What holds of each compensator: settings, source, what it asks of the loop. The tests prove every entry.

Examples
--------
>>> from stiction.models.compensators.facts import FACTS
>>> [name for name, facts in FACTS.items() if facts.tracks]
['TwoMove', 'FourMove']
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["FACTS", "CompensatorFacts"]

_SPAN, _PV, _TIME, _NUMBER = "% of span", "PV units", "s", "-"
_PULSES = {"amplitude": _SPAN, "width": _TIME, "interval": _TIME}
_WATCH = {"move": _TIME, "cycles": _NUMBER, "tries": _NUMBER}


@dataclass(frozen=True, slots=True)
class CompensatorFacts:
    """What holds of a compensator."""

    parameters: dict[str, str]
    """Setting -> unit."""
    source: str
    """Key in references.bib."""
    pulses: bool = False
    """Adds to the signal of the valve while the loop is closed."""
    holds: bool = False
    """Asks the controller to hold its integral."""
    tracks: bool = False
    """Opens the loop: asks the controller to track the signal sent."""
    rests: bool = False
    """Can end the cycle with a stem that stands still, and then leaves an offset."""
    note: str = ""
    """What a user should know."""


FACTS: dict[str, CompensatorFacts] = {
    "Knocker": CompensatorFacts(_PULSES, "haegglund2002", pulses=True, note="pulses as high as S are worse than none"),
    "ConstantReinforcement": CompensatorFacts(
        {"amplitude": _SPAN}, "ivan2009", pulses=True, note="follows the noise: by far the most stem travel"
    ),
    "VariablePulses": CompensatorFacts(
        {**_PULSES, "full": _PV}, "munaro2016", pulses=True, note="less travel and more deviation than the knocker"
    ),
    "IntegralDeadband": CompensatorFacts(
        {"band": _PV}, "kuphaldt2019", holds=True, rests=True, note="no travel at all, an offset of up to the band"
    ),
    "Cuadros": CompensatorFacts(
        {**_PULSES, "band": _PV}, "cuadros2012", pulses=True, holds=True, rests=True,
        note="a knocker that stops, with an offset of up to the band",
    ),
    "TwoMove": CompensatorFacts(
        {"S": _SPAN, "J": _SPAN, "band": _PV, "reach": _NUMBER, **_WATCH}, "srinivasan2008b", tracks=True, rests=True,
        note="needs S and J, and a set point that stays; rather too large than too small",
    ),
    "FourMove": CompensatorFacts(
        {"band": _PV, "reach": _NUMBER, "share": _NUMBER, **_WATCH}, "cuadros2012b", tracks=True, rests=True,
        note="needs neither S nor J, but a symmetric cycle",
    ),
}  # fmt: skip
"""Class name -> facts."""
