"""Cascades: a controller whose OP is the set point of another loop has no valve of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["find_secondary_tags"]

PROBE_SAMPLES = 64
"""Samples that are compared first, since most pairs of loops already differ there [-]."""


def find_secondary_tags(
    records: Sequence[LoopRecord],
    masters: Mapping[str, str] | None = None,
    *,
    min_values: int = 12,
    max_rounding: float = 0.05,
    min_known: float = 0.9,
) -> list[str]:
    """Find for each loop of a source the loop whose set point is its OP, by its tag; "" where there is none.

    Parameters
    ----------
    records : sequence of LoopRecord
        Loops of one source.
    masters : mapping, optional
        Tag of a loop -> tag of its master, by the map; for these loops nothing is guessed.
    min_values : int
        Values that OP must take, so that its likeness to a set point is no chance [-].
    max_rounding : float
        Rounding, as a share of the range of the set point, above which likeness says nothing [-].
    min_known : float
        Share of the samples that must be known of both [-].

    Raises
    ------
    RecordError
        When a master of the map is not among the records.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> op, sp = np.arange(40.0) % 17, np.full(40, 50.0)
    >>> master, slave = LoopRecord("TIC-1", 1.0, op=op, sp=sp), LoopRecord("FIC-2", 1.0, op=op[::-1], sp=4.0 + 0.5 * op)
    >>> find_secondary_tags([master, slave])
    ['FIC-2', '']
    """
    masters = {tag.lower(): master for tag, master in (masters or {}).items() if master}
    tags = {record.tag.lower() for record in records}
    if unknown := [master for master in masters.values() if master.lower() not in tags]:
        raise RecordError(f"The map names {unknown[0]!r} as a master, but the source has no such loop; correct it.")
    by_map = {master.lower(): record.tag for record in records if (master := masters.get(record.tag.lower()))}
    free = [record for record in records if record.sp is not None and record.tag.lower() not in masters]

    def secondary_of(primary: LoopRecord) -> str:
        if tag := by_map.get(primary.tag.lower()):
            return tag
        if not free or np.unique(primary.op[np.isfinite(primary.op)]).size < min_values:
            return ""
        clock = (primary.dt, primary.start, len(primary))
        for other in free:
            if other is primary or other.sp is None or (other.dt, other.start, len(other)) != clock:
                continue
            if _is_scaled_copy(other.sp, primary.op, max_rounding, min_known):
                return other.tag
        return ""

    return [secondary_of(record) for record in records]


def _is_scaled_copy(sp: NDArray[np.float64], op: NDArray[np.float64], max_rounding: float, min_known: float) -> bool:
    """Whether a set point is an OP, but for its scale and the rounding of both."""
    from stiction.records.quality.quantisation import peak_to_peak, quantisation_step

    probe = slice(None, None, max(1, op.size // PROBE_SAMPLES))
    if not _is_near_line(sp[probe], op[probe], max_rounding):
        return False
    known = np.isfinite(sp) & np.isfinite(op)
    if known.sum() < min_known * op.size or not _is_near_line(sp, op, max_rounding):
        return False
    sp, op = sp[known], op[known]
    distance, slope = _distance_from_line(sp, op)
    return distance <= quantisation_step(sp) + abs(slope) * quantisation_step(op) + 1e-6 * peak_to_peak(sp)


def _is_near_line(sp: NDArray[np.float64], op: NDArray[np.float64], max_rounding: float) -> bool:
    """Whether a set point lies near a straight line of OP, where both are known."""
    known = np.isfinite(sp) & np.isfinite(op)
    sp, op = sp[known], op[known]
    return sp.size > 2 and _distance_from_line(sp, op)[0] <= max_rounding * float(np.ptp(sp)) > 0.0


def _distance_from_line(y: NDArray[np.float64], x: NDArray[np.float64]) -> tuple[float, float]:
    """The largest distance from a straight line, and its slope."""
    centred = x - x.mean()
    power = float(centred @ centred)
    if not power > 0.0:
        return np.inf, 0.0
    slope = float(centred @ y) / power
    return float(np.abs(y - y.mean() - slope * centred).max()), slope
