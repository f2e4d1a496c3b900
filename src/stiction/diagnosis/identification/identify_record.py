"""Identify the valve of a record by one of three models, and with it the process."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.identify import identify_valve, in_seconds, pv_on_record
from stiction.diagnosis.identification.model_fit import fit_stenman, likely_candidates, likely_range
from stiction.diagnosis.identification.position import fit_position, with_position
from stiction.diagnosis.identification.process_fit import fit_process
from stiction.diagnosis.identification.regression import build_regression, one_thread
from stiction.diagnosis.identification.signals import block_signals
from stiction.diagnosis.identification.three_parameter import (
    fit_three_parameter,
    op_moves,
    rate_interval,
    three_parameter_positions,
)
from stiction.diagnosis.oscillation import find_oscillation
from stiction.errors import ParameterError, RecordError
from stiction.records.conditioned import condition
from stiction.records.record import missing_pv_hint, require_record

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.model_fit import ModelFit, PositionCosts
    from stiction.diagnosis.identification.position import PositionFit
    from stiction.diagnosis.identification.result import ControllerFit, Identification
    from stiction.diagnosis.identification.signals import BlockSignals
    from stiction.records.record import LoopRecord

__all__ = ["MODELS", "PreparedRecord", "identify", "prepare_record"]

MODELS = ("kano", "stenman", "three_parameter")
"""Valve models that are identified."""
MIN_SAMPLES = 30
"""Samples that must be known [-]."""
NOT_USED = "The recorded valve position was not used: it has few values, does not follow OP, or is a copy of OP."
"""Remark on a record whose position says nothing about the stem."""


def identify(record: LoopRecord, model: str = "kano", *, period: float | None = None) -> Identification:
    """Identify stiction and process together.

    Parameters
    ----------
    record : LoopRecord
        A record with OP and PV. Where it has a valve position (MV) that follows OP, the valve is identified by the
        position, and the process by the PV.
    model : str
        Valve model; "kano" fits S and J, "stenman" d, "three_parameter" sb, sj and r of eq. 5 repaired.
    period : float, optional
        Period of the oscillation [s]. It is found where it is not given; `inf` says that nothing oscillates.

    Returns
    -------
    Identification
        S and J with intervals, the model's own parameters with theirs, the process, and both simulations.

    Raises
    ------
    RecordError
        When the record has no PV, OP or PV does not vary, or fewer than 30 samples can be analysed.
    ParameterError
        When `model` is unknown, or `period` is not positive or shorter than four samples.

    Notes
    -----
    A candidate valve is simulated over OP, and an autoregression predicts the PV one sample ahead from earlier values
    of PV, OP and valve position; the best valve leaves the smallest prediction error. It is searched from a grid, by
    pattern searches with smaller and smaller steps. The process is fitted afterwards, by the error of its simulation
    from the valve position. Intervals of S and J of Kano's valve are those of simulated loops with the same noise and
    sampling, all others come from the profile likelihood. In a limit cycle that repeats exactly S, r and the dead time
    cannot be told apart, and the intervals are long; a set point or load that moves shortens them.

    References
    ----------
    srinivasan2005; jelali2008: search over the nonlinear block around a least-squares fit of the linear one.
    srinivasan2008, eqs. 4 and 5; stenman2003.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> found = st.identify(st.simulate(loop, sp=10.0, duration=2000.0, seed=1))
    >>> abs(found.S - 3.0) < 0.3
    True
    """
    if model not in MODELS:
        raise ParameterError(f"model = {model!r} cannot be identified; use {', '.join(map(repr, MODELS))}.")
    prepared = prepare_record(record, period)
    found = prepared.identify_kano()
    if model == "kano":
        return found
    with one_thread():
        fit = fit_stenman(prepared.costs) if model == "stenman" else fit_three_parameter(prepared.costs)
        return _with_model(prepared, found, fit, model)


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """A record that is ready for the search of any valve model."""

    record: LoopRecord
    """The part that is analysed."""
    op: NDArray[np.float64]
    """Its OP without gaps [% of span]."""
    pv: NDArray[np.float64]
    """Its PV without gaps [engineering units]."""
    period: float | None
    """Period of the oscillation [s]; None where there is none."""
    controller: ControllerFit
    """The controller, which gives the sign of the process gain."""
    position: PositionFit | None
    """What the recorded position says; None where there is none that follows OP."""
    signals: BlockSignals
    """The signals compared by the PV."""
    costs: PositionCosts
    """What valve positions are compared with: the recorded position, or the PV."""

    @property
    def op_interval(self) -> float:
        """Time between two values of OP in `costs` [s]."""
        average = 1 if self.position is not None else self.signals.samples // self.signals.per_block
        return average * self.record.dt

    def identify_kano(self) -> Identification:
        """S and J, and the process."""
        found = identify_valve(self.op, self.pv, self.record.dt, self.period, self.controller, self.record.integrating)
        if self.position is not None:
            return with_position(found, self.position)
        return replace(found, reason=f"{found.reason} {NOT_USED}".strip()) if self.record.mv is not None else found


def prepare_record(record: LoopRecord, period: float | None = None) -> PreparedRecord:
    """Prepare a record for the search of valve models.

    The part that is analysed, its oscillation and controller. Arguments and errors are those of `identify`.
    """
    require_record(record)
    _check_period(record, period)
    if record.pv is None:
        raise RecordError(f"{record.tag} has no PV; identification needs OP and PV. {missing_pv_hint(record)}")
    for name, signal in (("OP", record.op), ("PV", record.pv)):
        known = signal[np.isfinite(signal)]
        if known.size and not float(np.ptp(known)) > 1e-9 * float(np.abs(known).max()):
            raise RecordError(f"{record.tag}: {name} does not vary; record while the controller moves the valve.")
    conditioned = condition(record)
    if conditioned.op.size < MIN_SAMPLES or conditioned.pv.size < MIN_SAMPLES or not conditioned.moves:
        raise RecordError(
            f"{record.tag}: {conditioned.op.size} samples in which both OP and PV vary can be analysed, {MIN_SAMPLES} "
            "are needed; record longer, with the controller in automatic."
        )
    part = conditioned.record.window(conditioned.first, conditioned.last)
    if period is None:
        oscillation = find_oscillation(conditioned.part)
        period = oscillation.period if oscillation.oscillating else None
    elif np.isinf(period):
        period = None
    position = None if part.mv is None else fit_position(conditioned.op, part.mv)
    # Blocks finer than those of a diagnosis: r shows in how the stem moves from sample to sample.
    signals = block_signals(
        conditioned.op, conditioned.pv, None if period is None else period / record.dt,
        samples_per_period=30.0, min_blocks=1200, max_blocks=4000,
    )  # fmt: skip
    return PreparedRecord(
        part, conditioned.op, conditioned.pv, period, fit_controller(part), position, signals,
        build_regression(signals.op, signals.pv, signals.per_block, signals.time_scale)
        if position is None else position.regression,
    )  # fmt: skip


def _check_period(record: LoopRecord, period: float | None, *, min_samples: float = 4.0) -> None:
    if period is None:
        return
    if not period > 0.0:
        raise ParameterError(
            f"period = {period:g} s is not positive; give the period of the oscillation, leave it out to estimate "
            "it, or give inf if nothing oscillates."
        )
    if period < min_samples * record.dt:
        raise ParameterError(
            f"period = {period:g} s is shorter than {min_samples:g} samples of {record.dt:g} s; give the period of "
            "the oscillation, leave it out to estimate it, or record faster."
        )


def _with_model(prepared: PreparedRecord, known: Identification, fit: ModelFit, model: str) -> Identification:
    """An identification with the valve of a fit in place of Kano's."""
    S, ratio, third, start = (float(x) for x in fit.best)
    r = third if model == "three_parameter" else np.inf
    rows = fit.found.valves
    likely, bands = likely_candidates(fit.found.cost, fit.share), 0.5 * rows[:, 0] * (1.0 + rows[:, 1])
    margin = RESOLUTION * S
    S_range, J_range = likely_range(rows[:, 0], likely, margin), likely_range(rows[:, 0] * rows[:, 1], likely, margin)
    dt, signals = prepared.op_interval, prepared.signals
    if model == "stenman":
        parameters, intervals = {"d": S}, {"d": S_range}
    else:
        low, high = rate_interval(fit, op_moves(prepared.costs.op))
        parameters = {"sb": 0.5 * S * (1.0 + ratio), "sj": S * ratio, "r": r / dt}
        intervals = {"sb": likely_range(bands, likely, margin), "sj": J_range, "r": (low / dt, high / dt)}
    average = signals.samples // signals.per_block * prepared.record.dt / dt
    blocks = three_parameter_positions(signals.op, signals.per_block, np.array([[S, ratio, r * average, start]]))[0]
    stem = three_parameter_positions(prepared.op, 1, np.array([[S, ratio, r * prepared.record.dt / dt, start]]))[0]
    process = fit_process(blocks, signals.pv, signals.period, prepared.controller.action, prepared.record.integrating)
    found = replace(
        known, model=model, S=S, J=S * ratio, S_low=S_range[0], S_high=S_range[1], J_low=J_range[0],
        J_high=J_range[1], mv=stem, process=in_seconds(process, signals.samples * prepared.record.dt),
        pv=pv_on_record(signals, blocks, process, prepared.op.size), fit=100.0 * (1.0 - process.error),
        parameters=parameters, parameter_intervals=intervals, segments=(), interval_features=(),
    )  # fmt: skip
    if prepared.position is not None:
        residual = prepared.costs.residuals(fit.position[np.newaxis])[0]
        linear = 1.0 - known.fit_linear / 100.0
        good = prepared.costs.residuals(prepared.costs.op[np.newaxis])[0]
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
