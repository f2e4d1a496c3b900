"""Settings of the textbook screen: the numbers with their units and limits, and the valves that they describe."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from stiction.apps.web.screen_settings import ScreenSettings, choice, quantity
from stiction.errors import ParameterError

if TYPE_CHECKING:
    from stiction.models import Valve

__all__ = ["TEXTBOOK_MODELS", "TextbookSettings"]

PSI_PER_PERCENT = 0.18
"""Pressure of 1 % OP on the valve of Table I [psi]."""
DIAPHRAGM_AREA_IN2 = 100.0
"""Area of its diaphragm [in2]."""

TEXTBOOK_MODELS = {
    "stenman": "Stenman: one band d = (S + J) / 2",
    "kano": "Kano: S and J",
    "he": "He: rests after every move",
}
"""Name of a valve model in the address -> its name on the screen."""


@dataclass(frozen=True)
class TextbookSettings(ScreenSettings):
    """The numbers of the textbook screen; the defaults are the example of the paper's section V.C.

    Raises
    ------
    ParameterError
        When a number is outside the limits of its `Quantity`, or `model` is unknown.
    """

    SCREEN = "the textbook"

    model: str = choice("stenman", TEXTBOOK_MODELS)
    S: float = quantity(0.5, "Deadband plus stickband S", "% of span", 0.01, 50.0, group="valve")
    J: float = quantity(0.5, "Slip jump J", "% of span", 0.0, 50.0, group="valve")
    r: float = quantity(0.5, "Rate r below which the stem sticks", "% of span / s", 0.0, 1e3, "log", group="valve")
    rate: float = quantity(0.1, "Rate of the ramp", "% of span / s", 1e-3, 1e3, "log", group="ramp")
    height: float = quantity(20.0, "Height of the ramp", "% of span", 0.1, 100.0, group="ramp")
    amplitude: float = quantity(0.6, "Amplitude A of the sine", "% of span", 1e-3, 100.0, group="sine")
    gain_factor: float = quantity(1.0, "Factor on the loop gain", "-", 0.01, 100.0, "log", group="loop")
    dead_time: float = quantity(0.0, "Dead time added", "s", 0.0, 100.0, group="loop")
    pulse: float = quantity(1.0, "Size of the pulse", "% of span", -10.0, 10.0, group="pulse")
    length: float = quantity(5.0, "Length of the pulse", "s", 0.1, 60.0, group="pulse")

    @property
    def band(self) -> float:
        """Input away from the resting stem that breaks it loose, (S + J) / 2 [% of span]."""
        return (self.S + self.J) / 2.0

    @property
    def lag(self) -> float:
        """Distance of the moving stem from its input, (S - J) / 2 [% of span].

        Raises
        ------
        ParameterError
            When J exceeds S.
        """
        if self.J > self.S:
            raise ParameterError(f"J = {self.J:g} % exceeds S = {self.S:g} %: lower J, or raise S.")
        return (self.S - self.J) / 2.0

    def valve(self) -> Valve:
        """Make the valve of `model`.

        Raises
        ------
        ParameterError
            When J exceeds S.
        """
        from stiction import models

        if self.model == "kano":
            return models.Kano(self.band + self.lag, self.J)
        return models.Stenman(self.band) if self.model == "stenman" else models.He(self.band, self.lag)

    def first_rest_level(self) -> float:
        """Position of the stem from which a sine reaches its cycle: rest levels of -d/2, d/2, ... [% of span]."""
        if self.model == "kano":
            return min(self.lag - self.amplitude, 0.0)
        return (self.band if self.model == "stenman" else self.J) / 2.0

    def ramp_valves(self) -> dict[str, Valve]:
        """Make one valve of each model with the same S and J, by the name on the screen.

        Raises ParameterError when J exceeds S.
        """
        from stiction import models
        from stiction.models.parameter_sets import table1_reading_a

        pounds_per_percent = PSI_PER_PERCENT * DIAPHRAGM_AREA_IN2
        physical = table1_reading_a(
            static=f"{pounds_per_percent * self.band} lbf",
            coulomb=f"{pounds_per_percent * self.lag} lbf",
            hold="linear",
            travel=(-math.inf, math.inf),
        )
        return {
            "Ideal": models.Ideal(),
            "Stenman (one parameter)": models.Stenman(self.band),
            "Kano, Choudhury (S, J)": models.Kano(self.S, self.J),
            "He (fs, fd)": models.He(self.band, self.lag),
            "Three parameters (eq. 5)": models.Srinivasan(self.band, self.J, self.r),
            "Physical (Table I)": physical,
        }
