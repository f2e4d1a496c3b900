"""How a loop oscillates when it is let run, and how far two oscillations are apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.compensation.exchange import exchange
from stiction.compensation.repair import stiction_of
from stiction.compensation.surroundings import run_in
from stiction.diagnosis.oscillation import about_drift, control_error, filled, find_oscillation, half_cycles, smooth
from stiction.limitcycle.continuous_form import continuous_form
from stiction.simulation import simulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.compensation.surroundings import Surroundings
    from stiction.models import Loop
    from stiction.records.record import LoopRecord

__all__ = ["NO_CYCLE", "Cycle", "cycle_in", "cycle_of", "distance", "own_period", "pace"]

SEEDS = 5
"""Runs over which the cycle of a noisy loop is taken [-]."""
SETTLE, RUN = 6, 12
"""Periods for settling, and those that are measured [-]."""
UNKNOWN = 3.0
"""S of a valve whose model has none, for the size of that load [% of span]."""
KICK = 1.2
"""Load that starts the cycle, over what a stem takes to break loose [-]."""
RESTING, LARGE = 0.4, 90.0
"""Swing of the OP below which it rests, over that of its large swings, and the percentile of those [-]."""


@dataclass(frozen=True)
class Cycle:
    """How a loop oscillates."""

    period: float
    """Period [s]; NaN when there is none."""
    amplitude_op: float
    """Half peak to peak of the OP [% of span]."""
    amplitude_pv: float
    """Half peak to peak of the PV [PV units]."""
    share: float = 1.0
    """Share of its periods in which it swings, and does not rest [-]."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        names = ("period_s", "amplitude_op", "amplitude_pv", "share")
        values = (self.period, self.amplitude_op, self.amplitude_pv, self.share)
        return {name: float(x) if np.isfinite(x) else None for name, x in zip(names, values, strict=True)}


NO_CYCLE = Cycle(float("nan"), 0.0, 0.0)


def cycle_of(
    loop: Loop, sp: float, op: float, period: float, around: Surroundings | None = None, seeds: int = SEEDS
) -> tuple[Cycle, float, LoopRecord]:
    """Let a loop run from rest after a pulse of load, and see how it oscillates once it has settled.

    Parameters
    ----------
    loop : Loop
        The loop.
    sp, op : float
        Operating point [PV units, % of span].
    period : float
        Period that is expected [s].
    around : Surroundings, optional
        What moves the loop from outside; by default its own noise alone.
    seeds : int
        Runs of a noisy loop [-].

    Returns
    -------
    tuple
        Medians over the runs; how much the runs differ, as the root mean square of the logarithms of their ratios to
        the medians [-]; and the run nearest to the medians.
    """
    alike = around is None and loop.noise == 0.0
    runs = [_run(loop, sp, op, period, around, seed) for seed in range(1 if alike else seeds)]
    cycles = [(one, record) for one, record in runs if one.period > 0.0]
    if 2 * len(cycles) < len(runs) or not cycles:
        return NO_CYCLE, 0.0, runs[0][1]
    table = np.array([[one.period, one.amplitude_op, one.amplitude_pv] for one, _ in cycles])
    middle = np.median(table, axis=0)
    apart = np.log(np.maximum(table, 1e-12) / np.maximum(middle, 1e-12))
    nearest = int(np.argmin(np.sum(apart**2, axis=1)))
    swings = np.concatenate([_swings(record.op, period / record.dt) for _, record in runs])
    median = Cycle(float(middle[0]), float(middle[1]), float(middle[2]), _share(swings))
    return median, float(np.sqrt(np.mean(apart**2))), cycles[nearest][1]


def cycle_in(record: LoopRecord, period: float) -> Cycle:
    """Pace of a record's OP, and its amplitudes over the `period` [s] expected, whether it is regular or not."""
    error, op = control_error(record), filled(record.op)
    if error is None or op is None:
        return NO_CYCLE
    samples = period / record.dt
    swings, errors = _swings(op, samples), _swings(error, samples)
    return Cycle(
        pace(about_drift(op, samples), samples) * record.dt,
        float(np.median(swings)),
        float(np.median(errors)),
        _share(swings),
    )


def pace(x: NDArray[np.float64], samples: float) -> float:
    """Twice the mean half period of a signal that swings about zero; NaN where it does not [samples]."""
    halves = half_cycles(x, samples)
    if len(halves) < 4:
        return float("nan")
    # Without the ends, where the drift is not known, and as many rises as falls, as the two differ.
    even = halves[1 : 1 + (len(halves) - 2) // 2 * 2]
    return 2.0 * float(np.mean(even[:, 1] - even[:, 0]))


def _swings(x: NDArray[np.float64], samples: float) -> NDArray[np.float64]:
    """Half peak to peak about the drift in each period, shape (n_periods,)."""
    calm = about_drift(smooth(x, samples / 24.0), samples)
    length = min(max(2, round(samples)), x.size)
    starts = np.arange(0.0, x.size - length + 1.0, samples).astype(np.intp)
    cycles = np.lib.stride_tricks.sliding_window_view(calm, length)[starts]
    return np.ptp(cycles, axis=1) / 2.0


def _share(swings: NDArray[np.float64]) -> float:
    """Share of the periods whose swing is not far below the large ones."""
    return float(np.mean(swings > RESTING * np.percentile(swings, LARGE)))


def distance(a: Cycle, b: Cycle) -> float:
    """Root mean square of the logarithms of the ratios of period and amplitudes [-]; infinite where `b` is no cycle."""
    if not (b.period > 0.0 and b.amplitude_op > 0.0 and b.amplitude_pv > 0.0):
        return float("inf")
    ratios = (b.period / a.period, b.amplitude_op / a.amplitude_op, b.amplitude_pv / a.amplitude_pv)
    return float(np.sqrt(np.mean(np.log(ratios) ** 2)))


def own_period(loop: Loop, sp: float, op: float) -> float:
    """Period of a loop of which nothing is known, looked for in longer and longer runs without noise [s]."""
    slowest = max(x for x in (loop.controller.Ti, loop.process.dead_time, 5.0 * loop.dt) if np.isfinite(x))
    quiet = exchange(loop, noise=0.0)
    for length in (60.0, 250.0, 1000.0):
        n = min(max(round(length * slowest / loop.dt), 400), 200_000)
        kick = _kick(loop, n, round(slowest / loop.dt))
        seen = find_oscillation(simulate(quiet, sp, n * loop.dt, kick, 0, pv_start=sp, op_start=op).window(n // 3, n))
        if seen.oscillating:
            return seen.period
    return 10.0 * slowest


def _kick(loop: Loop, n: int, length: int) -> NDArray[np.float64]:
    """Load that breaks the stem loose from the point of rest, at which it begins [% of span], shape (n_samples,).

    A stem that only rests and jumps would come back to that very point: a load of half a jump puts it out of reach.
    """
    found, load = continuous_form(loop.valve), np.zeros(n)
    if found is not None and found.staircase:
        load += found.jump / 2.0
    S = (stiction_of(loop.valve) or (UNKNOWN, 0.0))[0]
    load[: max(length, 3)] += max(0.7 * S, 0.0 if found is None else KICK * found.sb)
    return load


def _run(
    loop: Loop, sp: float, op: float, period: float, around: Surroundings | None, seed: int
) -> tuple[Cycle, LoopRecord]:
    samples = max(round(period / loop.dt), 4)
    settle, n = SETTLE * samples, (SETTLE + RUN) * samples
    kick = _kick(loop, n, samples // 3)
    record = run_in(around, loop, np.full(n, sp), kick, seed, sp, op).window(settle, n)
    # Alone, a loop may come to rest; in its surroundings it always moves.
    if np.ptp(record.op) < 1e-9 or (around is None and not find_oscillation(record).period > 0.0):
        return NO_CYCLE, record
    return cycle_in(record, period), record
