"""Run the twin with each remedy through one programme: a steady part, a set point step, and a load step.

For each seed, every remedy gets the same noise, disturbances and set point changes, the same constant load (it decides
where the stem would have to rest), the same start pulse, and steps of the same size and sign.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.compensation.external_inputs import simulate_with_inputs
from stiction.compensation.replace_parts import replace_parts
from stiction.errors import ParameterError, require_samples
from stiction.models import Kano

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from stiction.compensation.external_inputs import ExternalInputs
    from stiction.compensation.remedies import Remedy
    from stiction.compensation.twin import Twin
    from stiction.models import Loop
    from stiction.records.record import LoopRecord

__all__ = ["METRICS", "TrialProgramme", "measure_performance", "plan_programme", "run_jobs", "run_programme"]

METRICS = ("pv_std", "iae", "offset", "travel", "reversals", "op_travel", "sp_step", "load_step")
"""Names of the measured values of a run, in the order of its row."""
SETTLING_PERIODS, STEADY_PERIODS, STEP_PERIODS = 8.0, 14.0, 6.0
"""Periods for settling, of the steady part, and after each step [-]."""
MIN_STEADY_PERIODS = 2.0
"""Smallest length of the steady part, in periods [-]."""


class TrialProgramme(NamedTuple):
    """The programme of every run."""

    sp: float
    """Set point [PV units]."""
    op: float
    """Operating point of the OP [% of span]."""
    settle: int
    """Samples for settling, which are not measured."""
    steady: int
    """Samples without a step."""
    step: int
    """Samples after each step."""
    sp_step: float
    """Height of the set point step [PV units]."""
    load_step: float
    """Height of the load step [% of span]."""
    offset: float
    """Largest constant load; it is random for each seed [% of span]."""
    inputs: ExternalInputs | None = None
    """External inputs; None for the loop's own noise only."""

    @property
    def n(self) -> int:
        """Number of samples of a run."""
        return self.settle + self.steady + 2 * self.step


def plan_programme(twin: Twin, S: float, duration: float | None, dt: float | None = None) -> TrialProgramme:
    """Return the programme for a twin, with steps of the size of its limit cycle.

    `duration` is the length of the steady part [s], `dt` the sampling period if it is not that of the twin [s].
    """
    dt = twin.loop.dt if dt is None else dt
    if duration is not None:
        require_samples("duration", duration, dt)
    period = twin.measured.period if twin.measured.period > 0.0 else 100.0 * dt
    samples = max(period / dt, 4.0)
    if duration is not None and duration < MIN_STEADY_PERIODS * period:
        raise ParameterError(
            f"duration = {duration:g} s is shorter than {MIN_STEADY_PERIODS:g} periods of the loop ({period:.4g} s); "
            f"give at least {MIN_STEADY_PERIODS * period:.4g} s, or leave it out for {STEADY_PERIODS:g} periods."
        )
    steady = round(STEADY_PERIODS * samples) if duration is None else max(round(duration / dt), 20)
    return TrialProgramme(
        sp=twin.sp, op=twin.op, settle=round(SETTLING_PERIODS * samples), steady=steady,
        step=round(STEP_PERIODS * samples), sp_step=2.0 * twin.simulated.amplitude_pv, load_step=S, offset=S,
        inputs=twin.inputs,
    )  # fmt: skip


def run_programme(loop: Loop, plan: TrialProgramme, seed: int) -> LoopRecord:
    """Simulate a loop through the programme."""
    rng = np.random.default_rng([seed, 7])
    side = 1.0 if seed % 2 else -1.0
    load = np.full(plan.n, float(rng.uniform(-plan.offset, plan.offset)))
    load[: max(plan.settle // 24, 3)] += 0.7 * plan.offset * side
    load[plan.n - plan.step :] += plan.load_step * side
    sp = np.full(plan.n, plan.sp)
    sp[plan.settle + plan.steady :] += plan.sp_step * side
    return simulate_with_inputs(plan.inputs, loop, sp, load, seed, plan.sp, plan.op)


def measure_performance(record: LoopRecord, plan: TrialProgramme) -> NDArray[np.float64]:
    """Return the values of `METRICS` for a run, shape (8,)."""
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
    """Runs of one remedy over some seeds, with the valve of the twin or a changed one."""

    remedy: Remedy
    """The remedy."""
    S: float
    """Factor on the identified S [-]."""
    J: float
    """Factor on the identified J [-]."""
    seeds: int
    """Number of seeds [-]."""


def run_jobs(
    twin: Twin, plan: TrialProgramme, jobs: Sequence[Job], S: float, J: float, tick: Callable[[], Any] | None = None
) -> list[NDArray[np.float64]]:
    """Run the jobs on two threads; return a table of shape (n_seeds, 8) for each."""

    def one(job: Job) -> NDArray[np.float64]:
        loop = twin.loop
        if (job.S, job.J) != (1.0, 1.0):
            loop = replace_parts(loop, valve=Kano(S * job.S, min(J * job.J, S * job.S), travel=loop.valve.travel))
        loop = job.remedy.apply(loop)
        table = np.array([measure_performance(run_programme(loop, plan, seed), plan) for seed in range(job.seeds)])
        if tick is not None:
            tick()
        return table

    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(one, jobs))
