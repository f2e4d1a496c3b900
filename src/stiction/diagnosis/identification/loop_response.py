"""What a linear prediction of PV says: whether OP moves it, how stable the loop is, what stiction would have shown.

PV follows what it did before, outside waves at its three largest peaks, and OP. Without the waves a valve that is stuck
beside a periodic load seems to act on PV, because OP, an integral of PV, carries the phase of the load.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.op_answer import OpAnswer, find_answers
from stiction.diagnosis.identification.process_fit import FittedProcess, simulate_process
from stiction.diagnosis.identification.stems import as_valve_arrays, valve_positions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.result import ControllerFit, Identification, ProcessFit

__all__ = ["LoopResponse", "Margin", "fit_response"]

PV_LAGS, OP_LAGS, WAVES, HARMONICS = 16, 10, 3, 3
"""Earlier PVs and OPs, outside waves, and harmonics of each with the fundamental [-]."""
BLOCKS = (1, 4)
"""Samples of the block means in which the effect of OP is looked for [-]."""
MAX_BLOCKS, MIN_BLOCKS = 1500, 150
"""Most and fewest block means of a fit [-]."""
PER_PERIOD = 16.0
"""Block means to a period of the oscillation in the fit of the gain margin [-]."""
DRAWS = 24
"""Draws of the fitted weights from which the interval of the gain margin is taken [-]."""
S_GRID = np.geomspace(0.1, 30.0, 10)
"""S for which the evidence is predicted [% of span]."""
TYPICAL_JUMP = 0.3
"""J over S of the valve for which it is predicted [-]."""
MIN_SCALE = 1e-9
"""Size of a regressor that does not move [-]."""
RIDGE = 1e-8
"""Added to the diagonal of scaled normal equations [-]."""


@dataclass(frozen=True, slots=True)
class Margin:
    """Gain margin of the identified process with the identified controller."""

    low: float = math.nan
    """Lower end of the 70 % interval of ln(gain margin) [-]; NaN where unknown."""
    high: float = math.nan
    """Upper end [-]."""
    period: float = math.nan
    """Period of the loop at the limit of stability [s]."""


@dataclass(frozen=True, slots=True)
class LoopResponse:
    """What a linear prediction of PV says of the loop."""

    op_effect: float = math.nan
    """Gain of Schwarz's criterion by OP beside the outside waves, of the best block size [-]; below 0: none shown."""
    op_gain: float = math.nan
    """Gain of OP over its standard error, with the sign that the controller expects [-]."""
    op_effect_plain: float = math.nan
    """Gain of Schwarz's criterion by OP without the waves [-]."""
    answer: OpAnswer = (math.nan, math.nan)
    """Evidence of an answer of PV to OP beside the waves, with the sign that the controller expects and the other."""
    answer_plain: OpAnswer = (math.nan, math.nan)
    """The same without the waves."""
    sp_answer: float = 0.0
    """Evidence of an answer of PV to SP beside the waves, in the direction of SP; 0 where SP does not move."""
    margin: Margin = Margin()
    """Gain margin by the fit without the waves."""
    stem_for_op: float = math.nan
    """Twice the log likelihood ratio of the stem of the sticky valve over OP, both beside the waves [-]."""
    stem_beside_op: float = math.nan
    """Gain of Schwarz's criterion by that stem, OP and the waves in the fit too [-]."""
    stem_gain: float = math.nan
    """Gain of that stem over its standard error, with the sign that the controller expects [-]."""
    wave_effect: float = math.nan
    """Gain of Schwarz's criterion by the outside waves beside OP [-]; below 0: none shown."""
    wave_over_op: float = math.nan
    """Movement of PV by the outside wave at its largest peak over that by OP [-]."""
    load_size: float = math.nan
    """Amplitude of that wave as a load at the process inlet [% of span]."""
    evidence: NDArray[np.float64] | None = None
    """Twice the log likelihood ratio that a valve of each S in `S_GRID` would have over a good one [-]."""


@dataclass(frozen=True, eq=False)
class _Fit:
    """A least-squares fit in scaled regressors."""

    weights: NDArray[np.float64]
    """Weights, of the signals in their own deviations."""
    covariance: NDArray[np.float64]
    """Their covariance."""
    error: float
    """Sum of squared errors [-]."""
    n: int
    """Values predicted [-]."""


class _Blocks:
    """Block means of PV and OP in their deviations, and the normal equations of all regressors."""

    def __init__(
        self,
        op: NDArray[np.float64],
        pv: NDArray[np.float64],
        size: int,
        peaks: list[float],
        stem: NDArray[np.float64] | None = None,
    ) -> None:
        n = min(pv.size // size, MAX_BLOCKS)
        self.size, self.first = size, max(PV_LAGS, OP_LAGS)
        self.pv, self.scale_pv = self.means(pv, n)
        self.op, self.scale_op = self.means(op, n)
        self.target = self.pv[self.first :]
        turns = [2.0 * np.pi * size * h * f for f in peaks for h in range(1, HARMONICS + 1) if h * f * size < 0.5]
        self.turns = turns
        angle = np.outer(turns, np.arange(self.first, n))
        parts = [np.ones((1, self.target.size)), self._lags(self.pv, PV_LAGS), np.cos(angle), np.sin(angle),
                 self._lags(self.op, OP_LAGS)]  # fmt: skip
        if stem is not None:
            parts.append(self._lags(self.means(stem, n)[0], OP_LAGS))
        rows = np.vstack(parts)
        self.scales = np.maximum(np.sqrt(np.einsum("ij,ij->i", rows, rows)), MIN_SCALE)
        self.rows = rows / self.scales[:, np.newaxis]
        self.squares = self.rows @ self.rows.T + RIDGE * np.eye(len(rows))
        self.right = self.rows @ self.target
        own = 1 + PV_LAGS
        with_waves = own + 2 * len(turns)
        self.own, self.waves = np.arange(own), np.arange(own, with_waves)
        self.by_op, self.by_stem = (
            np.arange(with_waves, with_waves + OP_LAGS),
            np.arange(with_waves + OP_LAGS, len(rows)),
        )

    def means(self, x: NDArray[np.float64], n: int) -> tuple[NDArray[np.float64], float]:
        """Block means about their mean over their deviation, and that deviation."""
        x = x[: n * self.size].reshape(n, self.size).mean(axis=1)
        scale = max(float(x.std()), 1e-300)
        return (x - x.mean()) / scale, scale

    def _lags(self, x: NDArray[np.float64], count: int) -> NDArray[np.float64]:
        """Lags of a signal from 1 on, as rows."""
        return np.array([x[self.first - k : x.size - k] for k in range(1, count + 1)])

    def fit(self, *parts: NDArray[np.int64]) -> _Fit:
        """Fit PV by some of the rows."""
        used = np.concatenate(parts)
        inverse = np.linalg.inv(self.squares[np.ix_(used, used)])
        weights, size = inverse @ self.right[used], self.scales[used]
        n = self.target.size
        error = max(float(self.target @ self.target - weights @ self.right[used]), 1e-9 * n)
        return _Fit(weights / size, inverse * (error / n) / np.outer(size, size), error, n)

    def orthonormal(self, *parts: NDArray[np.int64]) -> NDArray[np.float64]:
        """Orthonormal rows that span some of the rows."""
        used = np.concatenate(parts)
        return np.linalg.solve(np.linalg.cholesky(self.squares[np.ix_(used, used)]), self.rows[used])


def _peaks(pv: NDArray[np.float64]) -> list[float]:
    """Frequencies of the largest peaks of PV, not next to each other [1/sample]."""
    size = 1 << (4 * pv.size - 1).bit_length()
    power = np.abs(np.fft.rfft((pv - pv.mean()) * np.hanning(pv.size), size)) ** 2
    width = max(round(2.5 * size / pv.size), 1)
    level = np.log(np.maximum(power, 1e-300))
    power[:width] = power[-1] = 0.0
    found = []
    for _ in range(WAVES):
        i = int(np.argmax(power))
        before, at, after = level[i - 1 : i + 2]  # between the frequencies: what a wave leaves would look like OP's
        bend = before - 2.0 * at + after
        found.append((i + (0.5 * (before - after) / bend if bend < 0.0 else 0.0)) / size)
        power[max(i - width, 0) : i + width + 1] = 0.0
    return found


def fit_response(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    dt: float,
    period: float | None,
    controller: ControllerFit,
    found: Identification,
    sp: NDArray[np.float64] | None = None,
) -> LoopResponse:
    """Fit the linear predictions of one record.

    OP [% of span], PV and SP [engineering units] have the sampling period `dt` [s]; `period` [s] is that of the
    oscillation, None without one; `found` gives the sticky valve and the process. Too short a record has no response.
    """
    if pv.size < MIN_BLOCKS or not (float(np.ptp(pv)) > 0.0 and float(np.ptp(op)) > 0.0):
        return LoopResponse()
    peaks = _peaks(pv[:8192])
    per_period = 40.0 if period is None else period / dt
    size = int(np.clip(per_period / PER_PERIOD, 1, max(pv.size // MIN_BLOCKS, 1)))
    blocks = _Blocks(op, pv, size, peaks, found.mv[: op.size])
    others = [_Blocks(op, pv, one, peaks) for one in BLOCKS if one != size and pv.size // one >= MIN_BLOCKS]
    effect, gain = max(map(_op_effect, (blocks, *others)))
    beside = blocks.fit(blocks.own, blocks.waves, blocks.by_op)
    own, plain = blocks.fit(blocks.own), blocks.fit(blocks.own, blocks.by_op)
    sign = controller.action
    stem = _stem_evidence(blocks, beside)
    wave, inlet = _main_wave(blocks, beside)
    moved = blocks.means(sp, blocks.pv.size)[0] if sp is not None and float(np.ptp(sp)) > 0.0 else None
    known = blocks.orthonormal(blocks.own, blocks.waves), blocks.orthonormal(blocks.own)
    answers = find_answers(blocks.op, moved, blocks.target, known, blocks.first, sign)
    return LoopResponse(
        effect, gain * sign if sign else math.nan, _criterion(own, plain, OP_LAGS), *answers,
        _margin(blocks, plain, controller, dt),
        stem_for_op=stem[0], stem_beside_op=stem[1], stem_gain=stem[2] * sign if sign else math.nan,
        wave_effect=_criterion(plain, beside, blocks.waves.size), wave_over_op=wave, load_size=inlet,
        evidence=_predicted_evidence(blocks, op, found.linear, dt, beside),
    )  # fmt: skip


def _criterion(without: _Fit, with_it: _Fit, count: int) -> float:
    """Gain of Schwarz's criterion by `count` regressors [-]."""
    return without.n * math.log(without.error / with_it.error) - count * math.log(without.n)


def _gain_over_error(fit: _Fit, count: int) -> float:
    """Sum of the last weights over its standard error [-]."""
    variance = float(fit.covariance[-count:, -count:].sum())
    return float(fit.weights[-count:].sum()) / math.sqrt(max(variance, 1e-300))


def _op_effect(blocks: _Blocks) -> tuple[float, float]:
    """Gain of the criterion by OP beside the waves, and its gain over the standard error [-]."""
    with_op = blocks.fit(blocks.own, blocks.waves, blocks.by_op)
    return _criterion(blocks.fit(blocks.own, blocks.waves), with_op, OP_LAGS), _gain_over_error(with_op, OP_LAGS)


def _stem_evidence(blocks: _Blocks, by_op: _Fit) -> tuple[float, float, float]:
    """What the stem of the sticky valve adds to OP or does in its place, and its gain over the standard error [-]."""
    alone = blocks.fit(blocks.own, blocks.waves, blocks.by_stem)
    both = blocks.fit(blocks.own, blocks.waves, blocks.by_op, blocks.by_stem)
    in_place = by_op.n * math.log(by_op.error / alone.error)
    return in_place, _criterion(by_op, both, OP_LAGS), _gain_over_error(both, OP_LAGS)


def _main_wave(blocks: _Blocks, fit: _Fit) -> tuple[float, float]:
    """Movement of PV by the wave at the largest peak over that by OP [-], and the wave as a load [% of span]."""
    if not blocks.waves.size:
        return math.nan, math.nan
    count = blocks.waves.size // 2
    wave = math.hypot(fit.weights[1 + PV_LAGS], fit.weights[1 + PV_LAGS + count])
    turns = blocks.turns[0]
    answer = abs(fit.weights[-OP_LAGS:] @ np.exp(-1j * turns * np.arange(1, OP_LAGS + 1)))
    op = 2.0 * abs(np.mean(blocks.op * np.exp(-1j * turns * np.arange(blocks.op.size))))
    return float(wave / max(answer * op, 1e-12)), float(wave / max(answer, 1e-12) * blocks.scale_op)


def _margin(blocks: _Blocks, fit: _Fit, controller: ControllerFit, dt: float) -> Margin:
    """Gain margin where the Nyquist curve crosses the negative real axis, over draws of the fitted weights."""
    if controller.form == "unknown" or not math.isfinite(controller.Ki):
        return Margin()
    used = np.r_[1 : PV_LAGS + 1, fit.weights.size - OP_LAGS : fit.weights.size]
    values, vectors = np.linalg.eigh(fit.covariance[np.ix_(used, used)])
    spread = np.random.default_rng(0).normal(size=(DRAWS, used.size)) * np.sqrt(np.maximum(values, 0.0))
    weights = fit.weights[used] + np.vstack([np.zeros(used.size), spread @ vectors.T])
    omega = np.geomspace(2.0 * np.pi / min(fit.n, 1200), 0.9 * np.pi, 120)
    back = np.exp(-1j * np.outer(omega, np.arange(1, PV_LAGS + 1)))
    process = (weights[:, PV_LAGS:] @ back[:, :OP_LAGS].T) / (1.0 - weights[:, :PV_LAGS] @ back.T)
    h = dt * blocks.size
    s = 1j * omega / h
    pid = controller.Kc * (1.0 + controller.Td * s) + controller.Ki / s
    loop = process * (pid * np.exp(-0.5j * omega / blocks.size) * blocks.scale_pv / blocks.scale_op)
    real, imag = loop.real, loop.imag
    falls = (imag[:, :-1] < 0.0) & (imag[:, 1:] >= 0.0) & (real[:, :-1] < 0.0)
    share = imag[:, :-1] / np.where(falls, imag[:, :-1] - imag[:, 1:], 1.0)
    size = np.where(falls, -(real[:, :-1] + share * np.diff(real, axis=1)), math.exp(-MAX_LN_MARGIN))
    margins = np.clip(-np.log(np.maximum(size.max(axis=1), 1e-300)), -MAX_LN_MARGIN, MAX_LN_MARGIN)
    low, high = np.quantile(margins[1:], (0.15, 0.85))
    at = int(np.argmax(size[0]))
    return Margin(float(low), float(high), 2.0 * math.pi / float(omega[at]) * h if falls[0, at] else math.nan)


MAX_LN_MARGIN = 3.0
"""Largest ln(gain margin) told apart [-]."""


def _predicted_evidence(
    blocks: _Blocks, op: NDArray[np.float64], process: ProcessFit, dt: float, fit: _Fit
) -> NDArray[np.float64]:
    """Twice the log likelihood ratio that a sticky valve of each S would have over a good one, waves beside both [-].

    The stem of such a valve over the OP as it was recorded, less OP, passes the process of a good valve and the
    fitted prediction of PV; what OP and the waves cannot imitate counts, over the variance of the prediction error.
    """
    n, h = blocks.pv.size, dt * blocks.size
    rows = np.array([(S, TYPICAL_JUMP, 0.0, 0.0) for S in S_GRID])
    stems = np.empty((len(rows), n))
    sent = np.ascontiguousarray(op[: n * blocks.size])
    valve_positions(sent, blocks.size, *as_valve_arrays(rows), stems)
    away = stems - sent.reshape(n, blocks.size).mean(axis=1)
    gain = process.gain * (h if process.integrating else 1.0) / blocks.scale_pv
    slow = math.inf if process.integrating else max(process.time_constant - process.lag, 0.0) / h
    block_process = FittedProcess(gain, slow, process.lag / h, min(process.dead_time / h, n - 1.0), 0.0)
    answer = np.array([simulate_process(x, block_process, None) for x in away])
    effect = answer[:, blocks.first :].copy()
    for k in range(1, PV_LAGS + 1):
        effect -= fit.weights[k] * answer[:, blocks.first - k : n - k]
    used = np.concatenate([blocks.own, blocks.waves, blocks.by_op])
    known = blocks.rows[used]
    effect -= np.linalg.solve(blocks.squares[np.ix_(used, used)], known @ effect.T).T @ known
    return fit.n * np.log1p(np.einsum("ij,ij->i", effect, effect) / fit.error)
