"""Cascades: a controller whose OP is the set point of another loop has no valve of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.records.quality.quantisation import peak_to_peak, quantisation_step

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["find_secondary_tags"]


def find_secondary_tags(
    records: Sequence[LoopRecord],
    masters: Mapping[str, str] | None = None,
    *,
    min_values: int = 12,
    max_rounding: float = 0.05,
    min_known: float = 0.9,
) -> list[str]:
    """Find for each loop the tag of the loop whose set point is its OP; "" where there is none.

    Those in `masters` are known. OP takes `min_values` values, both are known in `min_known` of the samples [-], and
    rounding is at most `max_rounding` of the range of the set point [-].
    """
    masters = {tag.lower(): master for tag, master in (masters or {}).items() if master}
    tags = {record.tag.lower() for record in records}
    if unknown := [master for master in masters.values() if master.lower() not in tags]:
        raise RecordError(
            f"The map names {unknown[0]!r} as a master, but the source has no such loop; correct the map."
        )
    by_map = {master.lower(): record.tag for record in records if (master := masters.get(record.tag.lower()))}
    free = [(record, record.sp) for record in records if record.sp is not None and record.tag.lower() not in masters]

    def secondary_of(primary: LoopRecord) -> str:
        if tag := by_map.get(primary.tag.lower()):
            return tag
        clock = (primary.dt, primary.start, len(primary))
        others = [(o, sp) for o, sp in free if o is not primary and (o.dt, o.start, len(o)) == clock]
        if not others:
            return ""
        some = slice(None, None, max(1, len(primary) // 64))  # most pairs of loops already differ there
        probes = np.array([sp[some] for _, sp in others])
        for k in np.flatnonzero(_distances(probes, primary.op[some])[0] <= max_rounding):
            other, sp = others[k]
            n_values = np.unique(primary.op[np.isfinite(primary.op)]).size
            if n_values >= min_values and _is_scaled_copy(sp, primary.op, max_rounding, min_known):
                return other.tag
        return ""

    return [secondary_of(record) for record in records]


def _is_scaled_copy(sp: NDArray[np.float64], op: NDArray[np.float64], max_rounding: float, min_known: float) -> bool:
    """Whether a set point is an OP, but for its scale and the rounding of both."""
    known = np.isfinite(sp) & np.isfinite(op)
    sp, op = sp[known], op[known]
    if op.size < min_known * known.size:
        return False
    distance, slope = (float(x[0]) for x in _distances(sp[None], op))
    swing = peak_to_peak(sp)
    rounding = quantisation_step(sp) + abs(slope) * quantisation_step(op) + 1e-6 * swing
    return distance <= max_rounding and distance * swing <= rounding


def _distances(sps: NDArray[np.float64], op: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Largest distance of each set point, a row each, from its straight line of OP [share of its range], and slopes."""
    known = np.isfinite(sps) & np.isfinite(op)
    swing = np.where(known, sps, -np.inf).max(axis=1) - np.where(known, sps, np.inf).min(axis=1)
    count = np.maximum(known.sum(axis=1, keepdims=True), 1)
    x, y = (np.where(known, z, 0.0) for z in (op, sps))
    x, y = (np.where(known, z - z.sum(axis=1, keepdims=True) / count, 0.0) for z in (x, y))
    power = (x * x).sum(axis=1)
    slope = np.divide((x * y).sum(axis=1), power, out=np.zeros(len(sps)), where=power > 0.0)
    usable = (known.sum(axis=1) > 2) & (swing > 0.0) & (power > 0.0)
    distance = np.abs(y - slope[:, None] * x).max(axis=1)
    return np.divide(distance, swing, out=np.full(len(sps), np.inf), where=usable), slope
