r"""Stenman's one-parameter valve and the process behind it, from OP and PV.

Stenman's :math:`d` is eq. 5 repaired with :math:`sb = sj = d` and :math:`r = \infty`: the stem breaks away when OP is
more than d from it, slips to OP, and rests again at once. Of the two-parameter valves with S = J = d Kano's breaks
away at the same distance and slips as far, but then slides on with OP until that turns or stops. The two are the
same valve exactly where no sample that follows a slip moves OP on by up to d in the same direction; elsewhere they
are never more than d apart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.model_fit import ModelFit, Tied, fit_model
from stiction.diagnosis.identification.model_result import result_of
from stiction.diagnosis.identification.model_signals import signals_of

if TYPE_CHECKING:
    from stiction.diagnosis.identification.valve_trials import Stretches
    from stiction.diagnosis.identified import Identification
    from stiction.records.record import LoopRecord

__all__ = ["fit_stenman", "identify_stenman"]

TIED = Tied(lowest=1.0, rates=np.array([np.inf]), n=1200)
"""S = J = d, and a stem that never follows."""


def identify_stenman(record: LoopRecord, known: Identification, period: float | None = None) -> Identification:
    """Identify Stenman's d and the process together by simulation error.

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
        d with its interval in `parameters`, S = J = d, the process, stem and PV.

    Raises
    ------
    RecordError
        When a signal does not vary.

    References
    ----------
    stenman2003; srinivasan2008, eq. 4; srinivasan2005, after whom d is searched over a linear process.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Stenman(2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> sp = np.repeat(np.random.default_rng(0).uniform(7.0, 13.0, 60), 35)
    >>> found = st.identify(st.simulate(loop, sp, 2100.0), "stenman", period=130.0)
    >>> abs(found.parameters["d"] - 2.0) < 0.1
    True
    """
    return result_of(record, fit_stenman(signals_of(record, period), known), "stenman", known, period)


def fit_stenman(signals: Stretches, known: Identification) -> ModelFit:
    """Search d.

    Parameters
    ----------
    signals : Stretches
        What to compare.
    known : Identification
        What (S, J) found on the same record.

    Returns
    -------
    ModelFit
        The best valve and process, and all that was tried.
    """
    return fit_model(signals, TIED, known)
