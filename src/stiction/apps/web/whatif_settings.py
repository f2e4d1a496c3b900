"""Settings of the what-if screen: what can be moved, within which limits, and the loop that they describe."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from stiction.apps.web.screen_settings import ScreenSettings, choice, quantity
from stiction.errors import ParameterError

if TYPE_CHECKING:
    from stiction.models import PID, Loop, Valve
    from stiction.models.compensators import Compensator

__all__ = ["COMPENSATORS", "VALVE_MODELS", "WhatIfSettings"]

VALVE_MODELS = {
    "kano": "Kano: S and J",
    "choudhury": "Choudhury: S and J",
    "he": "He: rests after every move",
    "stenman": "Stenman: one band d = (S + J) / 2",
    "srinivasan": "Three parameters: sb, sj and a rate r",
    "ideal": "Good valve: no stiction",
}
"""Name of a valve model in the address -> its name on the screen."""
COMPENSATORS = {
    "none": "None",
    "Knocker": "Knocker",
    "ConstantReinforcement": "Constant reinforcement",
    "VariablePulses": "Variable pulses",
    "Cuadros": "Knocker that stops",
    "IntegralDeadband": "Integral deadband",
    "TwoMove": "Two moves",
    "FourMove": "Four moves",
}
"""Name of a compensator in the address -> its name on the screen."""
MAX_SAMPLES = 200_000
"""Most samples that one simulation may take [-]."""
SETTLING_WINDOWS = 3.0
"""Time simulated before the part that is shown, in lengths of that part [-]."""


@dataclass(frozen=True)
class WhatIfSettings(ScreenSettings):
    """The loop of the what-if screen, in the numbers of its sliders.

    Raises
    ------
    ParameterError
        When a number is outside the limits of its `Quantity`, or the simulation would be too long.

    Examples
    --------
    >>> settings = WhatIfSettings(S=3.0, J=1.0)
    >>> settings.valve().S, settings.loop.process.order
    (3.0, 1)
    """

    SCREEN = "the what-if screen"

    model: str = choice("kano", VALVE_MODELS)
    compensator: str = choice("none", COMPENSATORS)
    S: float = quantity(5.0, "Deadband plus stickband S", "% of span", 0.0, 100.0, group="valve")
    J: float = quantity(2.0, "Slip jump J", "% of span", 0.0, 100.0, group="valve")
    r: float = quantity(0.1, "Rate r below which the stem sticks", "% of span / s", 0.0, 1e4, "log", group="valve")
    Kc: float = quantity(0.2, "Controller gain Kc", "% of span per PV unit", -1e6, 1e6, "log", group="controller")
    Ti: float = quantity(10.0, "Integral time Ti", "s", 1e-3, 1e7, "log", group="controller")
    Td: float = quantity(0.0, "Derivative time Td", "s", 0.0, 1e6, group="controller")
    gain: float = quantity(3.0, "Process gain", "PV units per % of span", -1e6, 1e6, "log", group="process")
    """Of an integrating process per second."""
    tau: float = quantity(10.0, "Time constant", "s", 0.0, 1e7, "log", group="process")
    """Of an integrating process its lag."""
    lag: float = quantity(0.0, "Second time constant", "s", 0.0, 1e6, group="process")
    dead_time: float = quantity(10.0, "Dead time", "s", 0.0, 1e6, group="process")
    integrating: bool = False
    """Whether the process integrates."""
    noise: float = quantity(0.0, "Noise of the PV (standard deviation)", "PV units", 0.0, 1e6, group="simulation")
    duration: float = quantity(600.0, "Time shown", "s", 1e-2, 1e8, "log", group="simulation")
    dt: float = quantity(1.0, "Sampling period", "s", 1e-4, 1e5, "log", group="simulation")
    sp: float = quantity(150.0, "Set point", "PV units", -1e12, 1e12, group="simulation")
    op: float = quantity(50.0, "Mean OP", "% of span", -1e3, 1e3, group="simulation")
    op_low: float = quantity(0.0, "Lower limit of OP", "% of span", -1e9, 1e9, group="simulation")
    op_high: float = quantity(100.0, "Upper limit of OP", "% of span", -1e9, 1e9, group="simulation")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.op_low < self.op_high:
            raise ParameterError(
                f"The lower limit of OP is {self.op_low:g} % and the upper {self.op_high:g} %: raise the upper one."
            )
        if self.duration > self.max_duration(self.dt):
            raise ParameterError(
                f"The time shown, {self.duration:g} s, is too long for a sampling period of {self.dt:g} s: at most "
                f"{self.max_duration(self.dt):g} s are simulated. Shorten it, or lengthen the sampling period."
            )
        if self.dead_time > MAX_SAMPLES * self.dt:
            raise ParameterError(
                f"The dead time, {self.dead_time:g} s, is longer than {MAX_SAMPLES:,} samples of {self.dt:g} s: "
                "shorten it, or lengthen the sampling period."
            )
        if self.duration < 10.0 * self.dt:
            raise ParameterError(
                f"The time shown, {self.duration:g} s, is shorter than 10 samples of {self.dt:g} s: lengthen it."
            )

    @staticmethod
    def max_duration(dt: float) -> float:
        """Return the longest time that can be shown with a sampling period `dt` [s]."""
        return 0.5 * MAX_SAMPLES * dt / (SETTLING_WINDOWS + 2.0)

    @property
    def settling_time(self) -> float:
        """Time simulated before the part that is shown [s]."""
        slowest = 10.0 * (self.tau + self.lag + self.dead_time)
        return max(SETTLING_WINDOWS * self.duration, min(slowest, 0.5 * MAX_SAMPLES * self.dt))

    def valve(self) -> Valve:
        """Make the valve with S and J in the form of its model.

        Raises
        ------
        ParameterError
            When J exceeds S and the model cannot have that.
        """
        from stiction import models

        if self.model in ("kano", "choudhury"):
            return (models.Kano if self.model == "kano" else models.Choudhury)(self.S, self.J)
        if self.model == "ideal":
            return models.Ideal()
        if self.model == "srinivasan":
            return models.Srinivasan((self.S + self.J) / 2.0, self.J, self.r)
        if self.model == "stenman":
            return models.Stenman((self.S + self.J) / 2.0)
        if self.J > self.S:
            raise ParameterError(f"J = {self.J:g} % exceeds S = {self.S:g} %, which He's valve cannot have: lower J.")
        return models.He((self.S + self.J) / 2.0, (self.S - self.J) / 2.0)

    def controller(self) -> PID:
        """Make the controller; its derivative has the usual filter of Td / 10."""
        from stiction.models import PID

        return PID(self.Kc, self.Ti, self.Td, N=10.0, op_limits=(self.op_low, self.op_high))

    def compensator_model(self) -> Compensator | None:
        """Make the compensator with the settings that belong to S and J; None where none is chosen.

        Raises ParameterError when S is 0.
        """
        if self.compensator == "none":
            return None
        from stiction import models

        if self.S <= 0.0:
            raise ParameterError(
                "S = 0, but the settings of a compensator are computed from S. Raise S, or choose no compensator."
            )
        # Of an integrating process: what it makes of 1 % in the time in which the controller answers.
        gain = self.gain * (self.Ti + self.dead_time) if self.integrating else self.gain
        kind = getattr(models, self.compensator)
        return kind.for_stiction(self.S, min(self.J, self.S), self.dt, gain=gain, noise=self.noise)

    @cached_property
    def loop(self) -> Loop:
        """The loop of these settings.

        Raises
        ------
        ParameterError
            When a part cannot be made of its numbers; the message says which to move.
        """
        from stiction.models import FOPDT, SOPDT, Integrating, Loop

        if self.gain == 0.0:
            raise ParameterError("The process gain is 0: PV would not respond to the valve. Give another gain.")
        if self.integrating:
            process = Integrating(self.gain, self.dead_time, self.tau)
        elif self.lag > 0.0:
            process = SOPDT(self.gain, self.tau, self.lag, self.dead_time)
        else:
            process = FOPDT(self.gain, self.tau, self.dead_time)
        return Loop(
            self.controller(), self.valve(), process, self.dt, noise=self.noise, compensator=self.compensator_model()
        )
