"""Every effect by its name and one strength: 0 is hardly there, 1 is the worst that a plant lives with."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, require_seed
from stiction.records.quality.quantisation import robust_range
from stiction.records.record import require_record
from stiction.simulation.historian.spoiled import (
    clipped,
    clock_jumps,
    frozen,
    gaps,
    missing,
    part_manual,
    replayed,
    rescaled,
)
from stiction.simulation.historian.stored import (
    averaged,
    exception_reported,
    interpolated,
    quantised,
    sampled,
    swinging_door,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from stiction.records.record import LoopRecord

__all__ = ["EFFECTS", "SLOWER", "spoil"]

SLOWEST = 60
"""Longest sampling, averaging or interpolating interval of the effects [samples of the record]."""
SLOWER = ("sampling", "averaging", "interpolation")
"""Effects whose strength sets an interval: SLOWEST to the power of the strength [samples of the record]."""


def _interval(record: LoopRecord, strength: float) -> float:
    return round(SLOWEST**strength) * record.dt


def _rounded(record: LoopRecord, strength: float, seed: int) -> LoopRecord:
    del seed
    assert record.pv is not None
    part = 0.01 + 0.29 * strength
    return quantised(record, op=part * robust_range(record.op), pv=part * robust_range(record.pv))


def _units(record: LoopRecord, strength: float, seed: int) -> LoopRecord:
    rng = np.random.default_rng(require_seed(seed))
    pv = (float(10.0 ** rng.uniform(-3.0, 3.0)), float(rng.uniform(-100.0, 100.0)))
    op = [(0.01, 0.0), (0.16, 4.0)][int(rng.integers(2))] if strength > 0.5 else (1.0, 0.0)
    return rescaled(record, op=op, pv=pv)


EFFECTS: dict[str, Callable[[LoopRecord, float, int], LoopRecord]] = {
    "sampling": lambda record, strength, _: sampled(record, _interval(record, strength)),
    "averaging": lambda record, strength, _: averaged(record, _interval(record, strength)),
    "interpolation": lambda record, strength, _: interpolated(record, _interval(record, strength)),
    "exception": lambda record, strength, _: exception_reported(record, 2.0 * strength),
    "swinging door": lambda record, strength, _: swinging_door(record, 2.0 * strength),
    "quantisation": _rounded,
    "gaps": lambda record, strength, seed: gaps(record, 0.3 * strength, seed),
    "missing": lambda record, strength, seed: missing(record, 0.3 * strength, seed),
    "held": lambda record, strength, seed: frozen(record, 0.3 * strength, seed),
    "clock": lambda record, strength, seed: clock_jumps(record, 1 + round(4.0 * strength), seed),
    "replay": lambda record, strength, seed: replayed(record, 0.3 * strength, seed),
    "manual": lambda record, strength, seed: part_manual(record, 0.5 * strength, seed, told=bool(seed % 2)),
    "saturation": lambda record, strength, _: clipped(record, 0.5 * strength),
    "units": _units,
}
"""Name -> effect of (record, strength, seed): intervals to 60 samples, deviations to 2 standard deviations, steps to
0.3 of the swing, 30 % missing, held or replayed, five clock jumps, half of the record in manual or saturated."""


def spoil(record: LoopRecord, effect: str, strength: float, seed: int = 0) -> LoopRecord:
    """Put a record through one effect of a historian.

    Parameters
    ----------
    record : LoopRecord
        What was recorded, OP and PV at least.
    effect : str
        One of `EFFECTS`.
    strength : float
        How bad it is [-], 0 to 1.
    seed : int
        Seed of what is random in it.

    Returns
    -------
    LoopRecord
        The record as the historian gives it back.

    Raises
    ------
    ParameterError
        When the effect is unknown or the strength outside 0 to 1.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from stiction.simulation.historian import spoil
    >>> record = LoopRecord("FC1", 1.0, op=np.arange(120.0), pv=np.arange(120.0))
    >>> len(spoil(record, "sampling", strength=1.0))
    2
    """
    require_record(record)
    if effect not in EFFECTS:
        raise ParameterError(f"effect {effect!r} is unknown; use {', '.join(EFFECTS)}.")
    if not 0.0 <= strength <= 1.0:
        raise ParameterError(f"strength = {strength:g} is outside 0 to 1; 1 is the worst of each effect.")
    return EFFECTS[effect](record, strength, seed)
