"""Every effect by its name and a strength from 0 (hardly visible) to 1 (the worst in a plant)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calibration.historian.data_faults import (
    add_clock_jumps,
    add_gaps,
    add_manual_period,
    change_units,
    clip_op,
    drop_samples,
    freeze_signals,
    replay_segment,
)
from calibration.historian.historian_storage import (
    average_intervals,
    compress_by_swinging_door,
    interpolate_samples,
    quantise_signals,
    report_by_exception,
    sample_slower,
)
from stiction.errors import ParameterError, require_seed
from stiction.records.quality.quantisation import robust_range
from stiction.records.record import require_record

if TYPE_CHECKING:
    from collections.abc import Callable

    from stiction.records.record import LoopRecord

__all__ = ["EFFECTS", "INTERVAL_EFFECTS", "apply_effect"]

MAX_INTERVAL_SAMPLES = 60
"""Longest sampling, averaging or interpolating interval of the effects [samples of the record]."""
INTERVAL_EFFECTS = ("sampling", "averaging", "interpolation")
"""Effects whose strength sets an interval: `MAX_INTERVAL_SAMPLES` to the power of the strength [samples]."""


def _effect_interval(record: LoopRecord, strength: float) -> float:
    return round(MAX_INTERVAL_SAMPLES**strength) * record.dt


def _quantise_by_strength(record: LoopRecord, strength: float, seed: int) -> LoopRecord:
    del seed
    assert record.pv is not None
    part = 0.01 + 0.29 * strength
    return quantise_signals(record, op=part * robust_range(record.op), pv=part * robust_range(record.pv))


def _draw_units(record: LoopRecord, strength: float, seed: int) -> LoopRecord:
    rng = np.random.default_rng(require_seed(seed))
    pv = (float(10.0 ** rng.uniform(-3.0, 3.0)), float(rng.uniform(-100.0, 100.0)))
    op = [(0.01, 0.0), (0.16, 4.0)][int(rng.integers(2))] if strength > 0.5 else (1.0, 0.0)
    return change_units(record, op=op, pv=pv)


EFFECTS: dict[str, Callable[[LoopRecord, float, int], LoopRecord]] = {
    "sampling": lambda record, strength, _: sample_slower(record, _effect_interval(record, strength)),
    "averaging": lambda record, strength, _: average_intervals(record, _effect_interval(record, strength)),
    "interpolation": lambda record, strength, _: interpolate_samples(record, _effect_interval(record, strength)),
    "exception": lambda record, strength, _: report_by_exception(record, 2.0 * strength),
    "swinging door": lambda record, strength, _: compress_by_swinging_door(record, 2.0 * strength),
    "quantisation": _quantise_by_strength,
    "gaps": lambda record, strength, seed: add_gaps(record, 0.3 * strength, seed),
    "missing": lambda record, strength, seed: drop_samples(record, 0.3 * strength, seed),
    "held": lambda record, strength, seed: freeze_signals(record, 0.3 * strength, seed),
    "clock": lambda record, strength, seed: add_clock_jumps(record, 1 + round(4.0 * strength), seed),
    "replay": lambda record, strength, seed: replay_segment(record, 0.3 * strength, seed),
    "manual": lambda record, strength, seed: add_manual_period(
        record, 0.5 * strength, seed, record_mode=bool(seed % 2)
    ),
    "saturation": lambda record, strength, _: clip_op(record, 0.5 * strength),
    "units": _draw_units,
}
"""Name -> effect of (record, strength, seed): at strength 1 intervals of 60 samples, deviations of 2 standard
deviations, steps of 0.3 of the swing, 30 % missing, held or replayed, five clock jumps, half in manual or saturated."""


def apply_effect(record: LoopRecord, effect: str, strength: float, seed: int = 0) -> LoopRecord:
    """Apply one effect of a historian to a record.

    Parameters
    ----------
    record : LoopRecord
        The record, with OP and PV.
    effect : str
        One of `EFFECTS`.
    strength : float
        Strength of the effect [-], 0 to 1.
    seed : int
        Seed of the random part of the effect.

    Returns
    -------
    LoopRecord
        The record with the effect.

    Raises
    ------
    ParameterError
        When the effect is unknown or the strength outside 0 to 1.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import apply_effect
    >>> record = LoopRecord("FC1", 1.0, op=np.arange(120.0), pv=np.arange(120.0))
    >>> len(apply_effect(record, "sampling", strength=1.0))
    2
    """
    require_record(record)
    if effect not in EFFECTS:
        raise ParameterError(f"effect {effect!r} is unknown; use {', '.join(EFFECTS)}.")
    if not 0.0 <= strength <= 1.0:
        raise ParameterError(f"strength = {strength:g} is outside 0 to 1; give 0 (no effect) to 1 (largest effect).")
    return EFFECTS[effect](record, strength, seed)
