"""The remedies that are tried: no action, a repaired valve, other controller settings, and each compensator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from stiction.compensation.repair import REPAIRED_DEADBAND, REPAIRED_RESOLUTION, repair, residual_stiction
from stiction.compensation.replace_parts import replace_parts
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

__all__ = ["NO_ACTION", "REPAIR", "RETUNING", "Remedy", "remedies_for"]

NO_ACTION, REPAIR, RETUNING = "do nothing", "fix the valve", "retune"

HEIGHT_FACTORS = (0.6, 1.0, 1.4)
"""Pulse heights that are tried, relative to those from `for_stiction` [-]."""
BAND_FACTORS = (0.6, 1.0, 1.6)
"""Bands that are tried, relative to those from `for_stiction` [-]."""


@dataclass(frozen=True)
class Remedy:
    """A change of a loop."""

    name: str
    """`do nothing`, `fix the valve`, `retune`, or the name of the compensator."""
    words: str
    """What to do, as a sentence."""
    controller: PID | None = None
    """New settings of the controller; None for no change."""
    compensator: Any = None
    """Compensator to add; None for none."""
    limits: tuple[float, float] | None = None
    """Deadband and resolution of the repaired valve [% of span]; None without a repair."""

    def apply(self, loop: Loop) -> Loop:
        """Return a loop with the remedy."""
        if self.limits is not None:
            return repair(loop, *self.limits)
        return replace_parts(loop, controller=self.controller or loop.controller, compensator=self.compensator)

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the remedy by name."""
        if self.compensator is not None:
            return {k: v for k, v in self.compensator.to_dict().items() if k != "compensator"}
        if self.controller is not None:
            return {"Kc": self.controller.Kc, "Ti": self.controller.Ti, "Td": self.controller.Td}
        return {} if self.limits is None else dict(zip(("deadband", "resolution"), self.limits, strict=True))


def remedies_for(
    S: float, J: float, gain: float, dt: float, loop: Loop, retuning: Retuning
) -> tuple[tuple[Remedy, ...], dict[str, tuple[Remedy, ...]]]:
    """List the remedies: those with fixed settings, and the variants of the others.

    Parameters
    ----------
    S, J : float
        Identified stiction [% of span].
    gain : float
        Peak to peak of the PV in the limit cycle, relative to S [PV units per % of span].
    dt : float
        Sampling period of the record [s]; pulses last whole samples.
    loop : Loop
        The twin.
    retuning : Retuning
        New controller settings for it.

    Returns
    -------
    tuple
        Remedies with fixed settings; and name -> variants, of which only the best is tried with all seeds.
    """
    fixed = [
        Remedy(NO_ACTION, "Leave the loop as it is."),
        Remedy(REPAIR, _describe_repair(*residual_stiction(S)), limits=residual_stiction(S)),
    ]
    if retuning.controller != loop.controller:
        pid = retuning.controller
        fixed.append(Remedy(RETUNING, f"Set Kc = {pid.Kc:.3g}, Ti = {pid.Ti:.3g} s.", controller=pid))
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
                _describe_pulses(name, base.amplitude * height),
                compensator=replace(base, amplitude=base.amplitude * height),
            )
            for height in HEIGHT_FACTORS
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
        for wide in BAND_FACTORS
    )
    for name, kind in (("two-move", TwoMove), ("four-move", FourMove)):
        base = kind.for_stiction(S, J, dt, **given)
        variants[name] = tuple(
            Remedy(
                name,
                "Position the stem with the loop open; close the loop when the error exceeds "
                f"{base.band * wide:.3g} PV units.",
                compensator=replace(base, band=base.band * wide),
            )
            for wide in BAND_FACTORS
        )
    return tuple(fixed), variants


def _describe_repair(deadband: float, resolution: float) -> str:
    left = f"at most {deadband:.2g} % deadband and {resolution:.2g} % resolution afterwards"
    if deadband + resolution < REPAIRED_DEADBAND + REPAIRED_RESOLUTION:
        usual = REPAIRED_DEADBAND + REPAIRED_RESOLUTION
        return f"Repair the valve: {left}, half of the present S, because the usual {usual:g} % would be more."
    return f"Repair the valve: {left}, as is usual for a good valve."


def _describe_pulses(name: str, amplitude: float) -> str:
    return f"Add {amplitude:.3g} % to the valve signal by the {name} rule."
