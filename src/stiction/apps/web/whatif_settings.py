"""Settings of the what-if screen: what can be moved, within which limits, and the loop that they describe."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

from stiction.apps.web.screen_settings import ScreenSettings
from stiction.apps.web.whatif_quantities import COMPENSATORS, QUANTITIES, VALVE_MODELS
from stiction.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.models import PID, Loop, Valve
    from stiction.models.compensators import Compensator

__all__ = ["WhatIfSettings"]

MAX_SAMPLES = 200_000
"""Most samples that one simulation may take [-]."""
SETTLING_WINDOWS = 3.0
"""Time simulated before the part that is shown, in lengths of that part [-]."""


@dataclass(frozen=True)
class WhatIfSettings(ScreenSettings):
    """The loop of the what-if screen, in the numbers of its sliders.

    Parameters
    ----------
    model, compensator : str
        One of `VALVE_MODELS` and of `COMPENSATORS`.
    S, J : float
        Deadband plus stickband and slip jump [% of span].
    r : float
        Rate of the three-parameter valve [% of span / s].
    Kc : float
        Controller gain [% of span per PV unit].
    Ti, Td : float
        Integral and derivative time [s].
    gain : float
        Process gain [PV units per % of span]; of an integrating process per second of it.
    tau, lag, dead_time : float
        First and second time constant, dead time [s].
    integrating : bool
        Whether the process integrates; `tau` is then its lag.
    noise : float
        Standard deviation of the noise on the PV [PV units].
    duration : float
        Time shown [s].
    dt : float
        Sampling period [s].
    sp, op : float
        Set point [PV units] and mean OP [% of span].
    op_low, op_high : float
        Limits of OP [% of span].

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
    QUANTITIES = QUANTITIES
    CHOICES: ClassVar[Mapping[str, Mapping[str, str]]] = {"model": VALVE_MODELS, "compensator": COMPENSATORS}

    model: str = "kano"
    compensator: str = "none"
    S: float = 5.0
    J: float = 2.0
    r: float = 0.1
    Kc: float = 0.2
    Ti: float = 10.0
    Td: float = 0.0
    gain: float = 3.0
    tau: float = 10.0
    lag: float = 0.0
    dead_time: float = 10.0
    integrating: bool = False
    noise: float = 0.0
    duration: float = 600.0
    dt: float = 1.0
    sp: float = 150.0
    op: float = 50.0
    op_low: float = 0.0
    op_high: float = 100.0

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

        Raises
        ------
        ParameterError
            When S is 0.
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
