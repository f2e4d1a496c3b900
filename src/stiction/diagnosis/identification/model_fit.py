"""One valve model and the process behind it, fitted to a whole record by simulation error.

Every model here is eq. 5 repaired with some of (sb, sj, r) tied, so that one search serves all and what they leave
can be compared: same stretches, same processes, same samples.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.model_signals import begins_of, near_processes, wide_processes
from stiction.diagnosis.identification.valve_trials import Processes, Stretches, Trials, answer_of, stem_of, try_valves

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Identification, ProcessFit
    from stiction.records.record import LoopRecord

__all__ = ["ModelFit", "Tied", "fit_model", "fit_process"]

LEAST_S = 0.2
"""Smallest S tried at first, as a share of OP's swing [-]."""
N_BEGINS, N_CLOSER_BEGINS = 10, 48
"""Samples tried for the first slip [-], at first and in every closer search."""
STAGES = (
    (1.3, 0.03, 0.12, 12, 24),
    (1.15, 0.012, 0.05, 5, 72),
    (1.06, 0.005, 0.02, 3, 200),
    (1.03, 0.002, 0.01, 2, 600),
)
"""Of each closer search: factor between lags, steps of S (relative) and of J / S, how many valleys it follows, and
which part of all rates a step of r passes."""
N_RATES = 8
"""Rates at which the likelihood is looked at about the best valve [-]."""
N_BANDS = 5
"""Bands of S from each of which the search may go closer [-]."""
S_AROUND = np.array([-0.12, -0.07, -0.035, -0.015, 0.0, 0.015, 0.035, 0.07, 0.12])
RATIO_AROUND = np.array([-0.5, -0.3, -0.15, -0.06, 0.0, 0.06, 0.15, 0.3, 0.5])
"""Where the likelihood is looked at about the best valve: S (relative) and J / S [-]."""


class Tied(NamedTuple):
    """What a model leaves free of (S, J / S, r)."""

    ratios: NDArray[np.float64]
    """J / S tried at first [-], increasing, shape (n_ratios,); one value ties it."""
    rates: NDArray[np.float64]
    """r tried [% of span / s], increasing, shape (n_rates,)."""
    n_S: int
    """Values of S tried at first [-]."""


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


def fit_model(
    record: LoopRecord, signals: Stretches, tied: Tied, known: Identification, nested: tuple[ModelFit, ...] = ()
) -> ModelFit:
    """Search a model's valves and processes, wide first, then closer about several valleys.

    Parameters
    ----------
    record : LoopRecord
        The record.
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
    by_stem = record.mv is not None
    sign = 1.0 if by_stem else fit_controller(record).action
    valleys = _first_look(signals, tied, known, sign, by_stem)
    valleys += [_Valley(one.error, one.valve, one.process, one.signals) for one in nested]
    tried = [one.trials for one in nested]
    for spread, step, part, keep, share in STAGES:
        move = max(tied.rates.size // share, 1)
        valleys = sorted(valleys, key=lambda valley: valley.error)[:keep]
        for n, valley in enumerate(valleys):
            about = _about(valley.valve, tied, step * np.arange(-2.0, 3.0), part * np.arange(-1.0, 2.0), move)
            trials = try_valves(valley.signals, about, near_processes(valley.process, signals, by_stem, spread), sign)
            tried.append(trials)
            i = trials.best()
            if trials.error[i] < valley.error:
                valley = _Valley(float(trials.error[i]), trials.valves[i], trials.process[i], valley.signals)
            valleys[n] = valley if by_stem else _begun(valley, sign)
    best = min(valleys, key=lambda valley: valley.error)
    sb, sj, own = best.valve
    places = np.linspace(0, tied.rates.size - 1, N_RATES).astype(int)
    every = np.unique(np.append(tied.rates[places], own))
    region = np.concatenate([_about(np.array([sb, sj, r]), tied, S_AROUND, RATIO_AROUND, 0) for r in every])
    tried.append(try_valves(best.signals, region, near_processes(best.process, signals, by_stem, 1.15), sign))
    tried.append(Trials(best.valve[np.newaxis], np.array([best.error]), best.process[np.newaxis]))
    return ModelFit(best.signals, Trials(*(np.concatenate(parts) for parts in zip(*tried, strict=True))))


def fit_process(record: LoopRecord, signals: Stretches, valve: NDArray[np.float64], known: ProcessFit) -> ModelFit:
    """Search the process behind a valve that is known.

    Parameters
    ----------
    record : LoopRecord
        The record.
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
    by_stem = record.mv is not None
    sign = 1.0 if by_stem else fit_controller(record).action
    alone, valves = signals.alone(0), valve[np.newaxis]
    begins = alone.start if by_stem else begins_of(alone, N_BEGINS)
    wide = wide_processes(signals, known, by_stem)
    trials = try_valves(alone, np.repeat(valves, len(begins), axis=0), wide, sign, begins[:, np.newaxis])
    i = trials.best()
    valley = _Valley(float(trials.error[i]), valve, trials.process[i], signals)
    for spread, *_ in ((1.6,), *STAGES):
        if not by_stem:
            valley = _begun(valley, sign)
        trials = try_valves(valley.signals, valves, near_processes(valley.process, signals, by_stem, spread), sign)
        valley = _Valley(float(trials.error[0]), valve, trials.process[0], valley.signals)
    return ModelFit(valley.signals, trials)


def _first_look(signals: Stretches, tied: Tied, known: Identification, sign: float, by_stem: bool) -> list[_Valley]:
    """The best valleys of a wide search of the first stretch, for every sample in which the stem may first slip."""
    alone = signals.alone(0)
    few = tied.rates[np.unique(np.linspace(0, tied.rates.size - 1, 5).astype(int))]
    swing = float(np.ptp(signals.op))
    valves = _lattice(swing * np.geomspace(LEAST_S, 1.0, tied.n_S), tied.ratios, few)
    if known.S > 0.0:
        part = np.clip([known.J / known.S], tied.ratios[0], tied.ratios[-1])
        valves = np.concatenate([valves, _lattice(np.array([known.S]), part, few)])
    begins = alone.start if by_stem else begins_of(alone, N_BEGINS)
    starts = np.repeat(begins[:, np.newaxis], valves.shape[0], axis=0)
    wide = wide_processes(signals, known.process, by_stem)
    trials = try_valves(alone, np.tile(valves, (begins.shape[0], 1)), wide, sign, starts)
    found = []
    for row in _apart(trials, swing):
        valley = _Valley(float(trials.error[row]), trials.valves[row], trials.process[row], signals)
        found.append(valley if by_stem else _begun(valley, sign))
    return found


def _lattice(S: NDArray[np.float64], ratio: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.float64]:
    """All (sb, sj, r) of some S, J / S and r, shape (n, 3)."""
    S, ratio, r = (axis.ravel() for axis in np.meshgrid(S, ratio, r, indexing="ij"))
    return np.stack([0.5 * S * (1.0 + ratio), S * ratio, r], axis=1)


def _about(
    valve: NDArray[np.float64], tied: Tied, step: NDArray[np.float64], part: NDArray[np.float64], reach: int
) -> NDArray[np.float64]:
    """Valves about one: S in relative steps, J / S in parts, and the rates `reach` places before and after."""
    sb, sj, r = valve
    S = 2.0 * sb - sj
    ratio = np.unique(np.clip(sj / S + part, tied.ratios[0], tied.ratios[-1])) if S > 0.0 else tied.ratios[:1]
    i = int(np.searchsorted(tied.rates, r))
    places = np.unique(np.clip([i - reach, i, i + reach], 0, tied.rates.size - 1))
    return _lattice(S * (1.0 + step), ratio, tied.rates[places] if reach else np.array([r]))


def _apart(trials: Trials, swing: float) -> list[int]:
    """The best valve of each rate in each band of S."""
    S = 2.0 * trials.valves[:, 0] - trials.valves[:, 1]
    band = np.digitize(S, swing * np.geomspace(LEAST_S, 1.0, N_BANDS + 1)[1:-1])
    best: dict[tuple[int, float], int] = {}
    for row in np.argsort(trials.error):
        best.setdefault((int(band[row]), float(trials.valves[row, 2])), int(row))
    return list(best.values())


def _begun(valley: _Valley, sign: float) -> _Valley:
    """The valley with every stretch begun as its valve and process fit it best."""
    signals = valley.signals
    _, first, second, delay = valley.process
    whole = int(np.floor(delay))
    process = Processes(np.array([first]), np.array([second]), np.array([whole, whole + 1]))
    start = signals.start.copy()
    for i in range(start.shape[0]):
        alone = signals.alone(i)
        begins = np.concatenate([begins_of(alone, N_CLOSER_BEGINS), start[i : i + 1]])
        tried = try_valves(
            alone, np.repeat(valley.valve[np.newaxis], len(begins), axis=0), process, sign, begins[:, np.newaxis]
        )
        start[i] = begins[tried.best()]
    begun = signals._replace(start=start)
    trials = try_valves(begun, valley.valve[np.newaxis], process, sign)
    return _Valley(float(trials.error[0]), valley.valve, trials.process[0], begun)
