"""Section V: which model shows which phenomenon of the paper, by a number measured on the model."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.json_form import Result
from stiction.models import Srinivasan, Table
from stiction.paper.fig2 import find_slips
from stiction.paper.fig5 import JUMPS, POSITIONS, STICK_BANDS
from stiction.paper.lab_valve import FOLLOWED_RATES, STAIRCASE_RATES, lab_models
from stiction.paper.table1 import PSI_PER_PERCENT, table1_reading_a
from stiction.simulation.stroke import stroke

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Valve

__all__ = ["Answer", "ModelTrial", "Phenomenon", "Section5", "model_trials", "section5"]

MIN_VARIATION_RATIO = 1.05
"""Ratio above which a slip varies [-]."""


@dataclass(frozen=True)
class ModelTrial:
    """A model and the ramps on which it is tested."""

    valve: Valve
    """The valve."""
    low: float
    """Begin of the ramps [% of span]."""
    high: float
    """End of the ramps [% of span]."""
    slow: tuple[float, float]
    """Two rates with stairs in the paper [% of span / s]."""
    fast: float
    """A rate that the stem followed in the paper [% of span / s]."""
    step: float
    """Largest change of the OP in a sample of a slow ramp [% of span]."""
    band: float
    """Static friction band [% of span]."""


@dataclass(frozen=True)
class Answer:
    """Result of one model for one phenomenon."""

    value: float
    """The number measured, in the unit of the phenomenon."""
    shown: bool
    """Whether the model shows the phenomenon."""
    paper: bool | None
    """Whether it does so in the paper; None where the paper does not say."""


@dataclass(frozen=True)
class Phenomenon:
    """One phenomenon and the result of each model."""

    name: str
    """The phenomenon, in the paper's words where it has them."""
    quantity: str
    """What is measured, with its unit."""
    answers: dict[str, Answer]
    """Answer by model."""


@dataclass(frozen=True)
class Section5(Result):
    """Models against phenomena."""

    models: tuple[str, ...]
    """Names of the models."""
    phenomena: tuple[Phenomenon, ...]
    """The phenomena of sections II to V."""

    def summary(self) -> str:
        """Summary in a sentence per model."""
        lines = []
        for model in self.models:
            missed = [p.name for p in self.phenomena if not p.answers[model].shown]
            lines.append(f"{model}: " + (f"misses {'; '.join(missed)}." if missed else "shows all."))
        return "\n".join(lines)


_PAPER_ANSWERS: dict[str, dict[str, bool]] = {
    "physical (eqs. 1-3)": {"follow": True, "stairs": True, "rate": True, "travel": False},
    "one parameter (eq. 4)": {"follow": False, "stairs": True, "rate": False, "travel": False},
    "two parameters": {"follow": True, "stairs": False, "rate": False},
    "three parameters, printed (eq. 5)": {"deadband": True, "follow": True, "stairs": True, "rate": True},
    "three parameters over travel and rate": {
        "deadband": True, "follow": True, "stairs": True, "rate": True, "slip": True, "travel": True,
    },
}  # fmt: skip
"""Statements of sections IV and V about each model."""

_PHENOMENA = {
    "deadband": ("Dead-band", "OP travel after a reversal before the stem moves [% of span]"),
    "follow": ("Stick, jump, follow on a fast ramp", "rests after the first slip [-]"),
    "stairs": ("Stick-slip on a slow ramp", "rests after the first slip [-]"),
    "rate": ("Dependence on the rate of the input", "rests on the slow ramp less those on the fast one [-]"),
    "slip": ("Slip jump that varies with the rate", "slip at the faster of two slow rates over that at the slower [-]"),
    "travel": ("Friction that varies over the travel", "largest slip on a slow ramp over the smallest [-]"),
    "step": ("A large step is answered", "distance from the OP left after a step, in static bands [-]"),
}


def model_trials() -> dict[str, ModelTrial]:
    """Models to test, by name.

    The physical valve is Table I in reading A on the slopes of Fig. 2; the others are the laboratory valve of
    Figs. 3 and 4 on its rates, from 5 to 65 % so that there are enough stairs to compare. The last has the tables of
    Fig. 5, and a jump that is a quarter larger at 0.0125 %/s than at 0.01 %/s: this project's choice.

    Examples
    --------
    >>> from stiction.paper.section5 import model_trials
    >>> list(model_trials())[0]
    'physical (eqs. 1-3)'
    """
    physical = table1_reading_a(hold="linear", travel=(-math.inf, math.inf))
    slow, faster, fast = (slope / PSI_PER_PERCENT for slope in (2.0, 4.0, 9.0))
    trials = {
        "physical (eqs. 1-3)": ModelTrial(physical, 0.0, 100.0, (slow, faster), fast, 0.01, 100.0 * 3.84 / 18.0),
    }
    lab = (5.0, 65.0, (STAIRCASE_RATES[1], STAIRCASE_RATES[0]), FOLLOWED_RATES[0], 0.0125)
    trials |= {name: ModelTrial(valve, *lab, 5.1) for name, valve in lab_models().items()}
    place, rates = np.array(POSITIONS), np.array([STAIRCASE_RATES[1], STAIRCASE_RATES[0]])
    jump = Table(place, np.outer(JUMPS, [1.0, 1.25]), rates)
    varied = Srinivasan(Table(place, np.array(STICK_BANDS)), jump, r=math.sqrt(STAIRCASE_RATES[0] * FOLLOWED_RATES[1]))
    trials["three parameters over travel and rate"] = ModelTrial(varied, *lab, max(STICK_BANDS))
    return trials


def section5() -> Section5:
    """Test every model for every phenomenon.

    Returns a number and a yes or no for each, with the statement of the paper.

    References
    ----------
    srinivasan2008, sections IV and V.

    Examples
    --------
    >>> from stiction.paper import section5
    >>> stairs = section5().phenomena[2]
    >>> [stairs.answers[model].shown for model in ("one parameter (eq. 4)", "two parameters")]
    [True, False]
    """
    trials = model_trials()
    measured = {model: _measure(trial) for model, trial in trials.items()}
    phenomena = tuple(
        Phenomenon(name, quantity, {model: _answer(key, model, measured[model]) for model in trials})
        for key, (name, quantity) in _PHENOMENA.items()
    )
    return Section5(tuple(trials), phenomena)


def _answer(key: str, model: str, measured: dict[str, float]) -> Answer:
    value = measured[key]
    shown = {
        "deadband": value > 0.0,
        "follow": value == 0.0,
        "stairs": value > 1.0,
        "rate": value > 1.0,
        "slip": value > MIN_VARIATION_RATIO,
        "travel": value > MIN_VARIATION_RATIO,
        "step": value <= 1.0,
    }[key]
    return Answer(value, shown, _PAPER_ANSWERS.get(model, {}).get(key))


def _measure(trial: ModelTrial) -> dict[str, float]:
    slower, slow, fast = (find_slips(_ramp(trial, rate))[1] for rate in (*trial.slow, trial.fast))
    return {
        "deadband": _reversal_travel(trial),
        "follow": float(fast.size),
        "stairs": float(slow.size),
        "rate": float(slow.size - fast.size),
        "slip": float(np.median(slow) / np.median(slower)) if slow.size and slower.size else math.nan,
        "travel": float(slower.max() / slower.min()) if slower.size > 1 else math.nan,
        "step": _error_after_step(trial),
    }


def _ramp(trial: ModelTrial, rate: float) -> NDArray[np.float64]:
    """Stem on a ramp, shape (n_samples,) [% of span]; same sampling period at every rate."""
    dt = trial.step / trial.slow[1]
    return _stem(trial, np.arange(trial.low, trial.high, rate * dt), dt)


def _reversal_travel(trial: ModelTrial) -> float:
    """OP travel after a reversal of the fast ramp before the stem moves back [% of span]."""
    dt = trial.step / trial.slow[1]
    up = np.arange(trial.low, trial.high, trial.fast * dt)
    op = np.r_[up, up[::-1]]
    back = np.diff(_stem(trial, op, dt))[up.size :] < 0.0
    return float(up[-1] - op[up.size + 1 + int(back.argmax())]) if back.any() else math.inf


def _error_after_step(trial: ModelTrial) -> float:
    """Distance from the OP at the end of a step of twice the static band, over that band [-]."""
    op = np.full(100, trial.low + 2.0 * trial.band)
    op[0] = trial.low
    return float(abs(op[-1] - _stem(trial, op, 1.0)[-1]) / trial.band)


def _stem(trial: ModelTrial, op: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    mv = stroke(trial.valve, op, dt, mv_start=trial.low).mv
    assert mv is not None
    return mv
