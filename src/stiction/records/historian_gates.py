"""Gates on what a historian or a reader did to a record between the controller and here."""

from __future__ import annotations

import numpy as np

from stiction.records.gate import LEAST_SAMPLES, Gate, View, at_least, at_most
from stiction.records.replay import replayed
from stiction.records.storage import averaging_window, controller_saw, exception_deviation, straight, swing

__all__ = ["averaging", "clock", "compression", "exception", "held", "replay", "resampled"]

STRAIGHT = 10.0
"""Samples that may lie on straight lines between two others [%]."""
POINTS_PER_CYCLE = 6
"""Stored points per cycle below which the shape of a signal is the historian's."""
HELD = 20.0
"""Samples in which OP and PV may both repeat their last value [%]."""


def compression(view: View) -> Gate | None:
    """Find OP or PV on exactly straight lines that no controller makes: swinging door or interpolation."""
    n = len(view.part)
    if n < 10 or view.pv is None:
        return None
    drawn = {
        "OP": straight(view.op, view.pv, view.op_step, view.pv_step),
        "PV": straight(view.pv, view.op, view.pv_step, view.op_step),
    }
    name = max(drawn, key=lambda signal: drawn[signal])
    share, stored = 100.0 * drawn[name] / n, n - drawn[name]
    why = f"{name} lies on exactly straight lines in {share:.3g} % of the samples"
    if share <= STRAIGHT:
        return Gate("compression", "ok", share, STRAIGHT, f"{why}.")
    why += ": interpolated by the historian"
    if view.period is not None:
        points = stored * view.period / view.part.duration
        lost = points < POINTS_PER_CYCLE
        value, limit, why = points, POINTS_PER_CYCLE, f"{why}, {points:.1f} points per cycle were stored"
    else:
        lost = stored < LEAST_SAMPLES
        value, limit, why = stored, LEAST_SAMPLES, f"{why}, {stored} points were stored"
    remedy = "export raw values, or switch compression off and record again."
    if lost:
        return Gate("compression", "refuses", float(value), limit, f"{why}: shapes are lost; {remedy}")
    return Gate("compression", "lowers", share, STRAIGHT, f"{why}; {remedy}")


def exception(view: View) -> Gate | None:
    """Find OP or PV stored only after it had moved by a deviation: small movements are lost, and it seems to stick."""
    if len(view.part) < 10 or view.pv is None:
        return None
    op, pv = exception_deviation(view.op, view.op_step), exception_deviation(view.pv, view.pv_step)
    if pv and controller_saw(view.op, view.pv, view.op_step):
        pv = 0.0
    found = [(swing(x) / size, name, size) for x, name, size in ((view.op, "OP", op), (view.pv, "PV", pv)) if size]
    if not found:
        return Gate("exception", "ok", 0.0, 0.0, "OP and PV also change by small steps: no exception deviation is seen.")
    levels, name, size = min(found)
    why = (
        f"{name} rests and then changes by {size:.3g} or more, its swing over {levels:.1f}: stored by exception; "
        "set the exception deviation to 0 and record again."
    )
    return at_least("exception", levels, 20, 3.5, why)


def held(view: View) -> Gate | None:
    """Find OP and PV both repeated: the historian stored less often than it was asked."""
    if len(view.part) < 2 or view.pv is None:
        return None
    fresh = (np.diff(view.op) != 0.0) | (np.diff(view.pv) != 0.0)
    share = 100.0 * (1.0 - float(np.mean(fresh)))
    why = f"OP and PV both repeat their last value in {share:.3g} % of the samples"
    remedy = "; export raw values at the rate of the controller."
    if share > HELD and view.period is not None:
        points = float(np.mean(fresh)) * view.period / view.record.dt
        why = f"{why}, {points:.1f} new values per cycle"
        if points < 4:
            return Gate("held", "refuses", points, 4, why + remedy)
    return at_most("held", share, HELD, np.inf, why + (remedy if share > HELD else "."))


def averaging(view: View) -> Gate | None:
    """Find OP and PV smoothed by a moving average; one over the sampling interval alone leaves no trace."""
    if view.pv is None:
        return None
    window = averaging_window(view.op, view.pv)
    if not window:
        return None
    why = f"OP and PV are moving averages over {window * view.record.dt:.4g} s"
    remedy = "; export raw values."
    if view.period is None:
        return Gate("averaging", "lowers", window, 1, why + remedy)
    share = window * view.record.dt / view.period
    return at_most("averaging", share, 0.1, 1 / 3, f"{why}, {100 * share:.3g} % of a cycle{remedy}")


def replay(view: View) -> Gate | None:
    """Find stretches that occur twice, value for value."""
    if view.pv is None or len(view.part) < 2:
        return None
    share, periodic = replayed(view.op, view.pv)
    if periodic:
        why = "The record repeats itself value for value over and over: simulated without noise, or coarse."
        return Gate("replay", "ok", 100.0 * share, 2.0, why)
    hint = ": data were copied; ask for the raw record" if share > 0.02 else ""
    why = f"{100 * share:.3g} % of the samples repeat an earlier stretch value for value{hint}."
    return at_most("replay", 100.0 * share, 2, np.inf, why)


def clock(view: View) -> Gate:
    """Count clock changes that the reader met."""
    jumps = view.record.provenance.clock_jumps
    why = (
        f"The clock jumped {jumps} times; see what the reader guessed, or cut the record there."
        if jumps
        else "The clock runs evenly."
    )
    return at_most("clock", jumps, 0, np.inf, why)


def resampled(view: View) -> Gate | None:
    """Count the values that the reader held to fill an even grid."""
    made_up = view.record.provenance.made_up
    if not made_up or not len(view.record):
        return None
    share = 100.0 * made_up / len(view.record)
    why = f"{share:.3g} % of the samples are held values that fill an even grid"
    hint = "; export at an even rate, or give a longer dt" if share > 25 else ""
    return at_most("resampled", share, 25, 75, f"{why}{hint}.")
