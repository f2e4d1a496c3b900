"""The features from which the causes of an oscillation are computed: one table."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.loop_response import S_GRID
from stiction.diagnosis.identification.regression import standardise
from stiction.diagnosis.verdict.features import log_evidence, sensitivity

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.dead_zone import DeadZone
    from stiction.diagnosis.identification.loop_response import LoopResponse
    from stiction.diagnosis.identification.result import ControllerFit, Identification
    from stiction.diagnosis.result import Oscillation

__all__ = ["CAUSE_FEATURES", "CauseFeature", "CauseInput", "compute_cause_features"]


FEW = 3.0
"""Samples at an end of OP's range that are no stay at a limit [-]."""


@dataclass(frozen=True, eq=False)
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
    spike_share: float
    """Share of the samples in which PV jumps away and back [-]."""
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

    @cached_property
    def pv_power(self) -> tuple[NDArray[np.float64], float, NDArray[np.float64]]:
        """Power spectrum of PV, zeros added, its values to a line [-], and their frequencies [1/period]."""
        n, size = self.pv.size, 1 << (4 * self.pv.size - 1).bit_length()
        power = np.abs(np.fft.rfft((self.pv - self.pv.mean()) * np.hanning(n), size)) ** 2
        return power, size / n, np.arange(power.size, dtype=np.float64) * (self.per_period / size)

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


def _period_over_limit(found: CauseInput, *, plain: bool) -> float:
    """Ln of the period of the oscillation over that at the limit of stability."""
    margin = found.response.plain if plain else found.response.beside_waves
    period = found.oscillation.period if found.oscillation.oscillating else math.nan
    return math.log(period / margin.period)


def _line(found: CauseInput, *, wide: float) -> float:
    """Share of PV's power near its main frequency, or at it and above, that stands in one line."""
    if not found.oscillation.oscillating or not found.per_period > 0.0:
        return math.nan
    power, step, turns = found.pv_power
    near = np.flatnonzero((turns > 0.8) & (turns < 1.25))
    if near.size == 0:
        return math.nan
    i, width = int(near[np.argmax(power[near])]), max(round(2.0 * step), 1)
    around = power[(turns > turns[i] / 1.5) & (turns < turns[i] * wide)]
    return float(power[max(i - width, 0) : i + width + 1].sum() / max(float(around.sum()), 1e-300))


def _coherence(found: CauseInput, of: str) -> float:
    """Share of the power of PV, OP or the error that goes with SP, by averaged spectra without their bias [-]."""
    sp = found.sp
    if sp is None or not float(np.ptp(sp)) > 0.0:
        return 0.0
    y = {"pv": found.pv, "op": found.op, "error": sp - found.pv}[of]
    scale = 4.0 * found.per_period if found.per_period > 0.0 else y.size / 10.0
    length = int(min(max(scale, 64.0), y.size / 5.0))
    if length < 16 or not float(np.ptp(y)) > 0.0:
        return 0.0
    windows = [np.lib.stride_tricks.sliding_window_view(x, length)[:: max(length // 2, 1)] for x in (sp, y)]
    taper = np.hanning(length)
    size = np.maximum(windows[1].std(axis=1, keepdims=True), 1e-12 * float(np.ptp(y)))  # each window counts alike
    by_sp, by_y = (np.fft.rfft((x - x.mean(axis=1, keepdims=True)) / size * taper, axis=1) for x in windows)
    count = by_sp.shape[0]
    power_sp, power = (np.abs(by_sp) ** 2).mean(axis=0), (np.abs(by_y) ** 2).mean(axis=0)
    together = np.abs((by_sp.conj() * by_y).mean(axis=0)) ** 2 / np.maximum(power_sp * power, 1e-300)
    unbiased = np.clip((together - 1.2 / count) / (1.0 - 1.2 / count), 0.0, 1.0)
    return float((unbiased * power).sum() / power.sum())


def _sp_size(found: CauseInput) -> float:
    return 0.0 if found.sp is None else min(float(found.sp.std()) / max(float(found.pv.std()), 1e-300), 2.0)


def _at_limits(found: CauseInput, *, both: bool) -> float:
    """Share of the samples with OP at its largest and smallest values, without single ones; of both, the smaller."""
    near, single = 0.6 * found.op_step + 0.002 * found.op_range, FEW / found.op.size
    shares = float(np.mean(found.op >= found.op.max() - near)), float(np.mean(found.op <= found.op.min() + near))
    return max(min(shares) - single, 0.0) if both else max(sum(shares) - 2.0 * single, 0.0)


def _at_rate(found: CauseInput) -> float:
    """Share of the moves of OP that are as fast as its fastest, 3 % off at most."""
    moves = np.abs(np.diff(found.op))
    fast = float(np.quantile(moves, 0.97))
    near = np.abs(moves - fast) <= 0.03 * fast + 1.01 * found.op_step
    return float(np.mean(near)) if fast > 3.0 * found.op_step else 0.0


def _block_means(found: CauseInput, fewest: int) -> NDArray[np.float64]:
    """PV in means of a sixteenth of a period, `fewest` at least."""
    samples = found.per_period if found.oscillation.oscillating else 40.0
    size = int(np.clip(samples / 16.0, 1, max(found.pv.size / fewest, 1)))
    return found.pv[: found.pv.size // size * size].reshape(-1, size).mean(axis=1)


def _white(found: CauseInput) -> float:
    """Variance of the moves of PV's block means over twice their variance: 1 of white noise, 0 of a slow wave."""
    y = _block_means(found, 50)
    return float(np.var(np.diff(y)) / max(2.0 * float(np.var(y)), 1e-300))


def _damping(found: CauseInput, lags: int = 16) -> float:
    """-lg(1 - r) with r the largest pole of PV predicted from itself alone."""
    from scipy.linalg import solve_toeplitz

    y = standardise(_block_means(found, 100))
    products = np.array([y[: y.size - k] @ y[k:] for k in range(lags + 1)]) / y.size
    products[0] *= 1.0 + 1e-6
    poles = np.roots(np.r_[1.0, -solve_toeplitz(products[:-1], products[1:])])
    return -math.log10(max(1.0 - float(np.abs(poles).max()), 1e-4)) if poles.size else 0.0


def _foretold(found: CauseInput, share: float) -> float:
    """ln(1 + evidence foretold of a sticky valve), S of 1 % where `share` is 0, else that share of OP's range."""
    evidence = found.response.evidence
    if evidence is None:
        return math.nan
    S = 1.0 if share == 0.0 else max(share * found.op_range, float(S_GRID[0]))
    return math.log1p(max(float(np.interp(math.log(S), np.log(S_GRID), evidence)), 0.0))


def _signs(text: str) -> dict[str, int]:
    """Causes and signs: `valve+ external- tuning`; `unseen` is a valve that sticks or is stuck unseen."""
    return {one.rstrip("+-"): {"+": 1, "-": -1}.get(one[-1], 0) for one in text.split()}


def _feature(
    name: str, formula: str, causes: str, compute: Callable[[CauseInput], float], unit: str = "-"
) -> CauseFeature:
    return CauseFeature(name, formula, unit, _signs(causes), compute)


CAUSE_FEATURES: tuple[CauseFeature, ...] = (
    _feature("log_odds", "log odds of stiction by the verdict's model", "valve+ external unseen+",
             lambda x: x.log_odds),
    _feature("over_good", "asinh(LLR / 20)", "valve+ tuning external unseen+", _ratio("good")),
    _feature("over_deadband", "asinh(LLR / 20)", "valve unseen", _ratio("deadband")),
    _feature("over_dead_zone", "asinh(LLR / 20)", "valve+ dead_zone- unseen+", _ratio("dead_zone")),
    _feature("beside_load", "asinh(LLR / 20)", "valve+ unseen+", _ratio("beside_periodic_load")),
    _feature("load_over_good", "asinh(LLR / 20)", "valve tuning external+ dead_zone unseen",
             _over_good("periodic_load")),
    _feature("relay_over_good", "asinh(LLR / 20)", "external+ dead_zone unseen", _over_good("relay_load")),
    _feature("zone_over_good", "asinh(LLR / 20)", "dead_zone+ external-",
             _zone(lambda x: log_evidence(x.likelihood_ratio))),
    _feature("zone_width", "width over range of OP", "dead_zone",
             _zone(lambda x: (x.high - x.low) / max(x.op_high - x.op_low, 1e-9))),
    _feature("zone_crossings", "ln(1 + reversals of OP)", "dead_zone valve",
             _zone(lambda x: math.log1p(x.op_reversals))),
    _feature("stem_for_op", "asinh(LLR / 20), outside waves beside", "valve+ unseen+",
             lambda x: log_evidence(x.response.stem_for_op)),
    _feature("stem_beside_op", "asinh(BIC gain / 20), waves and OP beside", "valve+ unseen+",
             lambda x: log_evidence(x.response.stem_beside_op)),
    _feature("stem_gain", "asinh(gain / standard error), waves and OP beside", "valve unseen",
             lambda x: math.asinh(x.response.stem_gain)),
    _feature("stem_gain_beside_op", "asinh(gain / standard error)", "valve+",
             lambda x: math.asinh(x.controller.action * x.identification.process_gains["stem_beside_op"])),
    _feature("band_to_swing", "S / range of OP", "valve unseen",
             lambda x: min(x.identification.S / max(x.op_range, 1e-9), 1.5)),
    _feature("op_effect", "asinh(BIC gain of OP / 20), waves beside", "tuning external unseen-",
             lambda x: log_evidence(x.response.op_effect)),
    _feature("op_gain", "asinh(gain of OP / standard error), waves beside", "external unseen-",
             lambda x: math.asinh(x.response.op_gain)),
    _feature("op_effect_plain", "asinh(BIC gain of OP / 20)", "unseen",
             lambda x: log_evidence(x.response.op_effect_plain)),
    _feature("margin_low", "15 % point of ln(gain margin), waves beside", "tuning- external unseen",
             lambda x: x.response.beside_waves.low),
    _feature("margin_high", "85 % point of ln(gain margin), waves beside", "tuning- unseen",
             lambda x: x.response.beside_waves.high),
    _feature("plain_margin_low", "15 % point of ln(gain margin)", "tuning- external unseen",
             lambda x: x.response.plain.low),
    _feature("plain_margin_high", "85 % point of ln(gain margin)", "tuning- unseen", lambda x: x.response.plain.high),
    _feature("period_to_limit", "ln(period / period at the limit of stability), waves beside", "tuning external",
             lambda x: _period_over_limit(x, plain=False)),
    _feature("period_to_plain_limit", "ln(period / period at the limit of stability)", "tuning external",
             lambda x: _period_over_limit(x, plain=True)),
    _feature("sensitivity", "ln(1 / abs(1 + C P)) at the oscillation, sticky valve", "tuning",
             lambda x: _sensitivity(x, linear=False)),
    _feature("linear_sensitivity", "ln(1 / abs(1 + C P)) at the oscillation, good valve", "tuning external",
             lambda x: _sensitivity(x, linear=True)),
    _feature("line", "power of the main line over that of its octave", "tuning external sensor unseen",
             lambda x: _line(x, wide=1.5)),
    _feature("line_share", "power of the main line over all but slower power", "external",
             lambda x: _line(x, wide=math.inf)),
    _feature("regularity", "regularity of the oscillation", "tuning external",
             lambda x: min(x.oscillation.regularity, 10.0)),
    _feature("oscillates", "1 where the loop oscillates", "external rate_limit",
             lambda x: float(x.oscillation.oscillating)),
    _feature("damping", "-lg(1 - largest pole of PV)", "tuning unseen", _damping),
    _feature("sp_in_pv", "share of PV's power that goes with SP", "set_point tuning external unseen",
             lambda x: _coherence(x, "pv")),
    _feature("sp_in_op", "share of OP's power that goes with SP", "set_point", lambda x: _coherence(x, "op")),
    _feature("sp_in_error", "share of the error's power that goes with SP", "set_point",
             lambda x: _coherence(x, "error")),
    _feature("sp_size", "deviation of SP over that of PV", "set_point+ unseen", _sp_size),
    _feature("sp_cycles", "1 where SP has the same period", "set_point+", lambda x: float(x.oscillation.sp_cycles)),
    _feature("at_rate", "share of OP's moves at the largest rate", "rate_limit+ external", _at_rate),
    _feature("unexplained", "share of OP's moves that no controller explains", "rate_limit+ unseen",
             lambda x: x.controller.unexplained),
    _feature("at_limits", "share of the samples with OP at its ends", "tuning rate_limit external",
             lambda x: _at_limits(x, both=False)),
    _feature("at_both_limits", "smaller share of both ends", "tuning", lambda x: _at_limits(x, both=True)),
    _feature("pv_step", "quantisation step of PV over its range", "sensor+ external dead_zone-",
             lambda x: x.pv_step_share),
    _feature("spikes", "share of single samples off", "sensor+", lambda x: x.spike_share),
    _feature("white", "variance of PV's moves over twice its variance", "sensor external- unseen", _white),
    _feature("op_range", "ln(range of OP)", "unseen", lambda x: math.log(max(x.op_range, 1e-3)), "ln(% of span)"),
    _feature("linear_fit", "share of PV that a good valve explains in simulation", "unseen",
             lambda x: x.identification.fit_linear, "%"),
    _feature("foretold_at_1", "ln(1 + evidence of a valve with S of 1 %)", "unseen", lambda x: _foretold(x, 0.0)),
    _feature("foretold_at_swing", "ln(1 + evidence of a valve with S of 30 % of OP's range)", "unseen",
             lambda x: _foretold(x, 0.3)),
)  # fmt: skip
"""All features of the causes. LLR is twice the log likelihood ratio, BIC gain the gain of Schwarz's criterion."""


def compute_cause_features(found: CauseInput) -> dict[str, float]:
    """Compute all features of the causes.

    Parameters
    ----------
    found : CauseInput
        Results of the stages before.

    Returns
    -------
    dict of str to float
        Name -> value; NaN where a feature cannot be computed.
    """
    return {feature.name: float(feature.compute(found)) for feature in CAUSE_FEATURES}
