"""What goes missing or wrong between the plant and the file."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import ParameterError, require_finite, require_not_negative, require_seed
from stiction.records.record import require_record
from stiction.simulation.historian.historian_storage import SIGNALS, map_signals

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
    """Lose stretches of all signals.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.
    share : float
        Samples lost, as a share of the record [-], 0 to 1.
    seed : int
        Seed of where they lie.
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
    >>> from stiction.simulation.historian import add_gaps
    >>> record = add_gaps(LoopRecord("FC1", 1.0, op=np.arange(100.0)), share=0.3, seed=1)
    >>> int(np.isnan(record.op).sum())
    30
    """
    require_record(record)
    lost = np.zeros(len(record), dtype=bool)
    for first, last in _draw_segments(
        len(record), _require_share(share), count, np.random.default_rng(require_seed(seed))
    ):
        lost[first:last] = True
    return map_signals(record, lambda x: np.where(lost, np.nan, x))


def drop_samples(record: LoopRecord, share: float, seed: int = 0) -> LoopRecord:
    """Lose single samples here and there, of each signal by itself.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.
    share : float
        Chance of each sample to be lost [-], 0 to 1.
    seed : int
        Seed of which.

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
    >>> from stiction.simulation.historian import drop_samples
    >>> drop_samples(LoopRecord("FC1", 1.0, op=[1.0, 2.0, 3.0]), share=1.0).op.tolist()
    [nan, nan, nan]
    """
    require_record(record)
    share, rng = _require_share(share), np.random.default_rng(require_seed(seed))
    return map_signals(record, lambda x: np.where(rng.random(x.size) < share, np.nan, x))


def freeze_signals(record: LoopRecord, share: float, seed: int = 0, *, count: int = 3) -> LoopRecord:
    """Hold the last values of all signals over stretches, as a lost connection does.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.
    share : float
        Samples held, as a share of the record [-], 0 to 1.
    seed : int
        Seed of where.
    count : int
        Number of stretches [-].

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
    >>> from stiction.simulation.historian import freeze_signals
    >>> record = freeze_signals(LoopRecord("FC1", 1.0, op=np.arange(10.0)), share=0.5, count=1)
    >>> np.unique(record.op).size
    6
    """
    require_record(record)
    from_where = np.arange(len(record))
    for first, last in _draw_segments(
        len(record), _require_share(share), count, np.random.default_rng(require_seed(seed))
    ):
        from_where[first:last] = first
    return map_signals(record, lambda x: x[from_where])


def add_clock_jumps(record: LoopRecord, count: int, seed: int = 0, *, longest: float = 0.05) -> LoopRecord:
    """Set the clock forwards, which leaves a stretch out, or backwards, which writes a stretch over the one before.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.
    count : int
        Number of jumps [-].
    seed : int
        Seed of where, and of how far.
    longest : float
        Longest jump, as a share of the record [-].

    Returns
    -------
    LoopRecord
        A shorter record whose provenance counts the jumps, as a reader of time stamps would.

    Raises
    ------
    ParameterError
        When `count` is negative or `longest` outside 0 to 1.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from stiction.simulation.historian import add_clock_jumps
    >>> record = add_clock_jumps(LoopRecord("FC1", 1.0, op=np.arange(100.0)), count=2, seed=1)
    >>> record.provenance.clock_jumps, bool((np.diff(record.op) > 1.0).any())
    (2, True)
    """
    require_record(record)
    require_not_negative("count", count, "-")
    rng, kept = np.random.default_rng(require_seed(seed)), np.ones(len(record), dtype=bool)
    for _ in range(count):
        size = max(int(len(record) * _require_share(longest) * rng.random()), 1)
        first = int(rng.integers(0, max(len(record) - size, 1)))
        kept[first : first + size] = False
    signals: dict[str, Any] = {name: getattr(record, name) for name in (*SIGNALS, "auto")}
    origin = replace(record.provenance, clock_jumps=record.provenance.clock_jumps + count)
    return replace(record, provenance=origin, **{name: x[kept] for name, x in signals.items() if x is not None})


def replay_segment(record: LoopRecord, share: float, seed: int = 0) -> LoopRecord:
    """Copy an earlier stretch of the record over a later one.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.
    share : float
        Length of the stretch, as a share of the record [-], 0 to 0.5.
    seed : int
        Seed of where.

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
    >>> from stiction.simulation.historian import replay_segment
    >>> record = replay_segment(LoopRecord("FC1", 1.0, op=np.arange(10.0)), share=0.3, seed=1)
    >>> np.unique(record.op).size
    7
    """
    require_record(record)
    n, size = len(record), round(len(record) * _require_share(share, 0.5))
    rng, from_where = np.random.default_rng(require_seed(seed)), np.arange(n)
    first = int(rng.integers(0, n - 2 * size + 1))
    again = int(rng.integers(first + size, n - size + 1))
    from_where[again : again + size] = np.arange(first, first + size)
    return map_signals(record, lambda x: x[from_where])


def add_manual_period(record: LoopRecord, share: float, seed: int = 0, *, record_mode: bool = False) -> LoopRecord:
    """Put the loop in manual for a stretch: OP rests, PV settles to its median with the noise it has.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.
    share : float
        Length of the stretch, as a share of the record [-], 0 to 1.
    seed : int
        Seed of where, and of the noise.
    record_mode : bool
        Whether the mode was recorded, in `auto`.

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
    The noise is estimated from the PV's second differences, which leave white noise six times its variance.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from stiction.simulation.historian import add_manual_period
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
    """Record OP in a range that ends below its peaks: it rests at the limit while the loop goes on.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.
    share : float
        Samples at the limit [-], 0 to 1.

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
    >>> from stiction.simulation.historian import clip_op
    >>> clip_op(LoopRecord("FC1", 1.0, op=[1.0, 2.0, 3.0, 4.0, 5.0]), share=0.5).op.tolist()
    [1.0, 2.0, 3.0, 3.0, 3.0]
    """
    require_record(record)
    limit = float(np.nanquantile(record.op, 1.0 - _require_share(share)))
    return replace(record, op=np.minimum(record.op, limit))


def change_units(
    record: LoopRecord, *, op: tuple[float, float] = (1.0, 0.0), pv: tuple[float, float] = (1.0, 0.0)
) -> LoopRecord:
    """Write OP, and PV with its SP, in another unit.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.
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
    >>> from stiction.simulation.historian import change_units
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
        raise ParameterError(f"share = {share:g} is outside 0 to {most:g}; it is a part of the record.")
    return float(share)


def _draw_segments(n: int, share: float, count: int, rng: np.random.Generator) -> list[tuple[int, int]]:
    """`count` stretches that do not overlap, of share * n samples together: the rest is cut at random between them."""
    total = round(share * n)
    edges = np.round(np.linspace(0, total, count + 1)).astype(int)
    before = np.sort(rng.integers(0, n - total + 1, count))
    return [(int(before[i] + edges[i]), int(before[i] + edges[i + 1])) for i in range(count)]
