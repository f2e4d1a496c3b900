"""What a record must offer before a valve is judged by it: one small function for each gate.

The limits are this package's own, set so that the real records of the tests pass for what they are; each `why`
says what is wrong and what to record instead.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.digits import number_of
from stiction.records.durations import in_seconds
from stiction.records.gate import LEAST_CYCLES, LEAST_SAMPLES, Gate, Severity, View, at_least, at_most
from stiction.records.hand import stepped
from stiction.records.historian_gates import (
    averaging,
    clock,
    compression,
    exception,
    held,
    one_rate,
    outages,
    outliers,
    replay,
    resampled,
)
from stiction.records.limits import clipped
from stiction.records.missing_values import missing
from stiction.records.rests import runs
from stiction.records.signals import not_a_percentage
from stiction.records.storage import swing, usual_swing
from stiction.records.stretches import frozen, in_manual

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["GATES", "Gate", "Severity", "View"]

FEW_SAMPLES, FEW_CYCLES = 300, 8
MANY_SAMPLES, FEW_IF_SHORT, FEW_PER_CYCLE = 12, 6, 4
"""Samples per cycle below which confidence is lowered, and below which a short and a long record are refused [-]."""
SHORT = 200
"""Samples below which a record is short in that sense."""
MEMORY = 0.1
"""Likeness of a signal to its last value below which its movement is not resolved [-]."""
BRIDGED = 40.0
"""Samples of the usable stretch that may be bridged [%]."""
FEW_TURNS, TURN = 2 * LEAST_CYCLES, 0.15
"""Times that OP turns round below which nothing is sure, and what counts as turning, as a share of its usual swing. Of
1 800 loops simulated by another hand, with noise and upsets of all shapes, 35 that do not stick and two that do were
told beyond 0.9 on fewer turns, while every ripple of a hundredth counted as one."""
ALTERNATING = -0.6
"""Likeness that a cycle of less than three samples leaves, cos(2 pi / 3) = -0.5 and a margin [-]."""


def length(view: View) -> Gate:
    """Ask for samples in the longest usable stretch."""
    n = len(view.part)
    left_out = "manual control, a clipped OP, a frozen PV, a jump or a gap"
    why = f"{n} of {len(view.record)} samples are left in the longest stretch without {left_out}"
    return at_least(
        "length", n, FEW_SAMPLES, LEAST_SAMPLES, f"{why}; record some hundred." if n < FEW_SAMPLES else f"{why}."
    )


def cycles(view: View) -> Gate | None:
    """Ask for cycles of the oscillation in the usable stretch."""
    if view.period is None:
        return None
    count = view.part.duration / view.period
    hint = "; record ten cycles or more" if count < FEW_CYCLES else ""
    why = f"{count:.1f} cycles of {in_seconds(view.period)} in the usable stretch{hint}."
    return at_least("cycles", count, FEW_CYCLES, LEAST_CYCLES, why)


def sampling(view: View) -> Gate | None:
    """Ask for samples per cycle: what lies between two is not seen; without a cycle, that values resemble the last."""
    if view.period is not None:
        count = view.period / view.record.dt
        hint = f"; record every {view.period / 40:.2g} s or faster" if count < MANY_SAMPLES else ""
        short = len(view.part) < SHORT
        refuses = FEW_IF_SHORT if short else FEW_PER_CYCLE
        why = f"{count:.1f} samples per cycle{' in a short record' if short and count < refuses else ''}{hint}."
        return at_least("sampling", count, MANY_SAMPLES, refuses, why)
    if view.pv is None or len(view.part) < LEAST_SAMPLES:
        return None
    memory = max(_memory(view.op), _memory(view.pv))
    if memory >= MEMORY:
        return None
    why = f"OP and PV hardly resemble their last values (correlation {memory:.2f}): "
    if memory < ALTERNATING:
        why += f"they alternate, a cycle takes less than {in_seconds(3 * view.record.dt)}; record ten times as fast."
        return Gate("sampling", "refuses", memory, ALTERNATING, why)
    why += f"noise alone, or movement faster than {in_seconds(4 * view.record.dt)} per cycle; record faster."
    return Gate("sampling", "lowers", memory, MEMORY, why)


def _memory(x: NDArray[np.float64]) -> float:
    """Correlation with the last value (after von Neumann's ratio); 1 for a constant."""
    spread = float(np.var(x))
    return 1.0 - float(np.mean(np.diff(x) ** 2)) / (2.0 * spread) if spread > 0.0 else 1.0


def op_moves(view: View) -> Gate:
    """Ask that OP moves, nothing is learnt about the valve otherwise."""
    moved = swing(view.part.op if len(view.part) else view.record.op)
    still = "OP is constant: in manual, or OP was not recorded; put the controller in automatic and record again."
    why = f"OP moves by {moved:.3g}." if moved > 0 else still
    return Gate("op moves", "ok" if moved > 0 else "refuses", moved, 0.0, why)


def op_turns(view: View) -> Gate | None:
    """Count how often OP turns round: friction shows nowhere else."""
    if not swing(view.op) > 0.0:
        return None
    count = _turns(view.op, TURN * usual_swing(view.op))
    hint = ", where alone a valve shows its friction; record while it moves" if count < FEW_TURNS else ""
    return at_least("op turns", count, FEW_TURNS, -np.inf, f"OP turns round {number_of(count, 'time')}{hint}.")


def _turns(x: NDArray[np.float64], reach: float) -> int:
    """How often a signal turns round by more than `reach`."""
    ways = np.sign(np.diff(x))
    ways = ways[moving := ways != 0.0]
    ends = np.append(x[:-1][moving][np.append(True, ways[1:] != ways[:-1])], x[-1])  # where it turns round at all
    count, way, farthest = 0, 0.0, float(ends[0])
    low = high = farthest
    for value in ends.tolist():
        if way == 0.0:
            low, high = min(low, value), max(high, value)
            way = 1.0 if value - low > reach else -1.0 if high - value > reach else 0.0
            farthest = value
        elif way * (value - farthest) > 0.0:
            farthest = value
        elif way * (farthest - value) > reach:
            count, way, farthest = count + 1, -way, value
    return count


def pv_moves(view: View) -> Gate:
    """Ask that PV is there and moves."""
    if view.record.pv is None:
        return Gate("pv moves", "refuses", 0.0, 0.0, "PV was not recorded; record it beside OP.")
    assert view.part.pv is not None
    if np.array_equal(view.record.pv, view.record.op, equal_nan=True) and swing(view.op) > 0.0:
        twice = "PV and OP are the same numbers: one column was taken or exported twice; name the PV."
        return Gate("pv moves", "refuses", 0.0, 0.0, twice)
    moved = swing(view.part.pv if len(view.part) else view.record.pv)
    still = "PV is constant: a frozen transmitter or a wrong column; repair the one or name the other and record again."
    why = f"PV moves by {moved:.3g}." if moved > 0 else still
    return Gate("pv moves", "ok" if moved > 0 else "refuses", moved, 0.0, why)


def saturation(view: View) -> Gate:
    """Count OP resting at a limit: no feedback there; off 0 and 100 % not even the OP is known."""
    left_out = " (left out)" if clipped(view.record).any() else ""
    why = f"OP rests at a limit in {_share_in_stretches(view.at_limit)}{left_out}."
    return _left_out("saturation", view.at_limit, 80, why, "check sizing and limits, then record it off these", view)


def manual(view: View) -> Gate:
    """Count samples not in automatic: no feedback there."""
    off = in_manual(view.record)
    where = _share_in_stretches(off)
    if view.record.auto is not None:
        why = f"The loop is in manual in {where} (by the mode; left out)."
    elif stepped(view.record).any():
        why = f"OP rests at levels one straight after the other, as if moved by hand, in {where} (left out)."
    else:
        why = f"OP rests while PV moves, as in manual or within a controller's gap, in {where} (left out)."
    return _left_out("manual", off, 90, why, "record it in automatic", view)


def frozen_pv(view: View) -> Gate:
    """Count samples in which PV stands still as it never does otherwise."""
    still = frozen(view.record)
    why = f"PV stands still for {_share_in_stretches(still)} (left out)."
    return _left_out("frozen", still, 80, why, "repair the transmitter or its connection and record again", view)


def _share_in_stretches(marked: NDArray[np.bool_]) -> str:
    """Say in how many stretches samples are marked; their share, which `_left_out` knows, is to be put in."""
    return f"{{:.3g}} % of the samples in {number_of(len(runs(marked)), 'stretch', 'stretches')}"


def _left_out(name: str, mask: NDArray[np.bool_], refuses: float, why: str, remedy: str, view: View) -> Gate:
    """Lower above 5 %; refuse above a share, or when what is left is too little."""
    share = 100.0 * _share(mask)
    gate = at_most(name, share, 5, refuses, why.format(share))
    if gate.severity == "refuses":
        return replace(gate, why=f"{gate.why[:-1]}; {remedy}.")
    if gate.severity == "lowers" and view.too_little:
        return replace(gate, severity="refuses", why=f"{gate.why[:-1]}; what is left is too short: record longer.")
    return gate


def missing_values(view: View) -> Gate:
    """Count missing samples, the longest gap, and what was bridged in the usable stretch."""
    gone = missing(view.record)
    share = 100.0 * _share(gone)
    longest = max((last - first for first, last in runs(gone)), default=0) * view.record.dt
    bridged = missing(view.part)
    why = f"{share:.3g} % of the samples are without OP or PV"
    if share:
        why += f", the longest gap lasts {in_seconds(longest)}, {bridged.sum()} were bridged"
    if 100.0 * _share(bridged) > BRIDGED:
        why += "; repair the connection to the historian and record again."
        return Gate("missing", "refuses", 100.0 * _share(bridged), BRIDGED, why)
    if share > 2 and view.too_little:
        return Gate(
            "missing", "refuses", share, 2, f"{why}; what is left between the gaps is too short: record longer."
        )
    return at_most("missing", share, 2, np.inf, f"{why}.")


def op_scale(view: View) -> Gate | None:
    """Find an OP that is not in % of span."""
    op = view.record.op[np.isfinite(view.record.op)]
    if op.size == 0:
        return None
    low, high = float(op.min()), float(op.max())
    unit = view.record.provenance.op_unit
    seen = not_a_percentage(low, high)
    looks = f", as its header says, in {unit}" if unit else seen and f" and looks {seen}"
    why = f"OP lies in {low:.4g} to {high:.4g}"
    remedy = "S and J are in its unit, not in % of span; give op_range (--op-range) to convert."
    why += f"{looks}: {remedy}" if looks else " and is taken as % of span."
    return Gate("op scale", "lowers" if looks else "ok", high if abs(high) >= abs(low) else low, 100.0, why)


def op_resolution(view: View) -> Gate | None:
    """Find a coarse OP."""
    return _resolution("OP", view.op, view.steps[0], 6)


def pv_resolution(view: View) -> Gate | None:
    """Find a coarse PV: its stairs look like stick and slip."""
    return None if view.pv is None else _resolution("PV", view.pv, view.steps[1], 3)


def _resolution(name: str, x: NDArray[np.float64], step: float, refuses: float) -> Gate | None:
    values = np.unique(x)
    if len(values) < 2:
        return None
    if len(values) > 0.5 * len(x):
        levels = float(len(values))
    else:
        usual = usual_swing(x) or swing(x)
        if not step:
            gaps = np.diff(values)
            step = float(np.percentile(gaps[gaps > 1e-9 * usual], 5))
        levels = round(usual / step + 1.0, 6)  # the rounding of a unit must not decide at a limit
    hint = "; record it finer, and without rounding" if levels < 20 else ""
    return at_least(f"{name.lower()} resolution", levels, 20, refuses, f"{name} swings over {levels:.0f} steps{hint}.")


def _share(mask: NDArray[np.bool_]) -> float:
    return float(np.mean(mask)) if mask.size else 0.0


GATES = (
    *(length, cycles, sampling, op_moves, op_turns, pv_moves, saturation, manual, frozen_pv, missing_values),
    *(
        op_scale,
        op_resolution,
        pv_resolution,
        compression,
        exception,
        held,
        one_rate,
        outages,
        averaging,
        replay,
        clock,
    ),
    *(outliers, resampled),
)
"""All gates, in the order in which they are reported."""
