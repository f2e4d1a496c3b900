"""A sampled control loop: controller, valve, process and, optionally, a compensator of stiction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from stiction.errors import ParameterError, require_kind, require_not_negative, require_positive
from stiction.models.processes import as_process

if TYPE_CHECKING:
    from stiction.models.compensators import Compensator
    from stiction.models.component import Valve
    from stiction.models.controllers import PID
    from stiction.models.processes import StateSpace, TransferFunction
    from stiction.models.processes.discretise import Discrete

__all__ = ["Loop", "require_loop"]


@dataclass(frozen=True)
class Loop:
    """A sampled loop of controller, valve and process.

    Parameters
    ----------
    controller : PID
        The controller.
    valve : Valve
        Any valve model.
    process : TransferFunction, StateSpace or a system of `control` or `scipy.signal`
        The process from valve position to PV.
    dt : float
        Sampling period [s]. The controller reads the PV, then sets the OP, then the stem moves and stays
        there until the next sample.
    noise : float
        Standard deviation of the white measurement noise on the PV [PV units].
    compensator : Compensator, optional
        Compensator of stiction between controller and valve. It acts in automatic; in manual the OP goes to the
        valve unchanged.

    Raises
    ------
    ParameterError
        When `dt` is not positive, `noise` is negative, a part is of the wrong type, or the process passes its
        input to the PV without delay (an algebraic loop).

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> loop.process.order
    1
    """

    controller: PID
    valve: Valve
    process: TransferFunction | StateSpace
    dt: float
    noise: float = 0.0
    compensator: Compensator | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "dt", require_positive("dt", self.dt, "s"))
        put(self, "noise", require_not_negative("noise", self.noise, "PV units"))
        put(self, "process", as_process(self.process))
        for name in ("controller", "valve"):
            if not hasattr(getattr(self, name), "pack"):
                raise ParameterError(f"{name} is a {type(getattr(self, name)).__name__}; give a {name} model.")
        if self.compensator is not None:
            if not hasattr(self.compensator, "for_stiction"):
                raise ParameterError(
                    f"compensator is a {type(self.compensator).__name__}; give a compensator such as Knocker, or None."
                )
            self.compensator.pack(self.dt)
        if self.discrete.d != 0.0 and self.discrete.direct_delay == 0:
            raise ParameterError(
                f"process has a direct path ({self.discrete.d:g}) and no dead time: the PV would depend on the "
                "OP of the same sample. Add a lag or a dead time."
            )

    @cached_property
    def discrete(self) -> Discrete:
        """The process at the sampling period, with its input held between samples."""
        return self.process.discretise(self.dt)


def require_loop(loop: object) -> None:
    """Raise when the argument is not a `Loop`.

    `loop`: the argument to check. Raises ParameterError when it is anything but a `Loop`.

    Examples
    --------
    >>> import stiction as st
    >>> require_loop(Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0))
    """
    require_kind("loop", loop, Loop, "a Loop(controller, valve, process, dt)")
