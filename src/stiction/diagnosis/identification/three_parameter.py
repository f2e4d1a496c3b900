r"""The paper's three-parameter valve (sb, sj, r) and the process behind it, from OP and PV.

The paper left the identification of its eq. 5 open. Here it is the repaired eq. 5 that is fitted, see the errata.
A start comes from (S, J) by :math:`sb = (S + J) / 2`, :math:`sj = J`, and from Stenman's d with r infinite; then sb,
sj, r and the process are searched together by simulation error.

r shows only where a stem that moves sees OP go on in the same direction: at :math:`|\Delta u| / \Delta t \ge r` it
follows, below it rests. It is therefore tried at OP's own rates, and its interval ends at rates that OP had. Where
every move of OP is followed, or none, an end is zero or infinity. Held steps and a noisy OP, which turns before the
stem could follow, say nothing about r.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.diagnosis.identification.model_fit import ModelFit, Tied, fit_model
from stiction.diagnosis.identification.model_result import result_of
from stiction.diagnosis.identification.model_signals import rates_of, signals_of
from stiction.diagnosis.identification.stenman import fit_stenman

if TYPE_CHECKING:
    from stiction.diagnosis.identification.valve_trials import Stretches
    from stiction.diagnosis.identified import Identification
    from stiction.records.record import LoopRecord

__all__ = ["fit_three_parameter", "identify_three_parameter"]

N_FIRST = 6000
"""Valves tried at first [-]."""


def identify_three_parameter(record: LoopRecord, known: Identification, period: float | None = None) -> Identification:
    """Identify (sb, sj, r) and the process together by simulation error.

    Parameters
    ----------
    record : LoopRecord
        A record with OP and PV; where it has MV, the stem itself is compared.
    known : Identification
        What (S, J) found on the same record.
    period : float, optional
        Period of the oscillation [s].

    Returns
    -------
    Identification
        sb, sj and r with intervals in `parameters`, S = 2 sb - sj, J = sj, the process, stem and PV.

    Raises
    ------
    RecordError
        When a signal does not vary.

    Notes
    -----
    In a limit cycle that repeats exactly S, r and the dead time trade with each other, and the intervals say so. A
    set point or load that moves tells them apart.

    References
    ----------
    srinivasan2008, eq. 5; after srinivasan2005, a search over the nonlinear block around a linear one.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Srinivasan(2.0, 1.0, 0.05), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> sp = np.repeat(np.random.default_rng(0).uniform(7.0, 13.0, 60), 35)
    >>> found = st.identify(st.simulate(loop, sp, 2100.0), "three_parameter", period=130.0)
    >>> abs(found.parameters["sb"] - 2.0) < 0.1
    True
    """
    fit = fit_three_parameter(record, signals_of(record, period), known)
    return result_of(record, fit, "three_parameter", known, period)


def fit_three_parameter(
    record: LoopRecord, signals: Stretches, known: Identification, nested: tuple[ModelFit, ...] = ()
) -> ModelFit:
    """Search sb, sj and r.

    Parameters
    ----------
    record : LoopRecord
        The record.
    signals : Stretches
        What to compare.
    known : Identification
        What (S, J) found on the same record.
    nested : tuple of ModelFit, optional
        Fits of Stenman's and Kano's valve, which are special cases, where they were made already.

    Returns
    -------
    ModelFit
        The best valve and process, and all that was tried.
    """
    nested = nested or (fit_stenman(signals, known),)
    return fit_model(signals, Tied(0.0, rates_of(record), N_FIRST), known, nested)
