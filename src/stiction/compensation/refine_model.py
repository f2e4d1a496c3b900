"""Valve and process polished together, in open loop: a second lag, and dead time between samples.

The identification reports one time constant. A remedy that moves the stem often asks more of the process than the
slow cycle did, and S trades with dead time where little noise pins it (docs/verdict.md), so that the twin looks once
more about the point found, by simulation error from the recorded OP:

    min over (S, J/S, tau1, tau2, dead_time) of |t - K y|^2 / |t|^2,   K by least squares,

t the PV and y the process's answer to the stem, both about their moving average over one period.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.compensation.locked import locked_to
from stiction.diagnosis.oscillation import about_drift
from stiction.errors import RecordError
from stiction.models import FOPDT, SOPDT, Integrating, Kano
from stiction.records.gaps import forward_fill
from stiction.simulation import stroke

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis import Identification
    from stiction.models import TransferFunction
    from stiction.records.record import LoopRecord

__all__ = ["RefinedModel", "refine_model"]

RUNS, ENOUGH = 200, 4000
"""Simulations for each start of the search, and samples to which a long record is cut (six periods at least)."""
CLEAR = 0.02
"""Share left unexplained below which noise no longer pins S, and S is tried apart from the point found [-]."""
STARTS = ((1.0, 0.0, 0.0), (1.0, 0.0, 0.4), (1.0, -0.25, 0.2), (1.0, 0.25, 0.2), (0.85, 0.1, 0.2), (1.2, 0.1, 0.2))
"""Where the search starts: S over the one found, J / S beside it, tau2 over tau1 [-]."""
SLOW = 4.0
"""Periods over which the PV is averaged before what is left of it counts as moved from outside [-]."""
PERIODS = 6
"""Periods after which the stem's simulation starts afresh [-]."""
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
    """Look about the identified point for a valve and a process that explain more.

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
    late = found.process.dead_time
    tau, ratio = max(found.process.time_constant, 0.1 * record.dt), min(max(found.J / found.S, 0.0), 1.0)
    centre = np.array([np.log(found.S), ratio, np.log(tau / record.dt), 0.0, late / record.dt])
    best, least = centre, view.error(centre)
    before = least
    for share, jump, second in STARTS if before < CLEAR else ():
        shift = view.delay_of(found.S * (share - 1.0))
        guess = [centre[0] + np.log(share), np.clip(ratio + jump, 0.0, 1.0), centre[2], second, centre[4] - shift]
        best, least = min((best, least), _search(view, np.array(guess), 0), key=lambda one: one[1])
        if least < 1.5 * view.floor:
            break
    if least > 1.5 * view.floor:
        # Noise makes small stairs of the slips: the stem as it was followed stretch by stretch is the better one then.
        view.stem = forward_fill(found.mv, fill_start=True)[view.cut]
        best, least = centre, view.error(centre)
        before = least
        for second in (0.0, 0.4):
            guess = np.array([*centre[:3], second, centre[4]])
            best, least = min((best, least), _search(view, guess, 2), key=lambda one: one[1])
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


def _search(view: _View, guess: NDArray[np.float64], first: int) -> tuple[NDArray[np.float64], float]:
    """Simplex search of the coordinates from `first` on."""
    from scipy.optimize import minimize

    guess[4] = max(guess[4], 0.0)
    steps = np.diag(STEPS * np.where(np.arange(5) == 1, -1.0 if guess[1] > 0.5 else 1.0, 1.0))
    simplex = np.vstack([guess, guess + steps[first:]])[:, first:]
    done = minimize(
        lambda x: view.error(np.concatenate([guess[:first], x])),
        guess[first:],
        method="Nelder-Mead",
        options={"maxfev": RUNS if first == 0 else 2 * RUNS, "initial_simplex": simplex},
    )
    return np.concatenate([guess[:first], done.x]), float(done.fun)


class _View:
    """A record as the search looks at it; a place is ln S, J / S, ln tau1, tau2 / tau1, dead time [samples]."""

    def __init__(self, record: LoopRecord, integrating: bool, period: float) -> None:
        assert record.pv is not None
        self.dt, self.integrating, self.samples = record.dt, integrating, period / record.dt
        size = max(ENOUGH, round(6.0 * self.samples))
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
        # The stem of a valve that makes its loop cycle moves until OP turns: there it lies (S - J) / 2 behind, and
        # the simulation starts afresh, so that a stem which went astray does not stay so.
        wide = max(round(self.samples), 2)
        starts = range(0, max(self.op.size - wide, 1), PERIODS * wide)
        self.turns = [*(k + int(np.argmax(self.op[k : k + wide])) for k in starts), self.op.size]
        self.stem: NDArray[np.float64] | None = None

    def delay_of(self, width: float) -> float:
        """Samples by which a band wider by `width` [% of span] holds the stem longer."""
        return width / max(float(np.mean(np.abs(np.diff(self.op)))), 1e-9)

    def follow(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """Stem position over the recorded OP."""
        if self.stem is not None:
            return self.stem
        S = float(np.exp(place[0]))
        valve, lag = Kano(S, S * float(place[1])), 0.5 * S * (1.0 - float(place[1]))
        parts = [np.full(self.turns[0], self.op[self.turns[0]] - lag)]
        for a, b in pairwise(self.turns):
            stem = stroke(valve, self.op[a:b], self.dt, mv_start=float(self.op[a]) - lag).mv
            assert stem is not None
            parts.append(stem)
        return np.concatenate(parts)

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
