"""Slips and following of all ramps as rows for the fit, as events in time, and over the travel."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.valvetests.friction_fit import FrictionFit, SlipRows
from stiction.valvetests.result import StemEvent, TravelBin

if TYPE_CHECKING:
    from stiction.valvetests.ramp_split import OpRamp
    from stiction.valvetests.stem_moves import StemMoves

__all__ = ["ramp_events", "ramps_by_travel", "rows_for_fit"]


def rows_for_fit(ramps: tuple[OpRamp, ...], moves: tuple[StemMoves, ...]) -> SlipRows:
    """Slips and points of following of all ramps, in order."""
    slips: list[tuple[float, ...]] = []
    points: list[tuple[float, ...]] = []
    for ramp, moved in zip(ramps, moves, strict=True):
        first = len(slips)
        jump = moved.hidden.jump if moved.hidden else math.nan
        slips += [
            (ramp.direction, s.op, s.before, s.after, ramp.rate, math.isnan(s.stuck), jump, s.rise) for s in moved.slips
        ]
        if moved.hidden:
            points += [(first, 1.0, *point) for point in zip(moved.hidden.op, moved.hidden.stem, strict=True)]
        for follow in moved.follows:
            began = [k for k, s in enumerate(moved.slips) if s.time <= follow.start]
            if began:
                middle = 0.5 * (follow.op_start + follow.op_end), 0.5 * (follow.stem_start + follow.stem_end)
                place = first + began[-1]
                points += [(place, 0.0, *middle), (place, 0.0, follow.op_end, follow.stem_end)]
    direction, op, before, after, rate, followed, jumps, rise = np.array(slips, dtype=float).reshape(-1, 8).T
    place, mean, follow_op, follow_stem = np.array(points, dtype=float).reshape(-1, 4).T
    return SlipRows(
        direction, op, before, after, rate, followed > 0.0, jumps, rise, follow_slip=place.astype(np.int64),
        follow_mean=mean > 0.0, follow_op=follow_op, follow_stem=follow_stem,
    )  # fmt: skip


def ramp_events(
    ramps: tuple[OpRamp, ...], moves: tuple[StemMoves, ...], fit: FrictionFit | None
) -> tuple[StemEvent, ...]:
    """Every stick and slip, in order of time."""
    if fit is None:
        return ()
    table: list[StemEvent] = []
    n = 0
    for k, (ramp, moved) in enumerate(zip(ramps, moves, strict=True)):
        for slip in moved.slips:
            place = fit.offset + fit.slope * slip.before
            band, jump = float(fit.stick_bands[n]), float(fit.jumps[n])
            table.append(StemEvent("slip", slip.time, k, ramp.direction, slip.op, place, band, jump))
            n += 1
            if math.isfinite(slip.stuck):
                place = fit.offset + fit.slope * slip.after
                op = ramp.line.at(slip.stuck)
                table.append(StemEvent("stick", slip.stuck, k, ramp.direction, op, place, math.nan, math.nan))
        for follow in moved.follows:
            if follow.then_rest:
                place = fit.offset + fit.slope * follow.stem_end
                table.append(
                    StemEvent("stick", follow.end, k, ramp.direction, follow.op_end, place, math.nan, math.nan)
                )
    return tuple(sorted(table, key=lambda event: event.time))


def ramps_by_travel(rows: SlipRows, fit: FrictionFit | None, bins: int) -> tuple[TravelBin, ...]:
    """Stick band and jump in `bins` ranges of the travel, by direction."""
    if fit is None:
        return ()
    place = fit.offset + fit.slope * rows.before
    edges = np.linspace(float(place.min()), float(place.max()), bins + 1)
    member = np.clip(np.searchsorted(edges, place, side="right") - 1, 0, bins - 1)
    table: list[TravelBin] = []
    for heading in (1, -1):
        for k in range(bins):
            here = (member == k) & (rows.direction == heading)
            n = int(here.sum())
            if n:
                numbers = [
                    float(number)
                    for series in (fit.stick_bands[here], fit.jumps[here])
                    for number in (series.mean(), series.std(ddof=1) if n > 1 else math.nan)
                ]
                table.append(TravelBin(float(edges[k]), float(edges[k + 1]), heading, n, *numbers))
    return tuple(table)
