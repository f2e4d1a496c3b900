"""What a record must offer before a valve is judged by it: one small function for each gate.

The limits are this package's own, set so that the real records of the tests pass for what they are; each `why`
says what is wrong and what to record instead.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from stiction.records.replay import replayed
from stiction.records.signals import not_a_percentage
from stiction.records.stretches import in_manual, missing, runs, saturated

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["GATES", "Gate", "Severity", "View"]

Severity = Literal["ok", "lowers", "refuses"]


@dataclass(frozen=True, slots=True)
class Gate:
    """One check of a record."""

    name: str
    """What is checked."""
    severity: Severity
    """"ok", "lowers" the confidence, or "refuses" the record."""
    value: float
    """What was found."""
    limit: float
    """The limit that counts: the one passed, or the next one to be passed."""
    why: str
    """A sentence on what was found and what to do."""

    def to_dict(self) -> dict[str, Any]:
        """Give the gate, ready for JSON."""
        return asdict(self)


class View(NamedTuple):
    """What a gate looks at."""

    record: LoopRecord
    """The whole record."""
    part: LoopRecord
    """Its longest usable stretch."""
    period: float | None
    """Period of the oscillation [s], when known."""


def _at_least(name: str, value: float, lowers: float, refuses: float, why: str) -> Gate:
    severity: Severity = "refuses" if value < refuses else "lowers" if value < lowers else "ok"
    return Gate(name, severity, float(value), refuses if value < refuses else lowers, why)


def _at_most(name: str, value: float, lowers: float, refuses: float, why: str) -> Gate:
    severity: Severity = "refuses" if value > refuses else "lowers" if value > lowers else "ok"
    return Gate(name, severity, float(value), refuses if value > refuses else lowers, why)


def length(view: View) -> Gate:
    """Ask for samples in the longest usable stretch."""
    n = len(view.part)
    why = f"{n} of {len(view.record)} samples in the longest stretch in automatic, unsaturated and without gaps"
    return _at_least("length", n, 200, 60, f"{why}; record some hundred." if n < 200 else f"{why}.")


def cycles(view: View) -> Gate | None:
    """Ask for cycles of the oscillation in the usable stretch."""
    if view.period is None:
        return None
    count = view.part.duration / view.period
    hint = "; record ten cycles or more" if count < 8 else ""
    return _at_least("cycles", count, 8, 3, f"{count:.1f} cycles of {view.period:.4g} s in the usable stretch{hint}.")


def sampling(view: View) -> Gate | None:
    """Ask for samples per cycle: a jump shorter than the sampling period is not seen."""
    if view.period is None:
        return None
    count = view.period / view.record.dt
    hint = f"; record every {view.period / 40:.2g} s or faster" if count < 10 else ""
    return _at_least("sampling", count, 10, 4, f"{count:.1f} samples per cycle{hint}.")


def op_moves(view: View) -> Gate:
    """Ask that OP moves, nothing is learnt about the valve otherwise."""
    swing = _range(view.part.op if len(view.part) else view.record.op)
    why = f"OP moves by {swing:.3g}." if swing > 0 else "OP is constant: the loop is in manual or OP was not recorded."
    return Gate("op moves", "ok" if swing > 0 else "refuses", swing, 0.0, why)


def pv_moves(view: View) -> Gate:
    """Ask that PV is there and moves."""
    if view.record.pv is None:
        return Gate("pv moves", "refuses", 0.0, 0.0, "PV was not recorded; record it beside OP.")
    assert view.part.pv is not None
    swing = _range(view.part.pv if len(view.part) else view.record.pv)
    why = f"PV moves by {swing:.3g}." if swing > 0 else "PV is constant: a frozen transmitter or a wrong column."
    return Gate("pv moves", "ok" if swing > 0 else "refuses", swing, 0.0, why)


def saturation(view: View) -> Gate:
    """Count OP resting at a limit: no feedback there."""
    share = 100.0 * _share(saturated(view.record))
    return _at_most("saturation", share, 5, 80, f"OP rests at a limit in {share:.3g} % of the samples (left out).")


def manual(view: View) -> Gate:
    """Count samples not in automatic: no feedback there."""
    share = 100.0 * _share(in_manual(view.record))
    seen = "by the mode" if view.record.auto is not None else "as OP rests while PV moves"
    return _at_most(
        "manual", share, 5, 90, f"The loop is in manual in {share:.3g} % of the samples ({seen}; left out)."
    )


def op_resolution(view: View) -> Gate | None:
    """Find a coarse OP."""
    return _resolution("OP", view.part.op)


def pv_resolution(view: View) -> Gate | None:
    """Find a coarse PV: its stairs look like stick and slip."""
    return None if view.part.pv is None else _resolution("PV", view.part.pv)


def _resolution(name: str, x: NDArray[np.float64]) -> Gate | None:
    x = x[np.isfinite(x)]
    values = np.unique(x)
    if len(values) < 2:
        return None
    if len(values) > 0.5 * len(x):
        levels = float(len(values))
    else:
        swing = float(np.subtract(*np.percentile(x, (99, 1)))) or _range(x)
        gaps = np.diff(values)
        levels = swing / float(np.percentile(gaps[gaps > 1e-9 * swing], 5)) + 1.0
    hint = "; record it finer, and without rounding" if levels < 20 else ""
    return _at_least(f"{name.lower()} resolution", levels, 20, 3, f"{name} swings over {levels:.0f} steps{hint}.")


def compression(view: View) -> Gate | None:
    """Find OP on exactly straight lines while PV moves: a historian's interpolation, not a controller."""
    if len(view.part) < 10 or view.part.pv is None:
        return None
    swing = _range(view.part.op)
    slope = np.diff(view.part.op)
    gaps = np.diff(np.unique(view.part.op[np.isfinite(view.part.op)]))
    step = float(np.percentile(gaps, 5)) if gaps.size and gaps.size < 0.5 * len(view.part) else 0.0
    bend = np.abs(np.diff(slope))
    steep = np.abs(slope[1:]) > max(5.0 * step, 1e-6 * swing)
    straight = (bend <= 1e-7 * swing) & steep & (np.diff(view.part.pv)[1:] != 0.0)
    share = 100.0 * sum(last - first for first, last in runs(straight) if last - first >= 3) / len(view.part)
    why = f"OP lies on exactly straight lines in {share:.3g} % of the samples"
    hint = ": interpolated by the historian, shapes are lost; export raw values" if share > 10 else ""
    return _at_most("compression", share, 10, 60, f"{why}{hint}.")


def held(view: View) -> Gate | None:
    """Find OP and PV both repeated: the historian stored less often than it was asked."""
    if len(view.part) < 2 or view.part.pv is None:
        return None
    share = 100.0 * _share((np.diff(view.part.op) == 0.0) & (np.diff(view.part.pv) == 0.0))
    hint = "; export raw values at the rate of the controller" if share > 20 else ""
    return _at_most(
        "held", share, 20, np.inf, f"OP and PV both repeat their last value in {share:.3g} % of the samples{hint}."
    )


def missing_values(view: View) -> Gate:
    """Count missing samples and the longest gap."""
    gone = missing(view.record)
    share = 100.0 * _share(gone)
    longest = max((last - first for first, last in runs(gone)), default=0) * view.record.dt
    bridged = int(missing(view.part).sum())
    why = f"{share:.3g} % of the samples are missing"
    why += f", the longest gap lasts {longest:.4g} s, {bridged} were bridged by the last value." if share else "."
    return _at_most("missing", share, 2, 50, why)


def op_scale(view: View) -> Gate | None:
    """Find an OP that is not in % of span."""
    op = view.record.op[np.isfinite(view.record.op)]
    if op.size == 0:
        return None
    low, high = float(op.min()), float(op.max())
    looks = not_a_percentage(low, high)
    why = f"OP lies in {low:.4g} to {high:.4g}"
    why += f" and looks {looks}: S and J are in its unit, not in % of span." if looks else ", within 0 to 100 %."
    return Gate("op scale", "lowers" if looks else "ok", high if abs(high) >= abs(low) else low, 100.0, why)


def replay(view: View) -> Gate | None:
    """Find stretches that occur twice, value for value."""
    if view.part.pv is None or len(view.part) < 2:
        return None
    share, periodic = replayed(view.part.op, view.part.pv)
    if periodic:
        return Gate("replay", "ok", 100.0 * share, 2.0, "The record repeats itself exactly: simulated without noise.")
    hint = ": data were copied; ask for the raw record" if share > 0.02 else ""
    why = f"{100 * share:.3g} % of the samples repeat an earlier stretch value for value{hint}."
    return _at_most("replay", 100.0 * share, 2, np.inf, why)


def clock(view: View) -> Gate:
    """Count clock changes that the reader met."""
    jumps = view.record.provenance.clock_jumps
    why = f"The clock jumped {jumps} times; see what the reader guessed." if jumps else "The clock runs evenly."
    return _at_most("clock", jumps, 0, np.inf, why)


def _range(x: NDArray[np.float64]) -> float:
    x = x[np.isfinite(x)]
    return float(x.max() - x.min()) if x.size else 0.0


def _share(mask: NDArray[np.bool_]) -> float:
    return float(np.mean(mask)) if mask.size else 0.0


GATES = (
    *(length, cycles, sampling, op_moves, pv_moves, saturation, manual, missing_values, op_scale),
    *(op_resolution, pv_resolution, compression, held, replay, clock),
)
"""All gates, in the order in which they are reported."""
