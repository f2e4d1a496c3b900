"""Valves tried: any (sb, sj, r) before every process candidate, by simulation error over all stretches at once.

The record is cut into stretches, and the stem is started anew in each: what a slightly wrong valve does to the
stairs of a noisy OP is then forgotten after some periods. Gain, lags and dead time of the process and the valve are
those of the whole record; products and squares are summed over the stretches before the gain is solved for.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.processes import Processes, answer
from stiction.diagnosis.identification.search import lag_pair, remove_local_mean, shares
from stiction.models.compiled import kernel
from stiction.models.component import TIE, ValveState
from stiction.models.valves.srinivasan import srinivasan_step

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Stretches", "Trials", "answer_of", "stem_of", "try_valves"]


class Stretches(NamedTuple):
    """The signals compared: stretches one behind the other."""

    op: NDArray[np.float64]
    """Controller output [% of span], shape (n_samples * width,)."""
    target: NDArray[np.float64]
    """PV or stem about its local mean [its unit], shape (n_samples,)."""
    width: int
    """Samples of OP for each one of the target [-]."""
    half: int
    """Half width of the local mean [samples]; 0 for the mean of the stretch."""
    dt: float
    """Sampling period of OP [s]."""
    scale: float
    """Period of the oscillation, or another time scale of the record [samples of the target]."""
    bounds: NDArray[np.int64]
    """Where each stretch begins, and where the last one ends [samples of the target], shape (n_stretches + 1,)."""
    windows: NDArray[np.int64]
    """First sample compared in each stretch and one past the last, from its beginning, shape (n_stretches, 2)."""
    start: NDArray[np.float64]
    """How the stem begins in each stretch, shape (n_stretches, 3): the sample of OP at which it is known, the
    direction in which it moves there (then it is sb - sj behind OP), and how much further behind it is [% of span]."""
    by_stem: bool
    """Whether the target is the stem itself, so that there is no process."""
    sign: float
    """Sign that the process gain must have [-]; 0 for any."""
    first: NDArray[np.int64]
    """Where each stretch begins in the record [samples of the target], shape (n_stretches,)."""

    def alone(self, i: int) -> Stretches:
        """Stretch `i` by itself."""
        a, b = int(self.bounds[i]), int(self.bounds[i + 1])
        return self._replace(
            op=self.op[a * self.width : b * self.width],
            target=self.target[a:b],
            bounds=np.array([0, b - a]),
            windows=self.windows[i : i + 1],
            start=self.start[i : i + 1],
            first=self.first[i : i + 1],
        )

    @property
    def energy(self) -> float:
        """Sum of squares of what is compared."""
        parts = zip(self.bounds[:-1], self.windows, strict=True)
        return float(sum(np.sum(self.target[a + w[0] : a + w[1]] ** 2) for a, w in parts))


class Trials(NamedTuple):
    """What was tried and what each valve left."""

    valves: NDArray[np.float64]
    """sb, sj [% of span] and r [% of span / s], shape (n_valves, 3)."""
    error: NDArray[np.float64]
    """Share of the target's energy that the best process leaves [-], shape (n_valves,)."""
    process: NDArray[np.float64]
    """Its gain, first and second lag and dead time, times in samples, shape (n_valves, 4)."""

    def best(self) -> int:
        """Index of the valve that leaves least."""
        return int(np.argmin(self.error))


@kernel
def _stroke(op, sb, behind, slow, start, mv):
    """Drive the valve over `op` (n,) from the sample of `start` (3,) on; before, the stem rests where it is then.

    `behind` is sb - sj, how far behind OP a stem is that moves.
    """
    index, way = int(start[0]), start[1]
    position = op[index] - way * behind - start[2]
    s = ValveState(position, op[index], op[index], way, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for k in range(index + 1):
        mv[k] = position
    for k in range(index + 1, op.shape[0]):
        s = srinivasan_step(op[k], s, sb, behind, slow)
        mv[k] = s.position


@kernel
def _try(op, target, width, half, bounds, windows, start, valves, first, second, delays, sign, energy, found, work):
    """Fill `found` (n_valves, 5): error, gain, lag pair, whole and fractional dead time of the best process.

    `valves` (n_valves, 3) holds sb, sb - sj and the slowest move followed; `start` (n_valves, n_stretches, 3) may
    differ from valve to valve. `first`, `second` (n_lags,) are decays per sample. `work` holds signals
    (6, n_samples * width + 1) and sums (3, n_lags * n_delays) to work in.
    """
    stems, sums = work
    n_lags, n_delays = first.shape[0], delays.shape[0]
    for v in range(valves.shape[0]):
        sb, behind, slow = valves[v, 0], valves[v, 1], valves[v, 2]
        sums[:] = 0.0
        for i in range(windows.shape[0]):
            a, b = bounds[i], bounds[i + 1]
            n = b - a
            u = op[a * width : b * width]
            whole, mv, y, z = stems[0, : n * width], stems[1, :n], stems[2, :n], stems[3, :n]
            power, mixed = stems[4, : n + 1], stems[5, : n + 1]
            _stroke(u, sb, behind, slow, start[v, i], whole)
            centre = 0.0
            for k in range(n):
                total = 0.0
                for j in range(k * width, (k + 1) * width):
                    total += whole[j]
                mv[k] = total / width
                centre += mv[k]
            centre /= n
            begin, end = windows[i, 0], windows[i, 1]
            for q in range(n_lags):
                lag_pair(mv, centre, first[q], second[q], y)
                remove_local_mean(y, half, z)
                power[0] = power[1] = mixed[0] = mixed[1] = 0.0
                power[1] = z[0] * z[0]
                for k in range(1, n):
                    power[k + 1] = power[k] + z[k] * z[k]
                    mixed[k + 1] = mixed[k] + z[k] * z[k - 1]
                for d in range(n_delays):
                    shift = 1 + delays[d]
                    even = odd = 0.0
                    k = begin
                    while k + 1 < end:
                        even += target[a + k] * z[k - shift]
                        odd += target[a + k + 1] * z[k + 1 - shift]
                        k += 2
                    if k < end:
                        even += target[a + k] * z[k - shift]
                    at = q * n_delays + d
                    sums[0, at] += even + odd
                    sums[1, at] += power[end - shift] - power[begin - shift]
                    sums[2, at] += mixed[end - shift] - mixed[begin - shift]
        _choose(sums, delays, n_lags, sign, energy, 1e-12 * sb**2 * target.shape[0], found[v])


@kernel
def _choose(sums, delays, n_lags, sign, energy, least, found):
    """Best process from the products and squares; between neighbouring dead times the best fraction in closed form."""
    n_delays = delays.shape[0]
    found[0], found[1], found[2], found[3], found[4] = energy, 0.0, -1.0, 0.0, 0.0
    for at in range(n_lags * n_delays):
        d = at % n_delays
        c, power = sums[0, at], sums[1, at]
        if power <= least:
            continue
        if c * sign >= 0.0 and energy - c * c / power < found[0]:
            found[0], found[1], found[2], found[3], found[4] = (
                energy - c * c / power, c / power, at // n_delays, delays[d], 0.0,
            )  # fmt: skip
        if d + 1 == n_delays or delays[d + 1] != delays[d] + 1:
            continue
        next_c, next_power, mixed = sums[0, at + 1], sums[1, at + 1], sums[2, at]
        w0, w1 = shares(c, next_c, power, next_power, mixed, sign)
        left = energy - w0 * c - w1 * next_c
        if left < found[0]:
            found[0], found[1], found[2], found[3], found[4] = (
                left, w0 + w1, at // n_delays, delays[d], w1 / (w0 + w1),
            )  # fmt: skip


def try_valves(
    signals: Stretches,
    valves: NDArray[np.float64],
    processes: Processes,
    start: NDArray[np.float64] | None = None,
) -> Trials:
    """Try every valve with every process candidate, on two threads.

    Parameters
    ----------
    signals : Stretches
        What to compare.
    valves : ndarray, shape (n_valves, 3)
        sb, sj [% of span] and r [% of span / s].
    processes : Processes
        The process candidates.
    start : ndarray, shape (n_valves, n_stretches, 3), optional
        How the stem begins, for each valve; that of `signals` by default.

    Returns
    -------
    Trials
        What each valve leaves with its best process.
    """
    first, second = processes.decays()
    packed = _packed(valves, signals.dt)
    if start is None:
        start = np.repeat(signals.start[np.newaxis], valves.shape[0], axis=0)
    begins = start
    found = np.empty((valves.shape[0], 5))
    longest = int(np.diff(signals.bounds).max())
    energy = signals.energy

    def part(rows: slice) -> None:
        work = (np.empty((6, longest * signals.width + 1)), np.empty((3, first.size * processes.delays.size)))
        _try(
            signals.op, signals.target, signals.width, signals.half, signals.bounds, signals.windows, begins[rows],
            packed[rows], first, second, processes.delays, signals.sign, energy, found[rows], work,
        )  # fmt: skip

    middle = valves.shape[0] // 2
    if valves.shape[0] * signals.target.size * first.size > 2e5:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(part, (slice(0, middle), slice(middle, None))))
    else:
        part(slice(None))
    pair = found[:, 2].astype(int)
    process = np.stack([found[:, 1], processes.first[pair], processes.second[pair], found[:, 3] + found[:, 4]], axis=1)
    return Trials(valves, found[:, 0] / energy if energy > 0.0 else np.ones(valves.shape[0]), process)


def stem_of(signals: Stretches, valve: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stem of a valve over all stretches.

    Parameters
    ----------
    signals : Stretches
        The stretches.
    valve : ndarray, shape (3,)
        sb, sj [% of span] and r [% of span / s].

    Returns
    -------
    ndarray, shape (n_samples * width,)
        Stem position [% of span].
    """
    (sb, behind, slow), stem = _packed(valve[np.newaxis], signals.dt)[0], np.empty(signals.op.size)
    for (a, b), start in zip(_cuts(signals), signals.start, strict=True):
        part = slice(a * signals.width, b * signals.width)
        _stroke(signals.op[part], sb, behind, slow, start, stem[part])
    return stem


def answer_of(signals: Stretches, stem: NDArray[np.float64], process: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a process makes of a stem, about its local mean.

    Parameters
    ----------
    signals : Stretches
        The stretches.
    stem : ndarray, shape (n_samples * width,)
        Stem position [% of span].
    process : ndarray, shape (4,)
        Gain, first and second lag and dead time, times in samples.

    Returns
    -------
    ndarray, shape (n_samples,)
        Comparable with the target [its unit].
    """
    gain, first, second, delay = process
    out = np.zeros(signals.target.size)
    for a, b in _cuts(signals):
        mv = stem[a * signals.width : b * signals.width].reshape(b - a, signals.width).mean(axis=1)
        remove_local_mean(answer(mv, first, second, delay), signals.half, out[a:b])
    return gain * out


def _packed(valves: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    """Parameters as the step takes them: sb, sb - sj, r dt [% of span], sb widened and r dt narrowed by a tie."""
    sb, sj, r = valves.T
    return np.stack([sb * (1.0 + TIE), sb - sj, r * dt * (1.0 - TIE)], axis=1)


def _cuts(signals: Stretches) -> list[tuple[int, int]]:
    return list(zip(signals.bounds[:-1].tolist(), signals.bounds[1:].tolist(), strict=True))
