"""Faults in recorded data: gaps, frozen values, clock jumps, copied segments, other units."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration.historian.historian_storage import SIGNALS, map_signals
from stiction.errors import ParameterError, require_finite, require_not_negative, require_seed
from stiction.records.record import require_record

if TYPE_CHECKING:
    from stiction.records.record import LoopRecord

__all__ = [
    "add_clock_jumps",
    "add_gaps",
    "add_manual_period",
    "change_units",
    "clip_op",
    "drop_samples",
    "freeze_signals",
    "replay_segment",
]


def add_gaps(record: LoopRecord, share: float, seed: int = 0, *, count: int = 3) -> LoopRecord:
    """Remove segments of all signals.

    Parameters
    ----------
    record : LoopRecord
        The record.
    share : float
        Share of removed samples [-], 0 to 1.
    seed : int
        Seed of the positions.
    count : int
        Number of gaps [-].

    Returns
    -------
    LoopRecord
        A record of the same length, NaN in the gaps.

    Raises
    ------
    ParameterError
        When `share` is outside 0 to 1.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import add_gaps
    >>> record = add_gaps(LoopRecord("FC1", 1.0, op=np.arange(100.0)), share=0.3, seed=1)
    >>> int(np.isnan(record.op).sum())
    30
    """
    require_record(record)
    lost_mask = np.zeros(len(record), dtype=bool)
    for first, last in _draw_segments(
        len(record), _require_share(share), count, np.random.default_rng(require_seed(seed))
    ):
        lost_mask[first:last] = True
    return map_signals(record, lambda x: np.where(lost_mask, np.nan, x))


def drop_samples(record: LoopRecord, share: float, seed: int = 0) -> LoopRecord:
    """Remove single samples at random, independently for each signal.

    Parameters
    ----------
    record : LoopRecord
        The record.
    share : float
        Probability that a sample is removed [-], 0 to 1.
    seed : int
        Seed of the choice.

    Returns
    -------
    LoopRecord
        A record of the same length with NaN.

    Raises
    ------
    ParameterError
        When `share` is outside 0 to 1.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import drop_samples
    >>> drop_samples(LoopRecord("FC1", 1.0, op=[1.0, 2.0, 3.0]), share=1.0).op.tolist()
    [nan, nan, nan]
    """
    require_record(record)
    share, rng = _require_share(share), np.random.default_rng(require_seed(seed))
    return map_signals(record, lambda x: np.where(rng.random(x.size) < share, np.nan, x))


def freeze_signals(record: LoopRecord, share: float, seed: int = 0, *, count: int = 3) -> LoopRecord:
    """Hold the last values of all signals over segments, as after a lost connection.

    Parameters
    ----------
    record : LoopRecord
        The record.
    share : float
        Share of held samples [-], 0 to 1.
    seed : int
        Seed of the position.
    count : int
        Number of segments [-].

    Returns
    -------
    LoopRecord
        A record of the same length.

    Raises
    ------
    ParameterError
        When `share` is outside 0 to 1.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import freeze_signals
    >>> record = freeze_signals(LoopRecord("FC1", 1.0, op=np.arange(10.0)), share=0.5, count=1)
    >>> np.unique(record.op).size
    6
    """
    require_record(record)
    source_index = np.arange(len(record))
    for first, last in _draw_segments(
        len(record), _require_share(share), count, np.random.default_rng(require_seed(seed))
    ):
        source_index[first:last] = first
    return map_signals(record, lambda x: x[source_index])


def add_clock_jumps(record: LoopRecord, count: int, seed: int = 0, *, longest: float = 0.05) -> LoopRecord:
    """Remove a segment at each jump of the clock: forwards it is not recorded, backwards it is overwritten.

    Parameters
    ----------
    record : LoopRecord
        The record.
    count : int
        Number of jumps [-].
    seed : int
        Seed of the positions and lengths.
    longest : float
        Longest jump, as a share of the record [-].

    Returns
    -------
    LoopRecord
        A shorter record; its provenance counts the jumps, as a reader of time stamps does.

    Raises
    ------
    ParameterError
        When `count` is negative or `longest` outside 0 to 1.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import add_clock_jumps
    >>> record = add_clock_jumps(LoopRecord("FC1", 1.0, op=np.arange(100.0)), count=2, seed=1)
    >>> record.provenance.clock_jumps, bool((np.diff(record.op) > 1.0).any())
    (2, True)
    """
    require_record(record)
    require_not_negative("count", count, "-")
    rng, kept_mask = np.random.default_rng(require_seed(seed)), np.ones(len(record), dtype=bool)
    for _ in range(count):
        size = max(int(len(record) * _require_share(longest) * rng.random()), 1)
        first = int(rng.integers(0, max(len(record) - size, 1)))
        kept_mask[first : first + size] = False
    signals: dict[str, Any] = {name: getattr(record, name) for name in (*SIGNALS, "auto")}
    origin = replace(record.provenance, clock_jumps=record.provenance.clock_jumps + count)
    return replace(record, provenance=origin, **{name: x[kept_mask] for name, x in signals.items() if x is not None})


def replay_segment(record: LoopRecord, share: float, seed: int = 0) -> LoopRecord:
    """Copy an earlier segment of the record over a later one.

    Parameters
    ----------
    record : LoopRecord
        The record.
    share : float
        Length of the segment over the length of the record [-], 0 to 0.5.
    seed : int
        Seed of the position.

    Returns
    -------
    LoopRecord
        A record of the same length.

    Raises
    ------
    ParameterError
        When `share` is outside 0 to 0.5.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import replay_segment
    >>> record = replay_segment(LoopRecord("FC1", 1.0, op=np.arange(10.0)), share=0.3, seed=1)
    >>> np.unique(record.op).size
    7
    """
    require_record(record)
    n, size = len(record), round(len(record) * _require_share(share, 0.5))
    rng, source_index = np.random.default_rng(require_seed(seed)), np.arange(n)
    first = int(rng.integers(0, n - 2 * size + 1))
    again = int(rng.integers(first + size, n - size + 1))
    source_index[again : again + size] = np.arange(first, first + size)
    return map_signals(record, lambda x: x[source_index])


def add_manual_period(record: LoopRecord, share: float, seed: int = 0, *, record_mode: bool = False) -> LoopRecord:
    """Put the loop in manual for a period: OP is constant, PV settles to its median with unchanged noise.

    Parameters
    ----------
    record : LoopRecord
        The record.
    share : float
        Length of the period over the length of the record [-], 0 to 1.
    seed : int
        Seed of the position and of the noise.
    record_mode : bool
        Whether `auto` records the mode.

    Returns
    -------
    LoopRecord
        A record of the same length.

    Raises
    ------
    ParameterError
        When `share` is outside 0 to 1.

    Notes
    -----
    The noise is estimated from the second differences of the PV, which have six times the variance of white noise.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import add_manual_period
    >>> record = add_manual_period(LoopRecord("FC1", 1.0, op=np.arange(10.0)), share=0.4, record_mode=True)
    >>> int((~record.auto).sum()), np.unique(record.op).size
    (4, 7)
    """
    require_record(record)
    rng = np.random.default_rng(require_seed(seed))
    ((first, last),) = _draw_segments(len(record), _require_share(share), 1, rng)
    if first == last:
        return record
    inside = np.zeros(len(record), dtype=bool)
    inside[first:last] = True
    parts: dict[str, Any] = {"op": np.where(inside, record.op[first], record.op)}
    if record.pv is not None:
        noise = float(np.nanmedian(np.abs(np.diff(record.pv, 2)))) / 0.6745 / 6.0**0.5
        age = np.arange(len(record)) - first
        start, end = record.pv[first], float(np.nanmedian(record.pv))
        settling = end + (start - end) * np.exp(-np.maximum(age, 0) / 20.0) + rng.normal(0.0, 1.0, age.size) * noise
        parts["pv"] = np.where(inside, settling, record.pv)
    if record_mode:
        parts["auto"] = ~inside if record.auto is None else record.auto & ~inside
    return replace(record, **parts)


def clip_op(record: LoopRecord, share: float) -> LoopRecord:
    """Limit the recorded OP below its peaks; the other signals do not change.

    Parameters
    ----------
    record : LoopRecord
        The record.
    share : float
        Share of samples at the limit [-], 0 to 1.

    Returns
    -------
    LoopRecord
        A record of the same length.

    Raises
    ------
    ParameterError
        When `share` is outside 0 to 1.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import clip_op
    >>> clip_op(LoopRecord("FC1", 1.0, op=[1.0, 2.0, 3.0, 4.0, 5.0]), share=0.5).op.tolist()
    [1.0, 2.0, 3.0, 3.0, 3.0]
    """
    require_record(record)
    limit = float(np.nanquantile(record.op, 1.0 - _require_share(share)))
    return replace(record, op=np.minimum(record.op, limit))


def change_units(
    record: LoopRecord, *, op: tuple[float, float] = (1.0, 0.0), pv: tuple[float, float] = (1.0, 0.0)
) -> LoopRecord:
    """Convert OP, and PV with its SP, to other units.

    Parameters
    ----------
    record : LoopRecord
        The record.
    op, pv : tuple of float
        Factor and offset of the new unit: (0.16, 4.0) writes an OP in milliampere.

    Returns
    -------
    LoopRecord
        A record of the same length.

    Raises
    ------
    ParameterError
        When a factor or an offset is not finite.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import change_units
    >>> change_units(LoopRecord("FC1", 1.0, op=[0.0, 50.0, 100.0]), op=(0.16, 4.0)).op.tolist()
    [4.0, 12.0, 20.0]
    """
    require_record(record)
    units = {"op": op, "mv": op, "pv": pv, "sp": pv}
    changed: dict[str, Any] = {}
    for name, unit in units.items():
        factor, offset = (require_finite(f"unit of {name}", number) for number in unit)
        x = getattr(record, name)
        if x is not None and (factor, offset) != (1.0, 0.0):
            changed[name] = offset + factor * x
    return replace(record, **changed)


def _require_share(share: float, most: float = 1.0) -> float:
    if not 0.0 <= share <= most:
        raise ParameterError(
            f"share = {share:g} is outside 0 to {most:g}; give the share of the record within these limits."
        )
    return float(share)


def _draw_segments(n: int, share: float, count: int, rng: np.random.Generator) -> list[tuple[int, int]]:
    """`count` segments at random positions, without overlap, of share * n samples together."""
    total = round(share * n)
    edges = np.round(np.linspace(0, total, count + 1)).astype(int)
    before = np.sort(rng.integers(0, n - total + 1, count))
    return [(int(before[i] + edges[i]), int(before[i] + edges[i + 1])) for i in range(count)]
