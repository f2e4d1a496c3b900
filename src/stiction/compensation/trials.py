"""Trials: the twin with a remedy, over seeds, through one programme: undisturbed, a set point step, a load step.

Every remedy sees the same seeds: the same surroundings (noise, load, moves of the set point), the same constant load
(which decides where the stem would have to rest), the same pulse that starts the cycle, and steps of the same size and
sign. The PV's deviation is that from the set point.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.compensation.exchange import exchange
from stiction.compensation.surroundings import run_in
from stiction.errors import ParameterError, require_samples
from stiction.models import Kano

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from stiction.compensation.remedies import Remedy
    from stiction.compensation.surroundings import Surroundings
    from stiction.compensation.twin import Twin
    from stiction.models import Loop
    from stiction.records.record import LoopRecord

__all__ = ["METRICS", "Programme", "measure", "programme_for", "run", "run_all"]

METRICS = ("pv_std", "iae", "offset", "travel", "reversals", "op_travel", "sp_step", "load_step")
"""What is measured of a run, in the order of its row."""
SETTLE, STEADY, STEP = 8.0, 14.0, 6.0
"""Periods for settling, for what is undisturbed, and after each step [-]."""
SHORTEST = 2.0
"""Periods that what is undisturbed lasts at least [-]: a part of one cycle says nothing of a deviation."""


class Programme(NamedTuple):
    """What every run goes through."""

    sp: float
    """Set point [PV units]."""
    op: float
    """Operating point of the OP [% of span]."""
    settle: int
    """Samples left out at the beginning."""
    steady: int
    """Samples without a disturbance but those from the loop's surroundings."""
    step: int
    """Samples after each step."""
    sp_step: float
    """Height of the set point step [PV units]."""
    load_step: float
    """Height of the load step [% of span]."""
    offset: float
    """Largest constant load, drawn for each seed [% of span]."""
    around: Surroundings | None = None
    """What moves the loop from outside; None for its own noise alone."""

    @property
    def n(self) -> int:
        """Samples of a run."""
        return self.settle + self.steady + 2 * self.step


def programme_for(twin: Twin, S: float, duration: float | None, dt: float | None = None) -> Programme:
    """Programme for a twin: steps of the size of its cycle; `duration` [s] is that of the undisturbed part.

    `dt` is the sampling period [s] of another loop that is to go through the same.
    """
    dt = twin.loop.dt if dt is None else dt
    if duration is not None:
        require_samples("duration", duration, dt)
    period = twin.measured.period if twin.measured.period > 0.0 else 100.0 * dt
    samples = max(period / dt, 4.0)
    if duration is not None and duration < SHORTEST * period:
        raise ParameterError(
            f"duration = {duration:g} s is less than {SHORTEST:g} cycles of the loop, of {period:.4g} s; give at least "
            f"{SHORTEST * period:.4g} s, or none for {STEADY:g} cycles."
        )
    steady = round(STEADY * samples) if duration is None else max(round(duration / dt), 20)
    return Programme(
        sp=twin.sp, op=twin.op, settle=round(SETTLE * samples), steady=steady, step=round(STEP * samples),
        sp_step=2.0 * twin.simulated.amplitude_pv, load_step=S, offset=S, around=twin.around,
    )  # fmt: skip


def run(loop: Loop, plan: Programme, seed: int) -> LoopRecord:
    """Run a loop through the programme."""
    rng = np.random.default_rng([seed, 7])
    side = 1.0 if seed % 2 else -1.0
    load = np.full(plan.n, float(rng.uniform(-plan.offset, plan.offset)))
    load[: max(plan.settle // 24, 3)] += 0.7 * plan.offset * side
    load[plan.n - plan.step :] += plan.load_step * side
    sp = np.full(plan.n, plan.sp)
    sp[plan.settle + plan.steady :] += plan.sp_step * side
    return run_in(plan.around, loop, sp, load, seed, plan.sp, plan.op)


def measure(record: LoopRecord, plan: Programme) -> NDArray[np.float64]:
    """Row of `METRICS` of a run, shape (8,)."""
    assert record.pv is not None
    assert record.mv is not None
    assert record.sp is not None
    first, last = plan.settle, plan.settle + plan.steady
    deviation = record.pv - record.sp
    error = np.abs(deviation)
    steady = slice(first, last)
    hours = plan.steady * record.dt / 3600.0
    moves = np.diff(record.mv[steady])
    size = np.abs(moves)
    going = moves[size > 1e-9]
    return np.array(
        [
            float(deviation[steady].std()),
            float(error[steady].mean()),
            abs(float(deviation[steady].mean())),
            float(size.sum()) / hours,
            float(np.count_nonzero(going[1:] * going[:-1] < 0.0)) / hours,
            float(np.abs(np.diff(record.op[steady])).sum()) / hours,
            float(error[last : last + plan.step].mean()),
            float(error[last + plan.step :].mean()),
        ]
    )


@dataclass(frozen=True)
class Job:
    """One remedy, on the twin's valve or one that is off by a factor, over some seeds."""

    remedy: Remedy
    """What is tried."""
    S: float
    """Deadband plus stickband over the identified one [-]."""
    J: float
    """Slip jump over the identified one [-]."""
    seeds: int
    """Number of seeds [-]."""


def run_all(
    twin: Twin, plan: Programme, jobs: Sequence[Job], S: float, J: float, tick: Callable[[], Any] | None = None
) -> list[NDArray[np.float64]]:
    """Run the jobs on two threads; give each a table of shape (n_seeds, 8)."""

    def one(job: Job) -> NDArray[np.float64]:
        loop = twin.loop
        if (job.S, job.J) != (1.0, 1.0):
            loop = exchange(loop, valve=Kano(S * job.S, min(J * job.J, S * job.S), travel=loop.valve.travel))
        loop = job.remedy.apply(loop)
        table = np.array([measure(run(loop, plan, seed), plan) for seed in range(job.seeds)])
        if tick is not None:
            tick()
        return table

    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(one, jobs))
