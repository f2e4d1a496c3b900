"""The first stage of a diagnosis: whether this controller moves this valve, and the process answers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.loop_state.bad_data import find_bad_data
from stiction.diagnosis.loop_state.manual import find_manual
from stiction.diagnosis.loop_state.not_in_command import find_not_in_command
from stiction.diagnosis.loop_state.pv_frozen import find_pv_frozen
from stiction.diagnosis.loop_state.saturated import find_saturated
from stiction.diagnosis.loop_state.shut_in import find_shut_in
from stiction.diagnosis.loop_state.signals_swapped import are_signals_swapped, fit_pi_equation
from stiction.diagnosis.loop_state.signals_unrelated import find_unrelated_signals
from stiction.diagnosis.loop_state.state import STATES, LoopState, StateName, StateStretch
from stiction.diagnosis.loop_state.valve_not_responding import find_valve_not_responding
from stiction.records.analysis_window import forward_fill_sp
from stiction.records.conditioned import Conditioned
from stiction.records.gaps import fill_short_gaps
from stiction.records.record import mask_outliers
from stiction.records.runs import runs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.loop_state.wind_up import WindUp
    from stiction.records.record import LoopRecord

__all__ = ["assess_loop_state"]


def assess_loop_state(record: LoopRecord | Conditioned, *, min_share: float = 0.5) -> LoopState:
    """Say whether the controller of a record moves the valve and the process answers.

    `record`: a record with OP and PV, or one that is ready for analysis. `min_share`: share of the record that must be
    out of control for a state to hold for the record as a whole [-]. Returns the state over most of the record, with
    what was measured, and the stretches in other states.

    A sample takes the first state that holds of: bad data, manual by the mode, shut in, PV frozen, valve not responding
    or not in command, saturated, manual by the signals. Signals that are swapped or unrelated concern the record as a
    whole, and count where most of it is in control.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> pv = np.where(np.arange(600) < 200, 150.0, 0.2) + np.random.default_rng(1).normal(0.0, 0.1, 600)
    >>> op = np.linspace(40.0, 90.0, 600)
    >>> assess_loop_state(st.LoopRecord("FIC-101", 1.0, op=op, pv=pv, loop_type="flow")).state
    'shut_in'
    """
    record = record.record if isinstance(record, Conditioned) else mask_outliers(record)
    pv = record.pv
    if pv is None or len(record) == 0:
        return LoopState("bad_data", 0.0, record.duration, rejects=("PV was not recorded.",))
    signals = _signals(record, pv)
    codes, wound_up = _sample_states(record, signals)
    stretches = [
        StateStretch(state, first, last, first * record.dt, last * record.dt, _numbers(signals, first, last))
        for code, state in enumerate(STATES)
        if code
        for first, last in runs(codes == code)
    ]
    stretches.sort(key=lambda one: one.first)
    if np.mean(codes != 0) > min_share:
        return _headline(record, codes, tuple(stretches), wound_up)
    state, numbers = _record_state(signals.op, pv, record.sp)
    share = 1.0 if state != "in_control" else float(np.mean(codes == 0))
    return LoopState(state, 0.0, record.duration, share, numbers, stretches=tuple(stretches))


class _Signals(NamedTuple):
    """The signals of a record, as the checks take them."""

    op: NDArray[np.float64]
    """Controller output [% of span], in another unit where the scale is not known."""
    pv: NDArray[np.float64]
    """Process variable [its unit]."""
    sp: NDArray[np.float64] | None
    """Set point, as recorded or as the controller's equation tells it [unit of PV]."""
    has_sp: bool
    """Whether the set point was recorded."""
    limits: tuple[float, float]
    """Output limits [% of span], infinite where the scale of OP is not known."""
    at_limit: NDArray[np.bool_]
    """Where OP rests at a limit."""


def _signals(record: LoopRecord, pv: NDArray[np.float64]) -> _Signals:
    """Take the signals from a record, OP in % of span and SP without gaps."""
    op, limits = _in_percent(record)
    op, pv = fill_short_gaps(op), fill_short_gaps(pv)  # a short gap does not end a rest
    at_limit = find_saturated(op, limits=limits)
    recorded = forward_fill_sp(record)[0]
    sp = recorded if recorded is not None else _estimate_set_point(np.where(at_limit, np.nan, op), pv)
    return _Signals(op, pv, sp, recorded is not None, limits, at_limit)


def _sample_states(record: LoopRecord, signals: _Signals) -> tuple[NDArray[np.int8], dict[StateName, WindUp]]:
    """State of each sample as its place in `STATES`, and the wind-up found."""
    op, pv, sp, has_sp, limits, at_limit = signals
    codes = np.zeros(op.size, dtype=np.int8)
    wound_up: dict[StateName, WindUp] = {}
    if record.auto is None:
        _mark(codes, "manual", find_manual(op, pv, limits=limits))
    _mark(codes, "saturated", at_limit)
    if sp is not None and math.isfinite(limits[1]):
        # A valve that rests closed is in normal service, as a vent or a bypass.
        at_top = at_limit & (op > 0.5 * sum(limits)) if has_sp else None
        needs_integral = has_sp and record.loop_type == "flow"
        if (stuck := find_valve_not_responding(op, pv, sp)) is not None:
            wound_up["valve_not_responding"] = stuck
        elif (out := find_not_in_command(op, pv, sp, at_limit=at_top, needs_integral=needs_integral)) is not None:
            wound_up["not_in_command"] = out
        for state, one in wound_up.items():
            _mark(codes, state, slice(one.first, one.last))
    _mark(codes, "pv_frozen", find_pv_frozen(op, pv))
    if record.loop_type in ("flow", "other"):
        _mark(codes, "shut_in", find_shut_in(op, pv, sp, low=limits[0]))
    if record.auto is not None:
        _mark(codes, "manual", find_manual(op, pv, record.auto))
    _mark(codes, "bad_data", find_bad_data(op, pv))
    return codes, wound_up


def _record_state(
    op: NDArray[np.float64], pv: NDArray[np.float64], sp: NDArray[np.float64] | None
) -> tuple[StateName, dict[str, float]]:
    """State that concerns the record as a whole, with its numbers."""
    if (shares := are_signals_swapped(op, pv, sp)) is not None:
        return "signals_swapped", {"unexplained": shares[0], "unexplained_swapped": shares[1]}
    if (coherences := find_unrelated_signals(op, pv, sp)) is not None:
        return "signals_unrelated", {"coherence": coherences[0], "coherence_shifted": coherences[1]}
    return "in_control", {}


def _headline(
    record: LoopRecord, codes: NDArray[np.int8], stretches: tuple[StateStretch, ...], wound_up: dict[StateName, WindUp]
) -> LoopState:
    """The state that most samples out of control have, with the numbers of its longest stretch."""
    code = int(np.argmax(np.bincount(codes, minlength=len(STATES))[1:])) + 1
    state = STATES[code]
    own = [one for one in stretches if one.state == state]
    numbers = dict(max(own, key=lambda one: one.last - one.first).numbers)
    numbers["by_mode"] = float(record.auto is not None)
    if (one := wound_up.get(state)) is not None:
        numbers |= {"op_start": one.op_start, "op_end": one.op_end, "error": one.mean_error}
        numbers |= {"move_end_s": one.last_move * record.dt, "period_s": one.period * record.dt}
    share = float(np.mean(codes == code))
    return LoopState(state, own[0].start_s, own[-1].end_s, share, numbers, stretches=stretches)


def _mark(codes: NDArray[np.int8], state: StateName, where: NDArray[np.bool_] | slice) -> None:
    """Give samples a state, whatever state they had."""
    codes[where] = STATES.index(state)


def _in_percent(record: LoopRecord) -> tuple[NDArray[np.float64], tuple[float, float]]:
    """OP in % of span with its limits; a scale that is not known has no limits."""
    op = record.op
    if record.op_in_percent:
        return op, (0.0, 100.0)
    known = op[np.isfinite(op)]
    if known.size and known.min() >= 0.0 and known.max() <= 1.0:
        return 100.0 * op, (0.0, 100.0)
    return op, (-math.inf, math.inf)


def _estimate_set_point(
    op: NDArray[np.float64], pv: NDArray[np.float64], max_unexplained: float = 0.1
) -> NDArray[np.float64] | None:
    """The constant set point for which a PI equation computes OP from PV; None when no such equation holds."""
    fit = fit_pi_equation(op, pv)
    if fit is None or fit.unexplained > max_unexplained or not math.isfinite(fit.set_point):
        return None
    return np.full(pv.size, fit.set_point)


def _numbers(signals: _Signals, first: int, last: int) -> dict[str, float]:
    """Levels of OP and PV in a stretch, as far as they were recorded."""
    op, pv, sp, _, limits, _ = signals
    known = np.flatnonzero(np.isfinite(op[first:last])) + first
    numbers = {"samples": float(last - first), "op_in_percent": float(math.isfinite(limits[1]))}
    if known.size:
        numbers |= {"op_start": float(op[known[0]]), "op_end": float(op[known[-1]])}
    if np.isfinite(pv[first:last]).any():
        numbers["pv"] = float(np.nanmean(pv[first:last]))
        if sp is not None and np.isfinite(sp[first:last] - pv[first:last]).any():
            numbers["error"] = float(np.nanmean(sp[first:last] - pv[first:last]))
    return numbers
