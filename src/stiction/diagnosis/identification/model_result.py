"""What a model fit says: parameters with likelihood intervals, stem and PV, process in seconds."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.interval import CHI2_1, MODEL_ERROR
from stiction.diagnosis.identification.model_fit import ModelFit, fit_process
from stiction.diagnosis.identification.model_signals import rates_of, signals_of
from stiction.diagnosis.identification.processes import in_seconds
from stiction.diagnosis.identification.signals import hold_gaps
from stiction.diagnosis.identification.valve_trials import answer_of, stem_of
from stiction.diagnosis.identified import Identification, ProcessFit, Stretch, leaves_open

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["independent_samples", "interval", "likely", "result_of"]

FLOOR = 0.015
"""Half width below which no interval of a band goes, as a share of S [-]."""
PLACES = 0.05
"""The same for r, as a share of the rates that OP had [-]."""


def independent_samples(fit: ModelFit) -> float:
    """Independent samples in what a fit leaves [-].

    Parameters
    ----------
    fit : ModelFit
        The fit.

    Returns
    -------
    float
        Their number by the autocorrelation of the residual up to its first zero, and at most two for each period:
        a slip each way is what a period says about the valve.
    """
    count, samples = 0.0, 0
    for left in fit.residual():
        x = left - left.mean()
        n = x.size
        samples += n
        spectrum = np.fft.rfft(x, 2 * n)
        acf = np.fft.irfft(spectrum.real**2 + spectrum.imag**2)[:n]
        if acf[0] <= 0.0:
            count += n
            continue
        below = np.flatnonzero(acf <= 0.0)
        count += n / (1.0 + 2.0 * float(acf[1 : below[0] if below.size else n].sum()) / float(acf[0]))
    return max(min(count, 2.0 * samples / fit.signals.scale), 1.0)


def likely(fit: ModelFit) -> NDArray[np.bool_]:
    """Which of the valves tried lie in the 95 % likelihood region of one parameter.

    Parameters
    ----------
    fit : ModelFit
        The fit.

    Returns
    -------
    ndarray of bool, shape (n_valves,)
        True where the error is below the limit.
    """
    limit = max(fit.error * float(np.exp(CHI2_1 / independent_samples(fit))), fit.error + MODEL_ERROR)
    return fit.trials.error <= limit


def interval(values: NDArray[np.float64], inside: NDArray[np.bool_], least: float) -> tuple[float, float]:
    """Ends of the region for one band.

    Parameters
    ----------
    values : ndarray, shape (n_valves,)
        The band's value for each valve tried [% of span].
    inside : ndarray of bool, shape (n_valves,)
        Which of them are likely.
    least : float
        What is added at either end [% of span]: the step of the search.

    Returns
    -------
    tuple of float
        Lower and upper end [% of span].
    """
    return max(float(values[inside].min()) - least, 0.0), float(values[inside].max()) + least


def _rates(values: NDArray[np.float64], inside: NDArray[np.bool_], rates: NDArray[np.float64]) -> tuple[float, float]:
    """Interval of r: up to rates of OP that were tried and are not likely, some places away at least."""
    low, high = values[inside].min(), values[inside].max()
    below, above = values[values < low], values[values > high]
    least = int(np.ceil(PLACES * rates.size))
    first = max(int(np.searchsorted(rates, low)) - least, 0)
    last = min(int(np.searchsorted(rates, high)) + least, rates.size - 1)
    return (
        min(float(rates[first]), float(below.max()) if below.size else 0.0),
        max(float(rates[last]), float(above.min()) if above.size else float(high)),
    )


def result_of(
    record: LoopRecord, fit: ModelFit, model: str, known: Identification, period: float | None
) -> Identification:
    """Write a fit as an identification.

    Parameters
    ----------
    record : LoopRecord
        The record.
    fit : ModelFit
        The fit.
    model : str
        "stenman" or "three_parameter".
    known : Identification
        What (S, J) found on the same record.
    period : float or None
        Period of the oscillation [s].

    Returns
    -------
    Identification
        Parameters with intervals, process, stem and PV. The error surface stays that of (S, J).
    """
    sb, sj, r = (float(x) for x in fit.valve)
    bands, jumps, rates = fit.trials.valves.T
    S, inside = 2.0 * sb - sj, likely(fit)
    least = FLOOR * S
    S_low, S_high = interval(2.0 * bands - jumps, inside, least)
    J_low, J_high = interval(jumps, inside, least)
    if model == "stenman":
        parameters, intervals = {"d": sb}, {"d": (S_low, S_high)}
    else:
        parameters = {"sb": sb, "sj": sj, "r": r}
        intervals = {
            "sb": interval(bands, inside, least), "sj": (J_low, J_high), "r": _rates(rates, inside, rates_of(record)),
        }  # fmt: skip
    behind = fit
    if record.mv is not None:
        unseen = replace(record, mv=None)
        behind = fit_process(signals_of(unseen, period), fit.valve, known.process)
    good = fit_process(fit.signals, np.zeros(3), known.linear or known.process)
    mv, pv = _stitched(record, behind)
    return replace(
        known,
        model=model, S=S, J=sj, S_low=S_low, S_high=S_high, J_low=J_low, J_high=J_high,
        process=_process(behind),
        fit=100.0 * (1.0 - fit.error),
        fit_linear=100.0 * (1.0 - good.error),
        mv=mv, pv=pv,
        linear=known.linear if record.mv is not None else _process(good),
        stretches=_stretches(fit, good, len(record)),
        reason=_reason(model, intervals, S, rates),
        parameters=parameters,
        parameter_intervals=intervals,
    )  # fmt: skip


def _reason(model: str, intervals: dict[str, tuple[float, float]], S: float, rates: NDArray[np.float64]) -> str:
    """What the record cannot tell."""
    if model == "stenman":
        return ""
    reasons = []
    if leaves_open(*intervals["sj"], S):
        reasons.append("sj cannot be told from this record.")
    fastest = rates[np.isfinite(rates)].max()
    low, high = intervals["r"]
    if low == 0.0 and np.isinf(high):
        reasons.append("r cannot be told from this record: with any, the valve explains it.")
    elif np.isinf(high):
        reasons.append(f"r has no upper bound: OP never moved faster than {fastest:.3g} %/s.")
    return " ".join(reasons)


def _process(fit: ModelFit) -> ProcessFit:
    """The process in seconds."""
    return in_seconds(fit.process, fit.signals.dt * fit.signals.width, fit.signals.width)


def _stretches(fit: ModelFit, good: ModelFit, samples: int) -> tuple[Stretch, ...]:
    """The one valve's fit in each stretch."""
    signals, found = fit.signals, []
    S, J = float(2.0 * fit.valve[0] - fit.valve[1]), float(fit.valve[1])
    energy = [
        float(np.sum(signals.target[a + w[0] : a + w[1]] ** 2))
        for a, w in zip(signals.bounds[:-1], signals.windows, strict=True)
    ]
    rows = zip(signals.first, np.diff(signals.bounds), energy, fit.residual(), good.residual(), strict=True)
    for first, n, whole, left, linear in rows:
        share = [100.0 * (1.0 - float(np.sum(x**2)) / whole) if whole > 0.0 else 0.0 for x in (left, linear)]
        last = min(int(first + n) * signals.width, samples)
        found.append(Stretch(int(first) * signals.width, last, S, J, *share))
    return tuple(found)


def _stitched(record: LoopRecord, fit: ModelFit) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stem and simulated PV sample by sample of the record, cut half way where two stretches meet."""
    signals, n = fit.signals, len(record)
    width, half = signals.width, signals.half
    stem = stem_of(signals, fit.valve)
    answer = answer_of(signals, stem, fit.process)
    assert record.pv is not None
    pv_record = hold_gaps(record.pv)
    thin = pv_record[: n // width * width].reshape(-1, width).mean(axis=1)
    sizes = np.diff(signals.bounds)
    ends = signals.first + sizes
    cuts = np.concatenate([[0], (signals.first[1:] + ends[:-1]) // 2, [ends[-1]]])
    mv, pv = np.empty(ends[-1] * width), np.full(ends[-1], np.nan)
    for i, (low, high) in enumerate(pairwise(cuts)):
        a, first = signals.bounds[i], signals.first[i]
        shift = a - first
        mv[low * width : high * width] = stem[(low + shift) * width : (high + shift) * width]
        p, q = max(low, first + half), min(high, first + sizes[i] - half)
        target = signals.target[p + shift : q + shift]
        pv[p:q] = thin[p:q] - target + answer[p + shift : q + shift]
    at = np.minimum(np.arange(n), mv.size - 1)
    return mv[at], pv[at // width]
