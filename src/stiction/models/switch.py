"""The one file that knows all valve pages: from a model's code to its step."""

from __future__ import annotations

from stiction.models.compiled import kernel
from stiction.models.component import TIE, ValveState, at_rest
from stiction.models.table import lookup
from stiction.models.valves.choudhury import choudhury_step
from stiction.models.valves.he import he_step
from stiction.models.valves.ideal import ideal_step
from stiction.models.valves.kano import kano_at_rest, kano_step
from stiction.models.valves.srinivasan import srinivasan_printed_step, srinivasan_step
from stiction.models.valves.stenman import stenman_step

__all__ = ["CHOUDHURY", "HE", "IDEAL", "KANO", "SRINIVASAN", "STENMAN", "valve_at_rest", "valve_step"]

IDEAL, STENMAN, KANO, CHOUDHURY, HE, SRINIVASAN, SRINIVASAN_PRINTED = 0, 1, 2, 3, 4, 5, 6
SRINIVASAN_TABLED, SRINIVASAN_TABLED_PRINTED = 7, 8

_at_rest = kernel(at_rest)


@kernel
def valve_at_rest(model: int, op: float, position: float, p) -> ValveState:
    """State of valve `model` with packed parameters `p`, its stem resting at `position` under the input `op`."""
    if model == KANO:
        return kano_at_rest(op, position, p[4])
    return _at_rest(op, position)


@kernel
def valve_step(model: int, op: float, s: ValveState, p) -> ValveState:
    """One sample of valve `model` with packed parameters `p`, the input limited to the travel p[0]..p[1]."""
    op = min(max(op, p[0]), p[1])
    if model == KANO:
        return kano_step(op, s, p[2], p[3], p[4])
    if model == STENMAN:
        return stenman_step(op, s, p[2])
    if model == CHOUDHURY:
        return choudhury_step(op, s, p[2], p[3], p[4])
    if model == HE:
        return he_step(op, s, p[2], p[3])
    if model == SRINIVASAN:
        return srinivasan_step(op, s, p[2], p[3], p[4])
    if model == SRINIVASAN_PRINTED:
        return srinivasan_printed_step(op, s, p[2], p[3], p[4])
    if model == SRINIVASAN_TABLED or model == SRINIVASAN_TABLED_PRINTED:
        rate = abs(op - s.op) / p[3]
        sb = lookup(p, 5, s.position, rate)
        sj = lookup(p, int(p[4]), s.position, rate)
        if model == SRINIVASAN_TABLED:
            return srinivasan_step(op, s, sb * (1.0 + TIE), sb - sj, p[2])
        return srinivasan_printed_step(op, s, sb * (1.0 + TIE), sj, p[2])
    return ideal_step(op, s)
