"""The row of one loop in an audit, and what the work on it depends on."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    from stiction.fleet.block_means import Clock
    from stiction.fleet.loop_oscillations import LoopOscillation
    from stiction.fleet.source_parts import LoopPlace

__all__ = ["WorkSettings", "empty_row", "main_oscillation", "require_row"]


@dataclass(frozen=True)
class WorkSettings:
    """What the work on each loop depends on."""

    clock: Clock
    """Blocks that all loops share."""
    since: datetime | None = None
    """First time."""
    until: datetime | None = None
    """Time before which the samples end."""
    prior: float = 0.25
    """Share of sticky valves in the plant [-]."""
    costs: tuple[float, float, float] = (1.0, 1.0, 0.2)
    """Costs of a false alarm, a missed sticky valve, and an open question."""
    time_limit: float = 60.0
    """Longest processor time for one loop [s]."""


def empty_row(place: LoopPlace) -> dict[str, Any]:
    """Row of a loop of which nothing is known yet, with all keys."""
    return {
        "tag": place.tag,
        "area": place.area,
        "source": place.part.display_name,
        "status": "screened",
        "verdict": "undecided",
        "probability": None,
        "loop_state": None,
        "oscillation_cause": "none",
        "oscillation_causes": None,
        "period_s": None,
        "S": None,
        "S_low": None,
        "S_high": None,
        "J": None,
        "J_low": None,
        "J_high": None,
        "priority": 0.0,
        "severity": 0.0,
        "confidence": 0.0,
        "importance": place.importance,
        "severity_parts": {},
        "reason": "",
        "action": "",
        "oscillating": False,
        "regularity": None,
        "oscillation_index": 0.0,
        "automatic_share": None,
        "manual_share": None,
        "cascade_share": None,
        "saturated_share": None,
        "not_in_command_share": None,
        "missing_share": None,
        "error_mean_absolute": None,
        "variability": None,
        "valve_travel_per_day": None,
        "reversals_per_day": None,
        "loop_type": None,
        "pv_unit": "",
        "dt_s": None,
        "samples": None,
        "start": None,
        "end": None,
        "data_warnings": [],
        "oscillations": [],
        "group": None,
        "follows": None,
    }


def main_oscillation(oscillations: Sequence[LoopOscillation]) -> LoopOscillation | None:
    """The regular oscillation with the highest autocorrelation, else the highest of all; None when there is none."""
    return max(oscillations, key=lambda one: (one.regular, one.height), default=None)


def require_row(row: dict[str, Any]) -> dict[str, Any]:
    """Refuse numbers that JSON cannot hold; they are a fault of the program."""
    try:
        json.dumps(row, allow_nan=False)
    except ValueError:
        raise RecordError(
            "a result is not a finite number, which is an error in the program; please report it.", where=row["tag"]
        ) from None
    return row
