"""Layout of a simulated plant: loops, tuning, faults, and the paths between loops."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from stiction.models import FOPDT, PID, Ideal, Integrating, Kano, Loop

__all__ = ["LoopLayout", "Path", "PlantLayout", "draw_layout"]

LOOP_TYPE_RANGES = {
    "flow": ("FIC", (6.0, 14.0), (2.0, 6.0)),
    "pressure": ("PIC", (20.0, 50.0), (5.0, 12.0)),
    "temperature": ("TIC", (90.0, 240.0), (15.0, 40.0)),
    "level": ("LIC", (0.0, 0.0), (5.0, 10.0)),
}
"""Loop type -> letters of its tag, range of the time constant [s], range of the dead time [s]."""
UNIT_LOOP_TYPES = ("flow", "flow", "flow", "pressure", "pressure", "temperature", "level", "flow", "flow", "flow")
"""Single loops of a unit."""
PRIMARY_LOOP_TYPES = ("temperature", "level")
"""Primary loops of a unit; the secondary of each is a flow loop."""


@dataclass(frozen=True)
class LoopLayout:
    """One loop, with all signals in percent of span."""

    tag: str
    """Tag, with the unit before a slash."""
    loop_type: str
    """Type as in `LoopRecord`."""
    gain: float
    """Process gain [-]; integration rate of a level loop [1/s]."""
    time_constant: float
    """Time constant [s]; 0 for a level loop."""
    dead_time: float
    """Dead time [s]."""
    Kc: float
    """Controller gain [-]."""
    Ti: float
    """Integral time [s]."""
    noise: float
    """Standard deviation of the measurement noise [% of span]."""
    drift: float
    """Standard deviation of the slowly varying load [% of span]."""
    span: tuple[float, float]
    """Range of the transmitter [engineering units]."""
    S: float = 0.0
    """Deadband plus stickband of the valve [% of span]."""
    J: float = 0.0
    """Slip jump of the valve [% of span]."""
    sp_steps: int = 0
    """Set point changes in the record [-]."""
    cause: str = "none"
    """Cause of the fault: "stiction", "tight tuning", "sensor", or "none"."""
    state: str = "in_control"
    """Loop state: "in_control", "manual", "saturated" or "pv_frozen"."""

    def loop(self, dt: float) -> Loop:
        """Controller, valve and process, sampled at `dt` [s]."""
        if self.loop_type == "level":
            process = Integrating(self.gain, self.dead_time)
        else:
            process = FOPDT(self.gain, self.time_constant, self.dead_time)
        valve = Kano(self.S, self.J) if self.S else Ideal()
        return Loop(PID(self.Kc, self.Ti, op_limits=(0.0, 100.0)), valve, process, dt, noise=self.noise)


@dataclass(frozen=True)
class Path:
    """A stream or a common header through which the PV of one loop disturbs another."""

    source: int
    """Index of the loop that disturbs."""
    target: int
    """Index of the loop that is disturbed."""
    gain: float
    """Load at the target over the deviation of the source's PV, both in % of span [-]."""
    delay: float
    """Transport delay [s]."""
    lag: float
    """Time constant of the mixing on the way [s]."""


@dataclass(frozen=True)
class PlantLayout:
    """Loops, cascades and paths of a plant."""

    loops: tuple[LoopLayout, ...]
    """All loops."""
    secondary: dict[int, int]
    """Index of a primary loop -> index of its secondary loop."""
    paths: tuple[Path, ...]
    """Paths, ordered so that the paths to a loop come before the paths from it."""
    sources: tuple[int, ...]
    """Index of the loop from which each group's oscillation starts."""


def draw_layout(rng: np.random.Generator, *, units: int = 4, steady: bool = False) -> PlantLayout:
    """Draw the loops of a plant, two sources of oscillation, and the paths on which these spread.

    `rng`: source of random numbers. `units`: units, 14 loops each [-]. `steady`: draw the same plant with ideal valves
    and with a stable gain of the second source. Returns the plant: a sticky valve and a loop with too high a gain whose
    oscillations spread, a level loop with too short an integral time, a sticky valve that disturbs no other loop, a
    frozen transmitter, a loop in manual, and one at its output limit.

    Examples
    --------
    >>> layout = draw_layout(np.random.default_rng(0))
    >>> len(layout.loops), [layout.loops[k].cause for k in layout.sources]
    (56, ['stiction', 'tight tuning'])
    """
    loops: list[LoopLayout] = []
    secondary: dict[int, int] = {}
    for unit in range(1, units + 1):
        for loop_type in (*UNIT_LOOP_TYPES, *PRIMARY_LOOP_TYPES):
            loops.append(_draw_loop(rng, loop_type, unit, len(loops)))
        first_primary = len(loops) - len(PRIMARY_LOOP_TYPES)
        for k, _ in enumerate(PRIMARY_LOOP_TYPES):
            secondary[first_primary + k] = len(loops)
            loops.append(_draw_loop(rng, "flow", unit, len(loops)))
            loops[first_primary + k] = _tune_primary(loops[first_primary + k], loops[-1])
    size = len(loops) // units
    first, second = (int(k) for k in rng.permutation(units)[:2])
    sticky = first * size + int(rng.choice([0, 1, 2, 3, 12, 13]))
    tight = second * size + int(rng.choice([3, 4, 5]))
    used = {sticky, tight, *_cascade_partners(secondary, sticky), *_cascade_partners(secondary, tight)}
    paths: list[Path] = []
    for source, unit, is_sticky in ((sticky, first, True), (tight, second, False)):
        near = [k for k in range(unit * size, (unit + 1) * size) if k not in used]
        other = ({first, second} ^ {unit}).pop()
        further = next(u for u in ((unit + 1) % units, (unit + 2) % units) if u != other)
        far = [k for k in range(further * size, (further + 1) * size) if k not in used]
        paths += _draw_paths(rng, source, near, far, is_sticky)
        used |= {path.target for path in paths}
        used |= {partner for path in paths for partner in _cascade_partners(secondary, path.target)}
    free = [k for k in range(len(loops)) if k not in used and not _cascade_partners(secondary, k)]
    _set_faults(rng, loops, free, sticky, tight)
    if steady:
        loops = [
            replace(loop, S=0.0, J=0.0, Kc=0.25 * loop.Kc if k == tight else loop.Kc) for k, loop in enumerate(loops)
        ]
    return PlantLayout(tuple(loops), secondary, tuple(paths), (sticky, tight))


def _draw_loop(rng: np.random.Generator, loop_type: str, unit: int, number: int) -> LoopLayout:
    letters, time_constants, dead_times = LOOP_TYPE_RANGES[loop_type]
    tau, dead = float(rng.uniform(*time_constants)), float(rng.uniform(*dead_times))
    noise, drift = float(rng.uniform(0.1, 0.4)), float(rng.uniform(0.5, 2.0))
    if loop_type == "level":
        gain = float(rng.uniform(0.002, 0.006))
        closed = float(rng.uniform(60.0, 150.0))
        Kc, Ti = 1.0 / (gain * (closed + dead)), 4.0 * (closed + dead)
    else:
        gain = float(rng.uniform(0.7, 1.4))
        closed = float(rng.uniform(1.0, 2.0)) * max(tau, dead)
        Kc, Ti = tau / (gain * (closed + dead)), tau
    low = float(rng.choice([0.0, 0.0, 20.0, 100.0]))
    span = (low, low + float(rng.choice([10.0, 50.0, 100.0, 250.0])))
    tag = f"UNIT{unit}/{letters}-{unit}{number % 100:02d}{int(rng.integers(1, 10))}"
    steps = int(rng.integers(1, 4)) if rng.random() < 0.3 else 0
    return LoopLayout(
        tag, loop_type, gain, tau, dead, Kc=Kc, Ti=Ti, noise=noise, drift=drift, span=span, sp_steps=steps
    )


def _tune_primary(primary: LoopLayout, secondary: LoopLayout) -> LoopLayout:
    """Allow for the lag of the secondary loop in the tuning of its primary."""
    lag = secondary.Ti / (secondary.Kc * secondary.gain) + secondary.dead_time
    if primary.loop_type == "level":
        closed = 100.0 + primary.dead_time + lag
        return replace(primary, Kc=1.0 / (primary.gain * closed), Ti=4.0 * closed)
    closed = primary.time_constant + primary.dead_time + lag
    return replace(primary, Kc=primary.time_constant / (primary.gain * closed), Ti=primary.time_constant)


def _cascade_partners(secondary: dict[int, int], k: int) -> list[int]:
    """The other loop of a cascade, if there is one."""
    return [b if a == k else a for a, b in secondary.items() if k in (a, b)]


def _draw_paths(rng: np.random.Generator, source: int, near: list[int], far: list[int], sticky: bool) -> list[Path]:
    """Paths from a source to loops of its unit, and from there to some of another unit; the last two are weak."""
    n_near, n_far = int(rng.integers(4, 7)), int(rng.integers(2, 5))
    targets = [int(k) for k in rng.choice(near, n_near, replace=False)]
    remote = [int(k) for k in rng.choice(far, n_far, replace=False)]
    starts = [source] * n_near + [int(rng.choice([source, *targets[:2]])) for _ in remote]
    ends = targets + remote
    paths = []
    for k, (start, end) in enumerate(zip(starts, ends, strict=True)):
        weak = k in (n_near - 1, len(ends) - 1)
        gain = float(rng.uniform(0.03, 0.08) if weak else np.exp(rng.uniform(np.log(0.3), np.log(2.5))))
        gain *= float(rng.choice([-1.0, 1.0])) * (3.0 if start == source and not sticky else 1.0)
        paths.append(Path(start, end, gain, float(rng.uniform(5.0, 25.0)), float(rng.uniform(5.0, 25.0))))
    return paths


def _set_faults(rng: np.random.Generator, loops: list[LoopLayout], free: list[int], sticky: int, tight: int) -> None:
    """Give the sources and five of the free loops their faults."""

    def take(*types: str) -> int:
        k = int(rng.choice([k for k in free if loops[k].loop_type in types]))
        free.remove(k)
        return k

    for k in (sticky, take("flow", "pressure")):
        S = float(rng.uniform(4.0, 8.0))
        loops[k] = replace(loops[k], S=S, J=S * float(rng.uniform(0.6, 1.0)), cause="stiction", sp_steps=0)
    tau, dead = float(rng.uniform(40.0, 100.0)), float(rng.uniform(15.0, 35.0))
    tightened = replace(loops[tight], time_constant=tau, dead_time=dead, Ti=tau, cause="tight tuning", sp_steps=0)
    loops[tight] = replace(tightened, Kc=float(rng.uniform(0.94, 0.98)) * _ultimate_gain(tightened))
    level = take("level")
    loops[level] = replace(loops[level], Ti=loops[level].Ti / 40.0, cause="tight tuning")
    for cause, state in (("sensor", "pv_frozen"), ("none", "manual"), ("none", "saturated")):
        k = take("flow", "pressure", "temperature")
        loops[k] = replace(loops[k], cause=cause, state=state)


def _ultimate_gain(loop: LoopLayout, dt: float = 5.0) -> float:
    """Controller gain at which the loop with its integral time just oscillates, the sampling counted as a delay."""
    low, high = 1e-4, math.pi / dt
    for _ in range(60):
        w = math.sqrt(low * high)
        phase = -math.atan(w * loop.time_constant) - w * (loop.dead_time + 0.5 * dt) - math.atan(1.0 / (w * loop.Ti))
        low, high = (w, high) if phase > -math.pi else (low, w)
    return math.hypot(1.0, low * loop.time_constant) / (loop.gain * math.hypot(1.0, 1.0 / (low * loop.Ti)))
