"""The remedies that are tried: nothing, a good valve, other settings, and each compensator with its settings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from stiction.compensation.exchange import exchange
from stiction.compensation.repair import DEADBAND, RESOLUTION, kept, repair
from stiction.models import (
    ConstantReinforcement,
    Cuadros,
    FourMove,
    IntegralDeadband,
    Knocker,
    TwoMove,
    VariablePulses,
)

if TYPE_CHECKING:
    from stiction.compensation.retune import Retuning
    from stiction.models import PID, Loop

__all__ = ["FIX", "NOTHING", "RETUNE", "Remedy", "remedies_for"]

NOTHING, FIX, RETUNE = "do nothing", "fix the valve", "retune"

HEIGHTS = (0.6, 1.0, 1.4)
"""Pulse heights tried, over those that `for_stiction` gives [-]."""
BANDS = (0.6, 1.0, 1.6)
"""Bands tried, over those that `for_stiction` gives [-]."""


@dataclass(frozen=True)
class Remedy:
    """Something that can be done to a loop."""

    name: str
    """do nothing, fix the valve, retune, or the compensator's name."""
    words: str
    """What is done, in a sentence."""
    controller: PID | None = None
    """The controller's new settings; None leaves them."""
    compensator: Any = None
    """The compensator put in; None for none."""
    limits: tuple[float, float] | None = None
    """Deadband and resolution that the repaired valve may keep [% of span]; None where it is not repaired."""

    def apply(self, loop: Loop) -> Loop:
        """Put the remedy into a loop, the twin's or another one."""
        if self.limits is not None:
            return repair(loop, *self.limits)
        return exchange(loop, controller=self.controller or loop.controller, compensator=self.compensator)

    @property
    def settings(self) -> dict[str, Any]:
        """What is set, by name."""
        if self.compensator is not None:
            return {k: v for k, v in self.compensator.to_dict().items() if k != "compensator"}
        if self.controller is not None:
            return {"Kc": self.controller.Kc, "Ti": self.controller.Ti, "Td": self.controller.Td}
        return {} if self.limits is None else dict(zip(("deadband", "resolution"), self.limits, strict=True))


def remedies_for(
    S: float, J: float, gain: float, dt: float, loop: Loop, retuning: Retuning
) -> tuple[tuple[Remedy, ...], dict[str, tuple[Remedy, ...]]]:
    """List the remedies without a choice, and the variants of those that have one.

    Parameters
    ----------
    S, J : float
        Identified stiction [% of span].
    gain : float
        PV deviation that S makes, over S [PV units per % of span].
    dt : float
        Sampling period of the record [s], in which pulses are counted.
    loop : Loop
        The twin.
    retuning : Retuning
        The settings found for it.

    Returns
    -------
    tuple
        Remedies that are what they are; and name -> variants, of which the best is tried in full.
    """
    fixed = [
        Remedy(NOTHING, "Leave the loop as it is."),
        Remedy(FIX, _repair_words(*kept(S)), limits=kept(S)),
    ]
    if retuning.controller != loop.controller:
        pid = retuning.controller
        fixed.append(Remedy(RETUNE, f"Set Kc = {pid.Kc:.3g}, Ti = {pid.Ti:.3g} s.", controller=pid))
    given = {"gain": gain, "noise": loop.noise}
    pulses = {
        "knocker": Knocker.for_stiction(S, J, dt, **given),
        "constant reinforcement": ConstantReinforcement.for_stiction(S, J, dt, **given),
        "variable pulses": VariablePulses.for_stiction(S, J, dt, **given),
        "knocker that stops": Cuadros.for_stiction(S, J, dt, **given),
    }
    variants = {
        name: tuple(
            Remedy(
                name,
                _words(name, base.amplitude * height),
                compensator=replace(base, amplitude=base.amplitude * height),
            )
            for height in HEIGHTS
        )
        for name, base in pulses.items()
    }
    stop = IntegralDeadband.for_stiction(S, J, dt, **given)
    variants["integral deadband"] = tuple(
        Remedy(
            "integral deadband",
            f"Hold the integral while the error is below {stop.band * wide:.3g} PV units.",
            compensator=replace(stop, band=stop.band * wide),
        )
        for wide in BANDS
    )
    for name, kind in (("two-move", TwoMove), ("four-move", FourMove)):
        base = kind.for_stiction(S, J, dt, **given)
        variants[name] = tuple(
            Remedy(
                name,
                f"Place the stem with the loop open; close it when the error leaves {base.band * wide:.3g} PV units.",
                compensator=replace(base, band=base.band * wide),
            )
            for wide in BANDS
        )
    return tuple(fixed), variants


def _repair_words(deadband: float, resolution: float) -> str:
    left = f"{deadband:.2g} % deadband and {resolution:.2g} % resolution left"
    if deadband + resolution < DEADBAND + RESOLUTION:
        return f"Repair the valve: {left}, half of its S; the usual {DEADBAND + RESOLUTION:g} % would leave more of it."
    return f"Repair the valve: {left}, as a good one may keep."


def _words(name: str, amplitude: float) -> str:
    return f"Add {amplitude:.3g} % to the valve signal by the {name} rule."
