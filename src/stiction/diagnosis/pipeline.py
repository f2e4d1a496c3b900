"""The main question: whether the valve sticks, how much, how sure that is, and what to do."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection import detect_all
from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.identify import identify_valve
from stiction.diagnosis.identification.position import PositionFit, fit_position
from stiction.diagnosis.loop_state import LoopState, assess_loop_state
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.verdict.causes import OscillationCause, assess_causes
from stiction.diagnosis.verdict.decision import Costs, decide
from stiction.diagnosis.verdict.diagnosis import Diagnosis
from stiction.diagnosis.verdict.features import FeatureInput, compute_features
from stiction.diagnosis.verdict.model import stiction_model
from stiction.diagnosis.verdict.readings import compare_readings
from stiction.errors import RecordError, require_probability
from stiction.records.assess import assess_quality
from stiction.records.conditioned import Conditioned, condition
from stiction.records.quantiles import robust_std
from stiction.records.record import missing_pv_hint, require_record

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import ControllerFit, Identification
    from stiction.diagnosis.result import Oscillation
    from stiction.records.assess import Quality
    from stiction.records.record import LoopRecord

__all__ = ["diagnose", "find_features"]


def diagnose(record: LoopRecord, *, prior: float = 0.25, costs: Costs | None = None) -> Diagnosis:
    """Say whether the valve of a loop sticks, how much, how sure that is, and what to do.

    Parameters
    ----------
    record : LoopRecord
        A record of one loop, OP and PV at least.
    prior : float
        Share of sticky valves where the record comes from [-].
    costs : Costs, optional
        What a false alarm, a missed sticky valve and an open question cost; 1, 1 and 0.2 when not given.

    Returns
    -------
    Diagnosis
        Verdict with probability, reason and action; the evidence; the identified valve and process. A record that
        cannot be judged is `undecided`, with the reason.

    Raises
    ------
    RecordError
        When the record has no PV at all, or is a path or the list that `read` gives.
    ParameterError
        When the prior is not between 0 and 1.

    Notes
    -----
    The stages are those of the code below, each a function of the results before it. See docs/understand/verdict.md.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> st.diagnose(st.simulate(loop, sp=10.0, duration=2000.0, loop_type="flow")).verdict
    'stiction'
    """
    _check(record, prior)
    costs = costs or Costs()
    if record.other_readings:
        readings = (replace(record, other_readings=()), *record.other_readings)
        return compare_readings([diagnose(one, prior=prior, costs=costs) for one in readings])
    conditioned = condition(record)
    state = assess_loop_state(conditioned)
    judged = conditioned.without(_left_out(state)) if state.in_control else conditioned
    oscillation = find_oscillation(judged.part)
    quality = assess_quality(judged, oscillation.period if oscillation.oscillating else None)
    if state.in_control and not (quality.usable and judged.moves):
        state = _bad_data(state, quality)
    if not state.in_control:
        return _undecided(conditioned.record, state, oscillation, quality, prior, costs)
    controller = _fit_controller(judged, quality)
    valve = _identify(judged, oscillation, controller)
    position = _position(judged)
    found = FeatureInput(
        valve, controller, oscillation, judged.op_swing, _ratio(judged.pv_step, judged.pv_swing),
        np.nan if position is None else position.likelihood_ratio,
    )  # fmt: skip
    features = compute_features(found)
    model = stiction_model()
    probability = model.probability(features, prior)
    causes = assess_causes(
        valve, controller, oscillation, probability, pv_step_share=found.pv_step_share, spike_share=_spikes(judged.pv)
    )
    return Diagnosis(
        record=conditioned.record,
        verdict=decide(probability, costs),
        probability=probability,
        loop_state=state,
        oscillation=oscillation,
        oscillation_cause=causes,
        quality=quality,
        evidence=detect_all(judged.part, oscillation),
        identification=valve if position is None else _with_position(valve, position),
        controller=controller,
        features=features,
        contributions=model.contributions(features),
        prior=prior,
        costs=costs,
    )


def _check(record: LoopRecord, prior: float) -> None:
    require_record(record)
    if record.pv is None:
        raise RecordError(f"{record.tag} has no PV; a diagnosis needs OP and PV. {missing_pv_hint(record)}")
    require_probability("prior", prior)


EXCLUDED_STATES = ("manual", "not_in_command", "shut_in", "valve_not_responding", "pv_frozen", "bad_data")
"""States whose stretches are left out; at a limit OP is still what the valve was sent."""


def _left_out(state: LoopState) -> list[tuple[int, int]]:
    return [(one.first, one.last) for one in state.stretches if one.state in EXCLUDED_STATES]


def _bad_data(state: LoopState, quality: Quality) -> LoopState:
    """The state of a record that the data checks reject."""
    rejects = tuple(check.why for check in quality.rejections)
    why = rejects or ("OP or PV does not vary enough to identify a valve; record while both move.",)
    return replace(state, state="bad_data", share=1.0, rejects=why)


def _undecided(
    record: LoopRecord, state: LoopState, oscillation: Oscillation, quality: Quality, prior: float, costs: Costs
) -> Diagnosis:
    """The diagnosis of a record in which the valve cannot be judged."""
    return Diagnosis(
        record, "undecided", prior, state, oscillation, OscillationCause(0.0, 0.0, 0.0, 0.0, 0.0), quality,
        prior=prior, costs=costs,
    )  # fmt: skip


def _fit_controller(judged: Conditioned, quality: Quality) -> ControllerFit:
    part = judged.record.window(judged.first, judged.last)
    is_averaged = any(check.name == "moving average" for check in quality.checks)
    return fit_controller(part, (judged.op_step, judged.pv_step), is_averaged)


def _identify(judged: Conditioned, oscillation: Oscillation, controller: ControllerFit) -> Identification:
    period = oscillation.period if oscillation.oscillating else None
    return identify_valve(
        judged.op, judged.pv, judged.record.dt, period, controller, judged.record.integrating, judged.gaps
    )


def _position(judged: Conditioned) -> PositionFit | None:
    """Stiction by the recorded valve position, where there is one."""
    mv = judged.record.mv
    return None if mv is None else fit_position(judged.op, mv[judged.first : judged.last])


def _with_position(valve: Identification, position: PositionFit) -> Identification:
    """S and J by the position, the process by the PV."""
    S, J = position.valve.S, position.valve.S * position.valve.ratio
    return replace(
        valve, S=S, J=J, S_low=position.S_range[0], S_high=position.S_range[1], J_low=position.J_range[0],
        J_high=position.J_range[1], mv=position.position, by_position=True, fit=position.explained, reason="",
    )  # fmt: skip


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole > 0.0 else 0.0


def _spikes(pv: np.ndarray, *, min_jump: float = 8.0) -> float:
    """Share of the samples in which the PV jumps away from both neighbours, by robust deviations of its moves [-]."""
    moves = np.diff(pv)
    usual = robust_std(moves) if moves.size else 0.0
    if not usual > 0.0:
        return 0.0
    away = (moves[:-1] * moves[1:] < 0.0) & (np.minimum(np.abs(moves[:-1]), np.abs(moves[1:])) > min_jump * usual)
    return float(np.mean(away))


def find_features(record: LoopRecord) -> dict[str, float]:
    """Compute the features of a record (see `verdict.features.FEATURES`); empty where it cannot be judged."""
    return diagnose(record).features
