"""The loop's twin: a simulated loop that cycles as the record does.

Valve and process are those of the identification, fitted again by simulation from the recorded OP (`refine_model`).
The controller is given, or fitted to OP and error. Noise and a random load are the difference of recorded and simulated
PV, its white part and the rest. The twin is then simulated in closed loop with the recorded set point and compared with
the record: period, amplitude of OP, amplitude of PV. Remedies are tried only on a twin that oscillates as the loop
does; where it does not, `match` searches the uncertainty for one that does.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.compensation.controller_from_record import controller_from_record
from stiction.compensation.cycle import Cycle, cycle_in, cycle_of, distance, own_period, pace
from stiction.compensation.match import bring_nearer
from stiction.compensation.refine_model import refine_model
from stiction.compensation.repair import stiction_of
from stiction.compensation.surroundings import Surroundings
from stiction.display.duration_format import format_seconds
from stiction.errors import RecordError
from stiction.models import Kano, Loop, TransferFunction
from stiction.records.analysis_window import analysis_window, usable_segment
from stiction.records.gaps import forward_fill

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.compensation.refine_model import RefinedModel
    from stiction.diagnosis import Diagnosis, Identification
    from stiction.models import PID
    from stiction.records.record import LoopRecord

__all__ = ["Twin", "analysed_segment", "build_twin", "twin_of_loop"]

PERIOD_LIMIT, AMPLITUDE_LIMIT, MOST_SPREAD = 0.15, 0.25, 0.15
"""Largest relative error of period and amplitudes of a twin that fits, and how much the spread from run to run may
widen them [-]."""
STEADIER = 0.1
"""Share of its periods by which a twin may rest more than the record before it is said [-]."""
MOST_LEFT = 0.4
"""Share of the PV's movement, about its average over a period, that valve and process may leave unexplained [-]."""
SHORTEST = 8.0
"""Samples to a period below which an oscillation is no time scale of the valve's [-]."""
FINER = 5
"""Samples of the twin to one of a record that does not show the controller's own [-]."""


@dataclass(frozen=True)
class Twin:
    """A simulated loop that stands for a real one."""

    loop: Loop
    """Controller, valve, process and noise."""
    sp: float
    """Set point about which remedies are tried [PV units]."""
    op: float
    """OP about which the loop works [% of span]."""
    measured: Cycle
    """How the record oscillates."""
    simulated: Cycle
    """How the twin does."""
    score: float
    """1 minus the root mean square of the relative errors of period and amplitudes [-]; 1 is the same cycle."""
    fits: bool
    """Whether the twin may advise."""
    reason: str
    """Why it may, or may not."""
    unexplained: float = 0.0
    """Share of the PV's movement about its average over a period that valve and process leave [-]."""
    changes: tuple[str, ...] = ()
    """What was changed of the point identified, and by how much."""
    around: Surroundings | None = field(default=None, repr=False, compare=False)
    """What moves the loop from outside; None for its own noise alone."""
    overlay: dict[str, NDArray[np.float64]] = field(default_factory=dict, repr=False, compare=False)
    """Three periods aligned in phase: time [s], op, op_twin, pv, pv_twin, shape (n_samples,) each."""

    @property
    def dt(self) -> float:
        """Sampling period of the record [s]; the twin's own may be finer."""
        return self.loop.dt if self.around is None else self.around.dt

    def summary(self) -> str:
        """The comparison in a sentence or two."""
        a, b = self.measured, self.simulated
        return (
            f"{self.reason} Record: period {format_seconds(a.period)}, OP amplitude {a.amplitude_op:.3g} %, PV "
            "amplitude "
            f"{a.amplitude_pv:.3g}; twin: {format_seconds(b.period)}, {b.amplitude_op:.3g} %, {b.amplitude_pv:.3g}."
        )

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        S, J = stiction_of(self.loop.valve) or (None, None)
        pid, process = self.loop.controller, self.loop.process
        return {
            "S": S,
            "J": J,
            "controller": {"Kc": pid.Kc, "Ti_s": pid.Ti if np.isfinite(pid.Ti) else None, "Td_s": pid.Td},
            "process": {
                "num": [float(x) for x in getattr(process, "num", ())],
                "den": [float(x) for x in getattr(process, "den", ())],
                "dead_time_s": process.dead_time,
            },
            "dt_s": self.loop.dt,
            "noise": self.loop.noise,
            "unexplained": self.unexplained,
            "sp": self.sp,
            "op": self.op,
            "measured": self.measured.to_dict(),
            "simulated": self.simulated.to_dict(),
            "score": self.score if np.isfinite(self.score) else None,
            "fits": self.fits,
            "reason": self.reason,
            "changes": list(self.changes),
            "overlay": {name: [float(x) for x in series] for name, series in self.overlay.items()},
        }


def twin_of_loop(loop: Loop, *, sp: float = 50.0, op: float = 50.0) -> Twin:
    """Take given parameters as they are: the loop is its own twin.

    Parameters
    ----------
    loop : Loop
        The loop.
    sp, op : float
        Operating point [PV units, % of span].

    Returns
    -------
    Twin
        The loop with the cycle it falls into.
    """
    cycle, _, _ = cycle_of(loop, sp, op, own_period(loop, sp, op))
    reason = "Parameters were given, so that there is no record to compare with."
    return Twin(loop, sp, op, cycle, cycle, 1.0, True, reason)


def build_twin(diagnosis: Diagnosis, controller: PID | None = None) -> Twin:
    """Build the twin of a diagnosed loop and compare it with the record.

    Parameters
    ----------
    diagnosis : Diagnosis
        A diagnosis with an identified valve and process, and a period.
    controller : PID, optional
        The loop's controller; by default a PI is found from OP and error.

    Returns
    -------
    Twin
        `fits` says whether it may advise, `reason` why.

    Raises
    ------
    RecordError
        When nothing was identified, the loop has no period, no controller is found, or the valve found does not move.
    """
    found, tag = diagnosis.identification, diagnosis.record.tag
    if found is None:
        raise RecordError(f"{tag}: no valve and process were identified; there is nothing to build a twin on.")
    record = analysed_segment(diagnosis)
    assert record.pv is not None
    scale = _scale(record, diagnosis)
    pid, finer = (controller, 1) if controller is not None else _controller(record)
    better = refine_model(record, found, scale, cycles=diagnosis.oscillation.oscillating)
    pv = forward_fill(record.pv, fill_start=True)
    sp = pv if record.sp is None else forward_fill(record.sp, fill_start=True)
    level, op = float(np.mean(sp)), float(np.mean(better.mv))
    moves = np.zeros(1) if record.sp is None else sp - level
    loop = Loop(pid, Kano(better.S, better.J), better.process, record.dt / finer, noise=better.noise)
    around = Surroundings(moves, better.left, record.dt)
    measured = cycle_in(replace(record, pv=pv, sp=None if record.sp is None else sp), scale)
    changes = _changes(found, better)
    if not measured.period > 0.0:
        raise RecordError(f"{tag}: OP does not swing, so that there is nothing to judge a twin by.")
    cycle, spread, run = cycle_of(loop, level, op, scale, around)
    fits, reason = _judge(measured, cycle, spread)
    if better.error > MOST_LEFT:
        fits, reason = (
            False,
            (
                f"Valve and process leave {100.0 * better.error:.0f} % of the PV's movement unexplained (at most "
                f"{100.0 * MOST_LEFT:.0f} %): too much for a twin."
            ),
        )
    elif not fits:
        nearer = bring_nearer(loop, level, op, around, measured)
        if nearer is not None:
            loop, told = nearer
            cycle, spread, run = cycle_of(loop, level, op, scale, around)
            fits, reason = _judge(measured, cycle, spread)
            changes += tuple(told)
    if not fits and (against := _against(loop, given=controller is not None)):
        reason = against
    if fits and cycle.share < measured.share - STEADIER:
        reason += (
            f" It is less steady: it rests in {100.0 * (1.0 - cycle.share):.0f} % of its periods, the record in "
            f"{100.0 * (1.0 - measured.share):.0f} %."
        )
    overlay = _overlay(record, pv, run, scale) if cycle.period > 0.0 else {}
    score = 1.0 - distance(measured, cycle)
    return Twin(loop, level, op, measured, cycle, score, fits, reason, better.error, changes, around, overlay)


def analysed_segment(diagnosis: Diagnosis) -> LoopRecord:
    """The stretch that a diagnosis speaks of, its gaps bridged: a part of the record where the valve sticks in that.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis.

    Returns
    -------
    LoopRecord
        The samples in which the valve and process were identified.
    """
    record, window = diagnosis.record, (diagnosis.quality.first, diagnosis.quality.last)
    return usable_segment(record if analysis_window(record) == window else record.window(*window))


def _scale(record: LoopRecord, diagnosis: Diagnosis) -> float:
    """Period of the oscillation [s]; where there is none, the pace at which OP swings about its mean."""
    seen = diagnosis.oscillation
    if seen.oscillating and seen.period >= SHORTEST * record.dt:
        return seen.period
    op = forward_fill(record.op, fill_start=True)
    found = pace(op - op.mean(), SHORTEST)
    return (found if found > 0.0 else op.size / 5.0) * record.dt


def _controller(record: LoopRecord) -> tuple[PID, int]:
    """The record's controller, and how many of its samples there are to one of the record: 1, or `FINER`."""
    pid, exact = controller_from_record(record)
    return pid, 1 if exact else FINER


def _against(loop: Loop, *, given: bool = True) -> str:
    """Say that the controller, given or found, drives PV away from SP; empty where it does not."""
    if not isinstance(loop.process, TransferFunction):
        return ""
    num, den = (np.trim_zeros(np.atleast_1d(part), "b") for part in (loop.process.num, loop.process.den))
    Kc, gain = loop.controller.Kc, float(num[-1] / den[-1]) if num.size else 0.0
    if Kc * gain >= 0.0:
        return ""
    if not given:
        return (
            f"By the process found more OP {'raises' if gain > 0.0 else 'lowers'} this PV, and the controller found, "
            f"Kc = {Kc:g}, would drive PV away from SP: one of the two was not identified."
        )
    return (
        f"The controller's gain, Kc = {Kc:g}, has the wrong sign: more OP {'raises' if gain > 0.0 else 'lowers'} this "
        f"PV, so it would drive PV away from SP. Give Kc = {-Kc:g} (--controller), if that is the controller's action."
    )


def _judge(a: Cycle, b: Cycle, spread: float) -> tuple[bool, str]:
    """Whether the twin repeats the record's cycle, with the reason; noisy cycles differ from run to run by `spread`."""
    if not np.isfinite(distance(a, b)):
        return False, "The twin does not cycle, the record does: something that was not identified drives the loop."
    wider = min(2.0 * spread, MOST_SPREAD)
    compared = (
        ("period", b.period / a.period, PERIOD_LIMIT + wider),
        ("OP amplitude", b.amplitude_op / a.amplitude_op, AMPLITUDE_LIMIT + wider),
        ("PV amplitude", b.amplitude_pv / a.amplitude_pv, AMPLITUDE_LIMIT + wider),
    )
    wrong = [
        f"its {name} is {100.0 * (ratio - 1.0):+.0f} % off (at most {100.0 * limit:.0f} %)"
        for name, ratio, limit in compared
        if abs(ratio - 1.0) > limit
    ]
    if wrong:
        return False, f"The twin does not repeat the record's cycle: {', '.join(wrong)}."
    return True, "The twin repeats the record's cycle."


def _changes(found: Identification, better: RefinedModel) -> tuple[str, ...]:
    """What the open-loop search changed by more than 2 %, and the second lag it found."""
    compared = (
        ("S", "%", found.S, better.S),
        ("J", "%", found.J, better.J),
        ("dead time", "s", found.process.dead_time, better.process.dead_time),
    )
    least = {"dead time": max(0.01 * found.process.time_constant, 1e-6)}
    told = [
        f"{name} {a:.3g} to {b:.3g} {unit}"
        for name, unit, a, b in compared
        if abs(b - a) > 0.02 * abs(a) + least.get(name, 1e-9)
    ]
    return (*told, *(["a second lag"] if better.process.den.size > 2 else []))


def _overlay(
    record: LoopRecord, pv: NDArray[np.float64], run: LoopRecord, period: float
) -> dict[str, NDArray[np.float64]]:
    """Three periods of the record's middle, and those of the twin that are nearest to them."""
    assert run.pv is not None
    op, step = forward_fill(record.op, fill_start=True), round(record.dt / run.dt)
    op_twin, pv_twin = run.op[::step], run.pv[::step]
    n = min(round(3.0 * period / record.dt), op.size, op_twin.size // 2)
    first = (op.size - n) // 2
    part = op[first : first + n]
    # Square of the distance of every window to the part, both about their means, but for what all windows share.
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
