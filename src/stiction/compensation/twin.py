"""The loop's twin: a simulated loop that cycles as the record does.

Valve and process come from the identification, polished in open loop (`refine`); the controller from OP and error, or
given; the noise from what the simulated PV leaves; a slowly varying load from what the moving averages of stem and PV do
not explain of each other. The twin is then let run on its own, closed, with the recorded set point, and compared with the
record: period, amplitude of OP, amplitude of PV. Only a twin that cycles as the loop does may advise.

Where it does not, the amplitudes tell what to change: a Kano valve scales, (S, J) -> (c S, c J) leaves the period and
takes every amplitude times c, so that the period asks for another J / S, dead time or gain, and the amplitudes for S.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.compensation.refine import refine
from stiction.diagnosis.identification import fit_controller
from stiction.diagnosis.identification.signals import hold_gaps
from stiction.diagnosis.oscillation import find_oscillation, smooth
from stiction.errors import RecordError
from stiction.models import PID, Kano, Loop
from stiction.records.quality import usable_part
from stiction.simulation import simulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Diagnosis
    from stiction.models import TransferFunction
    from stiction.records.record import LoopRecord

__all__ = ["Cycle", "Twin", "build_twin", "twin_of_loop"]

PERIOD_LIMIT, AMPLITUDE_LIMIT = 0.15, 0.25
"""Largest relative error of the period and of the amplitudes of a twin that fits [-]."""
CONTROLLER_LIMIT = 0.9
"""Share of the OP that a controller found from the record must explain [-]."""
SEEDS, MOST_SPREAD = 5, 0.25
"""Runs over which the twin's cycle is taken, and how far their spread may widen the limits at most [-]."""
SLOW_LOAD = 0.05
"""Standard deviation of the slow load over S below which it is left out [-]."""


@dataclass(frozen=True)
class Cycle:
    """How a loop oscillates."""

    period: float
    """Period [s]; NaN when there is none."""
    amplitude_op: float
    """Half peak to peak of the OP [% of span]."""
    amplitude_pv: float
    """Half peak to peak of the PV [PV units]."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            name: float(value) if np.isfinite(value) else None
            for name, value in (
                ("period_s", self.period), ("amplitude_op", self.amplitude_op), ("amplitude_pv", self.amplitude_pv),
            )
        }  # fmt: skip


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
    """Standard deviation of the slowly varying load at the process inlet [% of span]."""
    load_time: float
    """Time over which that load changes [s]."""
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
    """Three periods of record and twin, aligned in phase: time [s], op, op_twin, pv, pv_twin, shape (n_samples,) each."""

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
            "S": getattr(valve, "S", None), "J": getattr(valve, "J", None),
            "controller": {"Kc": pid.Kc, "Ti_s": pid.Ti if np.isfinite(pid.Ti) else None, "Td_s": pid.Td},
            "process": {
                "num": list(getattr(process, "num", ())), "den": list(getattr(process, "den", ())),
                "dead_time_s": process.dead_time,
            },
            "dt_s": self.loop.dt, "noise": self.loop.noise, "load": self.load, "load_time_s": self.load_time,
            "sp": self.sp, "op": self.op,
            "measured": self.measured.to_dict(), "simulated": self.simulated.to_dict(),
            "score": self.score if np.isfinite(self.score) else None,
            "fits": self.fits, "reason": self.reason, "changes": list(self.changes),
            "overlay": {name: [float(x) for x in series] for name, series in self.overlay.items()},
        }  # fmt: skip


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
    cycle, _, _ = _cycles(loop, sp, op, None, _own_period(loop, sp, op))
    reason = "Parameters were given, so that there is no record to compare with."
    return Twin(loop, sp, op, 0.0, 0.0, cycle, cycle, 1.0, True, reason)


def build_twin(diagnosis: Diagnosis, controller: PID | None = None) -> Twin:
    """Build the twin of a diagnosed loop and compare it with the record.

    Parameters
    ----------
    diagnosis : Diagnosis
        A diagnosis with an identified valve and process.
    controller : PID, optional
        The loop's controller; by default a PI is found from OP and error.

    Returns
    -------
    Twin
        `fits` says whether it may advise, `reason` why.

    Raises
    ------
    RecordError
        When nothing was identified, the loop does not oscillate, or no controller is found.
    """
    found, seen = diagnosis.identification, diagnosis.oscillation
    if found is None:
        raise RecordError(
            f"{diagnosis.record.tag}: no valve and process were identified; there is nothing to build on."
        )
    if not seen.period > 0.0:
        raise RecordError(f"{diagnosis.record.tag} has no period; a twin is judged by the cycle it repeats.")
    record = usable_part(diagnosis.record)
    assert record.pv is not None
    better = refine(record, found, seen.period)
    pid = controller if controller is not None else _controller(record)
    dt, pv = record.dt, hold_gaps(record.pv)
    noise = min(float(np.std(np.diff(better.left, 2))) / np.sqrt(6.0), float(better.left.std()))
    sp = pv if record.sp is None else hold_gaps(record.sp)
    load, load_time = _slow_load(better.mv, pv, better.process, seen.period / dt, dt)
    loop = Loop(pid, Kano(better.S, better.J), better.process, dt, noise=noise)
    level, op = float(np.mean(sp)), float(np.mean(better.mv))
    measured = Cycle(seen.period, seen.amplitude_op, seen.amplitude_pv)
    moves = None if record.sp is None or np.ptp(sp) == 0.0 else sp - level
    cycle, spread, run = _cycles(loop, level, op, moves, seen.period)
    changes = list(_changes(found, better.S, better.J, better.process))
    fits, reason = _judge(measured, cycle, spread)
    if not fits:
        nearer = _closer(loop, level, op, moves, measured)
        if nearer is not None:
            loop, told = nearer
            cycle, spread, run = _cycles(loop, level, op, moves, seen.period)
            fits, reason = _judge(measured, cycle, spread)
            changes += told
    if load < SLOW_LOAD * better.S:
        load = 0.0
    score = 1.0 - _distance(measured, cycle)
    overlay = _overlay(record, pv, run, seen.period) if np.isfinite(cycle.period) else {}
    return Twin(loop, level, op, load, load_time, measured, cycle, score, fits, reason, tuple(changes), overlay)


def _controller(record: LoopRecord) -> PID:
    """The PI controller behind the record."""
    found = fit_controller(record)
    if found.fit < CONTROLLER_LIMIT or not (found.Ti > 0.0 and found.Kc != 0.0):
        raise RecordError(
            f"{record.tag}: no PI controller explains the OP ({100.0 * found.fit:.0f} % of its movement, "
            f"{100.0 * CONTROLLER_LIMIT:.0f} % needed); give controller=PID(Kc, Ti), or check that it is in automatic."
        )
    return PID(found.Kc, found.Ti, op_limits=(0.0, 100.0))


def _slow_load(
    mv: NDArray[np.float64], pv: NDArray[np.float64], process: TransferFunction, samples: float, dt: float
) -> tuple[float, float]:
    """Standard deviation [% of span] and time scale [s] of the load that the averages over a period leave."""
    slow_mv, slow_pv = smooth(mv, samples), smooth(pv, samples)
    inside = slice(round(samples), max(mv.size - round(samples), round(samples) + 3))
    gain = process.num[-1] / (process.den[-1] if process.den[-1] != 0.0 else process.den[-2])
    needed = np.gradient(slow_pv, dt) / gain if process.den[-1] == 0.0 else (slow_pv - slow_pv.mean()) / gain
    load = (needed - slow_mv)[inside]
    load = load - load.mean()
    size = float(load.std())
    speed = float(np.std(np.diff(load))) / dt if load.size > 2 else 0.0
    return size, max(size / speed if speed > 0.0 else 0.0, samples * dt)


def _cycles(
    loop: Loop, sp: float, op: float, moves: NDArray[np.float64] | None, period: float, seeds: int = SEEDS
) -> tuple[Cycle, float, LoopRecord]:
    """How the loop oscillates: medians over the seeds, how much they differ [-], and the run nearest to the medians."""
    runs = [_run(loop, sp, op, moves, period, seed) for seed in range(seeds if loop.noise > 0.0 else 1)]
    cycles = [(one, run) for one, run in runs if one.period > 0.0]
    if 2 * len(cycles) < len(runs) or not cycles:
        return Cycle(float("nan"), 0.0, 0.0), 0.0, runs[0][1]
    table = np.array([[one.period, one.amplitude_op, one.amplitude_pv] for one, _ in cycles])
    middle = np.median(table, axis=0)
    apart = np.log(np.maximum(table, 1e-12) / np.maximum(middle, 1e-12))
    nearest = int(np.argmin(np.sum(apart**2, axis=1)))
    return Cycle(*(float(x) for x in middle)), float(np.sqrt(np.mean(apart**2))), cycles[nearest][1]


def _run(
    loop: Loop, sp: float, op: float, moves: NDArray[np.float64] | None, period: float, seed: int
) -> tuple[Cycle, LoopRecord]:
    """Let the loop run from rest after a load pulse, and measure how it oscillates once it has settled."""
    samples = max(round(period / loop.dt), 4)
    settle, n = 6 * samples, 12 * samples if moves is None else max(moves.size, 12 * samples)
    kick = np.zeros(settle + n)
    kick[: max(samples // 3, 3)] = 0.7 * getattr(loop.valve, "S", 3.0)
    target: Any = sp
    if moves is not None:
        target = sp + np.concatenate([np.zeros(settle), moves, np.zeros(n - moves.size)])
    record = simulate(loop, target, (settle + n) * loop.dt, kick, seed, pv_start=sp, op_start=op)
    record = record.window(settle, settle + n)
    seen = find_oscillation(record)
    if not seen.oscillating:
        return Cycle(float("nan"), 0.0, 0.0), record
    return Cycle(seen.period, seen.amplitude_op, seen.amplitude_pv), record


def _own_period(loop: Loop, sp: float, op: float) -> float:
    """Period of a loop of which nothing is known: looked for in longer and longer runs [s]."""
    slowest = max(getattr(loop.controller, "Ti", 1.0), loop.process.dead_time, 1.0 * loop.dt)
    if not np.isfinite(slowest):
        slowest = max(loop.process.dead_time, 10.0 * loop.dt)
    for length in (60.0, 250.0, 1000.0):
        n = min(max(round(length * slowest / loop.dt), 400), 200_000)
        kick = np.zeros(n)
        kick[: max(round(slowest / loop.dt), 3)] = 0.7 * getattr(loop.valve, "S", 3.0)
        run = simulate(replace(loop, noise=0.0), sp, n * loop.dt, kick, 0, pv_start=sp, op_start=op)
        seen = find_oscillation(run.window(n // 3, n))
        if seen.oscillating:
            return seen.period
    return 10.0 * slowest


def _distance(a: Cycle, b: Cycle) -> float:
    """Root mean square of the logarithms of the ratios of period and amplitudes; infinite without a cycle."""
    if not (b.period > 0.0 and b.amplitude_op > 0.0 and b.amplitude_pv > 0.0):
        return float("inf")
    ratios = (b.period / a.period, b.amplitude_op / a.amplitude_op, b.amplitude_pv / a.amplitude_pv)
    return float(np.sqrt(np.mean(np.log(ratios) ** 2)))


def _judge(a: Cycle, b: Cycle, spread: float) -> tuple[bool, str]:
    """Whether the twin repeats the record's cycle, with the reason; noisy cycles differ from run to run by `spread`."""
    if not np.isfinite(_distance(a, b)):
        return False, "The twin does not cycle, the record does: something that was not identified drives the loop."
    wider = min(2.0 * spread, MOST_SPREAD)
    off = {
        "period": (b.period / a.period - 1.0, PERIOD_LIMIT + wider),
        "OP amplitude": (b.amplitude_op / a.amplitude_op - 1.0, AMPLITUDE_LIMIT + wider),
        "PV amplitude": (b.amplitude_pv / a.amplitude_pv - 1.0, AMPLITUDE_LIMIT + wider),
    }
    wrong = [
        f"its {name} is {100.0 * error:+.0f} % off (at most {100.0 * limit:.0f} %)"
        for name, (error, limit) in off.items()
        if abs(error) > limit
    ]
    if wrong:
        return False, f"The twin does not repeat the record's cycle: {', '.join(wrong)}."
    return True, "The twin repeats the record's cycle."


def _changes(found: Any, S: float, J: float, process: TransferFunction) -> tuple[str, ...]:
    """What the open-loop search changed by more than 2 %, and the second lag it found."""
    told = []
    for name, before, after in (("S", found.S, S), ("J", found.J, J), ("dead time", found.process.dead_time, process.dead_time)):  # fmt: skip # noqa: E501
        if abs(after - before) > 0.02 * max(abs(before), 1e-9) + 1e-9:
            told.append(f"{name} {before:.3g} to {after:.3g}")
    if process.den.size > (2 if not found.process.integrating else 2):
        told.append("a second lag")
    return tuple(told)


def _closer(
    loop: Loop, sp: float, op: float, moves: NDArray[np.float64] | None, measured: Cycle
) -> tuple[Loop, list[str]] | None:
    """Change dead time, J / S and gain until the period matches, and S until the amplitudes do; None where none do."""
    valve = loop.valve
    assert isinstance(valve, Kano)
    best, told, least = None, [], float("inf")
    for longer, ratio, gain in product((1.0, 0.85, 1.15, 0.7, 1.3), (1.0, 0.75, 1.25), (1.0, 0.9, 1.1)):
        process = replace(loop.process, num=loop.process.num * gain, dead_time=loop.process.dead_time * longer)
        J = min(valve.J * ratio, valve.S)
        trial = replace(loop, process=process, valve=Kano(valve.S, J))
        seen, _, _ = _cycles(trial, sp, op, moves, measured.period, 3)
        if not (seen.period > 0.0 and abs(seen.period / measured.period - 1.0) < PERIOD_LIMIT):
            continue
        scale = np.sqrt(measured.amplitude_op / seen.amplitude_op * measured.amplitude_pv / seen.amplitude_pv)
        if not 0.75 <= scale <= 1.35:
            continue
        trial = replace(trial, valve=Kano(valve.S * scale, J * scale))
        seen, _, _ = _cycles(trial, sp, op, moves, measured.period, 3)
        moved = np.abs(np.log([longer, ratio, gain, scale])).sum()
        if _distance(measured, seen) + 0.2 * moved < least:
            best, least = trial, _distance(measured, seen) + 0.2 * moved
            factors = (("dead time", longer), ("J / S", J / valve.J if valve.J else 1.0), ("gain", gain), ("S", scale))
            told = [f"{name} times {factor:.2f}" for name, factor in factors if abs(factor - 1.0) > 0.005]
    return None if best is None else (best, told)


def _overlay(
    record: LoopRecord, pv: NDArray[np.float64], run: LoopRecord, period: float
) -> dict[str, NDArray[np.float64]]:
    """Three periods of the record's middle, and those of the twin that agree best with them."""
    assert run.pv is not None
    op = hold_gaps(record.op)
    n = min(round(3.0 * period / record.dt), op.size, run.op.size // 2)
    first = (op.size - n) // 2
    a_op, a_pv = op[first : first + n], pv[first : first + n]
    centred = a_op - a_op.mean()
    windows = np.lib.stride_tricks.sliding_window_view(run.op, n)[: max(round(1.5 * period / record.dt), 1)]
    match = (windows - windows.mean(axis=1, keepdims=True)) @ centred
    at = int(np.argmax(match))
    return {
        "time": np.arange(n) * record.dt, "op": a_op, "op_twin": run.op[at : at + n], "pv": a_pv,
        "pv_twin": run.pv[at : at + n],
    }  # fmt: skip
