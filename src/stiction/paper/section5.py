"""Section V: which model shows which of the paper's phenomena, each answer a number measured on the model."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.models import Srinivasan, Table
from stiction.paper.fig2 import finished_slips
from stiction.paper.fig5 import JUMP, POSITION, STICK_BAND
from stiction.paper.lab_valve import FOLLOWED, STAIRS, lab_models
from stiction.paper.table1 import PSI_PER_PERCENT, table1_reading_a
from stiction.simulation.stroke import stroke

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Valve

__all__ = ["Answer", "Phenomenon", "Section5", "Trial", "section5", "trials"]

VARIES = 1.05
"""Ratio from which a slip is said to vary [-]."""


@dataclass(frozen=True)
class Trial:
    """A model and the ramps on which it is asked."""

    valve: Valve
    """The valve."""
    low: float
    """Begin of the ramps [% of span]."""
    high: float
    """End of the ramps [% of span]."""
    slow: tuple[float, float]
    """Two rates at which the paper saw stairs [% of span / s]."""
    fast: float
    """A rate that it saw followed [% of span / s]."""
    step: float
    """Largest change of the OP in a sample of a slow ramp [% of span]."""
    band: float
    """Static friction band [% of span]."""


@dataclass(frozen=True)
class Answer:
    """What one model says to one phenomenon."""

    value: float
    """The number measured, in the unit of the phenomenon."""
    shown: bool
    """Whether the model shows the phenomenon."""
    paper: bool | None
    """Whether the paper says that it does; None where the paper does not say."""


@dataclass(frozen=True)
class Phenomenon:
    """One phenomenon and what each model makes of it."""

    name: str
    """The phenomenon, in the paper's words where it has them."""
    quantity: str
    """What is measured, with its unit."""
    answers: dict[str, Answer]
    """Answer by model."""


@dataclass(frozen=True)
class Section5:
    """Models against phenomena."""

    models: tuple[str, ...]
    """Names of the models."""
    phenomena: tuple[Phenomenon, ...]
    """The phenomena of sections II to V."""

    def summary(self) -> str:
        """Say it in a sentence per model."""
        told = []
        for model in self.models:
            missed = [p.name for p in self.phenomena if not p.answers[model].shown]
            told.append(f"{model}: " + (f"misses {'; '.join(missed)}." if missed else "shows all."))
        return "\n".join(told)

    def to_dict(self, *, series: bool = True) -> dict[str, Any]:
        """JSON-ready form."""
        from stiction.paper.plain import plain

        return plain(self, series=series)


_SAID: dict[str, dict[str, bool]] = {
    "physical (eqs. 1-3)": {"follow": True, "stairs": True, "rate": True, "travel": False},
    "one parameter (eq. 4)": {"follow": False, "stairs": True, "rate": False, "travel": False},
    "two parameters": {"follow": True, "stairs": False, "rate": False},
    "three parameters, printed (eq. 5)": {"deadband": True, "follow": True, "stairs": True, "rate": True},
    "three parameters over travel and rate": {
        "deadband": True, "follow": True, "stairs": True, "rate": True, "slip": True, "travel": True,
    },
}  # fmt: skip
"""What sections IV and V say of each model."""

_PHENOMENA = {
    "deadband": ("Dead-band", "OP travel after a reversal before the stem moves [% of span]"),
    "follow": ("Stick, jump, follow on a fast ramp", "rests after the first slip [-]"),
    "stairs": ("Stick-slip on a slow ramp", "rests after the first slip [-]"),
    "rate": ("Dependence on the rate of the input", "rests on the slow ramp less those on the fast one [-]"),
    "slip": ("Slip jump that varies with the rate", "slip at the faster of two slow rates over that at the slower [-]"),
    "travel": ("Friction that varies over the travel", "largest slip on a slow ramp over the smallest [-]"),
    "step": ("A large step is answered", "distance from the OP left after a step, in static bands [-]"),
}


def trials() -> dict[str, Trial]:
    """Models to be asked, by name.

    The physical valve is Table I in reading A on the slopes of Fig. 2; the others are the laboratory valve of
    Figs. 3 and 4 on its rates, from 5 to 65 % so that there are stairs enough to compare. The last has the tables of
    Fig. 5, and a jump that is a quarter larger at 0.0125 %/s than at 0.01 %/s: this project's choice.

    Examples
    --------
    >>> from stiction.paper.section5 import trials
    >>> list(trials())[0]
    'physical (eqs. 1-3)'
    """
    physical = table1_reading_a(hold="linear", travel=(-math.inf, math.inf))
    slow, faster, fast = (slope / PSI_PER_PERCENT for slope in (2.0, 4.0, 9.0))
    asked = {
        "physical (eqs. 1-3)": Trial(physical, 0.0, 100.0, (slow, faster), fast, 0.01, 100.0 * 3.84 / 18.0),
    }
    lab = (5.0, 65.0, (STAIRS[1], STAIRS[0]), FOLLOWED[0], 0.0125)
    asked |= {name: Trial(valve, *lab, 5.1) for name, valve in lab_models().items()}
    place, rates = np.array(POSITION), np.array([STAIRS[1], STAIRS[0]])
    jump = Table(place, np.outer(JUMP, [1.0, 1.25]), rates)
    varied = Srinivasan(Table(place, np.array(STICK_BAND)), jump, r=math.sqrt(STAIRS[0] * FOLLOWED[1]))
    asked["three parameters over travel and rate"] = Trial(varied, *lab, max(STICK_BAND))
    return asked


def section5() -> Section5:
    """Ask every model for every phenomenon.

    Returns
    -------
    Section5
        A number and a yes or no for each, beside what the paper says.

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
    asked = trials()
    measured = {model: _measure(trial) for model, trial in asked.items()}
    phenomena = tuple(
        Phenomenon(name, quantity, {model: _answer(key, model, measured[model]) for model in asked})
        for key, (name, quantity) in _PHENOMENA.items()
    )
    return Section5(tuple(asked), phenomena)


def _answer(key: str, model: str, measured: dict[str, float]) -> Answer:
    value = measured[key]
    shown = {
        "deadband": value > 0.0,
        "follow": value == 0.0,
        "stairs": value > 1.0,
        "rate": value > 1.0,
        "slip": value > VARIES,
        "travel": value > VARIES,
        "step": value <= 1.0,
    }[key]
    return Answer(value, shown, _SAID.get(model, {}).get(key))


def _measure(trial: Trial) -> dict[str, float]:
    slower, slow, fast = (finished_slips(_ramp(trial, rate))[1] for rate in (*trial.slow, trial.fast))
    return {
        "deadband": _reversal(trial),
        "follow": float(fast.size),
        "stairs": float(slow.size),
        "rate": float(slow.size - fast.size),
        "slip": float(np.median(slow) / np.median(slower)) if slow.size and slower.size else math.nan,
        "travel": float(slower.max() / slower.min()) if slower.size > 1 else math.nan,
        "step": _left(trial),
    }


def _ramp(trial: Trial, rate: float) -> NDArray[np.float64]:
    """Stem on a ramp, shape (n_samples,) [% of span]; sampled alike at every rate, as the laboratory did in time."""
    dt = trial.step / trial.slow[1]
    return _stem(trial, np.arange(trial.low, trial.high, rate * dt), dt)


def _reversal(trial: Trial) -> float:
    """OP travel after a reversal of the fast ramp before the stem moves back [% of span]."""
    dt = trial.step / trial.slow[1]
    up = np.arange(trial.low, trial.high, trial.fast * dt)
    op = np.r_[up, up[::-1]]
    back = np.diff(_stem(trial, op, dt))[up.size :] < 0.0
    return float(up[-1] - op[up.size + 1 + int(back.argmax())]) if back.any() else math.inf


def _left(trial: Trial) -> float:
    """Distance from the OP at the end of a step of twice the static band, over that band [-]."""
    op = np.full(100, trial.low + 2.0 * trial.band)
    op[0] = trial.low
    return float(abs(op[-1] - _stem(trial, op, 1.0)[-1]) / trial.band)


def _stem(trial: Trial, op: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    mv = stroke(trial.valve, op, dt, mv_start=trial.low).mv
    assert mv is not None
    return mv
