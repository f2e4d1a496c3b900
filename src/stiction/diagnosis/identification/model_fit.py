"""One valve model and the process behind it, fitted to a whole record by simulation error.

Every model here is eq. 5 repaired with some of (sb, sj, r) tied, so that one search serves all and what they leave
can be compared: same stretches, same processes, same samples.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.model_signals import begins_of, near_processes, wide_processes
from stiction.diagnosis.identification.processes import Processes
from stiction.diagnosis.identification.valve_trials import Stretches, Trials, answer_of, stem_of, try_valves

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.diagnosis.identified import Identification, ProcessFit

__all__ = ["ModelFit", "Tied", "fit_model", "fit_process"]

LEAST_S = 0.12
"""Smallest S tried at first, as a share of OP's swing [-]."""
# Widths and numbers were chosen by how often intervals hold the truth of staircases
# (tests/diagnosis/identification/staircases.py), which docs/valve-models-from-a-record.md counts.
N_BEGINS, N_CLOSER_BEGINS = 12, 48
"""Samples tried for the first slip [-], at first and in every closer search."""
STAGES = ((1.3, 0.015, 0.08, 12, 16), (1.15, 0.012, 0.05, 40, 6))
"""Of each search after the first look: factor between lags, steps of S (relative) and of J / S, which part of all rates
a step of r passes, and how many valleys are followed."""
CLOSER = ((1.06, 0.005, 0.02, 120), (1.03, 0.002, 0.01, 400))
"""The same of those about the best valley."""
S_AROUND = np.array([-0.1, -0.05, -0.025, -0.01, 0.0, 0.01, 0.025, 0.05, 0.1])
RATIO_AROUND = np.array([-0.4, -0.2, -0.1, -0.04, 0.0, 0.04, 0.1, 0.2, 0.4])
"""Where the likelihood is looked at about the best valve: S (relative) and J / S [-]."""
RATES_AROUND = np.array([-0.5, -0.2, -0.07, 0.0, 0.07, 0.2, 0.5])
"""The same for r, as a share of all rates [-]."""
FEW = 15
"""Valves up to which each has a beginning of its own in a closer search [-]."""
N_VALLEYS = 24
"""Valleys from which the search goes closer [-]."""


class Tied(NamedTuple):
    """What a model leaves free of (S, J / S, r)."""

    lowest: float
    """Smallest J / S [-]; the largest is 1, where the stem jumps to OP."""
    rates: NDArray[np.float64]
    """r tried [% of span / s], increasing, shape (n_rates,)."""
    n: int
    """Valves tried at first [-]."""


class ModelFit(NamedTuple):
    """A model fitted."""

    signals: Stretches
    """What was compared."""
    trials: Trials
    """Valves tried about the best, with their errors."""

    @property
    def valve(self) -> NDArray[np.float64]:
        """sb, sj [% of span] and r [% of span / s] of the best valve, shape (3,)."""
        return self.trials.valves[self.trials.best()]

    @property
    def process(self) -> NDArray[np.float64]:
        """Gain, first and second lag and dead time of its process, times in samples, shape (4,)."""
        return self.trials.process[self.trials.best()]

    @property
    def error(self) -> float:
        """Share of the energy compared that it leaves [-]."""
        return float(self.trials.error.min())

    def residual(self) -> list[NDArray[np.float64]]:
        """What it leaves in the window of each stretch [unit of the target]."""
        left = self.signals.target - answer_of(self.signals, stem_of(self.signals, self.valve), self.process)
        return [left[a + w[0] : a + w[1]] for a, w in zip(self.signals.bounds[:-1], self.signals.windows, strict=True)]


class _Valley(NamedTuple):
    """A valve, its process, and how the stem begins."""

    error: float
    valve: NDArray[np.float64]
    process: NDArray[np.float64]
    signals: Stretches


def fit_model(signals: Stretches, tied: Tied, known: Identification, nested: tuple[ModelFit, ...] = ()) -> ModelFit:
    """Search a model's valves and processes, wide first, then closer about several valleys.

    Parameters
    ----------
    signals : Stretches
        What to compare, as `signals_of` makes it.
    tied : Tied
        What the model leaves free.
    known : Identification
        What (S, J) found: its valve is tried as well, and its lags are where processes are looked for.
    nested : tuple of ModelFit, optional
        Fits of models that are special cases of this one, to go on from.

    Returns
    -------
    ModelFit
        The best valve and process, and all that was tried.
    """
    valleys = _first_look(signals, tied, known)
    valleys += [_Valley(one.error, one.valve, one.process, one.signals) for one in nested]
    tried = [one.trials for one in nested]
    for *widths, keep in STAGES:
        valleys = sorted(valleys, key=lambda valley: valley.error)[:keep]
        valleys = [_closer(valley, tied, widths, tried) for valley in valleys]
    best = min(valleys, key=lambda valley: valley.error)
    for _ in range(2):
        for widths in CLOSER:
            best = _closer(best, tied, widths, tried)
        wider = _profile(best, tied, tried)
        if wider.error >= best.error:
            break
        best = wider
    tried.append(Trials(best.valve[np.newaxis], np.array([best.error]), best.process[np.newaxis]))
    return ModelFit(best.signals, Trials(*(np.concatenate(parts) for parts in zip(*tried, strict=True))))


def _closer(valley: _Valley, tied: Tied, widths: Sequence[float], tried: list[Trials]) -> _Valley:
    """The valley searched about its valve; what was tried joins `tried`."""
    spread, step, part, share = widths
    move = max(int(tied.rates.size / share), 1)
    valves = _about(valley.valve, tied, step * np.arange(-2.0, 3.0), part * np.arange(-1.0, 2.0), (-move, 0, move))
    found = _best(valley, valves, spread, tried, own=len(valves) <= FEW)
    if found.error < valley.error:
        valley = found
    return valley if valley.signals.by_stem else _begun(valley)


def _best(about: _Valley, valves: NDArray[np.float64], spread: float, tried: list[Trials], own: bool) -> _Valley:
    """The best of some valves about a valley; all join `tried`. With `own` each has a beginning of its own."""
    signals = about.signals
    starts = np.repeat(signals.start[np.newaxis], len(valves), axis=0)
    if own and not signals.by_stem:
        starts = _begins(signals, valves, about.process, N_BEGINS)
    trials = try_valves(signals, valves, near_processes(about.process, signals, spread), starts)
    tried.append(trials)
    i = trials.best()
    return _Valley(float(trials.error[i]), trials.valves[i], trials.process[i], signals._replace(start=starts[i]))


def _profile(best: _Valley, tied: Tied, tried: list[Trials]) -> _Valley:
    """The best of many valves far about the best; all join `tried`."""
    moves = np.unique((RATES_AROUND * tied.rates.size).astype(int))
    valves = np.concatenate(
        [
            _about(best.valve, tied, S_AROUND, np.zeros(1), moves),
            _about(best.valve, tied, S_AROUND, RATIO_AROUND, (0,)),
            _about(best.valve, tied, np.zeros(1), RATIO_AROUND, moves),
        ]
    )
    return _best(best, valves, 1.15, tried, own=True)


def fit_process(signals: Stretches, valve: NDArray[np.float64], known: ProcessFit) -> ModelFit:
    """Search the process behind a valve that is known.

    Parameters
    ----------
    signals : Stretches
        What to compare.
    valve : ndarray, shape (3,)
        sb, sj [% of span] and r [% of span / s]; zeros are a good valve.
    known : ProcessFit
        Where processes are looked for.

    Returns
    -------
    ModelFit
        The valve and its best process.
    """
    alone, valves = signals.alone(0), valve[np.newaxis]
    begins = alone.start if signals.by_stem else begins_of(alone, N_BEGINS)
    wide = wide_processes(signals, known)
    trials = try_valves(alone, np.repeat(valves, len(begins), axis=0), wide, begins[:, np.newaxis])
    i = trials.best()
    valley = _Valley(float(trials.error[i]), valve, trials.process[i], signals)
    for spread in (1.6, 1.3, 1.15, 1.06):
        if not signals.by_stem:
            valley = _begun(valley)
        trials = try_valves(valley.signals, valves, near_processes(valley.process, signals, spread))
        valley = _Valley(float(trials.error[0]), valve, trials.process[0], valley.signals)
    return ModelFit(valley.signals, trials)


def _first_look(signals: Stretches, tied: Tied, known: Identification) -> list[_Valley]:
    """The best valleys of a wide search of the first stretch, for every sample in which the stem may first slip."""
    alone = signals.alone(0)
    begins = alone.start if signals.by_stem else begins_of(alone, N_BEGINS)
    spread = _halton(tied.n, 4)
    S = float(np.ptp(signals.op)) * LEAST_S ** (1.0 - spread[0])
    # The ends are tried more often: they are models of their own.
    ratio, place = (np.clip(1.2 * x - 0.1, 0.0, 1.0) for x in spread[1:3])
    ratio = tied.lowest + (1.0 - tied.lowest) * ratio
    r = tied.rates[np.round(place * (tied.rates.size - 1)).astype(int)]
    valves = np.stack([0.5 * S * (1.0 + ratio), S * ratio, r], axis=1)
    which = np.minimum((spread[3] * len(begins)).astype(int), len(begins) - 1)
    if known.S > 0.0:
        own = _about(np.array([0.5 * (known.S + known.J), known.J, 0.0]), tied, np.zeros(1), np.zeros(1), (0,))[0]
        own = np.array([[own[0], own[1], r] for r in np.unique(tied.rates[[0, tied.rates.size // 2, -1]])])
        valves = np.concatenate([valves, np.repeat(own, len(begins), axis=0)])
        which = np.concatenate([which, np.tile(np.arange(len(begins)), len(own))])
    wide = wide_processes(signals, known.process)
    trials = try_valves(alone, valves, wide, begins[which][:, np.newaxis])
    found = []
    for row in _apart(trials, tied.rates):
        valley = _Valley(float(trials.error[row]), trials.valves[row], trials.process[row], signals)
        found.append(valley if signals.by_stem else _begun(valley))
    return found


def _halton(n: int, dimensions: int) -> NDArray[np.float64]:
    """Halton's sequence in the unit cube, shape (dimensions, n): points that leave no gap in any axis."""
    out = np.zeros((dimensions, n))
    for row, base in zip(out, (2, 3, 5, 7), strict=False):
        k, share = np.arange(1, n + 1), 1.0
        while k.any():
            share /= base
            row += share * (k % base)
            k //= base
    return out


def _lattice(S: NDArray[np.float64], ratio: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.float64]:
    """All (sb, sj, r) of some S, J / S and r, shape (n, 3)."""
    S, ratio, r = (axis.ravel() for axis in np.meshgrid(S, ratio, r, indexing="ij"))
    return np.stack([0.5 * S * (1.0 + ratio), S * ratio, r], axis=1)


def _about(
    valve: NDArray[np.float64],
    tied: Tied,
    step: NDArray[np.float64],
    part: NDArray[np.float64],
    moves: Sequence[int] | NDArray[np.int64],
) -> NDArray[np.float64]:
    """Valves about one: S in relative steps, J / S in parts, r by places among the rates."""
    sb, sj, r = valve
    S = 2.0 * sb - sj
    ratio = np.unique(np.clip(sj / S + part, tied.lowest, 1.0))
    places = np.unique(np.clip(int(np.searchsorted(tied.rates, r)) + np.asarray(moves), 0, tied.rates.size - 1))
    return _lattice(S * (1.0 + step), ratio, tied.rates[places])


def _apart(trials: Trials, rates: NDArray[np.float64]) -> list[int]:
    """The best valves that are apart from one another in S, J / S or the rate."""
    sb, sj, r = trials.valves.T
    S = 2.0 * sb - sj
    where = np.stack([np.log(S) / 0.02, sj / S / 0.2, np.searchsorted(rates, r) / (0.2 * rates.size)])
    found: list[int] = []
    for row in np.argsort(trials.error):
        if not found or np.abs(where[:, found] - where[:, [row]]).max(axis=0).min() > 1.0:
            found.append(int(row))
            if len(found) == N_VALLEYS:
                break
    return found


def _begun(valley: _Valley) -> _Valley:
    """The valley with every stretch begun as its valve and process fit it best."""
    signals, valve = valley.signals, valley.valve[np.newaxis]
    begun = signals._replace(start=_begins(signals, valve, valley.process, N_CLOSER_BEGINS)[0])
    trials = try_valves(begun, valve, _same(signals, valley.process))
    if trials.error[0] >= valley.error:
        return valley
    return _Valley(float(trials.error[0]), valley.valve, trials.process[0], begun)


def _begins(
    signals: Stretches, valves: NDArray[np.float64], process: NDArray[np.float64], n: int
) -> NDArray[np.float64]:
    """How each stretch begins best for each valve with a given process, shape (n_valves, n_stretches, 3)."""
    same = _same(signals, process)
    out = np.empty((len(valves), *signals.start.shape))
    for i, own in enumerate(signals.start):
        alone = signals.alone(i)
        begins = np.concatenate([begins_of(alone, n), own[np.newaxis]])
        rows, starts = np.repeat(valves, len(begins), axis=0), np.tile(begins, (len(valves), 1))
        trials = try_valves(alone, rows, same, starts[:, np.newaxis])
        out[:, i] = begins[trials.error.reshape(len(valves), -1).argmin(axis=1)]
    return out


def _same(signals: Stretches, process: NDArray[np.float64]) -> Processes:
    """One process, with the dead times about its own."""
    _, first, second, delay = process
    whole, last = int(np.floor(delay)), int(signals.windows[:, 0].min()) - signals.half - 1
    delays = np.arange(max(whole - 1, -1), min(whole + 2, last) + 1)
    return Processes(np.array([first]), np.array([second]), delays)
