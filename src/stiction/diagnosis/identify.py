"""The valve of a record by one of three models, and with it the process."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.diagnosis.identification.identify_record import MODELS, fit_segment, identify_model
from stiction.diagnosis.pipeline import diagnose
from stiction.diagnosis.segment import judge_in_control, require_in_control
from stiction.errors import ParameterError
from stiction.records.record import require_record

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import Identification
    from stiction.records.record import LoopRecord

__all__ = ["identify"]


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
        When the record has no PV, the loop is out of control, its data cannot be used, or its quality codes can be
        read in several ways, with different verdicts.
    ParameterError
        When `model` is unknown, or `period` is not positive or shorter than four samples.

    Notes
    -----
    The segment is that of `diagnose`, unless `period` is given; Kano's valve is `diagnose(record).identification`.

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
    require_record(record)
    if period is not None:
        return identify_model(fit_segment(judge_in_control(record, period=period)), model)
    found = diagnose([record], methods=False)
    segment = require_in_control(found.segment)
    if model == "kano" and found.identification is not None:
        return found.identification
    return identify_model(fit_segment(segment), model)
