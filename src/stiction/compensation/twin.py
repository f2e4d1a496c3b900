"""The loop's twin: a simulated copy of the loop that oscillates like its record.

Valve and process are identified, then fitted again by simulation from the recorded OP (`refine_model`). The
controller is given, or fitted to OP and control error. Noise and disturbances are the difference between recorded and
simulated PV. The twin is then simulated in closed loop with the recorded set point and compared with the record:
period, OP amplitude and PV amplitude. Remedies are tried only on a twin that oscillates like the loop; if it does
not, `adjust_twin` searches for one that does, within the uncertainty of the identification.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.compensation.adjust_twin import adjust_twin
from stiction.compensation.controller_from_record import controller_from_record
from stiction.compensation.cycle_measurement import (
    Cycle,
    crossing_period,
    cycle_distance,
    measure_cycle,
    simulate_cycle,
    undisturbed_period,
)
from stiction.compensation.external_inputs import ExternalInputs
from stiction.compensation.refine_model import refine_model
from stiction.compensation.repair import stiction_of
from stiction.compensation.twin_start import start_of_twin
from stiction.display.duration_format import format_seconds
from stiction.display.json_form import Result, fields_to_json, to_json
from stiction.errors import RecordError
from stiction.models import Kano, Loop, TransferFunction

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.compensation.refine_model import RefinedModel
    from stiction.compensation.twin_start import TwinStart
    from stiction.diagnosis import Diagnosis, Identification
    from stiction.diagnosis.segment import JudgedSegment
    from stiction.models import PID
    from stiction.records.record import LoopRecord

__all__ = ["Twin", "build_twin", "twin_of_loop"]

MAX_PERIOD_ERROR, MAX_AMPLITUDE_ERROR, MAX_SPREAD = 0.15, 0.25, 0.15
"""Largest relative errors of period and amplitudes, and how much the spread between runs may raise them [-]."""
MAX_RESTING_EXCESS = 0.1
"""Share of the periods by which a twin may rest more than the record without a remark [-]."""
MAX_UNEXPLAINED_SHARE = 0.4
"""Largest share of the PV movement, minus its moving average over one period, that may be unexplained [-]."""
MIN_SAMPLES_PER_PERIOD = 8.0
"""Smallest number of samples in a period for its use as a time scale [-]."""
TWIN_SAMPLES_PER_SAMPLE = 5
"""Samples of the twin for each sample of a record that is slower than the controller [-]."""


@dataclass(frozen=True)
class Twin(Result):
    """A simulated copy of a loop."""

    _json_keys = (
        "loop.dt as dt_s", "loop.noise as noise", "unexplained", "sp", "op", "measured", "simulated", "score", "fits",
        "reason", "changes", "overlay",
    )  # fmt: skip

    loop: Loop
    """Controller, valve, process and noise."""
    sp: float
    """Mean set point of the runs [PV units]."""
    op: float
    """Mean OP of the runs [% of span]."""
    measured: Cycle
    """Oscillation of the record."""
    simulated: Cycle
    """Oscillation of the twin."""
    score: float
    """1 minus the root mean square of the log ratios of period and amplitudes [-]; 1 is the same oscillation."""
    fits: bool
    """Whether the twin oscillates like the record, so that remedies can be tried on it."""
    reason: str
    """Why it fits, or why not."""
    unexplained: float = 0.0
    """Share of the PV movement, minus its moving average over one period, that valve and process do not explain [-]."""
    changes: tuple[str, ...] = ()
    """Changes of the identified values, and by how much."""
    inputs: ExternalInputs | None = field(default=None, repr=False, compare=False)
    """External inputs; None for the loop's own noise only."""
    overlay: dict[str, NDArray[np.float64]] = field(default_factory=dict, repr=False, compare=False)
    """Three periods of record and twin in phase: time [s], op, op_twin, pv, pv_twin, shape (n_samples,) each."""
    start: TwinStart | None = field(default=None, repr=False, compare=False)
    """Start values from which it moves by itself; None for a loop that was not identified from a record."""

    @property
    def dt(self) -> float:
        """Sampling period of the record [s]; the twin's own may be finer."""
        return self.loop.dt if self.inputs is None else self.inputs.dt

    def summary(self) -> str:
        """Return the reason and the comparison with the record as text."""
        return f"{self.reason} {self.comparison}"

    @property
    def comparison(self) -> str:
        """Oscillation of the record and of the twin as a sentence."""
        a, b = self.measured, self.simulated
        return (
            f"Record: period {format_seconds(a.period)}, OP amplitude {a.amplitude_op:.3g} %, "
            f"PV amplitude {a.amplitude_pv:.3g}; "
            f"twin: {format_seconds(b.period)}, {b.amplitude_op:.3g} %, {b.amplitude_pv:.3g}."
        )

    def to_dict(self, *, series: bool = True) -> dict[str, Any]:
        """JSON-ready form, with the stiction, the controller and the process of the loop."""
        S, J = stiction_of(self.loop.valve) or (None, None)
        pid, process = self.loop.controller, self.loop.process
        polynomials = {name: list(getattr(process, name, ())) for name in ("num", "den")}
        parts = {
            "S": S,
            "J": J,
            "controller": {"Kc": pid.Kc, "Ti_s": pid.Ti, "Td_s": pid.Td},
            "process": {**polynomials, "dead_time_s": process.dead_time},
        }
        return {**to_json(parts), **fields_to_json(self, series=series)}


def twin_of_loop(loop: Loop, *, sp: float = 50.0, op: float = 50.0) -> Twin:
    """Return a given loop as a twin.

    `sp`, `op`: operating point [PV units, % of span]. Returns the loop with its limit cycle.
    """
    cycle, _, _ = simulate_cycle(loop, sp, op, undisturbed_period(loop, sp, op))
    reason = "The loop was not identified from a record, so there is no record to compare it with."
    return Twin(loop, sp, op, cycle, cycle, 1.0, True, reason)


def build_twin(diagnosis: Diagnosis, controller: PID | None = None) -> Twin:
    """Build the twin of a diagnosed loop and compare it with the record.

    `diagnosis`: a diagnosis with an identified valve and process. `controller`: the loop's controller; by default it is
    identified from OP and control error. `fits` says whether it oscillates like the record, `reason` why. Raises
    RecordError when valve, process or controller was not identified, OP does not oscillate, or the identified valve
    does not move.
    """
    identification, tag = diagnosis.identification, diagnosis.record.tag
    if identification is None:
        raise RecordError("valve and process were not identified, so the loop cannot be simulated.", where=tag)
    segment, record, pv = diagnosis.segment, diagnosis.segment.part, diagnosis.segment.pv
    scale = _time_scale(segment)
    pid, finer = (controller, 1) if controller is not None else _find_controller(diagnosis)
    better = refine_model(record, identification, scale, cycles=diagnosis.oscillation.oscillating)
    sp = pv if record.sp is None else record.sp
    level, op = float(np.mean(sp)), float(np.mean(better.mv))
    moves = np.zeros(1) if record.sp is None else sp - level
    loop = Loop(pid, Kano(better.S, better.J), better.process, record.dt / finer, noise=better.noise)
    inputs = ExternalInputs(moves, better.residual, record.dt)
    measured = measure_cycle(record, scale)
    changes = _describe_changes(identification, better)
    if not measured.period > 0.0:
        raise RecordError("OP does not oscillate, so a simulation cannot be compared with the record.", where=tag)
    cycle, spread, run = simulate_cycle(loop, level, op, scale, inputs)
    fits, reason = _compare_cycles(measured, cycle, spread)
    if better.error > MAX_UNEXPLAINED_SHARE:
        fits, reason = (
            False,
            (
                f"Valve and process as identified do not explain {100.0 * better.error:.0f} % of the PV movement "
                f"(limit {100.0 * MAX_UNEXPLAINED_SHARE:.0f} %), so remedies cannot be tried on them."
            ),
        )
    elif not fits:
        nearer = adjust_twin(loop, level, op, inputs, measured)
        if nearer is not None:
            loop, adjustments = nearer
            cycle, spread, run = simulate_cycle(loop, level, op, scale, inputs)
            fits, reason = _compare_cycles(measured, cycle, spread)
            changes += tuple(adjustments)
    if not fits and (against := _wrong_action_text(loop, given=controller is not None)):
        reason = against
    if fits and cycle.share < measured.share - MAX_RESTING_EXCESS:
        reason += (
            f" But it is less regular: it does not oscillate in {100.0 * (1.0 - cycle.share):.0f} % of its periods, "
            "the record in "
            f"{100.0 * (1.0 - measured.share):.0f} %."
        )
    overlay = _align_periods(record, pv, run, scale) if cycle.period > 0.0 else {}
    score = 1.0 - cycle_distance(measured, cycle)
    return Twin(
        loop, level, op, measured, cycle, score, fits=fits, reason=reason, unexplained=better.error, changes=changes,
        inputs=inputs, overlay=overlay, start=start_of_twin(loop, level, op, record, pv, measured),
    )  # fmt: skip


def _time_scale(segment: JudgedSegment) -> float:
    """Return the period of the oscillation [s], or that of OP about its mean when there is no regular oscillation."""
    period, op, dt = segment.period, segment.op, segment.dt
    if period is not None and period >= MIN_SAMPLES_PER_PERIOD * dt:
        return period
    found = crossing_period(op - op.mean(), MIN_SAMPLES_PER_PERIOD)
    return (found if found > 0.0 else op.size / 5.0) * dt


def _find_controller(diagnosis: Diagnosis) -> tuple[PID, int]:
    """Return the identified controller, and the number of its samples for each sample of the record."""
    assert diagnosis.controller is not None
    pid, exact = controller_from_record(diagnosis.segment, diagnosis.controller)
    return pid, 1 if exact else TWIN_SAMPLES_PER_SAMPLE


def _wrong_action_text(loop: Loop, *, given: bool = True) -> str:
    """Say that the controller drives PV away from SP; empty when it does not."""
    if not isinstance(loop.process, TransferFunction):
        return ""
    num, den = (np.trim_zeros(np.atleast_1d(part), "b") for part in (loop.process.num, loop.process.den))
    Kc, gain = loop.controller.Kc, float(num[-1] / den[-1]) if num.size else 0.0
    if Kc * gain >= 0.0:
        return ""
    if not given:
        return (
            f"In the identified process more OP {'raises' if gain > 0.0 else 'lowers'} PV, and the identified "
            f"controller, Kc = {Kc:g}, would drive PV away from SP: one of the two is wrong. "
            "Give the controller with its Kc and Ti."
        )
    return (
        f"The controller gain, Kc = {Kc:g}, has the wrong sign: more OP {'raises' if gain > 0.0 else 'lowers'} PV, so "
        f"this controller would drive PV away from SP. Give Kc = {-Kc:g} if that is its action."
    )


def _compare_cycles(a: Cycle, b: Cycle, spread: float) -> tuple[bool, str]:
    """Return whether oscillation `b` of the twin matches `a` of the record, and why; `spread` is that of the runs."""
    if not np.isfinite(cycle_distance(a, b)):
        return (
            False,
            "The simulated loop does not oscillate, but the record does: something else drives the loop.",
        )
    wider = min(2.0 * spread, MAX_SPREAD)
    compared = (
        ("period", b.period / a.period, MAX_PERIOD_ERROR + wider),
        ("OP amplitude", b.amplitude_op / a.amplitude_op, MAX_AMPLITUDE_ERROR + wider),
        ("PV amplitude", b.amplitude_pv / a.amplitude_pv, MAX_AMPLITUDE_ERROR + wider),
    )
    wrong = [
        f"its {name} differs by {100.0 * (ratio - 1.0):+.0f} % (limit {100.0 * limit:.0f} %)"
        for name, ratio, limit in compared
        if abs(ratio - 1.0) > limit
    ]
    if wrong:
        return False, f"The simulated loop does not oscillate like the record: {', '.join(wrong)}."
    return True, "The simulated loop oscillates like the record."


def _describe_changes(identification: Identification, better: RefinedModel) -> tuple[str, ...]:
    """List the values that the open-loop fit changed by more than 2 %, and a second lag."""
    compared = (
        ("S", "%", identification.S, better.S),
        ("J", "%", identification.J, better.J),
        ("dead time", "s", identification.process.dead_time, better.process.dead_time),
    )
    least = {"dead time": max(0.01 * identification.process.time_constant, 1e-6)}
    changes = [
        f"{name} {a:.3g} to {b:.3g} {unit}"
        for name, unit, a, b in compared
        if abs(b - a) > 0.02 * abs(a) + least.get(name, 1e-9)
    ]
    return (*changes, *(["a second lag"] if better.process.den.size > 2 else []))


def _align_periods(
    record: LoopRecord, pv: NDArray[np.float64], run: LoopRecord, period: float
) -> dict[str, NDArray[np.float64]]:
    """Return three periods from the middle of the record, and the closest part of the twin's run."""
    assert run.pv is not None
    op, step = record.op, round(record.dt / run.dt)
    op_twin, pv_twin = run.op[::step], run.pv[::step]
    n = min(round(3.0 * period / record.dt), op.size, op_twin.size // 2)
    first = (op.size - n) // 2
    part = op[first : first + n]
    # Squared distance of every window to the part, both minus their means, except for a constant.
    sums, squares = (np.concatenate([np.zeros(1), np.cumsum(x)]) for x in (op_twin, op_twin**2))
    spread = squares[n:] - squares[:-n] - (sums[n:] - sums[:-n]) ** 2 / n
    at = int(np.argmin(spread - 2.0 * np.correlate(op_twin, part - part.mean(), "valid")))
    return {
        "time": record.time[:n],
        "op": part,
        "op_twin": op_twin[at : at + n],
        "pv": pv[first : first + n],
        "pv_twin": pv_twin[at : at + n],
    }
