"""Valve and process fitted together by simulation from the recorded OP: S, J, two lags and dead time.

The identification predicts each PV sample from the ones before, which leaves J and the process gain uncertain where a
slip is short. A remedy is simulated over many cycles, so the twin is fitted by simulation,

    min over (S, J/S, tau1, tau2, dead_time) of |t - K y|^2 / |t|^2,   K by least squares,

t the PV and y the response of the process to the stem, both about their moving average over one period.
"""

from __future__ import annotations

from itertools import pairwise, product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.compensation.locked import locked_to
from stiction.diagnosis.identification.process_fit import fit_process
from stiction.diagnosis.oscillation import about_drift
from stiction.errors import RecordError
from stiction.models import FOPDT, SOPDT, Integrating, Kano
from stiction.records.gaps import forward_fill
from stiction.simulation.drivers import stroke_one

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis import Identification
    from stiction.models import TransferFunction
    from stiction.records.record import LoopRecord

__all__ = ["RefinedModel", "refine_model"]

MAX_EVALUATIONS, MAX_SAMPLES = 300, 4000
"""Simulations of each search, and samples to which a long record is cut (six periods at least)."""
JUMP_RATIOS = (0.1, 0.4, 0.7, 1.0)
"""Values of J / S from which the search starts, beside the one identified [-]."""
SEARCHED_VALVES = (
    *product((1.0, 1.002, 1.006), np.linspace(0.02, 1.0, 50)),
    *product((0.88, 0.91, 0.94, 0.97, 0.985, 1.015, 1.03, 1.06, 1.09, 1.12), np.linspace(0.05, 1.0, 11)),
)
"""Valves tried before the last search: S over that of the best one, and J / S [-]."""
MAX_SEARCHES = 2
"""Starts that are searched, those with the smallest error [-]."""
SLOW = 4.0
"""Periods over which the PV is averaged before what is left of it counts as moved from outside [-]."""
RESTART_PERIODS = (1, 6, 1_000_000)
"""Periods after which the simulation of the stem starts again [-]: with one period a wrong slip cannot last, but a
stem that rests before OP turns starts from a wrong position; so runs of six periods and one run are tried too."""
STEPS = np.array([0.01, 0.1, 0.2, 0.3, 0.5])
"""First steps in ln S, J / S, ln tau1, tau2 / tau1 and dead time in samples [-]."""


class RefinedModel(NamedTuple):
    """A valve and a process that turn the recorded OP into the recorded PV."""

    S: float
    """Deadband plus stickband [% of span]."""
    J: float
    """Slip jump [% of span]."""
    process: TransferFunction
    """The process."""
    error: float
    """Share of the PV's energy about its moving average that is left [-]."""
    error_found: float
    """The same at the point identified [-]."""
    mv: NDArray[np.float64]
    """Stem position [% of span], shape (n_searched,); a long record is searched in its first part only."""
    left: NDArray[np.float64]
    """Recorded PV minus the simulated one, about its average over `SLOW` periods [PV units], shape (n_inside,)."""
    noise: float
    """Standard deviation of the white part of what is left [PV units]."""


def refine_model(record: LoopRecord, found: Identification, period: float, *, cycles: bool = True) -> RefinedModel:
    """Fit valve and process to the PV, starting from the identified ones.

    Parameters
    ----------
    record : LoopRecord
        The stretch that was identified.
    found : Identification
        Valve and process found in it.
    period : float
        Period of the oscillation [s].
    cycles : bool
        Whether that is regular: then what of the rest keeps step with it is the model's error, and left out of `left`.

    Returns
    -------
    RefinedModel
        The best point; the identified one where nothing explains more.

    Raises
    ------
    RecordError
        When the valve found does not move in the samples that are looked at.
    """
    view = _View(record, found.process.integrating, period)
    if found.by_position:
        view.stem = forward_fill(found.mv, fill_start=True)[view.cut]
        best = view.with_process(found.S, found.J / found.S)
        before = view.error(best)
        best, least = _search(view, best, first=2)
    else:
        best, least, before = _search_valve_and_process(view, found)
    gain, mv, left = view.closely(best)
    if gain == 0.0:
        raise RecordError(
            f"{record.tag}: the valve found does not move in the samples that a twin is built on; cut the record to a "
            "stretch in which the loop cycles."
        )
    if cycles:
        left = left - locked_to(view.op[view.inside], left, view.samples)
    close = about_drift(left, view.samples)
    S, lag = float(np.exp(best[0])), float(np.exp(best[2])) * record.dt
    return RefinedModel(
        S=S,
        J=S * float(best[1]),
        process=view.process(gain, lag, lag * float(best[3]), float(best[4]) * record.dt),
        error=least,
        error_found=before,
        mv=mv,
        left=left,
        noise=min(float(np.std(np.diff(close, 2))) / float(np.sqrt(6.0)), float(close.std())),
    )


def _search_valve_and_process(view: _View, found: Identification) -> tuple[NDArray[np.float64], float, float]:
    """The best place, its error, and the error at the identified valve."""
    starts = [view.with_process(found.S, ratio) for ratio in (min(max(found.J / found.S, 0.0), 1.0), *JUMP_RATIOS)]
    errors = [view.error(start) for start in starts]
    first, _ = min((_search(view, starts[k]) for k in np.argsort(errors)[:MAX_SEARCHES]), key=lambda one: one[1])
    results = []
    for periods in RESTART_PERIODS:
        view.restart_every(periods)
        valves = (view.with_valve(first, *valve) for valve in SEARCHED_VALVES)
        place, error = _search(view, min((first, *valves), key=view.error))
        results.append((error, periods, place))
    _, periods, best = min(results, key=lambda one: one[0])
    view.restart_every(periods)
    return *_search(view, best), errors[0]


def _search(view: _View, guess: NDArray[np.float64], first: int = 0) -> tuple[NDArray[np.float64], float]:
    """Simplex search of the coordinates from `first` on."""
    from scipy.optimize import minimize

    guess[4] = max(guess[4], 0.0)
    steps = np.diag(STEPS * np.where(np.arange(5) == 1, -1.0 if guess[1] > 0.5 else 1.0, 1.0))
    simplex = np.vstack([guess, guess + steps[first:]])[:, first:]
    done = minimize(
        lambda x: view.error(np.concatenate([guess[:first], x])),
        guess[first:],
        method="Nelder-Mead",
        options={"maxfev": MAX_EVALUATIONS, "initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-7},
    )
    return np.concatenate([guess[:first], done.x]), float(done.fun)


class _View:
    """A record as the search looks at it; a place is ln S, J / S, ln tau1, tau2 / tau1, dead time [samples]."""

    def __init__(self, record: LoopRecord, integrating: bool, period: float) -> None:
        assert record.pv is not None
        self.dt, self.integrating, self.samples = record.dt, integrating, period / record.dt
        size = max(MAX_SAMPLES, round(6.0 * self.samples))
        self.cut = slice(0, size)
        self.op, self.pv = (
            forward_fill(record.op, fill_start=True)[self.cut],
            forward_fill(record.pv, fill_start=True)[self.cut],
        )
        # Half a window at the ends, and the first period: what the stem did before the record is not known.
        first = round(1.5 * self.samples) if self.op.size > 5.0 * self.samples else round(0.5 * self.samples)
        self.inside = slice(first, max(self.op.size - round(0.5 * self.samples), first + 10))
        self.target = about_drift(self.pv, self.samples)[self.inside]
        self.energy = float(self.target @ self.target)
        noise = float(np.std(np.diff(self.target, 2))) / np.sqrt(6.0)
        self.floor = noise * noise * self.target.size / self.energy
        self.stem: NDArray[np.float64] | None = None
        self.turns: list[int] = []
        self.restart_every(1)

    def restart_every(self, periods: int) -> None:
        """Start the simulation of the stem again where OP turns, where a moving stem is (S - J) / 2 away from it."""
        width = max(round(self.samples), 2)
        starts = range(0, max(self.op.size - width, 1), periods * width)
        self.turns = [*(k + int(np.argmax(self.op[k : k + width])) for k in starts), self.op.size]

    def with_process(self, S: float, ratio: float) -> NDArray[np.float64]:
        """The place of a valve and of the process that is fitted to its stem."""
        place = np.array([np.log(S), ratio, 0.0, 0.0, 0.0])
        process = fit_process(self.follow(place), self.pv, self.samples, integrating=self.integrating)
        slow, fast = (process.fast, 0.0) if self.integrating else (process.slow, process.fast)
        place[2:] = np.log(max(slow, 0.1)), fast / max(slow, 0.1), process.dead_time
        return place

    def follow(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """Stem position over the recorded OP."""
        if self.stem is not None:
            return self.stem
        S = float(np.exp(place[0]))
        valve, lag = Kano(S, S * float(place[1])), 0.5 * S * (1.0 - float(place[1]))
        parameters, stem = valve.pack(self.dt), np.empty_like(self.op)
        stem[: self.turns[0]] = self.op[self.turns[0]] - lag
        for a, b in pairwise(self.turns):
            stroke_one(valve.code, parameters, self.op[a:b], float(self.op[a]) - lag, stem[a:b])
        return stem

    def with_valve(self, place: NDArray[np.float64], share: float, ratio: float) -> NDArray[np.float64]:
        """The place with S times `share`, another J / S, and a dead time shorter by the later slip."""
        moves = max(float(np.mean(np.abs(np.diff(self.op)))), 1e-9)
        later = float(np.exp(place[0])) * (share - 1.0) / moves
        return np.array([place[0] + np.log(share), ratio, *place[2:4], max(place[4] - later, 0.0)])

    def answer(self, mv: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.float64]:
        """Process of gain 1 driven by the stem, about its moving average, shape (n_inside,)."""
        return about_drift(self.through(mv, place), self.samples)[self.inside]

    def through(self, mv: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.float64]:
        """Process of gain 1 driven by the stem, shape (n_searched,)."""
        lag = float(np.exp(place[2]))
        return _lags(mv - mv.mean(), lag, lag * float(place[3]), float(place[4]), self.integrating)

    def error(self, place: NDArray[np.float64]) -> float:
        """Share of the target's energy that the best gain leaves; above 1 outside the limits."""
        outside = max(-place[1], place[1] - 1.0, -place[3], place[3] - 1.0, -place[4], place[4] - 0.5 * self.op.size)
        if outside > 0.0:
            return 1.0 + float(outside)
        y = self.answer(self.follow(place), place)
        power, cross = float(y @ y), float(self.target @ y)
        return 1.0 - cross * cross / (power * self.energy) if power > 0.0 else 1.0

    def closely(self, place: NDArray[np.float64]) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Gain [PV units per %, or per % and s], stem and what is left of the target."""
        mv = self.follow(place)
        y = self.answer(mv, place)
        gain = float(self.target @ y) / max(float(y @ y), 1e-300)
        left = self.pv - gain * self.through(mv, place)
        return gain / (self.dt if self.integrating else 1.0), mv, about_drift(left, SLOW * self.samples)[self.inside]

    def process(self, gain: float, first: float, second: float, dead_time: float) -> TransferFunction:
        """The process with its time constants and dead time [s]."""
        if self.integrating:
            return Integrating(gain, dead_time, first if first > 0.2 * self.dt else 0.0)
        short = second < max(0.05 * first, 0.1 * self.dt)
        return FOPDT(gain, first, dead_time) if short else SOPDT(gain, first, second, dead_time)


def _lags(x: NDArray[np.float64], first: float, second: float, delay: float, integrating: bool) -> NDArray[np.float64]:
    """Answer of two lags [samples] (an integrator and one lag) of gain 1 to `x` held between samples, exactly."""
    if integrating:
        whole = _one(x, np.inf, delay)
        return whole - first * _one(x, first, delay) if first > 0.2 else whole
    if second < 0.05 * first or second < 0.1:
        return _one(x, first, delay)
    if second > 0.98 * first:
        second = 0.98 * first
    return (first * _one(x, first, delay) - second * _one(x, second, delay)) / (first - second)


def _one(x: NDArray[np.float64], lag: float, delay: float) -> NDArray[np.float64]:
    """Answer of one lag or, where it is infinite, an integrator."""
    from scipy.signal import lfilter

    whole = int(delay)
    part = delay - whole
    if np.isinf(lag):
        keep, new, old = 1.0, 1.0 - part, part
    else:
        keep = float(np.exp(-1.0 / max(lag, 1e-3)))
        new = -float(np.expm1(-(1.0 - part) / max(lag, 1e-3)))
        old = 1.0 - keep - new
    y = np.asarray(lfilter([0.0, new, old], [1.0, -keep], x))
    return y if whole == 0 else np.concatenate([np.zeros(whole), y[:-whole]])
