"""The features from which the causes of an oscillation are computed: one table."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.loop_response import S_GRID
from stiction.diagnosis.oscillation.signal_shape import (
    largest_pole,
    line_share,
    noise_share,
    share_at_limits,
    share_at_rate,
    share_by_lags,
)
from stiction.diagnosis.verdict.features import log_evidence, sensitivity

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.dead_zone import DeadZone
    from stiction.diagnosis.identification.loop_response import LoopResponse
    from stiction.diagnosis.identification.result import ControllerFit, Identification
    from stiction.diagnosis.result import Oscillation

__all__ = ["CAUSE_FEATURES", "CauseFeature", "CauseInput", "compute_cause_features"]


@dataclass(frozen=True, slots=True, eq=False)
class CauseInput:
    """What the stages before found."""

    op: NDArray[np.float64]
    """OP of the judged part [% of span]."""
    pv: NDArray[np.float64]
    """PV of the judged part [engineering units]."""
    sp: NDArray[np.float64] | None
    """SP of the judged part [engineering units]; None where none was recorded."""
    dt: float
    """Sampling period [s]."""
    op_step: float
    """Quantisation step of OP [% of span]."""
    pv_step_share: float
    """Quantisation step of PV over its 98 % range [-]."""
    oscillation: Oscillation
    """The oscillation."""
    controller: ControllerFit
    """The controller."""
    identification: Identification
    """Stiction and process by OP and PV."""
    response: LoopResponse
    """The linear predictions of PV."""
    log_odds: float
    """Log odds of stiction by the model of the verdict [-]."""

    @property
    def per_period(self) -> float:
        """Samples to a period of the oscillation, or of the best candidate [-]; NaN without one."""
        return self.oscillation.period / self.dt if self.oscillation.period > 0.0 else math.nan

    def block(self, fewest: int) -> int:
        """Samples of block means, 16 to a period and at least `fewest` in the record [-]."""
        per_period = self.per_period if self.oscillation.oscillating else 40.0
        return int(np.clip(per_period / 16.0, 1, max(self.pv.size / fewest, 1)))

    @property
    def op_range(self) -> float:
        """Range of OP [% of span]."""
        return float(np.ptp(self.op))


@dataclass(frozen=True, slots=True)
class CauseFeature:
    """One feature and the causes that it speaks for or against."""

    name: str
    """Name in code and JSON."""
    formula: str
    """How it is computed, in words."""
    unit: str
    """Its unit."""
    signs: dict[str, int]
    """Cause -> +1 when a larger value makes it more likely, -1 when less, 0 when either."""
    compute: Callable[[CauseInput], float]
    """The formula; NaN when it cannot be computed."""


def _ratio(name: str) -> Callable[[CauseInput], float]:
    """Evidence for the sticky valve over another explanation."""
    return lambda found: log_evidence(found.identification.likelihood_ratios.get(name, math.nan))


def _over_good(name: str) -> Callable[[CauseInput], float]:
    """Evidence for another explanation over a good valve."""

    def compute(found: CauseInput) -> float:
        ratios = found.identification.likelihood_ratios
        return log_evidence(ratios["good"] - ratios.get(name, math.nan))

    return compute


def _zone(formula: Callable[[DeadZone], float]) -> Callable[[CauseInput], float]:
    """A number of the most likely dead zone."""
    return lambda found: math.nan if (zone := found.identification.dead_zone) is None else formula(zone)


def _sensitivity(found: CauseInput, *, linear: bool) -> float:
    one = found.identification
    one = replace(one, process=one.linear) if linear else one
    period = found.oscillation.period if found.oscillation.oscillating else math.nan
    return math.log(sensitivity(one, found.controller, period))


def _period_over_limit(found: CauseInput) -> float:
    """Ln of the period of the oscillation over that at the limit of stability."""
    period = found.oscillation.period if found.oscillation.oscillating else math.nan
    return math.log(period / found.response.margin.period)


def _line(found: CauseInput) -> float:
    known = found.oscillation.oscillating and found.per_period > 0.0
    return line_share(found.pv, found.per_period) if known else math.nan


def _sp_size(found: CauseInput) -> float:
    if found.sp is None or not float(np.ptp(found.sp)) > 0.0:
        return 0.0
    return min(float(found.sp.std()) / max(float(found.pv.std()), 1e-300), 2.0)


def _sp_changes(found: CauseInput) -> float:
    """ln(1 + samples at which SP changes): an operator changes it now and then, a master all the time."""
    return 0.0 if found.sp is None else math.log1p(int(np.count_nonzero(np.diff(found.sp))))


def _predicted(found: CauseInput) -> float:
    """ln(1 + evidence predicted of a sticky valve with S of 0.3 of OP's range)."""
    evidence = found.response.evidence
    if evidence is None:
        return math.nan
    S = max(0.3 * found.op_range, float(S_GRID[0]))
    return math.log1p(max(float(np.interp(math.log(S), np.log(S_GRID), evidence)), 0.0))


def _signs(text: str) -> dict[str, int]:
    """Causes and signs: `valve+ external- tuning`.

    `unseen` sticks or is stuck without being seen, `stuck` is stuck, `position` is an OP that is the stem's position.
    """
    return {one.rstrip("+-"): {"+": 1, "-": -1}.get(one[-1], 0) for one in text.split()}


def _feature(
    name: str, formula: str, causes: str, compute: Callable[[CauseInput], float], unit: str = "-"
) -> CauseFeature:
    return CauseFeature(name, formula, unit, _signs(causes), compute)


CAUSE_FEATURES: tuple[CauseFeature, ...] = (
    _feature("log_odds", "log odds of stiction by the verdict's model", "valve+ external unseen",
             lambda x: x.log_odds),
    _feature("over_good", "asinh(LLR / 20)", "valve+ tuning external unseen stuck position", _ratio("good")),
    _feature("over_deadband", "asinh(LLR / 20)", "valve unseen", _ratio("deadband")),
    _feature("over_dead_zone", "asinh(LLR / 20)", "valve+ dead_zone- unseen", _ratio("dead_zone")),
    _feature("beside_load", "asinh(LLR / 20)", "valve+ unseen", _ratio("beside_periodic_load")),
    _feature("load_over_good", "asinh(LLR / 20)", "valve tuning external dead_zone unseen stuck position",
             _over_good("periodic_load")),
    _feature("relay_over_good", "asinh(LLR / 20)", "external+ dead_zone unseen", _over_good("relay_load")),
    _feature("zone_over_good", "asinh(LLR / 20)", "dead_zone+ external-",
             _zone(lambda x: log_evidence(x.likelihood_ratio))),
    _feature("zone_width", "width over range of OP", "dead_zone",
             _zone(lambda x: (x.high - x.low) / max(x.op_high - x.op_low, 1e-9))),
    _feature("zone_crossings", "ln(1 + reversals of OP)", "dead_zone valve",
             _zone(lambda x: math.log1p(x.op_reversals))),
    _feature("stem_for_op", "asinh(LLR / 20), outside waves beside", "valve+ unseen stuck",
             lambda x: log_evidence(x.response.stem_for_op)),
    _feature("stem_beside_op", "asinh(BIC gain / 20), waves and OP beside", "valve+ unseen",
             lambda x: log_evidence(x.response.stem_beside_op)),
    _feature("stem_gain", "asinh(gain / standard error), waves and OP beside", "valve unseen",
             lambda x: math.asinh(x.response.stem_gain)),
    _feature("band", "ln(S)", "valve+", lambda x: math.log(max(x.identification.S, 1e-3)), "ln(% of span)"),
    _feature("band_to_swing", "S / range of OP", "valve unseen",
             lambda x: min(x.identification.S / max(x.op_range, 1e-9), 1.5)),
    _feature("op_effect", "asinh(BIC gain of OP / 20), waves beside", "tuning external unseen- stuck- position",
             lambda x: log_evidence(x.response.op_effect)),
    _feature("op_gain", "asinh(gain of OP / standard error), waves beside", "external unseen- stuck- position",
             lambda x: math.asinh(x.response.op_gain)),
    _feature("op_effect_plain", "asinh(BIC gain of OP / 20)", "unseen stuck position",
             lambda x: log_evidence(x.response.op_effect_plain)),
    _feature("op_answer", "asinh(LLR / 20) of the best first-order answer to OP, waves beside", "unseen- stuck-",
             lambda x: log_evidence(x.response.answer[0])),
    _feature("op_answer_wrong", "asinh(LLR / 20) of the best one with the wrong sign", "unseen stuck",
             lambda x: log_evidence(x.response.answer[1])),
    _feature("op_answer_plain", "asinh(LLR / 20) of the best one, no waves beside", "unseen stuck",
             lambda x: log_evidence(x.response.answer_plain[0])),
    _feature("sp_answer", "asinh(LLR / 20) of the best first-order answer to SP, waves beside", "unseen- stuck-",
             lambda x: log_evidence(x.response.sp_answer)),
    _feature("wave_effect", "asinh(BIC gain of outside waves / 20), OP beside", "tuning external+ set_point unseen",
             lambda x: log_evidence(x.response.wave_effect)),
    _feature("wave_over_op", "ln(movement of PV by the main wave over that by OP)",
             "tuning external valve- unseen stuck",
             lambda x: math.log(max(x.response.wave_over_op, 1e-6))),
    _feature("load_size", "ln(main wave as a load at the inlet)", "external tuning unseen stuck position",
             lambda x: math.log(max(x.response.load_size, 1e-6)), "ln(% of span)"),
    _feature("plain_margin_low", "15 % point of ln(gain margin)", "tuning- external unseen",
             lambda x: x.response.margin.low),
    _feature("plain_margin_high", "85 % point of ln(gain margin)", "tuning- unseen", lambda x: x.response.margin.high),
    _feature("period_to_plain_limit", "ln(period / period at the limit of stability)", "tuning external",
             _period_over_limit),
    _feature("sensitivity", "ln(1 / abs(1 + C P)) at the oscillation, sticky valve", "tuning",
             lambda x: _sensitivity(x, linear=False)),
    _feature("linear_sensitivity", "ln(1 / abs(1 + C P)) at the oscillation, good valve", "tuning external",
             lambda x: _sensitivity(x, linear=True)),
    _feature("line", "power of the main line over that of its octave", "tuning external sensor unseen stuck",
             _line),
    _feature("damping", "-lg(1 - largest pole of PV)", "tuning unseen stuck",
             lambda x: largest_pole(x.pv, x.block(100))),
    _feature("sp_size", "deviation of SP over that of PV", "set_point+ unseen", _sp_size),
    _feature("sp_changes", "ln(1 + samples at which SP changes)", "set_point+ position", _sp_changes),
    _feature("sp_effect", "share of PV's variance that lags of SP explain", "set_point+ external- tuning- stuck",
             lambda x: 0.0 if x.sp is None else share_by_lags(x.sp, x.pv, x.per_period)),
    _feature("at_rate", "share of OP's moves at the largest rate", "rate_limit+ external position-",
             lambda x: share_at_rate(x.op, x.op_step)),
    _feature("unexplained", "share of OP's moves that no controller explains",
             "rate_limit+ external- valve tuning unseen stuck", lambda x: x.controller.unexplained),
    _feature("unexplained_off_rate", "that share times the share of moves not at the largest rate", "position+",
             lambda x: x.controller.unexplained * (1.0 - share_at_rate(x.op, x.op_step))),
    _feature("at_limits", "share of the samples with OP at its ends", "tuning rate_limit external",
             lambda x: share_at_limits(x.op, x.op_step)),
    _feature("pv_step", "quantisation step of PV over its range", "sensor+ external dead_zone-",
             lambda x: x.pv_step_share),
    _feature("white", "variance of PV's moves over twice its variance", "sensor external- unseen stuck",
             lambda x: noise_share(x.pv, x.block(50))),
    _feature("op_range", "ln(range of OP)", "unseen stuck", lambda x: math.log(max(x.op_range, 1e-3)), "ln(% of span)"),
    _feature("linear_fit", "share of PV that a good valve explains in simulation", "unseen stuck",
             lambda x: x.identification.fit_linear, "%"),
    _feature("predicted_at_swing", "ln(1 + evidence of a valve with S of 30 % of OP's range)", "unseen stuck",
             _predicted),
)  # fmt: skip
"""All features of the causes. LLR is twice the log likelihood ratio, BIC gain the gain of Schwarz's criterion."""


def compute_cause_features(found: CauseInput) -> dict[str, float]:
    """Compute all features of the causes: name -> value, NaN where a feature cannot be computed."""
    return {feature.name: float(feature.compute(found)) for feature in CAUSE_FEATURES}
