"""Fit valve and process together by simulation from the recorded OP: S, J, two time constants and dead time.

The identification predicts each PV sample from the samples before it. That leaves J and the process gain uncertain when
a slip is short. A remedy is simulated over many cycles, so the twin is fitted by simulation,

    min over (S, J/S, tau1, tau2, dead_time) of |t - K y|^2 / |t|^2,   K by least squares,

where t is the PV and y the response of the process to the stem, both minus their moving average over one period.
"""

from __future__ import annotations

from itertools import pairwise, product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.compensation.cycle_average import periodic_part
from stiction.diagnosis.identification.process_fit import fit_process
from stiction.diagnosis.identification.simplex_search import simplex_search
from stiction.diagnosis.oscillation.signals import about_drift
from stiction.errors import RecordError
from stiction.models import FOPDT, SOPDT, Integrating, Kano
from stiction.simulation.drivers import stroke_one

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis import Identification
    from stiction.models import TransferFunction
    from stiction.records.record import LoopRecord

__all__ = ["RefinedModel", "refine_model"]

MAX_EVALUATIONS, MAX_SAMPLES = 300, 4000
"""Largest number of simulations in a search, and of samples used of a long record (six periods at least) [-]."""
JUMP_RATIOS = (0.1, 0.4, 0.7, 1.0)
"""Values of J / S from which the search starts, besides the identified one [-]."""
SEARCHED_VALVES = (
    *product((1.0, 1.002, 1.006), np.linspace(0.02, 1.0, 50)),
    *product((0.88, 0.91, 0.94, 0.97, 0.985, 1.015, 1.03, 1.06, 1.09, 1.12), np.linspace(0.05, 1.0, 11)),
)
"""Valves tried before the last search: S relative to the best valve so far, and J / S [-]."""
MAX_SEARCHES = 2
"""Number of starts that are searched, the ones with the smallest error [-]."""
DRIFT_PERIODS = 4.0
"""Length of the moving average that is subtracted from the residual of the PV, in periods [-]."""
RESTART_PERIODS = (1, 6, 1_000_000)
"""Periods after which the simulation of the stem starts again [-]. With one period, a wrong slip has no lasting effect,
but a stem that rests before OP reverses starts at a wrong position; so six periods and a single run are tried too."""
FIRST_STEPS = np.array([0.01, 0.1, 0.2, 0.3, 0.5])
"""First steps in ln S, J / S, ln tau1, tau2 / tau1 and dead time in samples [-]."""


class RefinedModel(NamedTuple):
    """Valve and process fitted to a record by simulation."""

    S: float
    """Deadband plus stickband [% of span]."""
    J: float
    """Slip jump [% of span]."""
    process: TransferFunction
    """The process."""
    error: float
    """Unexplained share of the PV's energy about its moving average [-]."""
    identified_error: float
    """The same share with the identified valve [-]."""
    mv: NDArray[np.float64]
    """Stem position [% of span], shape (n_searched,); only the first part of a long record is used."""
    residual: NDArray[np.float64]
    """Recorded PV minus the simulated PV, minus its moving average [PV units], shape (n_inside,)."""
    noise: float
    """Standard deviation of the white part of the residual [PV units]."""


def refine_model(
    record: LoopRecord, identification: Identification, period: float, *, cycles: bool = True
) -> RefinedModel:
    """Fit valve and process to the PV, starting from the identified ones.

    `record`: the judged part of a record, without gaps in OP and PV. `identification`: valve and process identified
    from it. `period`: period of the oscillation [s]. `cycles`: whether the oscillation is regular: then the periodic
    part of the residual is model error and is removed. Returns the best fit; the identified model when no other
    explains more. Raises RecordError when the identified valve does not move in these samples.
    """
    view = _SearchData(record, identification.process.integrating, period)
    if identification.by_position:
        view.stem = identification.mv[view.cut]
        best = view.with_process(identification.S, identification.J / identification.S)
        before = view.error(best)
        best, least = _search(view, best, first=2)
    else:
        best, least, before = _search_valve_and_process(view, identification)
    gain, mv, residual = view.gain_and_residual(best)
    if gain == 0.0:
        raise RecordError(
            "the identified valve does not move in the samples that the twin is fitted to",
            remedy="give a part of the record in which the loop oscillates",
            where=record.tag,
        )
    if cycles:
        residual = residual - periodic_part(view.op[view.inside], residual, view.samples)
    fast = about_drift(residual, view.samples)
    S, lag = float(np.exp(best[0])), float(np.exp(best[2])) * record.dt
    return RefinedModel(
        S=S,
        J=S * float(best[1]),
        process=view.process(gain, lag, lag * float(best[3]), float(best[4]) * record.dt),
        error=least,
        identified_error=before,
        mv=mv,
        residual=residual,
        noise=min(float(np.std(np.diff(fast, 2))) / float(np.sqrt(6.0)), float(fast.std())),
    )


def _search_valve_and_process(
    view: _SearchData, identification: Identification
) -> tuple[NDArray[np.float64], float, float]:
    """Return the best parameters, their error, and the error of the identified valve."""
    starts = [
        view.with_process(identification.S, ratio)
        for ratio in (min(max(identification.J / identification.S, 0.0), 1.0), *JUMP_RATIOS)
    ]
    errors = [view.error(start) for start in starts]
    first, _ = min((_search(view, starts[k]) for k in np.argsort(errors)[:MAX_SEARCHES]), key=lambda one: one[1])
    results = []
    for periods in RESTART_PERIODS:
        view.restart_every(periods)
        valves = (view.with_valve(first, *valve) for valve in SEARCHED_VALVES)
        parameters, error = _search(view, min((first, *valves), key=view.error))
        results.append((error, periods, parameters))
    _, periods, best = min(results, key=lambda one: one[0])
    view.restart_every(periods)
    return *_search(view, best), errors[0]


def _search(view: _SearchData, guess: NDArray[np.float64], first: int = 0) -> tuple[NDArray[np.float64], float]:
    """Search the parameters from number `first` on by the simplex method."""
    guess[4] = max(guess[4], 0.0)
    steps = np.diag(FIRST_STEPS * np.where(np.arange(5) == 1, -1.0 if guess[1] > 0.5 else 1.0, 1.0))
    simplex = np.vstack([guess, guess + steps[first:]])[:, first:]
    point, error = simplex_search(
        lambda x: view.error(np.concatenate([guess[:first], x])), simplex, MAX_EVALUATIONS, 1e-4, 1e-7
    )
    return np.concatenate([guess[:first], point]), error


class _SearchData:
    """Signals and errors for the search; the parameters are ln S, J / S, ln tau1, tau2 / tau1, dead time [samples]."""

    def __init__(self, record: LoopRecord, integrating: bool, period: float) -> None:
        assert record.pv is not None
        self.dt, self.integrating, self.samples = record.dt, integrating, period / record.dt
        size = max(MAX_SAMPLES, round(6.0 * self.samples))
        self.cut = slice(0, size)
        self.op, self.pv = record.op[self.cut], record.pv[self.cut]
        # Left out: half a window at both ends, and the first period, because the earlier stem motion is unknown.
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
        """Start the simulation of the stem again at reversals of OP, where a moving stem lags OP by (S - J) / 2."""
        width = max(round(self.samples), 2)
        starts = range(0, max(self.op.size - width, 1), periods * width)
        self.turns = [*(k + int(np.argmax(self.op[k : k + width])) for k in starts), self.op.size]

    def with_process(self, S: float, ratio: float) -> NDArray[np.float64]:
        """Return the parameters of a valve and of the process fitted to its stem position."""
        parameters = np.array([np.log(S), ratio, 0.0, 0.0, 0.0])
        process = fit_process(self.stem_position(parameters), self.pv, self.samples, integrating=self.integrating)
        slow, fast = (process.fast, 0.0) if self.integrating else (process.slow, process.fast)
        parameters[2:] = np.log(max(slow, 0.1)), fast / max(slow, 0.1), process.dead_time
        return parameters

    def stem_position(self, parameters: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the stem position for the recorded OP."""
        if self.stem is not None:
            return self.stem
        S = float(np.exp(parameters[0]))
        valve, lag = Kano(S, S * float(parameters[1])), 0.5 * S * (1.0 - float(parameters[1]))
        packed, stem = valve.pack(self.dt), np.empty_like(self.op)
        stem[: self.turns[0]] = self.op[self.turns[0]] - lag
        for a, b in pairwise(self.turns):
            stroke_one(valve.code, packed, self.op[a:b], float(self.op[a]) - lag, stem[a:b])
        return stem

    def with_valve(self, parameters: NDArray[np.float64], share: float, ratio: float) -> NDArray[np.float64]:
        """Return the parameters with S times `share`, another J / S, and a dead time without the delay of the slip."""
        moves = max(float(np.mean(np.abs(np.diff(self.op)))), 1e-9)
        delay = float(np.exp(parameters[0])) * (share - 1.0) / moves
        return np.array([parameters[0] + np.log(share), ratio, *parameters[2:4], max(parameters[4] - delay, 0.0)])

    def response(self, mv: NDArray[np.float64], parameters: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the output of the process with gain 1, minus its moving average, shape (n_inside,)."""
        return about_drift(self.process_output(mv, parameters), self.samples)[self.inside]

    def process_output(self, mv: NDArray[np.float64], parameters: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the output of the process with gain 1, driven by the stem, shape (n_searched,)."""
        lag = float(np.exp(parameters[2]))
        return _two_lags(mv - mv.mean(), lag, lag * float(parameters[3]), float(parameters[4]), self.integrating)

    def error(self, parameters: NDArray[np.float64]) -> float:
        """Return the unexplained share of the PV's energy with the best gain; above 1 outside the limits."""
        _, ratio, _, fast, delay = parameters
        outside = max(-ratio, ratio - 1.0, -fast, fast - 1.0, -delay, delay - 0.5 * self.op.size)
        if outside > 0.0:
            return 1.0 + float(outside)
        y = self.response(self.stem_position(parameters), parameters)
        power, cross = float(y @ y), float(self.target @ y)
        return 1.0 - cross * cross / (power * self.energy) if power > 0.0 else 1.0

    def gain_and_residual(
        self, parameters: NDArray[np.float64]
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Return the gain [PV units per %, or per % and s], the stem position and the residual of the PV."""
        mv = self.stem_position(parameters)
        y = self.response(mv, parameters)
        gain = float(self.target @ y) / max(float(y @ y), 1e-300)
        residual = self.pv - gain * self.process_output(mv, parameters)
        return (
            gain / (self.dt if self.integrating else 1.0),
            mv,
            about_drift(residual, DRIFT_PERIODS * self.samples)[self.inside],
        )

    def process(self, gain: float, first: float, second: float, dead_time: float) -> TransferFunction:
        """Return the process with time constants and dead time [s]."""
        if self.integrating:
            return Integrating(gain, dead_time, first if first > 0.2 * self.dt else 0.0)
        short = second < max(0.05 * first, 0.1 * self.dt)
        return FOPDT(gain, first, dead_time) if short else SOPDT(gain, first, second, dead_time)


def _two_lags(
    x: NDArray[np.float64], first: float, second: float, delay: float, integrating: bool
) -> NDArray[np.float64]:
    """Return the exact response of two lags [samples], or an integrator and a lag, to `x` held between samples."""
    if integrating:
        whole = _one_lag(x, np.inf, delay)
        return whole - first * _one_lag(x, first, delay) if first > 0.2 else whole
    if second < 0.05 * first or second < 0.1:
        return _one_lag(x, first, delay)
    if second > 0.98 * first:
        second = 0.98 * first
    return (first * _one_lag(x, first, delay) - second * _one_lag(x, second, delay)) / (first - second)


def _one_lag(x: NDArray[np.float64], lag: float, delay: float) -> NDArray[np.float64]:
    """Return the response of one lag, or of an integrator when the lag is infinite."""
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
