"""Gates on what a historian or a reader did to a record between the controller and here."""

from __future__ import annotations

import numpy as np

from stiction.records.digits import number_of
from stiction.records.durations import in_seconds
from stiction.records.gate import LEAST_SAMPLES, Gate, View, at_least, at_most
from stiction.records.one_rate import slower_of
from stiction.records.outliers import OP_OFF, far_off
from stiction.records.replay import replayed
from stiction.records.rests import runs
from stiction.records.smoothed import averaging_window
from stiction.records.storage import (
    coarse,
    controller_saw,
    exception_deviation,
    straight,
    swing,
)
from stiction.records.stretches import torn, unreached

__all__ = [
    "averaging",
    "clock",
    "compression",
    "exception",
    "held",
    "one_rate",
    "outages",
    "outliers",
    "replay",
    "resampled",
]

STRAIGHT = 10.0
"""Samples that may lie on straight lines between two others [%]."""
POINTS_PER_CYCLE = 8
"""Stored points per cycle below which the shape of a signal is the historian's [-]. Of 73 simulated loops with fewer
(`simulation.population`, seed 92) the cause would be named right in 67 %, of 13 between 8 and 10 in 85 %, as of those
with more (84 %)."""
LEVELS = 6
"""Exception deviations in the swing below which the historian's rests pass for the valve's, or hide them [-]. Of 25
simulated loops between 6 and 8 (`simulation.population`, seed 92) the cause would be named right in 80 %, as of those
above (77 %)."""
COPIED = 0.5
"""Samples that may repeat an earlier stretch value for value [%]: a copy, however short, breaks the record twice."""
FEW_NOTCHES = 150
"""Samples below which a moving average is no more than likely [-]: of 40 good loops, of which every 10th to 40th sample
was kept, 2 % of the pieces of 65 to 130 samples have such notches by chance, and none of 280 longer ones."""
HELD = 20.0
"""Samples in which OP and PV may both repeat their last value [%]."""


def compression(view: View) -> Gate | None:
    """Find OP or PV on exactly straight lines that no controller makes: swinging door or interpolation."""
    n = len(view.part)
    if n < 10 or view.pv is None:
        return None
    drawn = {
        "OP": straight(view.op, view.pv, *view.steps),
        "PV": straight(view.pv, view.op, *view.steps[::-1]),
    }
    name = max(drawn, key=lambda signal: drawn[signal])
    share = 100.0 * drawn[name] / n
    why = f"{name} lies on exactly straight lines in {share:.3g} % of the samples"
    if share <= STRAIGHT:
        return Gate("compression", "ok", share, STRAIGHT, f"{why}.")
    cycle = (view.cycle or view.part.duration) / view.record.dt
    points = (1.0 - drawn[name] / n) * cycle
    why += f": interpolated by the historian, {points:.1f} points per cycle were stored, {n - drawn[name]} in all"
    remedy = "export raw values, or switch compression off and record again."
    if points < POINTS_PER_CYCLE or n - drawn[name] < LEAST_SAMPLES:
        return Gate("compression", "refuses", points, POINTS_PER_CYCLE, f"{why}: shapes are lost; {remedy}")
    return Gate("compression", "lowers", share, STRAIGHT, f"{why}; {remedy}")


def exception(view: View) -> Gate | None:
    """Find OP or PV stored only after it had moved by a deviation: small movements are lost, and it seems to stick."""
    record = view.record
    if len(record) < 10 or record.pv is None:
        return None
    # The whole record: a long rest of OP would else be cut out as time in manual. What was lost rests by no historian.
    op, pv = (exception_deviation(x, step) for x, step in zip((record.op, record.pv), view.steps, strict=True))
    if pv and controller_saw(np.where(view.at_limit, np.nan, record.op), record.pv, view.steps[0]):
        pv = 0.0
    both = zip(("OP", "PV"), view.whole, (op, pv), strict=True)
    found = [(swing(x) / size, name, size) for name, x, size in both if size]
    if not found:
        return Gate(
            "exception", "ok", 0.0, 0.0, "OP and PV also change by small steps: no exception deviation is seen."
        )
    levels, name, size = min(found)
    why = (
        f"{name} rests and then changes by {size:.3g} or more, its swing over {levels:.1f}: stored by exception; "
        "set the exception deviation to 0 and record again."
    )
    return at_least("exception", levels, 20, LEVELS, why)


def held(view: View) -> Gate | None:
    """Find OP and PV both repeated: the historian stored less often than it was asked."""
    if len(view.part) < 2 or view.pv is None:
        return None
    moved = np.diff(view.op) != 0.0, np.diff(view.pv) != 0.0
    fresh = moved[0] | moved[1]
    share = 100.0 * (1.0 - float(np.mean(fresh)))
    why = f"OP and PV both repeat their last value in {share:.3g} % of the samples"
    remedy = "; export raw values at the rate of the controller."
    # Rounding repeats values too, but those of OP and of PV by themselves; a slow historian renews both at once.
    rounded = coarse(view.op) and coarse(view.pv) and 2 * np.sum(moved[0] & moved[1]) < np.sum(fresh)
    if share > HELD and view.period is not None and not rounded:
        points = float(np.mean(fresh)) * view.period / view.record.dt
        why = f"{why}, {points:.1f} new values per cycle"
        if points < 4:
            return Gate("held", "refuses", points, 4, why + remedy)
    return at_most("held", share, HELD, np.inf, why + (remedy if share > HELD else "."))


def one_rate(view: View) -> Gate | None:
    """Find one of OP and PV stored every few samples only, and held between, while the other moves."""
    if len(view.part) < 2 or view.pv is None:
        return None
    slower = slower_of(view.op, view.pv)
    if slower is None:
        return Gate("one rate", "ok", 1.0, 1.0, "OP and PV are stored equally often.")
    other = "OP" if slower.name == "PV" else "PV"
    why = f"{slower.name} is new every {slower.every} samples only and rests between, {other} does not"
    remedy = "unless the controller does that, export both at its rate."
    return Gate("one rate", "lowers", float(slower.every), 1.0, f"{why}; {remedy}")


def outages(view: View) -> Gate | None:
    """Count stretches in which the historian was not reached: OP and PV rest together, which they hardly ever do."""
    if view.pv is None:
        return None
    lost = runs(unreached(view.part))
    longest = max((last - first for first, last in lost), default=0) * view.record.dt
    why = f"OP and PV rest together and then leap in {number_of(len(lost), 'stretch', 'stretches')}"
    if lost:
        why += f" of up to {in_seconds(longest)}: the historian was not reached; repair its connection and record again"
    return at_most("outages", len(lost), 0, np.inf, f"{why}.")


def averaging(view: View) -> Gate | None:
    """Find OP and PV smoothed by a moving average; one over the sampling interval alone leaves no trace."""
    if view.pv is None:
        return None
    window = averaging_window(view.op, view.pv)
    if not window:
        return None
    seem = "are" if len(view.part) >= FEW_NOTCHES else "look like"
    why = f"OP and PV {seem} moving averages over {in_seconds(window * view.record.dt)}"
    remedy = "; export raw values."
    if view.period is None:
        return Gate("averaging", "lowers", window, 1, why + remedy)
    share = window * view.record.dt / view.period
    return at_most("averaging", share, 0.0, 1 / 3, f"{why}, {100 * share:.3g} % of a cycle{remedy}")


def replay(view: View) -> Gate | None:
    """Find stretches that occur twice, value for value."""
    if view.pv is None or len(view.part) < 2:
        return None
    share, periodic = replayed(view.op, view.pv, *view.steps)
    if periodic:
        why = "The record comes back to itself value for value: simulated without noise, or coarse."
        return Gate("replay", "ok", 100.0 * share, COPIED, why)
    hint = ": data were copied; ask for the raw record" if 100.0 * share > COPIED else ""
    why = f"{100 * share:.3g} % of the samples repeat an earlier stretch value for value{hint}."
    return at_most("replay", 100.0 * share, COPIED, np.inf, why)


def clock(view: View) -> Gate:
    """Count clock changes that the reader met."""
    told = view.record.provenance
    # The hour of a change of summer time tells itself, but only where OP and PV go on are no rows lost beside it.
    undone = told.summer_time if told.summer_time and not torn(view.record).any() else 0
    jumps = told.clock_jumps - undone
    seen = (
        f"The clock jumped, or rows were out of order, {number_of(jumps, 'time')}; see what the reader guessed, or cut "
        "the record there."
    )
    even = "The change of summer time was undone; OP and PV go on." if undone else "The clock runs evenly."
    why = seen if jumps else even
    return at_most("clock", jumps, 0, np.inf, why)


def outliers(view: View) -> Gate | None:
    """Count values that stand alone far off all others, and spikes of PV beside them."""
    left_out, record = view.record.provenance.outliers, view.record
    spikes = 0 if record.pv is None else int(far_off(record.pv, OP_OFF, record.samples_per_value).sum())
    if not left_out + spikes:
        return None
    alone, beside = number_of(left_out, "value"), number_of(spikes, "spike")
    why = f"{alone} far off all others, missing, and {beside} of PV that count"
    return at_most("outliers", left_out + spikes, 0, np.inf, f"{why}; check how the historian writes bad values.")


def resampled(view: View) -> Gate | None:
    """Count the values that the reader held to fill an even grid."""
    made_up = view.record.provenance.made_up
    if not made_up or len(view.record) < made_up:
        return None
    share = 100.0 * made_up / len(view.record)
    why = f"{share:.3g} % of the samples are held from earlier time stamps to fill an even grid"
    if view.period is not None:
        points = (1.0 - share / 100.0) * view.period / view.record.dt
        why += f", {points:.1f} recorded values per cycle"
        if points < 4:
            return Gate("resampled", "refuses", points, 4, f"{why}; export at an even and faster rate.")
    hint = "; export at an even rate" if share > 25 else ""
    return at_most("resampled", share, 25, np.inf, f"{why}{hint}.")
