"""From OP and PV to the sticky valve and the process behind it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.alternatives import alternative_costs, good_valve_cost, process_gains
from stiction.diagnosis.identification.candidates import joined
from stiction.diagnosis.identification.dead_zone import DeadZone
from stiction.diagnosis.identification.intervals import interval_features, intervals, segment_estimates, trend
from stiction.diagnosis.identification.process_fit import fit_process, in_seconds, pv_on_record
from stiction.diagnosis.identification.regression import MAX_POSITION_LAG, build_regression
from stiction.diagnosis.identification.result import Identification, LikelihoodSurface, Segment
from stiction.diagnosis.identification.search import (
    first_grid,
    refine_valve,
    search_behind_lags,
    search_deadband,
    search_valve,
)
from stiction.diagnosis.identification.signals import BlockSignals, block_signals
from stiction.diagnosis.identification.stems import whole_position
from stiction.records.quality.movement import count_reversals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.candidates import Candidates, Valve
    from stiction.diagnosis.identification.regression import Regression
    from stiction.diagnosis.identification.result import ControllerFit
    from stiction.diagnosis.segment import JudgedSegment

__all__ = ["ValveSearch", "identify_valve", "search_record"]

STICKY_SEGMENT = 12.0
"""Twice the log likelihood ratio from which a part of the record counts as sticky [-]: twice the 95 % point of
chi-square with two degrees of freedom, because the best of many valves is taken."""

LAG_WORTH = 8.0
"""Twice the log likelihood ratio that a lag of the actuator is worth by chance [-]."""


@dataclass(frozen=True, eq=False)
class ValveSearch:
    """The most likely valve and what it was compared with."""

    signals: BlockSignals
    """The signals compared."""
    regression: Regression
    """The regression of the last search."""
    candidates: Candidates
    """All valves compared in it."""
    valve: Valve
    """The most likely valve on shorter blocks, which show S and J better."""
    likelihood_ratios: dict[str, float]
    """Twice the log likelihood ratio of the best valve over each other explanation [-]."""
    gains: dict[str, float]
    """Process gain from the position of the best valve over its standard error [-], alone and beside OP."""
    dead_zone: DeadZone
    """The most likely dead zone at fixed OP."""
    surface: LikelihoodSurface
    """The first search."""


def search_record(
    op: NDArray[np.float64], pv: NDArray[np.float64], period: float | None, gaps: NDArray[np.bool_] | None = None
) -> ValveSearch:
    """Search the most likely valve of a record and compare it with other explanations.

    OP [% of span] and PV [engineering units] are filled where `gaps` says that nothing was recorded; the period is in
    samples, None without an oscillation.
    """
    signals = block_signals(op, pv, period, gaps=gaps)
    coarse = block_signals(op, pv, period, samples_per_period=16.0, max_blocks=1000, max_op_per_block=4, gaps=gaps)
    max_S = float(np.ptp(signals.op))
    fine = _regression(signals)
    first = fine if coarse.op.size == signals.op.size else _regression(coarse, 24)
    found, grid = search_valve(first, fine, max_S)
    short = block_signals(op, pv, period, samples_per_period=30.0, min_blocks=1200, max_blocks=4000, gaps=gaps)
    refined = refine_valve(fine if short.pv.size == signals.pv.size else _regression(short), found, max_S)
    found = joined(found, fine.evaluate(refined.local_minima(6, 0.002, 0.02)))
    sticky = fine.positions(np.array([found.best]))[0]
    costs, both, zone = alternative_costs(fine, signals.period, sticky, signals.gaps)
    gains = process_gains(fine, sticky)
    surface = _surface(first, grid, max_S)
    own = float(found.cost.min())
    deadband = search_deadband(fine, found, max_S)
    sticky_behind_lag, deadband_behind_lag = search_behind_lags(first, fine, found.best, max_S)
    best = min(own, deadband, sticky_behind_lag + LAG_WORTH)
    ratios = {name: cost - best for name, cost in costs.items()}
    deadband = min(deadband, deadband_behind_lag)
    ratios["deadband"] = deadband - min(own, sticky_behind_lag, deadband)
    if np.isfinite(both):
        ratios["beside_periodic_load"] = both
    reversals = count_reversals(sticky), count_reversals(signals.op, 0.25 * max_S)
    op_range = float(signals.op.min()), float(signals.op.max())
    dead_zone = DeadZone(*zone, *op_range, costs["good"] - costs["dead_zone"], *reversals)
    return ValveSearch(signals, fine, found, refined.best, ratios, gains, dead_zone, surface)


def _regression(signals: BlockSignals, max_position_lag: int = MAX_POSITION_LAG) -> Regression:
    return build_regression(
        signals.op,
        signals.pv,
        signals.per_block,
        signals.time_scale,
        max_position_lag=max_position_lag,
        gaps=signals.gaps,
    )


def _surface(regression: Regression, grid: Candidates, max_S: float) -> LikelihoodSurface:
    """The first search as a map; the better of both rules of motion counts."""
    S, ratio = first_grid(max_S)
    cost = grid.cost.reshape(S.size, ratio.size, 2).min(axis=2)
    return LikelihoodSurface(S, ratio, good_valve_cost(regression) - cost)


def identify_valve(segment: JudgedSegment, controller: ControllerFit) -> Identification:
    """Identify stiction and process together from OP and PV; the controller gives the sign of the process gain."""
    op, dt, period, integrating = segment.op, segment.dt, segment.period, segment.part.integrating
    search = search_record(op, segment.pv, None if period is None else period / dt, segment.signals.gaps)
    signals, regression, valve = search.signals, search.regression, search.valve
    features = interval_features(
        op, valve, search.likelihood_ratios["good"], regression.half_cycles, exact=controller.exact
    )
    S, J = intervals(valve, features, float(np.ptp(signals.op)))
    stem = whole_position(op, valve)
    used = slice(signals.first, signals.first + signals.pv.size * signals.samples)
    position = stem[used].reshape(-1, signals.samples).mean(axis=1)
    good = signals.op.reshape(-1, signals.per_block).mean(axis=1)
    fits = [fit_process(x, signals.pv, signals.period, controller.action, integrating) for x in (position, good)]
    simulated = [pv_on_record(signals, x, fit, op.size) for x, fit in zip((position, good), fits, strict=True)]
    segments = _segments(search, S[0], S[0] * valve.ratio, op.size)
    sticky = [segment for segment in segments if segment.likelihood_ratio > STICKY_SEGMENT]
    hours = np.array([0.5 * (one.first + one.last) * dt / 3600.0 for one in sticky])
    drift, drift_error = trend(hours, np.array([one.S for one in sticky]))
    return Identification(
        model="kano",
        S=S[0], J=J[0], S_low=S[1], S_high=S[2], J_low=J[1], J_high=J[2],
        process=in_seconds(fits[0], signals.samples * dt),
        linear=in_seconds(fits[1], signals.samples * dt),
        fit=100.0 * (1.0 - fits[0].error),
        fit_linear=100.0 * (1.0 - fits[1].error),
        mv=stem, pv=simulated[0], pv_linear=simulated[1],
        likelihood_ratios=search.likelihood_ratios,
        process_gains=search.gains,
        dead_zone=search.dead_zone,
        surface=search.surface,
        segments=segments,
        drift=drift,
        drift_error=drift_error,
        reason="" if controller.exact else NOT_EXACT,
        interval_features=tuple(features.tolist()),
    )  # fmt: skip


NOT_EXACT = "The record does not show every move of the controller output, which widens the interval of S."
"""Remark on a record that is slower than its controller, averaged or compressed."""


def _segments(
    search: ValveSearch, S: float, J: float, n_samples: int, *, cycles: float = 8.0, most: int = 8
) -> tuple[Segment, ...]:
    """S and evidence of parts of about eight cycles, at most eight; S and J [% of span] are those of the record."""
    signals, valve = search.signals, search.candidates.best
    count = int(np.clip(search.regression.n_predicted / (cycles * signals.time_scale), 1, most))
    sizes, ratios, ends = segment_estimates(search.regression, valve, count)
    samples = signals.first + np.minimum(ends * signals.samples, n_samples)
    return tuple(
        Segment(int(first), int(last), float(size / valve.S) * S, float(size / valve.S) * J, float(ratio))
        for first, last, size, ratio in zip(samples[:-1], samples[1:], sizes, ratios, strict=True)
    )
