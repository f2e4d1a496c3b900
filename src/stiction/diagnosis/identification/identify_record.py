"""Identify the valve of a record by one of three models, and with it the process."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.identify import identify_valve
from stiction.diagnosis.identification.model_fit import fit_stenman, likely_candidates, likely_range
from stiction.diagnosis.identification.position import fit_position, with_position
from stiction.diagnosis.identification.process_fit import fit_process, in_seconds, pv_on_record
from stiction.diagnosis.identification.regression import build_regression, one_thread
from stiction.diagnosis.identification.signals import block_signals
from stiction.diagnosis.identification.three_parameter import (
    fit_three_parameter,
    op_moves,
    rate_interval,
    three_parameter_positions,
)

if TYPE_CHECKING:
    from stiction.diagnosis.identification.model_fit import ModelFit, PositionCosts
    from stiction.diagnosis.identification.position import PositionFit
    from stiction.diagnosis.identification.result import ControllerFit, Identification
    from stiction.diagnosis.identification.signals import BlockSignals
    from stiction.diagnosis.segment import JudgedSegment

__all__ = ["MODELS", "ComparedSignals", "SegmentFit", "compared_signals", "fit_segment", "identify_model"]

MODELS = ("kano", "stenman", "three_parameter")
"""Valve models that are identified."""


def identify_model(fitted: SegmentFit, model: str) -> Identification:
    """Identify the valve of a fitted segment by one of `MODELS`."""
    if model == "kano":
        return fitted.identification
    with one_thread():
        compared = compared_signals(fitted.segment, fitted.position)
        fit = fit_stenman(compared.costs) if model == "stenman" else fit_three_parameter(compared.costs)
        return _with_model(fitted, compared, fit, model)


@dataclass(frozen=True, eq=False)
class SegmentFit:
    """Controller, valve and process fitted to a judged segment."""

    segment: JudgedSegment
    """The segment."""
    controller: ControllerFit
    """The controller, which gives the sign of the process gain."""
    by_pv: Identification
    """Valve and process by OP and PV."""
    position: PositionFit | None
    """What the recorded valve position says; None where there is none that follows OP."""

    @property
    def identification(self) -> Identification:
        """The valve by the recorded position where it says something, else by the PV; the process by the PV."""
        return with_position(self.by_pv, self.position, recorded=self.segment.part.mv is not None)


def fit_segment(segment: JudgedSegment) -> SegmentFit:
    """Fit controller, Kano's valve and process to a judged segment, as `identify` and `diagnose` do."""
    mv = segment.part.mv
    with one_thread():  # more of them round sums in another way
        controller = fit_controller(segment)
        position = None if mv is None else fit_position(segment.op, mv)
        return SegmentFit(segment, controller, identify_valve(segment, controller), position)


class ComparedSignals(NamedTuple):
    """What the valves of other models are compared with."""

    signals: BlockSignals
    """The signals compared by the PV."""
    costs: PositionCosts
    """The recorded position, or the PV."""
    op_interval: float
    """Time between two values of OP in `costs` [s]."""


def compared_signals(segment: JudgedSegment, position: PositionFit | None) -> ComparedSignals:
    """Prepare the search of other models, on blocks finer than Kano's: r shows in how the stem moves."""
    signals = block_signals(
        segment.op, segment.pv, None if segment.period is None else segment.period / segment.dt,
        samples_per_period=30.0, min_blocks=1200, max_blocks=4000,
    )  # fmt: skip
    if position is not None:
        return ComparedSignals(signals, position.regression, segment.dt)
    costs = build_regression(signals.op, signals.pv, signals.per_block, signals.time_scale)
    return ComparedSignals(signals, costs, signals.samples // signals.per_block * segment.dt)


def _with_model(fitted: SegmentFit, compared: ComparedSignals, fit: ModelFit, model: str) -> Identification:
    """An identification with the valve of a fit in place of Kano's."""
    S, ratio, third, start = (float(x) for x in fit.best)
    r = third if model == "three_parameter" else np.inf
    rows = fit.found.valves
    likely, bands = likely_candidates(fit.found.cost, fit.share), 0.5 * rows[:, 0] * (1.0 + rows[:, 1])
    margin = RESOLUTION * S
    S_range, J_range = likely_range(rows[:, 0], likely, margin), likely_range(rows[:, 0] * rows[:, 1], likely, margin)
    known, segment = fitted.identification, fitted.segment
    (signals, costs, dt), record_dt = compared, segment.dt
    if model == "stenman":
        parameters, intervals = {"d": S}, {"d": S_range}
    else:
        low, high = rate_interval(fit, op_moves(costs.op))
        parameters = {"sb": 0.5 * S * (1.0 + ratio), "sj": S * ratio, "r": r / dt}
        intervals = {"sb": likely_range(bands, likely, margin), "sj": J_range, "r": (low / dt, high / dt)}
    average = signals.samples // signals.per_block * record_dt / dt
    blocks = three_parameter_positions(signals.op, signals.per_block, np.array([[S, ratio, r * average, start]]))[0]
    stem = three_parameter_positions(segment.op, 1, np.array([[S, ratio, r * record_dt / dt, start]]))[0]
    action, integrating = fitted.controller.action, segment.part.integrating
    process = fit_process(blocks, signals.pv, signals.period, action, integrating)
    found = replace(
        known, model=model, S=S, J=S * ratio, S_low=S_range[0], S_high=S_range[1], J_low=J_range[0],
        J_high=J_range[1], mv=stem, process=in_seconds(process, signals.samples * record_dt),
        pv=pv_on_record(signals, blocks, process, segment.op.size), fit=100.0 * (1.0 - process.error),
        parameters=parameters, parameter_intervals=intervals, segments=(), interval_features=(),
    )  # fmt: skip
    if fitted.position is not None:
        residual = costs.residuals(fit.position[np.newaxis])[0]
        linear = 1.0 - known.fit_linear / 100.0
        good = costs.residuals(costs.op[np.newaxis])[0]
        unexplained = float(residual @ residual) / float(good @ good) * linear
        found = replace(found, fit=100.0 * (1.0 - unexplained))
    return replace(found, reason=" ".join(filter(None, (known.reason, _open_parameters(found)))))


RESOLUTION = 0.015
"""Share of S by which an interval is wider than the likely valves that were tried [-]."""


def _open_parameters(found: Identification) -> str:
    """Which parameters the record does not determine, in sentences."""
    if found.model != "three_parameter":
        return ""
    sentences = ["sj cannot be determined from this record."] if found.J_undetermined else []
    low, high = found.parameter_intervals["r"]
    if low == 0.0 and np.isinf(high):
        sentences.append("r cannot be determined from this record: the valve explains it with any r.")
    elif np.isinf(high):
        sentences.append("r has no upper bound: OP never moved faster while the stem moved.")
    return " ".join(sentences)
