"""Basins of attraction: the limit cycle in which each start, load or pulse ends."""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from stiction.display.json_form import Result, json_as
from stiction.errors import ParameterError, require_count, require_kind, require_numbers, require_positive
from stiction.limitcycle.exact.event_simulation import (
    DIVERGED,
    SETTLED,
    STOPPED,
    TERMS,
    RunLimits,
    RunSpace,
    simulate_events,
)
from stiction.limitcycle.exact.packed_loop import PackedLoop, pack_loop
from stiction.limitcycle.result import LimitCycle
from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from stiction.models import Loop

__all__ = ["Attractor", "BasinMap", "basin_map", "smallest_pulse"]

AT_REST = -1
"""Label of a start that ends at rest."""
UNSETTLED = -2
"""Label of a start that did not settle in time."""
RUNAWAY = -3
"""Label of a start whose OP grows without limit."""
_STARTS_PER_BLOCK = 32
"""Starts in one block of a thread [-]."""


@dataclass(frozen=True)
class Attractor:
    """A limit cycle, or family of cycles, in which a share of the starts ends."""

    label: int
    """Number in the map."""
    name: str
    """Number of levels of a staircase, or period and amplitude."""
    share: float
    """Share of the starts [-]."""
    period: tuple[float, float] = field(metadata=json_as("period_s"))
    """Shortest and longest period in it [s]; a family of cycles has a range."""
    amplitude: tuple[float, float]
    """Smallest and largest OP amplitude in it [% of span]."""


@dataclass(frozen=True)
class BasinMap(Result):
    """Limit cycle in which each start ends."""

    label: NDArray[np.int64]
    """Attractor of each start; -1 comes to rest, -2 did not settle in time, -3 runs away. Shape of the starts."""
    period: NDArray[np.float64] = field(metadata=json_as("period_s"))
    """Period reached [s], NaN where there is none."""
    amplitude: NDArray[np.float64]
    """OP amplitude reached [% of span], NaN where there is none."""
    level: NDArray[np.float64]
    """Highest rest level reached [% of span], NaN where there is none."""
    attractors: tuple[Attractor, ...]
    """The attractors, by amplitude."""

    def summary(self) -> str:
        """One line per attractor."""
        lines = [f"{self.label.size} starts end in {len(self.attractors)} attractors:"]
        lines += [f"  {a.label}: {a.name}, {100.0 * a.share:.1f} %" for a in self.attractors]
        for code, words in ((AT_REST, "come to rest"), (UNSETTLED, "did not settle"), (RUNAWAY, "run away")):
            share = float(np.mean(self.label == code))
            if share:
                lines.append(f"  {100.0 * share:.1f} % {words}")
        return "\n".join(lines)


class _Starts(NamedTuple):
    """Starts of a map, one row each."""

    z: NDArray[np.float64]
    """States, scaled, shape (n, n_states)."""
    x: NDArray[np.float64]
    """Stem positions [% of span], shape (n,)."""
    times: NDArray[np.float64]
    """Times at which the load changes [units of the loop], shape (n, 3)."""
    heights: NDArray[np.float64]
    """Loads from these times on [% of span], shape (n, 3)."""


@kernel
def _run_block(loop, starts, limits, size, out):
    """Run a block of starts; rows of `out`: status, period, OP amplitude, top level, slips in a turn, turns."""
    z, x, times, loads = starts
    n = z.shape[1]
    turns, states = np.empty((limits.turns + 1, 9)), np.empty((limits.turns + 1, n))
    none2, none = np.empty((0, 2)), np.empty(0)
    space = RunSpace(np.empty(size), np.empty((size, TERMS)), turns, states, none2, none, none, none, none)
    for i in range(z.shape[0]):
        status, k, _, _, period = simulate_events(loop, times[i], loads[i], z[i], x[i], 1.0, limits, space)
        out[i, 0], out[i, 5] = status, period
        if period > 0:
            high, low, top, slips = -math.inf, math.inf, -math.inf, 0.0
            for j in range(k - period, k):
                high, low = max(high, turns[j, 2]), min(low, turns[j, 3])
                top, slips = max(top, turns[j, 1]), slips + turns[j, 7]
            out[i, 1] = turns[k - 1, 0] - turns[k - 1 - period, 0]
            out[i, 2], out[i, 3], out[i, 4] = (high - low) / 2.0, top, slips


def basin_map(
    loop: Loop,
    *,
    op_start: ArrayLike = 0.0,
    pv_start: ArrayLike = 0.0,
    mv_start: ArrayLike = 0.0,
    disturbance: ArrayLike = 0.0,
    pulse: ArrayLike = 0.0,
    pulse_length: ArrayLike = 0.0,
    after: LimitCycle | None = None,
    phase: ArrayLike = 0.0,
    most_turns: int = 300,
    tolerance: float = 1e-5,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> BasinMap:
    """Find the limit cycle in which every start of a loop ends, in continuous time.

    The starts are broadcast against each other: a map is ``op_start[:, None]`` against ``pv_start[None, :]``, a
    Monte Carlo study a set of random arrays of one shape.

    Parameters
    ----------
    loop : Loop
        The loop.
    op_start, pv_start, mv_start : array_like
        Start: OP [% of span], PV [PV units] at rest, and stem position [% of span], as deviations from the point
        of rest. The input of the valve is held for one dead time.
    disturbance : array_like
        Permanent step of the load at time 0 [% of span].
    pulse, pulse_length : array_like
        Height [% of span] and length [s] of a load pulse that begins at time 0.
    after : LimitCycle, optional
        Start in this exact cycle instead of at `op_start`, `pv_start`, `mv_start`.
    phase : array_like
        Position in that cycle, as a share of its period from the rest at the top [-].
    most_turns : int
        Oscillations after which a start counts as not settled [-].
    tolerance : float
        Relative change between oscillations below which the motion has settled [-].
    threads : int, optional
        Threads that share the starts [-]; by default one per core.
    progress : callable, optional
        Called with (starts done, starts in all) after every block.

    Returns
    -------
    BasinMap
        Label, period, amplitude and top level per start, in the shape of the starts.

    Raises
    ------
    ParameterError
        When the loop has no continuous-time form, a start is not finite or its shape does not match the others,
        `most_turns` or `threads` is no whole number above 0, `tolerance` is not positive, or `after` is not an exact
        cycle.

    Notes
    -----
    The attractors of a staircase valve are named by their number of levels: each is a family of cycles over the
    conserved offset of the lattice, so that period and amplitude vary a little within one label.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> from stiction.limitcycle import basin_map
    >>> loop = st.Loop(st.PID.parallel(0.5, 1.0, 0.1), st.Stenman(0.5), st.TransferFunction([1], [5, 6, 1]), dt=0.01)
    >>> [a.name for a in basin_map(loop, op_start=np.array([0.3, 1.5]), mv_start=0.25).attractors]
    ['2 levels', '5 levels']
    """
    m = pack_loop(loop)
    most_turns, tolerance = require_count("most_turns", most_turns), require_positive("tolerance", tolerance)
    threads = (os.cpu_count() or 1) if threads is None else require_count("threads", threads)
    arguments = {
        "op_start": op_start, "pv_start": pv_start, "mv_start": mv_start, "disturbance": disturbance, "pulse": pulse,
        "pulse_length": pulse_length, "phase": phase,
    }  # fmt: skip
    starts = {name: require_numbers(name, value) for name, value in arguments.items()}
    try:
        op, pv, mv, step, height, length, at = np.broadcast_arrays(*starts.values())
    except ValueError:
        shapes = ", ".join(f"{name} {value.shape}" for name, value in starts.items() if value.ndim)
        raise ParameterError(f"The starts have shapes that do not match ({shapes}); give equal shapes.") from None
    shape = op.shape
    if np.any(length < 0.0):
        raise ParameterError("pulse_length has a negative value; give 0 s or more.")
    n = op.size
    if after is None:
        z = _start_states(m, op.ravel(), pv.ravel(), mv.ravel())
        x, wait = mv.ravel().copy(), np.zeros(n)
    else:
        if not getattr(after, "section", ()) or len(after.section) != m.linear.order + 1:
            raise ParameterError("after is not an exact cycle of this loop; take one from exact_limit_cycles(loop).")
        z = np.tile(after.section[:-1], (n, 1))
        x, wait = np.full(n, after.section[-1]), at.ravel() % 1.0 * after.period
    times = np.column_stack([np.zeros(n), wait, wait + length.ravel()]) / m.unit
    heights = np.column_stack([np.zeros(n), (height + step).ravel(), step.ravel()])
    if after is None:
        heights[:, 0] = heights[:, 1]
    out = np.full((n, 6), np.nan)
    starts = _Starts(np.ascontiguousarray(z / m.scale), x, times, heights)
    _run_in_threads(m, starts, RunLimits(most_turns, 400_000, tolerance), out, threads, progress)
    return _label_starts(m, out, shape)


def _run_in_threads(
    m: PackedLoop, starts: _Starts, limits: RunLimits, out: NDArray[np.float64], threads: int, progress
) -> None:
    """Run blocks of starts in threads, and write the results to `out`."""
    n, run_block = starts.x.shape[0], cast("Any", _run_block)

    def work(first: int) -> int:
        cut = slice(first, min(first + _STARTS_PER_BLOCK, n))
        run_block(m.packed, _Starts(*(start[cut] for start in starts)), limits, m.memory, out[cut])
        return cut.stop - cut.start

    done = 0
    with ThreadPoolExecutor(threads) as pool:
        for count in pool.map(work, range(0, n, _STARTS_PER_BLOCK)):
            done += count
            if progress is not None:
                progress(done, n)


def _start_states(m: PackedLoop, op, pv, mv) -> NDArray[np.float64]:
    """States with the process at rest at `pv`, the controller at `op` and the stem at `mv`, shape (n, n_states)."""
    linear = m.linear
    n = linear.order
    rows = np.zeros((n + 2, n + 1))
    process = np.nonzero(linear.C_pv)[0]
    last = int(process[-1]) + 1 if process.size else 0
    rows[:last, :n], rows[:last, n] = linear.A[:last], linear.B[:last]
    rows[n, :n], rows[n, n] = linear.C_pv, linear.D_pv
    rows[n + 1, :n] = linear.C
    known = np.zeros((n + 2, op.size))
    known[n] = pv
    known[n + 1] = op - linear.D * mv
    return np.asarray(np.linalg.lstsq(rows, known, rcond=1e-12)[0][:n].T, dtype=np.float64)


def _label_starts(m: PackedLoop, out: NDArray[np.float64], shape: tuple[int, ...]) -> BasinMap:
    """Group the final motions of all starts into attractors."""
    status, period, amplitude, top, slips, turns = out.T
    period = period * m.unit / np.maximum(turns, 1.0)
    label = np.full(status.size, AT_REST)
    label[status == STOPPED] = UNSETTLED
    label[status == DIVERGED] = RUNAWAY
    settled = np.nonzero(status == SETTLED)[0]
    groups: list[list[int]] = []
    for i in settled[np.argsort(amplitude[settled], kind="stable")]:
        for group in groups:
            j = group[0]
            if m.valve.staircase:
                same = slips[i] / turns[i] == slips[j] / turns[j]
            else:
                same = abs(period[i] / period[j] - 1.0) < 1e-2 and abs(amplitude[i] / amplitude[j] - 1.0) < 1e-2
            if same:
                group.append(int(i))
                break
        else:
            groups.append([int(i)])
    attractors = []
    for k, group in enumerate(groups):
        label[group] = k
        j = group[0]
        levels = slips[j] / turns[j] / 2.0 + 1.0
        name = f"{levels:g} levels" if m.valve.staircase else f"{period[j]:.4g} s, OP amplitude {amplitude[j]:.4g} %"
        attractors.append(
            Attractor(
                k, name, len(group) / status.size, (float(period[group].min()), float(period[group].max())),
                (float(amplitude[group].min()), float(amplitude[group].max())),
            )
        )  # fmt: skip
    gone = label < 0
    for values in (period, amplitude, top):
        values[gone] = np.nan
    return BasinMap(
        label.reshape(shape), period.reshape(shape), amplitude.reshape(shape), (top + m.linear.rest).reshape(shape),
        tuple(attractors),
    )  # fmt: skip


def smallest_pulse(
    loop: Loop, start: LimitCycle, end: LimitCycle, length: float, *, largest: float | None = None, phases: int = 16,
    sizes: int = 100,
) -> tuple[float, float] | None:  # fmt: skip
    """Find the smallest load pulse that moves a loop from one limit cycle to another.

    Parameters
    ----------
    loop : Loop
        The loop.
    start, end : LimitCycle
        Exact cycles of the loop, both stable.
    length : float
        Length of the pulse [s].
    largest : float, optional
        Largest pulse tried [% of span]; by default five times the amplitude of the larger cycle.
    phases, sizes : int
        Points of the cycle at which the pulse begins, and sizes tried before the smallest is refined.

    Returns
    -------
    (float, float) or None
        Size of the pulse [% of span], negative downwards, and the share of the period from the rest at the top at
        which it begins [-]; None when no pulse up to `largest` is enough.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.limitcycle import exact_limit_cycles, smallest_pulse
    >>> loop = st.Loop(st.PID.parallel(0.5, 1.0, 0.1), st.Stenman(0.5), st.TransferFunction([1], [5, 6, 1]), dt=0.01)
    >>> small, large = exact_limit_cycles(loop, families=["half"])
    >>> abs(smallest_pulse(loop, small, large, 5.0, phases=4, sizes=10)[0]) < 0.5
    True
    """
    for name, cycle in (("start", start), ("end", end)):
        require_kind(name, cycle, LimitCycle, "a cycle of exact_limit_cycles(loop)")
    limit = 5.0 * max(start.amplitude, end.amplitude) if largest is None else require_positive("largest", largest)
    phases, sizes = require_count("phases", phases), require_count("sizes", sizes)
    size = np.linspace(limit / sizes, limit, sizes)
    phase = np.arange(phases) / phases
    grid = np.concatenate([size, -size])[:, None], phase[None, :]

    def reaches(pulse, at):
        basins = basin_map(loop, after=start, pulse=pulse, pulse_length=length, phase=at)
        return (np.abs(basins.period * end.turns / end.period - 1.0) < 1e-3) & (
            np.abs(basins.amplitude / end.amplitude - 1.0) < 1e-3
        )

    hit = reaches(*grid)
    if not hit.any():
        return None
    order = np.where(hit, np.abs(grid[0]), np.inf)
    i, j = np.unravel_index(int(np.argmin(order)), order.shape)
    good, at = float(grid[0][i, 0]), float(phase[j])
    bad = good - math.copysign(limit / sizes, good)
    for _ in range(20):
        middle = 0.5 * (good + bad)
        if bool(reaches(middle, at).all()):
            good = middle
        else:
            bad = middle
    return good, at
