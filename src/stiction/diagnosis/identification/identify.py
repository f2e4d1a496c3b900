"""From OP and PV to the sticky valve and the process behind it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.grid import Processes, Surface, dense_processes, explore, near
from stiction.diagnosis.identification.search import follow, lag_pair, remove_local_mean
from stiction.diagnosis.identification.signals import Signals, prepare
from stiction.diagnosis.result import ErrorSurface, Identification, ProcessFit
from stiction.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["identify"]

N_S, N_J = 30, 30
"""Points of the dense search over S and J / S."""
FINE_STEP, N_FINE_J = 0.013, 36
"""Relative step of the fine search over S [-], and its points over J / S."""
N_VALLEYS = 6
"""Bands of S from each of which the search goes closer."""
CHI2_1, CHI2_2 = 3.841, 5.991
"""95 % points of the chi-square distribution with one and two degrees of freedom."""


def identify(record: LoopRecord, model: str = "kano", *, period: float | None = None) -> Identification:
    """Identify stiction and process together by simulation error.

    Parameters
    ----------
    record : LoopRecord
        A record with OP and PV.
    model : str
        Valve model; "kano" fits (S, J).
    period : float, optional
        Period of the oscillation [s]; slow disturbances are then kept out by comparing deviations from the
        moving average over one period. Without it the record is compared about its mean.

    Returns
    -------
    Identification
        S and J with intervals, the process, both simulations and the error surface.

    Raises
    ------
    RecordError
        When the record has no PV, no variation, or fewer than 30 samples.
    ParameterError
        When `model` is unknown or `period` not positive.

    Notes
    -----
    Every (S, J / S) of a 30 x 30 grid up to the OP's swing (a limit cycle needs OP_pp >= S) is tried with 100
    processes of one lag, an integrator among them, and 10 dead times; the best region is then searched twice
    again with closer grids and a second lag. The error is that of the simulation, not of a one-step
    prediction. The interval is the profile likelihood's, with as many independent samples as the
    autocorrelation of the residual leaves, and no more than two for each period: a slip each way.

    References
    ----------
    srinivasan2005; jelali2008: search over the nonlinear block around a least-squares fit of the linear one.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> found = st.identify(st.simulate(loop, sp=10.0, duration=2000.0), period=162.0)
    >>> abs(found.S - 3.0) < 0.3
    True
    """
    if model != "kano":
        raise ParameterError(f"model = {model!r} is not identified yet; use 'kano'.")
    if period is not None and not period > 0.0:
        raise ParameterError(f"period = {period} s is not positive; give the oscillation's period or leave it out.")
    signals = prepare(record, period)
    if signals.op.size < 30:
        raise RecordError(f"{record.tag} has {signals.op.size} samples; an identification needs at least 30.")
    swing = float(np.ptp(signals.op))
    if swing <= 0.0 or not np.any(signals.target):
        raise RecordError(f"{record.tag}: {'OP' if swing <= 0.0 else 'PV'} does not vary; nothing can be identified.")
    sign = fit_controller(record).action
    dense = explore(
        signals,
        swing * np.arange(1, N_S + 1) / N_S,
        np.linspace(0.0, 1.0, N_J),
        dense_processes(signals.scale, signals.op.size, record.integrating),
        sign,
    )
    found = _closer(signals, dense, sign, record.integrating, swing)
    linear = _linear(signals, sign, record.integrating)
    return _result(model, record, signals, found, linear)


def _optimum(surface: Surface) -> tuple[int, int]:
    i, j = np.unravel_index(int(np.argmin(surface.error)), surface.error.shape)
    return int(i), int(j)


def _closer(signals: Signals, dense: Surface, sign: float, integrating: bool | None, swing: float) -> list[Surface]:
    """Search the whole (S, J / S) plane again with few processes, then the best region with richer ones.

    A noisy OP makes the error surface rugged: a slip comes when the noise carries the OP over the band, so a
    band that is wrong by a few per cent slips at other moments. The true valve is a narrow dip, which only
    steps of about a per cent can find; the process is known well enough from the dense search to try few.
    """
    least = 0.25 * swing
    steps = int(np.ceil(np.log(swing / least) / np.log1p(FINE_STEP)))
    S = np.geomspace(least, swing, steps)
    fine = explore(signals, S, np.linspace(0.0, 1.0, N_FINE_J), _few(dense), sign)
    found = [dense, fine]
    starts = [(surface, *place) for surface in (dense, fine) for place in _valleys(surface, N_VALLEYS)]
    for closer, keep in ((1.0, 2 * N_VALLEYS), (0.4, 3)):
        starts.sort(key=lambda start: float(start[0].error[start[1], start[2]]))
        finer = []
        for surface, i, j in starts[:keep]:
            width = closer * np.linspace(-2.0, 2.0, 9)
            ratio = np.unique(np.clip(surface.ratio[j] + width / N_FINE_J, 0.0, 1.0))
            processes = near(surface.processes, surface.best[i, j], closer, integrating)
            finer.append(explore(signals, surface.S[i] * (1.0 + FINE_STEP * width), ratio, processes, sign))
        found += finer
        starts += [(surface, *_optimum(surface)) for surface in finer]
    return found


def _valleys(surface: Surface, n: int) -> list[tuple[int, int]]:
    """The best valve in each of `n` bands of S: the error has a valley along which S and dead time trade."""
    places = []
    for rows in np.array_split(np.arange(surface.S.size), n):
        i, j = np.unravel_index(int(np.argmin(surface.error[rows])), (rows.size, surface.ratio.size))
        places.append((int(rows[i]), int(j)))
    return places


def _few(dense: Surface) -> Processes:
    """The lag pairs of the best valves of the dense search, and all dead times about theirs."""
    order = np.argsort(dense.error, axis=None)[:12]
    best = dense.best.reshape(-1, 3)[order]
    lags = np.unique(best[:, 0].astype(int))[:4]
    low, high = int(best[:, 1].min()), int(best[:, 1].max())
    delays = np.unique(np.linspace(max(low - 1, -1), high + 2, 7).astype(np.int64))
    return Processes(dense.processes.first[lags], dense.processes.second[lags], delays)


def _limit(error: float, samples: float, chi2: float) -> float:
    """Error below which a parameter lies in the likelihood region."""
    return error * float(np.exp(chi2 / max(samples, 1.0)))


def _linear(signals: Signals, sign: float, integrating: bool | None) -> Surface:
    """The best linear process behind a good valve, searched as carefully as the sticky one."""
    nothing, one = np.zeros(1), np.zeros(1)
    found = explore(signals, nothing, one, dense_processes(signals.scale, signals.op.size, integrating, 40, 30), sign)
    for closer in (0.5, 0.2):
        processes = near(found.processes, found.best[0, 0], closer, integrating)
        finer = explore(signals, nothing, one, processes, sign)
        if finer.error[0, 0] < found.error[0, 0]:
            found = finer
    return found


def _simulated(signals: Signals, S: float, J: float, surface: Surface, i: int, j: int):
    """Stem and PV of the valve and process found, on the thinned time scale."""
    n = signals.op.size
    mv, raw, out = np.empty(n), np.empty(n), np.empty(n)
    follow(signals.op, S, J, mv)
    lag, delay = int(surface.best[i, j, 0]), int(surface.best[i, j, 1])
    if lag < 0:
        return mv, np.full(n, signals.pv.mean()), np.zeros(n)
    first, second = surface.processes.decays()
    lag_pair(mv, float(mv.mean()), first[lag], second[lag], raw)
    part = float(surface.best[i, j, 2])
    raw = (1.0 - part) * _shifted(raw, delay + 1) + part * _shifted(raw, delay + 2)
    remove_local_mean(raw, signals.half, out)
    gain = float(surface.gain[i, j])
    local = signals.pv - signals.target
    inside = slice(signals.half, n - signals.half) if signals.half else slice(0, n)
    level = np.full(n, np.nan)
    level[inside] = local[inside]
    return mv, level + gain * out, gain * out


def _shifted(x: NDArray[np.float64], samples: int) -> NDArray[np.float64]:
    return x if samples == 0 else np.concatenate([np.full(samples, x[0]), x[:-samples]])


def _independent(residual: NDArray[np.float64]) -> float:
    """Number of independent samples in a residual, from its autocorrelation up to the first zero."""
    n = residual.size
    x = residual - residual.mean()
    spectrum = np.fft.rfft(x, 2 * n)
    acf = np.fft.irfft(spectrum.real**2 + spectrum.imag**2)[:n]
    if acf[0] <= 0.0:
        return float(n)
    acf = acf / acf[0]
    below = np.flatnonzero(acf <= 0.0)
    end = int(below[0]) if below.size else n
    return n / (1.0 + 2.0 * float(acf[1:end].sum()))


def _interval(surface: Surface, limit: float, axis: int) -> tuple[float, float]:
    """Ends of the profile likelihood interval over S (axis 0) or J / S (axis 1), between the grid's points."""
    knots = surface.S if axis == 0 else surface.ratio
    profile = surface.error.min(axis=1 - axis)
    inside = np.flatnonzero(profile <= limit)
    if inside.size == 0:
        best = knots[int(profile.argmin())]
        return float(best), float(best)
    first, last = int(inside[0]), int(inside[-1])
    low, high = float(knots[first]), float(knots[last])
    if first > 0:
        share = (limit - profile[first]) / (profile[first - 1] - profile[first])
        low -= float(share * (knots[first] - knots[first - 1]))
    if last < knots.size - 1:
        share = (limit - profile[last]) / (profile[last + 1] - profile[last])
        high += float(share * (knots[last + 1] - knots[last]))
    return low, high


def _reach(found: list[Surface], limit: float, axis: int) -> tuple[float, float]:
    """Lowest and highest end of the intervals of all searches that came below the limit."""
    ends = np.array([_interval(surface, limit, axis) for surface in found if surface.error.min() <= limit])
    return float(ends[:, 0].min()), float(ends[:, 1].max())


def _result(model: str, record: LoopRecord, signals: Signals, found: list[Surface], linear: Surface) -> Identification:
    dense = found[0]
    closest = min(found, key=lambda surface: float(surface.error.min()))
    i, j = _optimum(closest)
    S, ratio = float(closest.S[i]), float(closest.ratio[j])
    J = S * ratio
    error = float(closest.error[i, j])
    linear_error = float(linear.error[0, 0])
    mv, pv, deviation = _simulated(signals, S, J, closest, i, j)
    inside = slice(signals.half, signals.op.size - signals.half) if signals.half else slice(None)
    independent = _independent((signals.target - deviation)[inside])
    independent = min(independent, 2.0 * signals.op.size / signals.scale)
    inner = _limit(error, independent, CHI2_1)
    S_low, S_high = _reach(found, inner, 0)
    ratio_low, ratio_high = _reach(found, inner, 1)
    lag = int(closest.best[i, j, 0])
    dead_time = max(float(closest.best[i, j, 1] + closest.best[i, j, 2]), 0.0)
    processes: Processes = closest.processes
    tau = float(processes.first[lag])
    integrating = bool(np.isinf(tau))
    gain = float(closest.gain[i, j]) / (signals.dt if integrating else 1.0)
    n = len(record)
    at = np.minimum(np.arange(n) // signals.thinned, signals.op.size - 1)
    process = ProcessFit(
        gain=gain,
        time_constant=float((processes.second[lag] if integrating else tau + processes.second[lag]) * signals.dt),
        dead_time=dead_time * signals.dt,
        integrating=integrating,
    )
    limit = _limit(float(dense.error.min()), independent, CHI2_2)
    return Identification(
        model=model,
        S=S,
        J=J,
        S_low=S_low,
        S_high=S_high,
        J_low=S * ratio_low,
        J_high=S * ratio_high,
        process=process,
        fit=100.0 * (1.0 - error),
        fit_linear=100.0 * (1.0 - linear_error),
        surface=ErrorSurface(dense.S, dense.ratio, dense.error, limit),
        mv=mv[at],
        pv=pv[at],
        reason="J cannot be told from this record." if ratio_high - ratio_low > 0.6 else "",
    )
