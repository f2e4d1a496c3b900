"""Settings of the textbook screen: the numbers with their units and limits, and the valves that they describe."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from stiction.apps.web.screen_settings import Quantity, ScreenSettings
from stiction.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.models import Valve

__all__ = ["TEXTBOOK_MODELS", "TEXTBOOK_QUANTITIES", "TextbookSettings"]

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
TEXTBOOK_QUANTITIES = {
    "S": Quantity("Deadband plus stickband S", "% of span", 0.01, 50.0, "linear", "valve"),
    "J": Quantity("Slip jump J", "% of span", 0.0, 50.0, "linear", "valve"),
    "r": Quantity("Rate r below which the stem sticks again", "% of span / s", 0.0, 1e3, "log", "valve"),
    "rate": Quantity("Rate of the ramp", "% of span / s", 1e-3, 1e3, "log", "ramp"),
    "height": Quantity("Height of the ramp", "% of span", 0.1, 100.0, "linear", "ramp"),
    "amplitude": Quantity("Amplitude A of the sine", "% of span", 1e-3, 100.0, "linear", "sine"),
    "gain_factor": Quantity("Factor on the loop gain", "-", 0.01, 100.0, "log", "loop"),
    "dead_time": Quantity("Dead time added", "s", 0.0, 100.0, "linear", "loop"),
    "pulse": Quantity("Size of the pulse", "% of span", -10.0, 10.0, "linear", "pulse"),
    "length": Quantity("Length of the pulse", "s", 0.1, 60.0, "linear", "pulse"),
}
"""Name in the address -> what the number is."""


@dataclass(frozen=True)
class TextbookSettings(ScreenSettings):
    """The numbers of the textbook screen; the defaults are the example of the paper's section V.C.

    Parameters
    ----------
    model : str
        One of `TEXTBOOK_MODELS`.
    S, J : float
        Deadband plus stickband and slip jump [% of span].
    r : float
        Rate of the three-parameter valve [% of span / s].
    rate, height : float
        Rate [% of span / s] and height [% of span] of the ramp.
    amplitude : float
        Amplitude of the sine [% of span].
    gain_factor : float
        Factor on the gain of the example loop [-].
    dead_time : float
        Dead time added to it [s].
    pulse, length : float
        Size [% of span] and length [s] of the load pulse.

    Raises
    ------
    ParameterError
        When a number is outside the limits of its `Quantity`, or `model` is unknown.
    """

    SCREEN = "the textbook"
    QUANTITIES = TEXTBOOK_QUANTITIES
    CHOICES: ClassVar[Mapping[str, Mapping[str, str]]] = {"model": TEXTBOOK_MODELS}

    model: str = "stenman"
    S: float = 0.5
    J: float = 0.5
    r: float = 0.5
    rate: float = 0.1
    height: float = 20.0
    amplitude: float = 0.6
    gain_factor: float = 1.0
    dead_time: float = 0.0
    pulse: float = 1.0
    length: float = 5.0

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

        Raises
        ------
        ParameterError
            When J exceeds S.
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
