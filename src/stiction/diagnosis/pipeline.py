"""The main question: whether the valve sticks, how much, how sure that is, and what to do."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection import detect_all
from stiction.diagnosis.evidence.diagnose_windows import diagnose_windows
from stiction.diagnosis.evidence.further import diagnose_further
from stiction.diagnosis.identification.identify_record import fit_segment
from stiction.diagnosis.identification.loop_response import fit_response
from stiction.diagnosis.identification.regression import one_thread
from stiction.diagnosis.segment import judge_segment
from stiction.diagnosis.verdict.cause_features import CauseInput, compute_cause_features
from stiction.diagnosis.verdict.causes import assess_causes, find_detectable_S, is_position, is_stuck
from stiction.diagnosis.verdict.decision import DEFAULT_PRIOR, DEFAULT_SMALLEST_S, Costs, decide
from stiction.diagnosis.verdict.diagnosis import Diagnosis
from stiction.diagnosis.verdict.features import FeatureInput, compute_features
from stiction.diagnosis.verdict.finding import is_backlash
from stiction.diagnosis.verdict.model import log_odds, stiction_model
from stiction.diagnosis.verdict.readings import compare_readings
from stiction.errors import require_positive, require_probability

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.evidence.further import StoredWindow
    from stiction.diagnosis.segment import JudgedSegment
    from stiction.records.record import LoopRecord

__all__ = ["diagnose", "diagnose_new"]


def diagnose(
    records: Sequence[LoopRecord],
    *,
    prior: float = 0.25,
    costs: Costs | None = None,
    smallest_S: float = DEFAULT_SMALLEST_S,
    methods: bool = True,
) -> Diagnosis:
    """Diagnose a loop from its records, in the order of time and none twice; see `order_records`.

    `stiction.diagnose` puts them in order, reads paths and frames, and describes parameters, result and errors.
    """
    require_probability("prior", prior)
    smallest_S = require_positive("smallest_S", smallest_S, "% of span")
    costs = costs or Costs()

    def judge(segment: JudgedSegment, methods: bool) -> Diagnosis:
        return _diagnose(segment, prior, costs, smallest_S, methods)

    with one_thread():
        if len(records) > 1 or not records[0].other_readings:
            return diagnose_windows(records, judge, methods=methods)
        segments = [judge_segment(one) for one in (records[0], *records[0].other_readings)]
        return compare_readings([judge(segment, methods) for segment in segments])


def diagnose_new(
    record: LoopRecord,
    stored: Sequence[StoredWindow],
    length: float | None,
    *,
    prior: float,
    costs: Costs,
    smallest_S: float = DEFAULT_SMALLEST_S,
) -> tuple[Diagnosis, list[StoredWindow]]:
    """Diagnose a loop of which a ledger holds windows: judge what is new in the record, and pool all.

    Returns the diagnosis, and the windows that are new or changed; see `diagnose_further`.
    """

    def judge(segment: JudgedSegment, methods: bool) -> Diagnosis:
        return _diagnose(segment, prior, costs, smallest_S, methods)

    with one_thread():
        if record.other_readings:
            return diagnose([record], prior=prior, costs=costs, smallest_S=smallest_S, methods=False), []
        return diagnose_further(record, stored, length, judge)


def _diagnose(segment: JudgedSegment, prior: float, costs: Costs, smallest_S: float, methods: bool) -> Diagnosis:
    """The stages from the judged segment to the verdict."""
    if not segment.loop_state.in_control:
        return Diagnosis(segment, "undecided", prior, prior=prior, costs=costs, smallest_S=smallest_S)
    fitted = fit_segment(segment)
    position_gain = math.nan if fitted.position is None else fitted.position.likelihood_ratio
    features = compute_features(
        FeatureInput(
            fitted.by_pv, fitted.controller, segment.oscillation, segment.signals.op_swing, segment.pv_step_share,
            position_gain,
        )
    )  # fmt: skip
    model = stiction_model()
    contributions = model.contributions(features)
    probability = model.sum_up(contributions, prior)
    sp = segment.part.sp
    sp = sp if sp is not None and np.isfinite(sp).all() else None
    response = fit_response(segment.op, segment.pv, segment.dt, segment.period, fitted.controller, fitted.by_pv, sp)
    cause_features = compute_cause_features(
        CauseInput(
            segment.op, segment.pv, sp, segment.dt,
            segment.signals.op_step, segment.pv_step_share, segment.oscillation,
            controller=fitted.controller, identification=fitted.by_pv, response=response,
            log_odds=log_odds(model.sum_up(contributions, DEFAULT_PRIOR)),
        )
    )  # fmt: skip
    S_detectable, causes = find_detectable_S(cause_features, response), assess_causes(cause_features, prior)
    excluded = S_detectable is not None and S_detectable <= smallest_S
    excluded |= is_backlash(causes, fitted.identification, smallest_S)  # play is what shows in place of stiction
    return Diagnosis(
        segment=segment,
        verdict=decide(probability, costs, excluded=excluded),
        probability=probability,
        oscillation_cause=causes,
        stuck=is_stuck(cause_features, causes),
        op_is_position=is_position(cause_features, causes),
        S_detectable=S_detectable,
        smallest_S=smallest_S,
        cause_features=cause_features,
        response=response,
        evidence=detect_all(segment.part, segment.oscillation) if methods else (),
        identification=fitted.identification,
        controller=fitted.controller,
        features=features,
        contributions=contributions,
        prior=prior,
        costs=costs,
    )
