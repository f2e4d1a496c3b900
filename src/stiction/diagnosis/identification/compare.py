"""Which valve model a record speaks for: good, Stenman's, Kano's or the three-parameter one, by Schwarz's criterion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.closer import closely
from stiction.diagnosis.identification.comparison import ModelComparison, ModelShare
from stiction.diagnosis.identification.identify import searched
from stiction.diagnosis.identification.interval import MODEL_ERROR
from stiction.diagnosis.identification.model_fit import ModelFit, Tied, fit_model, fit_process
from stiction.diagnosis.identification.model_result import independent_samples
from stiction.diagnosis.identification.model_signals import signals_of
from stiction.diagnosis.identification.stenman import fit_stenman
from stiction.diagnosis.identification.three_parameter import fit_three_parameter
from stiction.records.record import require_record

if TYPE_CHECKING:
    from stiction.records.record import LoopRecord

__all__ = ["compare_models"]

KANO = Tied(lowest=0.0, rates=np.zeros(1), n=1500)
"""(S, J) free, and a stem that follows at any rate."""
ENOUGH = 6.0
"""Difference of the criterion from which on a model is called better [-]; "strong" after Kass and Raftery."""


def compare_models(record: LoopRecord, *, period: float | None = None) -> ModelComparison:
    r"""Compare what the valve models explain of one record, with a penalty for their parameters.

    Parameters
    ----------
    record : LoopRecord
        A record with OP and PV; where it has MV, the stem itself is compared.
    period : float, optional
        Period of the oscillation [s]; slow disturbances are then kept out. It is found where it is not given, as
        `identify` finds it; `inf` compares about the mean.

    Returns
    -------
    ModelComparison
        The models by Schwarz's criterion, and whether their difference decides.

    Raises
    ------
    RecordError
        When the record has no PV, no variation, or fewer than 30 samples.
    ParameterError
        When `period` is not positive or shorter than four samples.

    Notes
    -----
    All models are fitted by one search to the same samples, each with a process of its own. With the share
    :math:`e` that a model of k parameters leaves and N independent samples (by the autocorrelation of the best
    model's residual, and at most two for each period)

    .. math:: BIC = N \ln \max(e, 0.002) + k \ln N

    Below 0.2 % the sampled process says no more, and the simpler model wins. The process counts the same in all.

    References
    ----------
    schwarz1978; kass1995.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> sp = np.repeat(np.random.default_rng(0).uniform(7.0, 13.0, 60), 35)
    >>> st.compare_models(st.simulate(loop, sp, 2100.0), period=130.0).best
    'kano'
    """
    require_record(record)
    dense = searched(record, period)
    known, record, period = closely(dense).told, dense.record, dense.period
    signals = signals_of(record, period)
    stenman, kano = fit_stenman(signals, known), fit_model(signals, KANO, known)
    fits = {
        "good": fit_process(signals, np.zeros(3), known.linear or known.process),
        "stenman": stenman,
        "kano": kano,
        "three_parameter": fit_three_parameter(record, signals, known, (stenman, kano)),
    }
    samples = independent_samples(min(fits.values(), key=lambda fit: fit.error))
    shares = [_share(model, fit, samples) for model, fit in fits.items()]
    return ModelComparison(
        models=tuple(sorted(shares, key=lambda share: share.bic)),
        samples=samples,
        compared="pv" if record.mv is None else "mv",
        enough=ENOUGH,
    )


def _share(model: str, fit: ModelFit, samples: float) -> ModelShare:
    sb, sj, r = (float(x) for x in fit.valve)
    parameters = {
        "good": {},
        "stenman": {"d": sb},
        "kano": {"S": 2.0 * sb - sj, "J": sj},
        "three_parameter": {"sb": sb, "sj": sj, "r": r},
    }[model]
    bic = samples * float(np.log(max(fit.error, MODEL_ERROR))) + len(parameters) * float(np.log(samples))
    return ModelShare(model, len(parameters), parameters, 100.0 * (1.0 - fit.error), bic)
