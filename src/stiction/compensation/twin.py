"""The loop's twin: a simulated loop that cycles as the record does.

Valve and process come from the identification, polished in open loop (`refine`); the controller from OP and error, or
given; noise and a random load from what the simulated PV leaves, its white part and the rest. The twin is then let run
on its own, closed, with the recorded set point, and compared with the record: period, amplitude of OP, amplitude of PV.
Only a twin that cycles as the loop does may advise; where it does not, `match` looks for one within the uncertainty
that does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.compensation.cycle import NO_CYCLE, Cycle, cycle_of, distance, own_period
from stiction.compensation.load import first_order
from stiction.compensation.match import bring_nearer
from stiction.compensation.refine import refine
from stiction.diagnosis.identification import fit_controller
from stiction.diagnosis.identification.signals import hold_gaps
from stiction.diagnosis.oscillation import about_drift
from stiction.errors import RecordError
from stiction.models import PID, Ideal, Kano, Loop
from stiction.records.quality import usable_part
from stiction.simulation import simulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.compensation.refine import Refined
    from stiction.diagnosis.result import Diagnosis, Identification
    from stiction.records.record import LoopRecord

__all__ = ["Twin", "build_twin", "twin_of_loop"]

PERIOD_LIMIT, AMPLITUDE_LIMIT, MOST_SPREAD = 0.15, 0.25, 0.15
"""Largest relative error of period and amplitudes of a twin that fits, and how much the spread from run to run may
widen them [-]."""
CONTROLLER_LIMIT = 0.9
"""Share of the OP that a controller found from the record must explain [-]."""
MOST_LEFT = 0.25
"""Share of the PV's movement, about its average over a period, that valve and process may leave unexplained [-]."""
LEAST_LOAD = 0.05
"""Standard deviation of the random load over S below which it is left out [-]."""


@dataclass(frozen=True)
class Twin:
    """A simulated loop that stands for a real one."""

    loop: Loop
    """Controller, valve, process and noise."""
    sp: float
    """Set point about which remedies are tried [PV units]."""
    op: float
    """OP about which the loop works [% of span]."""
    load: float
    """Standard deviation of the random load at the process inlet [% of span]."""
    load_time: float
    """Time constant of that load [s]."""
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
    changes: tuple[str, ...] = ()
    """What was changed of the point identified, and by how much."""
    overlay: dict[str, NDArray[np.float64]] = field(default_factory=dict, repr=False, compare=False)
    """Three periods aligned in phase: time [s], op, op_twin, pv, pv_twin, shape (n_samples,) each."""

    def summary(self) -> str:
        """The comparison in a sentence or two."""
        a, b = self.measured, self.simulated
        return (
            f"{self.reason} Record: period {a.period:.4g} s, OP amplitude {a.amplitude_op:.3g} %, PV amplitude "
            f"{a.amplitude_pv:.3g}; twin: {b.period:.4g} s, {b.amplitude_op:.3g} %, {b.amplitude_pv:.3g}."
        )

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        valve, pid, process = self.loop.valve, self.loop.controller, self.loop.process
        return {
            "S": getattr(valve, "S", None),
            "J": getattr(valve, "J", None),
            "controller": {"Kc": pid.Kc, "Ti_s": pid.Ti if np.isfinite(pid.Ti) else None, "Td_s": pid.Td},
            "process": {
                "num": [float(x) for x in getattr(process, "num", ())],
                "den": [float(x) for x in getattr(process, "den", ())],
                "dead_time_s": process.dead_time,
            },
            "dt_s": self.loop.dt,
            "noise": self.loop.noise,
            "load": self.load,
            "load_time_s": self.load_time,
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
    return Twin(loop, sp, op, 0.0, 0.0, cycle, cycle, 1.0, True, reason)


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
        When nothing was identified, the loop has no period, or no controller is found.
    """
    found, seen = diagnosis.identification, diagnosis.oscillation
    tag = diagnosis.record.tag
    if found is None:
        raise RecordError(f"{tag}: no valve and process were identified; there is nothing to build a twin on.")
    if not seen.period > 0.0:
        raise RecordError(f"{tag} has no period; a twin is judged by the cycle it repeats.")
    record = usable_part(diagnosis.record)
    assert record.pv is not None
    pid = controller if controller is not None else _controller(record)
    better = refine(record, found, seen.period)
    pv = hold_gaps(record.pv)
    sp = pv if record.sp is None else hold_gaps(record.sp)
    level, op = float(np.mean(sp)), float(np.mean(better.mv))
    moves = None if record.sp is None or np.ptp(sp) == 0.0 else sp - level
    loop = Loop(pid, Kano(better.S, better.J), better.process, record.dt, noise=_noise(better.left))
    measured = Cycle(seen.period, seen.amplitude_op, seen.amplitude_pv)
    changes = _changes(found, better)
    if better.error > MOST_LEFT:
        reason = (
            f"Valve and process leave {100.0 * better.error:.0f} % of the PV's movement unexplained (at most "
            f"{100.0 * MOST_LEFT:.0f} %): too much for a twin."
        )
        return Twin(loop, level, op, 0.0, 0.0, measured, NO_CYCLE, -math.inf, False, reason, changes)
    cycle, spread, run = cycle_of(loop, level, op, seen.period, moves)
    fits, reason = _judge(measured, cycle, spread)
    if not fits:
        nearer = bring_nearer(loop, level, op, moves, measured)
        if nearer is not None:
            loop, told = nearer
            cycle, spread, run = cycle_of(loop, level, op, seen.period, moves)
            fits, reason = _judge(measured, cycle, spread)
            changes += tuple(told)
    load, load_time = _load(better, loop.noise, seen.period / record.dt, record.dt)
    if load < LEAST_LOAD * better.S:
        load = 0.0
    overlay = _overlay(record, pv, run, seen.period) if cycle.period > 0.0 else {}
    score = 1.0 - distance(measured, cycle)
    return Twin(loop, level, op, load, load_time, measured, cycle, score, fits, reason, changes, overlay)


def _controller(record: LoopRecord) -> PID:
    """The PI controller behind the record."""
    found = fit_controller(record)
    if found.fit < CONTROLLER_LIMIT or not (found.Ti > 0.0 and found.Kc != 0.0):
        raise RecordError(
            f"{record.tag}: no PI controller explains the OP ({100.0 * found.fit:.0f} % of its movement, "
            f"{100.0 * CONTROLLER_LIMIT:.0f} % needed); give controller=PID(Kc, Ti), or check that it is in automatic."
        )
    return PID(found.Kc, found.Ti, op_limits=(0.0, 100.0))


def _noise(left: NDArray[np.float64]) -> float:
    """Standard deviation of the white part of what is left [PV units]: second differences see little else."""
    return min(float(np.std(np.diff(left, 2))) / float(np.sqrt(6.0)), float(left.std()))


def _load(better: Refined, noise: float, samples: float, dt: float) -> tuple[float, float]:
    """Standard deviation [% of span] and time scale [s] of a random load that leaves what the noise does not explain.

    A first-order load of a quarter of a period is sent through the process, and scaled so that its answer about the
    moving average has the variance of what is left of the PV, the noise taken off. What is left alike in period after
    period is the model's error and no load.
    """
    lag, wide = max(samples / 4.0, 1.0), round(samples)
    left = better.left
    if left.size > 2 * wide:
        left = (left[wide:] - left[:-wide]) / np.sqrt(2.0)
    spare = float(np.var(left)) - noise * noise
    if spare <= 0.0:
        return 0.0, lag * dt
    n = round(200.0 * samples)
    load = first_order(np.random.default_rng(0), n, lag)
    still = Loop(PID(1e-12, 1e12), Ideal(), better.process, dt)
    answer = simulate(still, 0.0, n * dt, load).pv
    assert answer is not None
    unit = float(np.std(about_drift(answer, samples)[round(samples) : -round(samples)]))
    return float(np.sqrt(spare)) / unit if unit > 0.0 else 0.0, lag * dt


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


def _changes(found: Identification, better: Refined) -> tuple[str, ...]:
    """What the open-loop search changed by more than 2 %, and the second lag it found."""
    compared = (
        ("S", found.S, better.S),
        ("J", found.J, better.J),
        ("dead time", found.process.dead_time, better.process.dead_time),
    )
    told = [f"{name} {a:.3g} to {b:.3g}" for name, a, b in compared if abs(b - a) > 0.02 * abs(a) + 1e-9]
    return (*told, *(["a second lag"] if better.process.den.size > 2 else []))


def _overlay(
    record: LoopRecord, pv: NDArray[np.float64], run: LoopRecord, period: float
) -> dict[str, NDArray[np.float64]]:
    """Three periods of the record's middle, and those of the twin that agree best with them."""
    assert run.pv is not None
    op = hold_gaps(record.op)
    n = min(round(3.0 * period / record.dt), op.size, run.op.size // 2)
    first = (op.size - n) // 2
    part = op[first : first + n]
    starts = max(round(1.5 * period / record.dt), 1)
    windows = np.lib.stride_tricks.sliding_window_view(run.op, n)[:starts]
    at = int(np.argmax(windows @ (part - part.mean())))
    return {
        "time": record.time[:n],
        "op": part,
        "op_twin": run.op[at : at + n],
        "pv": pv[first : first + n],
        "pv_twin": run.pv[at : at + n],
    }
