"""Which valve model a record supports: a good valve, Stenman's, Kano's or the three-parameter one, by Schwarz's BIC."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.candidates import joined
from stiction.diagnosis.identification.identify_record import compared_signals
from stiction.diagnosis.identification.model_fit import fit_kano, fit_stenman, model_fit
from stiction.diagnosis.identification.process_fit import fit_process
from stiction.diagnosis.identification.regression import one_thread
from stiction.diagnosis.identification.three_parameter import fit_three_parameter
from stiction.display.json_form import Result

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.identify_record import ComparedSignals, SegmentFit
    from stiction.diagnosis.identification.model_fit import ModelFit, PositionCosts

__all__ = ["ModelComparison", "ModelShare", "compare_fits"]


@dataclass(frozen=True, slots=True)
class ModelShare(Result):
    """What one valve model explains of a record."""

    model: str
    """good, stenman, kano or three_parameter."""
    free: int
    """Parameters of the valve that were fitted [-]."""
    parameters: dict[str, float]
    """Their values: d, S, J, sb, sj [% of span], r [% of span / s]."""
    fit: float
    """Share of the variation compared that the model explains in simulation [%]."""
    bic: float
    """Schwarz's criterion [-]; the smallest wins."""


_EXTENSIONS = {
    "good": ("stenman", "kano", "three_parameter"),
    "stenman": ("three_parameter",),
    "kano": ("three_parameter",),
    "three_parameter": (),
}
"""Model -> the models of which it is a special case."""


@dataclass(frozen=True, slots=True)
class ModelComparison(Result):
    """Which valve model a record supports, and by how much."""

    _json_keys = ("models", "best", "margin", "decided", "samples", "compared")

    models: tuple[ModelShare, ...]
    """The models, the smallest criterion first."""
    samples: float
    """Independent samples that the criterion counts [-]."""
    compared: str
    """Signal that was compared: pv or mv."""
    enough: float
    """Difference of the criterion from which on a model is called better [-]."""

    @property
    def best(self) -> str:
        """The simplest model whose criterion is not larger than the smallest by `enough`."""
        near = [one for one in self.models if one.bic < self.models[0].bic + self.enough]
        return min(near, key=lambda one: (one.free, one.bic)).model

    @property
    def margin(self) -> float:
        """How much larger the criterion is of the best model that is no extension of `best` [-]."""
        own = next(one for one in self.models if one.model == self.best)
        others = [one for one in self.models if one.model not in (own.model, *_EXTENSIONS[own.model])]
        return (min(one.bic for one in others) if others else self.models[0].bic) - own.bic

    @property
    def decided(self) -> bool:
        """Whether that is enough; a good valve also needs the smallest criterion."""
        return self.margin >= self.enough if self.best != "good" else self.models[0].model == "good"

    def summary(self) -> str:
        """The finding in a line or two."""
        shares = ", ".join(f"{one.model} {one.fit:.1f} %" for one in self.models)
        finding = f"{self.best} is enough" if self.decided else "the record does not decide between the models"
        return f"Explained of the {self.compared.upper()}: {shares}; by BIC {finding} (margin {self.margin:.1f})."


def compare_fits(fitted: SegmentFit, enough: float) -> ModelComparison:
    """Compare what the valve models explain of a fitted segment; see `stiction.compare_models`.

    `enough`: difference of Schwarz's criterion from which on a model is called better [-].
    """
    compared = compared_signals(fitted.segment, fitted.position)
    costs = compared.costs
    good = costs.op.reshape(-1, costs.per_block).mean(axis=1)
    with one_thread():
        stenman, kano = fit_stenman(costs), fit_kano(costs)
        three = fit_three_parameter(costs, (kano, stenman))
        stenman = _with_special_cases(costs, stenman, three, r=np.inf, rests=1.0)
        kano = _with_special_cases(costs, kano, three, r=0.0, rests=0.0)
        fits = {"stenman": stenman, "kano": kano, "three_parameter": three}
        best = min(fits.values(), key=lambda fit: fit.cost)
        samples = best.share * costs.n_predicted
        found = {
            name: (fit.cost, fit.position, _parameters(name, fit, compared.op_interval)) for name, fit in fits.items()
        }
        found["good"] = (float(costs.cost_of_positions(good[np.newaxis])[0]), good, {})
        shares = [
            ModelShare(
                name, len(values), values, _explained(fitted, compared, position),
                best.share * cost + len(values) * float(np.log(samples)),
            )
            for name, (cost, position, values) in found.items()
        ]  # fmt: skip
    signal = "pv" if fitted.position is None else "mv"
    return ModelComparison(tuple(sorted(shares, key=lambda one: one.bic)), samples, signal, enough)


def _with_special_cases(costs: PositionCosts, fit: ModelFit, three: ModelFit, r: float, rests: float) -> ModelFit:
    """A fit of Kano's or of Stenman's valve that also knows the three-parameter valves that are the same."""
    rows = three.found.valves
    same = (rows[:, 2] == r) & ((rests == 0.0) | (rows[:, 1] == 1.0))
    if not same.any() or three.found.cost[same].min() >= fit.cost:
        return fit
    best = rows[same][[int(np.argmin(three.found.cost[same]))]]
    best[:, 2] = rests
    found = joined(costs.evaluate(best), fit.found)
    return model_fit(costs, found, costs.positions(np.array([found.best]))[0])


def _parameters(model: str, fit: ModelFit, op_interval: float) -> dict[str, float]:
    S, ratio, r, _ = (float(x) for x in fit.best)
    if model == "stenman":
        return {"d": S}
    if model == "kano":
        return {"S": S, "J": S * ratio}
    return {"sb": 0.5 * S * (1.0 + ratio), "sj": S * ratio, "r": r / op_interval}


def _explained(fitted: SegmentFit, compared: ComparedSignals, position: NDArray[np.float64]) -> float:
    """Share of the recorded position, or of the PV in simulation, that a valve position explains [%]."""
    if fitted.position is not None:
        return 100.0 * fitted.position.regression.line(position).explained
    signals, integrating = compared.signals, fitted.segment.part.integrating
    process = fit_process(position, signals.pv, signals.period, fitted.controller.action, integrating)
    return 100.0 * (1.0 - process.error)
