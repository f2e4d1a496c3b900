"""The features from which the probability of stiction is computed: one table of names, formulas and signs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.alternatives import ALTERNATIVES

if TYPE_CHECKING:
    from collections.abc import Callable

    from stiction.diagnosis.identification.result import ControllerFit, Identification
    from stiction.diagnosis.result import Oscillation

__all__ = ["FEATURES", "Feature", "FeatureInput", "compute_features", "sensitivity"]


@dataclass(frozen=True, slots=True)
class FeatureInput:
    """What the stages before the verdict found."""

    identification: Identification
    """Stiction and process by OP and PV."""
    controller: ControllerFit
    """The controller."""
    oscillation: Oscillation
    """The oscillation."""
    op_swing: float
    """98 % range of OP [% of span]."""
    pv_step_share: float
    """Quantisation step of the PV over its 98 % range [-]."""
    position_gain: float = math.nan
    """Twice the log likelihood ratio of a sticky valve by the recorded valve position [-]; NaN without one."""


@dataclass(frozen=True, slots=True)
class Feature:
    """One feature."""

    name: str
    """Name in code and JSON."""
    label: str
    """Name on screens."""
    formula: str
    """How it is computed, in words."""
    unit: str
    """Its unit."""
    sign: int
    """+1 when a larger value makes stiction more likely, -1 when less."""
    compute: Callable[[FeatureInput], float]
    """The formula; NaN when it cannot be computed."""


def log_evidence(likelihood_ratio: float) -> float:
    """Twice a log likelihood ratio on a scale that grows like its logarithm: asinh(x / 20) [-].

    Examples
    --------
    >>> log_evidence(0.0), round(log_evidence(20.0), 2), round(log_evidence(-200.0), 2)
    (0.0, 0.88, -3.0)
    """
    return math.asinh(likelihood_ratio / 20.0)


def _evidence(name: str, fallback: str = "") -> Callable[[FeatureInput], float]:
    def compute(found: FeatureInput) -> float:
        ratios = found.identification.likelihood_ratios
        return log_evidence(ratios.get(name, ratios.get(fallback, math.nan)))

    return compute


def _of_process(compute: Callable[[FeatureInput], float], *, integrating: bool) -> Callable[[FeatureInput], float]:
    """Compute a feature for one kind of process only: deadband alone makes an integrating loop cycle, no other."""
    return lambda found: compute(found) if found.identification.process.integrating is integrating else math.nan


def _closest_ratio(found: FeatureInput) -> float:
    ratios = found.identification.likelihood_ratios
    return min(ratios[name] for name in ALTERNATIVES if name in ratios and name != "dead_zone")


def _kept_share(found: FeatureInput) -> float:
    return float(np.clip(_closest_ratio(found) / max(found.identification.likelihood_ratios["good"], 20.0), -1.0, 1.0))


def _signed_gain(name: str) -> Callable[[FeatureInput], float]:
    """Process gain over its standard error on the scale asinh(x) [-], NaN where its sign is not known."""

    def compute(found: FeatureInput) -> float:
        action, gain = found.controller.action, found.identification.process_gains.get(name, math.nan)
        return math.asinh(action * gain) if action != 0.0 else math.nan

    return compute


def _fit_gain(found: FeatureInput) -> float:
    return math.log(max(100.0 - found.identification.fit_linear, 1.0) / max(100.0 - found.identification.fit, 1.0))


def _tuning(found: FeatureInput) -> float:
    period = found.oscillation.period if found.oscillation.oscillating else math.nan
    return math.log(sensitivity(found.identification, found.controller, period))


FEATURES: tuple[Feature, ...] = (
    Feature("over_closest", "sticky valve against the closest other explanation",
            "smallest asinh(LLR / 20), dead zone aside", "-", 1, lambda found: log_evidence(_closest_ratio(found))),
    Feature("kept_share", "share of the evidence left after the closest explanation",
            "smallest LLR / max(LLR over good, 20), within -1 and 1", "-", 1, _kept_share),
    Feature("over_dead_zone", "sticky valve against dead zone at fixed OP", "asinh(LLR / 20)", "-", 1,
            _evidence("dead_zone")),
    Feature("over_periodic_load", "sticky valve against a periodic load", "asinh(LLR / 20)", "-", 1,
            _evidence("periodic_load", "good")),
    Feature("beside_periodic_load", "sticky valve, periodic load added to both", "asinh(LLR / 20)", "-", 1,
            _evidence("beside_periodic_load", "good")),
    Feature("over_deadband", "slip jump against deadband alone, self-regulating process", "asinh(LLR / 20)", "-", 1,
            _of_process(_evidence("deadband"), integrating=False)),
    Feature("over_deadband_integrating", "slip jump against deadband alone, integrating process", "asinh(LLR / 20)",
            "-", 1, _of_process(_evidence("deadband"), integrating=True)),
    Feature("band_to_swing", "stiction band relative to the OP swing", "S / 98 % range of OP", "-", 1,
            lambda found: min(found.identification.S / found.op_swing, 1.5) if found.op_swing > 0.0 else math.nan),
    Feature("jump_ratio_integrating", "slip jump relative to the band, integrating process", "J / S", "-", 1,
            _of_process(lambda found: found.identification.J / found.identification.S, integrating=True)),
    Feature("stem_gain", "process gain from the sticky valve, with the sign that the controller expects",
            "asinh(gain / its standard error)", "-", 1, _signed_gain("stem")),
    Feature("stem_gain_beside_op", "process gain from the sticky valve, OP acting beside it",
            "asinh(gain / its standard error)", "-", 1, _signed_gain("stem_beside_op")),
    Feature("fit_gain", "simulation with a sticky valve against a good one",
            "ln(unexplained good / unexplained sticky)", "-", 1, _fit_gain),
    Feature("tuning", "how close the loop is to instability by tuning", "ln(1 / abs(1 + C P)) at the oscillation",
            "-", -1, _tuning),
    Feature("position", "sticky valve by the recorded valve position", "asinh(LLR / 20)", "-", 1,
            lambda found: log_evidence(found.position_gain)),
)  # fmt: skip
"""All features, in the order of the model. LLR is twice the log likelihood ratio."""


def compute_features(found: FeatureInput) -> dict[str, float]:
    """Compute all features of a record.

    Parameters
    ----------
    found : FeatureInput
        Results of the stages before.

    Returns
    -------
    dict of str to float
        Name -> value; NaN where a feature cannot be computed.
    """
    return {feature.name: float(feature.compute(found)) for feature in FEATURES}


def sensitivity(identification: Identification, controller: ControllerFit, period: float) -> float:
    """Sensitivity of the identified loop at the frequency of the oscillation, 1 / abs(1 + C P) [-].

    Parameters
    ----------
    identification : Identification
        The process behind the sticky valve. That behind a good valve would hold the valve's part of the oscillation,
        and look unstable in every loop that oscillates by itself.
    controller : ControllerFit
        Gains of the controller.
    period : float
        Period of the oscillation [s].

    Returns
    -------
    float
        Sensitivity [-]; infinite at the limit of stability, NaN when controller, process or period are not known.

    Notes
    -----
    A loop without friction oscillates where C P = -1. With a sticky valve it does where C P N = -1, N being the
    describing function of the valve, so that C P is off -1.
    """
    process = identification.process
    if controller.form == "unknown" or not np.isfinite(controller.Ki) or not process.gain or not period > 0.0:
        return math.nan
    s = 2j * math.pi / period
    slow = max(process.time_constant - process.lag, 0.0)
    lags = (1.0 + process.lag * s) * (s if process.integrating else 1.0 + slow * s)
    pid = controller.Kc * (1.0 + controller.Td * s) + controller.Ki / s
    return 1.0 / max(abs(1.0 + pid * process.gain * np.exp(-process.dead_time * s) / lags), 1e-6)
