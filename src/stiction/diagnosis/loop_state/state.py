"""The state of a loop: whether its controller moves its valve and the process answers, and where it does not."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, get_args

from stiction.display.json_form import Result

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["STATES", "LoopState", "StateName", "StateStretch"]

StateName = Literal[
    "in_control",
    "manual",
    "saturated",
    "not_in_command",
    "shut_in",
    "valve_not_responding",
    "pv_frozen",
    "signals_swapped",
    "signals_unrelated",
    "bad_data",
]
STATES: tuple[StateName, ...] = get_args(StateName)
"""Names of all states."""


@dataclass(frozen=True, slots=True)
class StateStretch(Result):
    """One stretch of a record in a state other than `in_control`."""

    _json_keys = ("state", "start_s", "end_s")

    state: StateName
    """Its state."""
    first: int
    """First sample."""
    last: int
    """One past the last sample."""
    start_s: float
    """Start, from the first sample of the record [s]."""
    end_s: float
    """End, from the first sample of the record [s]."""
    numbers: Mapping[str, float] = field(default_factory=dict)
    """What was measured there, for the text: levels of OP [% of span], of PV and errors [unit of PV], shares [-]."""


@dataclass(frozen=True, slots=True)
class LoopState(Result):
    """Whether the controller moves the valve and the process answers, over most of a record."""

    _json_keys = ("state", "start_s", "end_s", "stretches")

    state: StateName
    """State over most of the record."""
    start_s: float
    """Start of that state, from the first sample of the record [s]."""
    end_s: float
    """End of that state, from the first sample of the record [s]."""
    share: float = 1.0
    """Share of the record in that state [-]."""
    numbers: Mapping[str, float] = field(default_factory=dict)
    """What was measured in that state, as in `StateStretch`."""
    rejects: tuple[str, ...] = ()
    """What the data checks say that reject the record; for `bad_data`."""
    stretches: tuple[StateStretch, ...] = ()
    """Stretches in another state than `in_control`, in their order; they are left out of what follows."""

    @property
    def in_control(self) -> bool:
        """Whether the rest of the diagnosis can judge the valve."""
        return self.state == "in_control"
