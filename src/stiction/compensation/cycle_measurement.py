"""Measure the oscillation of a record or of a simulated loop, and compare two oscillations."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.compensation.external_inputs import simulate_with_inputs
from stiction.compensation.repair import stiction_of
from stiction.compensation.replace_parts import replace_parts
from stiction.diagnosis.oscillation import find_oscillation, half_cycles
from stiction.diagnosis.oscillation.signals import about_drift, control_error, filled, smooth
from stiction.display.json_form import Result, json_as
from stiction.limitcycle.continuous_form import continuous_form
from stiction.simulation import simulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.compensation.external_inputs import ExternalInputs
    from stiction.models import Loop
    from stiction.records.record import LoopRecord

__all__ = [
    "NO_CYCLE",
    "Cycle",
    "crossing_period",
    "cycle_distance",
    "measure_cycle",
    "simulate_cycle",
    "undisturbed_period",
]

NOISE_SEEDS = 5
"""Runs of a noisy loop from which the median oscillation is taken [-]."""
SETTLING_PERIODS, MEASURED_PERIODS = 6, 12
"""Periods for settling, and periods that are measured [-]."""
ASSUMED_S_PERCENT = 3.0
"""S assumed for the start load when the valve model has no S [% of span]."""
START_LOAD_FACTOR = 1.2
"""Load that starts the oscillation, relative to the input that breaks the stem loose [-]."""
MAX_RESTING_SWING, LARGE_SWING_PERCENTILE = 0.4, 90.0
"""Swing below which OP rests, relative to its large swings [-], and the percentile that defines a large swing [%]."""


@dataclass(frozen=True)
class Cycle(Result):
    """Period and amplitudes of an oscillation."""

    period: float = field(metadata=json_as("period_s"))
    """Period [s]; NaN when there is none."""
    amplitude_op: float
    """Half peak to peak of the OP [% of span]."""
    amplitude_pv: float
    """Half peak to peak of the PV [PV units]."""
    share: float = 1.0
    """Share of the periods in which the loop swings instead of resting [-]."""


NO_CYCLE = Cycle(float("nan"), 0.0, 0.0)


def simulate_cycle(
    loop: Loop, sp: float, op: float, period: float, inputs: ExternalInputs | None = None, seeds: int = NOISE_SEEDS
) -> tuple[Cycle, float, LoopRecord]:
    """Simulate a loop from rest after a load pulse, and measure its oscillation after it has settled.

    Parameters
    ----------
    loop : Loop
        The loop.
    sp, op : float
        Operating point [PV units, % of span].
    period : float
        Expected period [s].
    inputs : ExternalInputs, optional
        Disturbances and set point changes; by default only the loop's own noise.
    seeds : int
        Runs of a noisy loop [-].

    Returns
    -------
    tuple
        Medians over the runs; the spread of the runs, as the root mean square of the logarithm of their ratios to the
        medians [-]; and the run closest to the medians.
    """
    is_deterministic = inputs is None and loop.noise == 0.0
    runs = [_simulate_run(loop, sp, op, period, inputs, seed) for seed in range(1 if is_deterministic else seeds)]
    cycles = [(one, record) for one, record in runs if one.period > 0.0]
    if 2 * len(cycles) < len(runs) or not cycles:
        return NO_CYCLE, 0.0, runs[0][1]
    table = np.array([[one.period, one.amplitude_op, one.amplitude_pv] for one, _ in cycles])
    middle = np.median(table, axis=0)
    apart = np.log(np.maximum(table, 1e-12) / np.maximum(middle, 1e-12))
    nearest = int(np.argmin(np.sum(apart**2, axis=1)))
    swings = np.concatenate([_swing_per_period(record.op, period / record.dt) for _, record in runs])
    median = Cycle(float(middle[0]), float(middle[1]), float(middle[2]), _swinging_share(swings))
    return median, float(np.sqrt(np.mean(apart**2))), cycles[nearest][1]


def measure_cycle(record: LoopRecord, period: float) -> Cycle:
    """Measure period and amplitudes of a record, regular or not; `period` is the expected period [s]."""
    error, op = control_error(record), filled(record.op)
    if error is None or op is None:
        return NO_CYCLE
    samples = period / record.dt
    swings, errors = _swing_per_period(op, samples), _swing_per_period(error, samples)
    return Cycle(
        crossing_period(about_drift(op, samples), samples) * record.dt,
        float(np.median(swings)),
        float(np.median(errors)),
        _swinging_share(swings),
    )


def crossing_period(x: NDArray[np.float64], samples: float) -> float:
    """Return the period of a signal from its zero crossings [samples]; NaN when there are too few."""
    halves = half_cycles(x, samples)
    if len(halves) < 4:
        return float("nan")
    # The drift is unknown at the ends, so they are left out. Rises and falls differ, so as many of each are taken.
    even = halves[1 : 1 + (len(halves) - 2) // 2 * 2]
    return 2.0 * float(np.mean(even[:, 1] - even[:, 0]))


def _swing_per_period(x: NDArray[np.float64], samples: float) -> NDArray[np.float64]:
    """Return half the peak to peak value in each period, drift removed, shape (n_periods,)."""
    detrended = about_drift(smooth(x, samples / 24.0), samples)
    length = min(max(2, round(samples)), x.size)
    starts = np.arange(0.0, x.size - length + 1.0, samples).astype(np.intp)
    cycles = np.lib.stride_tricks.sliding_window_view(detrended, length)[starts]
    return np.ptp(cycles, axis=1) / 2.0


def _swinging_share(swings: NDArray[np.float64]) -> float:
    """Return the share of the periods whose swing is not far below the large swings."""
    return float(np.mean(swings > MAX_RESTING_SWING * np.percentile(swings, LARGE_SWING_PERCENTILE)))


def cycle_distance(a: Cycle, b: Cycle) -> float:
    """Return the root mean square of the log ratios of period and amplitudes [-]; infinite if `b` is no oscillation."""
    if not (b.period > 0.0 and b.amplitude_op > 0.0 and b.amplitude_pv > 0.0):
        return float("inf")
    ratios = (b.period / a.period, b.amplitude_op / a.amplitude_op, b.amplitude_pv / a.amplitude_pv)
    return float(np.sqrt(np.mean(np.log(ratios) ** 2)))


def undisturbed_period(loop: Loop, sp: float, op: float) -> float:
    """Return the period of a loop without noise [s], found in longer and longer runs."""
    slowest = max(x for x in (loop.controller.Ti, loop.process.dead_time, 5.0 * loop.dt) if np.isfinite(x))
    quiet = replace_parts(loop, noise=0.0)
    for length in (60.0, 250.0, 1000.0):
        n = min(max(round(length * slowest / loop.dt), 400), 200_000)
        kick = _start_load(loop, n, round(slowest / loop.dt))
        seen = find_oscillation(simulate(quiet, sp, n * loop.dt, kick, 0, pv_start=sp, op_start=op).window(n // 3, n))
        if seen.oscillating:
            return seen.period
    return 10.0 * slowest


def _start_load(loop: Loop, n: int, length: int) -> NDArray[np.float64]:
    """Return a load that moves the stem away from its initial rest position [% of span], shape (n_samples,).

    A stem that only rests and jumps would return to exactly that position. A constant load of half a jump prevents it.
    """
    continuous, load = continuous_form(loop.valve), np.zeros(n)
    if continuous is not None and continuous.staircase:
        load += continuous.jump / 2.0
    S = (stiction_of(loop.valve) or (ASSUMED_S_PERCENT, 0.0))[0]
    load[: max(length, 3)] += max(0.7 * S, 0.0 if continuous is None else START_LOAD_FACTOR * continuous.sb)
    return load


def _simulate_run(
    loop: Loop, sp: float, op: float, period: float, inputs: ExternalInputs | None, seed: int
) -> tuple[Cycle, LoopRecord]:
    samples = max(round(period / loop.dt), 4)
    settle, n = SETTLING_PERIODS * samples, (SETTLING_PERIODS + MEASURED_PERIODS) * samples
    kick = _start_load(loop, n, samples // 3)
    record = simulate_with_inputs(inputs, loop, np.full(n, sp), kick, seed, sp, op).window(settle, n)
    # Without external inputs a loop may come to rest; with them it always moves.
    if np.ptp(record.op) < 1e-9 or (inputs is None and not find_oscillation(record).period > 0.0):
        return NO_CYCLE, record
    return measure_cycle(record, period), record
