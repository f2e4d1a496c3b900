"""Simulate a plant: first the sources of oscillation, then the loops that they disturb."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, require_count, require_positive, require_seed
from stiction.models.processes.first_order_lag import first_order_lag
from stiction.records.record import LoopRecord, Provenance
from stiction.simulation.closed_loop import simulate
from stiction.simulation.plant.cascade import simulate_cascade
from stiction.simulation.plant.layout import PlantLayout, draw_layout

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.simulation.plant.layout import LoopLayout

__all__ = ["PlantLoop", "SimulatedPlant", "simulate_plant"]

RECORD_START = datetime(2026, 3, 2, 6, 0)
OPERATING_POINT = 50.0
"""Operating point of every loop [% of span]."""
SETTLING_SHARE = 0.25
"""Time that the plant runs before the record starts, over the length of the record [-]."""
MIN_CLEAR_RATIO = 1.0
"""Standard deviation of an oscillation over the standard deviation of the noise, above which it is clear [-]."""
MIN_VISIBLE_RATIO = 0.2
"""The ratio below which the oscillation is invisible [-]."""


@dataclass(frozen=True)
class PlantLoop:
    """A loop of the plant: its record and its true fault."""

    record: LoopRecord
    """SP, PV, OP and mode."""
    cause: str
    """Cause of the fault: "stiction", "tight tuning", "external disturbance", "sensor" or "none"."""
    state: str
    """Loop state: "in_control", "manual", "saturated" or "pv_frozen"."""
    group: int
    """Number of the group whose oscillation is clear in this loop; 0 when there is none."""
    weak_group: int
    """Number of the group whose oscillation reaches this loop without being clear in it; 0 when there is none."""
    root: str
    """Tag of the loop from which the oscillation of its group starts; empty outside a group."""
    span: tuple[float, float]
    """Range of the transmitter [engineering units]."""
    S: float
    """Deadband plus stickband of the valve [% of span]."""
    J: float
    """Slip jump of the valve [% of span]."""


@dataclass(frozen=True)
class SimulatedPlant:
    """A plant with known faults."""

    loops: tuple[PlantLoop, ...]
    """All loops."""
    connections: tuple[tuple[str, str], ...]
    """Tags (from, to) of the loops that a stream or a common header connects."""

    @property
    def records(self) -> tuple[LoopRecord, ...]:
        """The record of each loop."""
        return tuple(loop.record for loop in self.loops)

    @property
    def spans(self) -> dict[str, tuple[float, float]]:
        """Tag -> range of the transmitter [engineering units]."""
        return {loop.record.tag: loop.span for loop in self.loops}

    @property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Tag of the root -> tags of the loops in which its oscillation is clear, itself included."""
        roots = dict.fromkeys(loop.root for loop in self.loops if loop.group)
        return {
            root: tuple(loop.record.tag for loop in self.loops if loop.root == root and loop.group) for root in roots
        }


def simulate_plant(seed: int = 0, *, hours: float = 6.0, dt: float = 5.0, units: int = 4) -> SimulatedPlant:
    """Simulate a plant in which two oscillations spread from loop to loop.

    `seed`: seed of the plant: loops, sources, paths, loads and noise. `hours`: length of the records [h]. `dt`:
    sampling period [s]; at most 10. `units`: units of 14 loops each; at least 4 [-]. Returns records and faults. A
    sticky valve and a loop with too high a gain are the sources of the two groups. Also, a level loop has too short an
    integral time, a sticky valve disturbs no other loop, a transmitter is frozen, a loop is in manual, and one rests at
    its output limit. Raises ParameterError when a number is outside its limits.

    The PV of a source, delayed and through a first-order lag, is a load of the loops that it reaches; from some of
    these the oscillation goes on to another unit. Two loops of each group are reached only weakly. A loop belongs to a
    group where the oscillation's standard deviation exceeds the noise's, by comparison with a run of the same plant,
    with the same loads and noise, in which no valve sticks and no loop is tuned too tightly.

    Examples
    --------
    >>> plant = simulate_plant(seed=0)
    >>> len(plant.loops), len(plant.groups), plant.loops[0].record.tag
    (56, 2, 'UNIT1/FIC-1009')
    """
    seed = require_seed(seed) or 0
    require_positive("hours", hours, "h")
    if require_positive("dt", dt, "s") > 10.0:
        raise ParameterError(f"dt = {dt:g} s is above 10 s, too slow for the flow loops of the plant; give 10 or less.")
    if require_count("units", units) < 4:
        raise ParameterError(f"units = {units} is below 4; two groups spread over two units each, so give 4 or more.")
    layout, steady = (draw_layout(np.random.default_rng(seed), units=units, steady=s) for s in (False, True))
    records = _run(layout, seed, hours, dt)
    visible = [_fault_to_noise_ratio(*pair) for pair in zip(records, _run(steady, seed, hours, dt), strict=True)]
    group_of = _reachable_groups(layout)
    loops = []
    for k, (loop, record) in enumerate(zip(layout.loops, records, strict=True)):
        group = group_of.get(k, 0)
        clear = visible[k] >= MIN_CLEAR_RATIO
        member = group if clear else 0
        cause = loop.cause if loop.cause != "none" or not member else "external disturbance"
        root = layout.loops[layout.sources[group - 1]].tag if member else ""
        weak = group if MIN_VISIBLE_RATIO <= visible[k] < MIN_CLEAR_RATIO else 0
        loops.append(
            PlantLoop(
                _to_engineering_units(record, loop),
                cause,
                loop.state,
                member,
                weak,
                root,
                span=loop.span,
                S=loop.S,
                J=loop.J,
            )
        )
    tags = [loop.tag for loop in layout.loops]
    return SimulatedPlant(tuple(loops), tuple((tags[path.source], tags[path.target]) for path in layout.paths))


def _run(layout: PlantLayout, seed: int, hours: float, dt: float) -> list[LoopRecord]:
    """Records of all loops in percent."""
    recorded = round(hours * 3600.0 / dt)
    n = recorded + round(SETTLING_SHARE * recorded)
    loads = [_draw_load(np.random.default_rng([seed, 1, k]), loop.drift, n, dt) for k, loop in enumerate(layout.loops)]
    sp = [_draw_sp(np.random.default_rng([seed, 2, k]), loop, n) for k, loop in enumerate(layout.loops)]
    records: dict[int, LoopRecord] = {}
    primary = {b: a for a, b in layout.secondary.items()}
    waiting = list(dict.fromkeys([*layout.sources, *(path.target for path in layout.paths), *range(len(loads))]))
    for k in waiting:
        if k in records:
            continue
        first = primary.get(k, k)
        both = [first, layout.secondary[first]] if first in layout.secondary else [first]
        for path in layout.paths:
            if path.target in both:
                pv = records[path.source].pv
                assert pv is not None
                loads[path.target] = loads[path.target] + path.gain * _delay_and_lag(
                    pv - OPERATING_POINT, path.delay, path.lag, dt
                )
        if len(both) == 2:
            a, b = both
            a_loop, b_loop = layout.loops[a].loop(dt), layout.loops[b].loop(dt)
            pv, op, pv2, op2 = simulate_cascade(a_loop, b_loop, sp[a], loads[a], loads[b], seed + 7919 * a)
            records[a] = _record(layout.loops[a], dt, sp[a], pv, op, secondary=layout.loops[b].tag)
            records[b] = _record(layout.loops[b], dt, op, pv2, op2)
        else:
            records[k] = _run_single(layout.loops[k], dt, sp[k], loads[k], seed + 7919 * k)
    return [records[k].window(n - recorded, n) for k in range(len(loads))]


def _run_single(
    layout: LoopLayout, dt: float, sp: NDArray[np.float64], load: NDArray[np.float64], seed: int
) -> LoopRecord:
    """Run one loop that is not in a cascade."""
    n = sp.size
    if layout.state == "pv_frozen":
        error = 0.02 * layout.noise
        op = np.clip(OPERATING_POINT + layout.Kc * error * (1.0 + np.arange(n) * dt / layout.Ti), 0.0, 100.0)
        return _record(layout, dt, np.full(n, OPERATING_POINT), np.full(n, OPERATING_POINT - error), op)
    if layout.state == "saturated":
        load = load - 75.0
    manual = np.full(n, OPERATING_POINT) if layout.state == "manual" else None
    run = simulate(
        layout.loop(dt), sp, n * dt, load, seed, manual=manual, pv_start=OPERATING_POINT, op_start=OPERATING_POINT
    )
    assert run.pv is not None
    return _record(layout, dt, sp, run.pv, run.op)


def _record(layout: LoopLayout, dt: float, sp, pv, op, *, secondary: str = "") -> LoopRecord:
    origin = Provenance(source="simulation", rows=op.size, secondary_tag=secondary)
    auto = np.full(op.size, layout.state != "manual")
    return LoopRecord(
        layout.tag,
        dt,
        op=op,
        pv=pv,
        sp=sp,
        auto=auto,
        loop_type=layout.loop_type,
        start=RECORD_START,
        provenance=origin,
    )


def _to_engineering_units(record: LoopRecord, layout: LoopLayout) -> LoopRecord:
    """PV and SP in engineering units, with the rounding of a historian."""
    low, high = layout.span
    assert record.pv is not None
    assert record.sp is not None
    scale = (high - low) / 100.0
    pv, sp = (low + scale * np.round(x, 2) for x in (record.pv, record.sp))
    return replace(record, pv=pv, sp=sp, op=np.round(record.op, 2), start=RECORD_START)


def _draw_load(rng: np.random.Generator, deviation: float, n: int, dt: float) -> NDArray[np.float64]:
    """Random load about zero: noise through a lag of 15 minutes."""
    pole = float(np.exp(-dt / 900.0))
    steps = rng.normal(0.0, deviation * np.sqrt(1.0 - pole**2), n)
    return first_order_lag(steps, pole, 1.0)


def _draw_sp(rng: np.random.Generator, layout: LoopLayout, n: int) -> NDArray[np.float64]:
    sp = np.full(n, OPERATING_POINT)
    for _ in range(layout.sp_steps):
        sp[int(rng.integers(n // 4, n)) :] += float(rng.uniform(-2.0, 2.0))
    return sp


def _delay_and_lag(x: NDArray[np.float64], delay: float, lag: float, dt: float) -> NDArray[np.float64]:
    """Delay a signal and pass it through a first-order lag."""
    samples, pole = round(delay / dt), float(np.exp(-dt / lag))
    late = np.concatenate([np.zeros(samples), x[: x.size - samples]])
    return first_order_lag(late, pole)


def _reachable_groups(layout: PlantLayout) -> dict[int, int]:
    """Loop -> number of the group whose source can disturb it, cascades included."""
    partner = layout.secondary | {b: a for a, b in layout.secondary.items()}
    group_of: dict[int, int] = {}
    for number, source in enumerate(layout.sources, start=1):
        reached = {source}
        for path in layout.paths:
            if {path.source, partner.get(path.source)} & reached:
                reached.add(path.target)
        group_of |= dict.fromkeys(reached | {partner[k] for k in reached if k in partner}, number)
    return group_of


def _fault_to_noise_ratio(record: LoopRecord, steady: LoopRecord) -> float:
    """Standard deviation of the effect of the faults over the noise of the steady plant, for the clearest signal.

    The noise is the deviation of the first difference over the root of 2.
    """
    ratios = [0.0]
    for x, calm in ((record.pv, steady.pv), (record.op, steady.op)):
        assert x is not None
        assert calm is not None
        noise = float(np.diff(calm).std()) / np.sqrt(2.0)
        if noise > 0.0:
            ratios.append(float(_remove_drift(x - calm, record.dt).std()) / noise)
    return max(ratios)


def _remove_drift(x: NDArray[np.float64], dt: float, window: float = 1800.0) -> NDArray[np.float64]:
    """Subtract the moving mean over half an hour; the ends without a full window are cut off."""
    width = round(window / dt)
    mean = np.convolve(x, np.full(width, 1.0 / width), "valid")
    return x[width // 2 : width // 2 + mean.size] - mean
