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
        clock = (primary.dt, primary.start, len(primary))
        others = [one for one in free if one is not primary and (one.dt, one.start, len(one)) == clock]
        if not others or np.unique(primary.op[np.isfinite(primary.op)]).size < min_values:
            return ""
        probe = slice(None, None, max(1, len(primary) // PROBE_SAMPLES))
        probes = np.array([one.sp[probe] for one in others if one.sp is not None])
        for k in np.flatnonzero(_near_line_mask(probes, primary.op[probe], max_rounding)):
            sp = others[k].sp
            if sp is not None and _is_scaled_copy(sp, primary.op, max_rounding, min_known):
                return others[k].tag
        return ""

    return [secondary_of(record) for record in records]


def _is_scaled_copy(sp: NDArray[np.float64], op: NDArray[np.float64], max_rounding: float, min_known: float) -> bool:
    """Whether a set point is an OP, but for its scale and the rounding of both."""
    from stiction.records.quality.quantisation import peak_to_peak, quantisation_step

    known = np.isfinite(sp) & np.isfinite(op)
    if known.sum() < min_known * op.size or not _near_line_mask(sp[None], op, max_rounding)[0]:
        return False
    sp, op = sp[known], op[known]
    distance, slope = (float(x[0]) for x in _fit_lines(sp[None], op))
    return distance <= quantisation_step(sp) + abs(slope) * quantisation_step(op) + 1e-6 * peak_to_peak(sp)


def _near_line_mask(sps: NDArray[np.float64], op: NDArray[np.float64], max_rounding: float) -> NDArray[np.bool_]:
    """Mark the set points, a row each, that lie near a straight line of OP, where both are known."""
    known = np.isfinite(sps) & np.isfinite(op)
    swing = np.where(known, sps, -np.inf).max(axis=1) - np.where(known, sps, np.inf).min(axis=1)
    return (known.sum(axis=1) > 2) & (swing > 0.0) & (_fit_lines(sps, op)[0] <= max_rounding * swing)


def _fit_lines(sps: NDArray[np.float64], op: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Largest distance of each set point from its straight line of OP, and the slopes."""
    known = np.isfinite(sps) & np.isfinite(op)
    count = np.maximum(known.sum(axis=1, keepdims=True), 1)
    x, y = (np.where(known, z, 0.0) for z in (op, sps))
    x, y = (np.where(known, z - z.sum(axis=1, keepdims=True) / count, 0.0) for z in (x, y))
    power = (x * x).sum(axis=1)
    slope = np.divide((x * y).sum(axis=1), power, out=np.zeros(len(sps)), where=power > 0.0)
    return np.where(power > 0.0, np.abs(y - slope[:, None] * x).max(axis=1), np.inf), slope
