"""Which model shows which of the paper's phenomena: its section V as a table of numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.json_form import Result
from stiction.errors import ParameterError
from stiction.models.lookup_table import Table
from stiction.models.valves import Srinivasan
from stiction.simulation.model_reduction import reduce_valve
from stiction.simulation.stroke import stroke

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from stiction.models import PhysicalValve, Valve
    from stiction.records import LoopRecord

    Drive = Callable[[NDArray[np.float64], float], NDArray[np.float64]]

__all__ = ["Phenomena", "phenomena_table"]

_RATE_RATIOS = (0.1, 0.5, 3.0)
"""Slow, middle and fast rate of a ramp over the critical rate [-]."""
_MIN_RELATIVE_CHANGE = 0.02
"""Relative change above which a slip varies, and a stem moves [-]."""
_SAMPLES_PER_SLIP = 200
_RAMP_LENGTH_BANDS = 8.0
"""Length of a ramp over the stick band [-]."""


@dataclass(frozen=True, slots=True)
class Phenomena(Result):
    """Behaviour of one model on ramps, in numbers."""

    _json_keys = (
        "model", "reversal_travel", "slips_slow", "slips_fast", "slip_over_rate", "slip_over_travel", "staircase",
        "follow", "rate_dependent", "slip_varies_with_rate", "slip_varies_with_position",
    )  # fmt: skip

    model: str
    """Name of the model."""
    reversal_travel: float
    """Input from the reversal of a slow ramp to the first move back [% of travel].

    On a staircase it lies between S and S + J; with slips that overshoot it is smaller."""
    slips_slow: int
    """Slips on a ramp at a tenth of the critical rate [-]."""
    slips_fast: int
    """Slips on a ramp at three times the critical rate [-]."""
    slip_over_rate: float
    """Change of the slip from a tenth to half of the critical rate, relative to its mean [-]."""
    slip_over_travel: float
    """Spread of the slips over the travel, largest less smallest relative to their mean [-]."""

    @property
    def staircase(self) -> bool:
        """Whether a slow ramp gives stairs."""
        return self.slips_slow > 2

    @property
    def follow(self) -> bool:
        """Whether a fast ramp gives one slip, then following."""
        return self.slips_fast == 1

    @property
    def rate_dependent(self) -> bool:
        """Whether the model shows both."""
        return self.staircase and self.follow

    @property
    def slip_varies_with_rate(self) -> bool:
        """Whether the slip changes with the rate by more than 2 %."""
        return self.slip_over_rate > _MIN_RELATIVE_CHANGE

    @property
    def slip_varies_with_position(self) -> bool:
        """Whether the slip changes over the travel by more than 2 %."""
        return self.slip_over_travel > _MIN_RELATIVE_CHANGE


def phenomena_table(valve: PhysicalValve) -> tuple[Phenomena, ...]:
    """Test each model for the phenomena of the paper.

    Parameters
    ----------
    valve : PhysicalValve
        The physical valve, from which the parameters of the data-driven models are computed.

    Returns
    -------
    tuple of Phenomena
        A row for each data-driven model, one for the three-parameter model with tables over travel and rate
        (its sb and sj a quarter larger at 100 % than at 0, its sj larger at higher rates), and one for physics.

    Raises
    ------
    ParameterError
        When no ramp gives stairs with this valve.

    References
    ----------
    srinivasan2008, section V.

    Examples
    --------
    >>> from stiction.models.parameter_sets import table1_reading_a
    >>> from stiction.simulation import phenomena_table
    >>> [row.model for row in phenomena_table(table1_reading_a()) if row.rate_dependent]
    ['Srinivasan', 'Srinivasan with tables', 'PhysicalValve']
    """
    reduction = reduce_valve(valve, samples=50)
    if not reduction.r:
        raise ParameterError(
            "The valve has no critical rate: it follows every ramp without steps. Raise its static friction or lower "
            "its damping."
        )
    models = reduction.valves()
    sb, sj, rate = (reduction.gain * value for value in (reduction.sb, reduction.sj, reduction.r))
    larger = np.array([1.0, 1.25])
    places, rates = np.array([0.0, 100.0]), np.array([0.0, rate])
    tables = Table(places, sb * larger), Table(places, sj * np.outer(larger, larger), rates)
    models["Srinivasan with tables"] = Srinivasan(*tables, rate)
    physical = replace(valve, lag=0.0, positioner=None, hold="linear", travel=(-math.inf, math.inf))

    def drive_physical(travel: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        return _position(stroke(physical, travel / reduction.gain + reduction.offset, dt, mv_start=float(travel[0])))

    drives: dict[str, Drive] = {name: _stroke_model(model) for name, model in models.items()}
    drives["PhysicalValve"] = drive_physical
    return tuple(_measure_model(name, drive, rate, sj, _RAMP_LENGTH_BANDS * sb) for name, drive in drives.items())


def _stroke_model(model: Valve) -> Drive:
    return lambda travel, dt: _position(stroke(model, travel, dt))


def _position(record: LoopRecord) -> NDArray[np.float64]:
    assert record.mv is not None
    return record.mv


def _measure_model(name: str, drive: Drive, rate: float, sj: float, span: float) -> Phenomena:
    slow, middle, fast = (_slips(drive, share * rate, sj, span) for share in _RATE_RATIOS)
    typical, faster = np.median(slow[1:] or [math.nan]), np.median(middle[1:] or [math.nan])
    return Phenomena(
        name,
        _reversal_travel(drive, _RATE_RATIOS[0] * rate, sj, span),
        len(slow),
        len(fast),
        float(2.0 * abs(faster - typical) / (faster + typical)),
        (max(slow[1:]) - min(slow[1:])) / float(typical) if len(slow) > 2 else math.nan,
    )


def _slips(drive: Drive, rate: float, sj: float, span: float) -> list[float]:
    """Travel of each slip on a ramp through the middle of the travel [% of travel]; the last may be cut short."""
    step = sj / _SAMPLES_PER_SLIP
    travel = np.arange(0.0, span, step)
    mv = drive(travel, step / rate)
    starts, rests = _edges(np.abs(np.diff(mv)), step)
    ends = [*rests, mv.size - 1][: starts.size]
    return [float(mv[end] - mv[start]) for start, end in zip(starts, ends, strict=True)]


def _reversal_travel(drive: Drive, rate: float, sj: float, span: float) -> float:
    """Input from the reversal to the first move down of a triangle [% of travel]."""
    step = sj / _SAMPLES_PER_SLIP
    up = np.arange(0.0, span, step)
    travel = np.concatenate([up, up[::-1]])
    mv = drive(travel, step / rate)
    starts, _ = _edges(-np.diff(mv), step)
    return float(travel[up.size - 1] - travel[starts[0]]) if starts.size else math.nan


def _edges(change: NDArray[np.float64], step: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Find the samples at which motion starts and ends."""
    edge = np.diff((change > _MIN_RELATIVE_CHANGE * step).astype(np.int8), prepend=0)
    return np.flatnonzero(edge > 0), np.flatnonzero(edge < 0)
