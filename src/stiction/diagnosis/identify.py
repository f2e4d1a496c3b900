"""The valve of a record by one of three models, and with it the process; which of them the record supports."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.diagnosis.evidence.windows import is_one_window
from stiction.diagnosis.identification.compare_models import compare_fits
from stiction.diagnosis.identification.identify_record import MODELS, fit_segment, identify_model
from stiction.diagnosis.pipeline import diagnose
from stiction.diagnosis.segment import judge_in_control, require_in_control
from stiction.errors import ParameterError
from stiction.records.record import require_record

if TYPE_CHECKING:
    from stiction.diagnosis.identification.compare_models import ModelComparison
    from stiction.diagnosis.identification.result import Identification
    from stiction.diagnosis.segment import JudgedSegment
    from stiction.records.record import LoopRecord

__all__ = ["compare_models", "identify"]


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
    The segment is that of `diagnose`: of a long record the window that stands for all. Without a `period` Kano's valve
    is `diagnose(record).identification`, whose S and J are those of all windows.

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
        return identify_model(fit_segment(_judge_window(record, period)), model)
    found = diagnose([record], methods=False)
    segment = require_in_control(found.segment)
    if model == "kano" and found.identification is not None:
        return found.identification
    return identify_model(fit_segment(segment), model)


def compare_models(record: LoopRecord, *, period: float | None = None, enough: float = 6.0) -> ModelComparison:
    r"""Compare what the valve models explain of one record, with a penalty for their parameters.

    Parameters
    ----------
    record : LoopRecord
        A record with OP and PV; where it has a valve position that follows OP, the position is compared.
    period : float, optional
        Period of the oscillation [s]. It is found where it is not given; `inf` says that nothing oscillates.
    enough : float
        Difference of the criterion from which on a model is called better [-]; 6 is "strong" after Kass and Raftery.

    Returns
    -------
    ModelComparison
        The models by Schwarz's criterion, and whether their difference decides.

    Raises
    ------
    RecordError
        When the record has no PV, the loop is out of control, its data cannot be used, or its quality codes can be
        read in several ways.
    ParameterError
        When `period` is not positive or shorter than four samples.

    Notes
    -----
    All models are compared by the same regression on the same samples. With the mean squared error :math:`e` that a
    model of k parameters leaves and N independent samples (by the autocorrelation of the best model's residual)

    .. math:: BIC = N \ln e + k \ln N

    The parameters of the process are as many for every model and do not count. The segment is that of `diagnose`: of a
    long record the window that stands for all.

    References
    ----------
    schwarz1978; kass1995.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import numpy as np
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    >>> sp = np.repeat(np.random.default_rng(0).uniform(7.0, 13.0, 40), 35)
    >>> st.compare_models(replace(st.simulate(loop, sp, 1400.0), mv=None), period=130.0).best
    'kano'
    """
    return compare_fits(fit_segment(_judge_window(record, period)), enough)


def _judge_window(record: LoopRecord, period: float | None) -> JudgedSegment:
    """The segment in which the valve of a record is identified: of a long record, of the window that stands for all."""
    require_record(record)
    if record.other_readings or is_one_window(record):
        return judge_in_control(record, period=period)
    segment = require_in_control(diagnose([record], methods=False).segment)
    return segment if period is None else judge_in_control(segment.record, period=period)
