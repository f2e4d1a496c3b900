"""Stiction by the recorded valve position: the band and the slip jump seen directly, without a process between."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.candidates import Candidates, Valve, combinations, joined, pattern_search
from stiction.diagnosis.identification.stems import as_valve_arrays, valve_positions

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["PositionFit", "fit_position"]

MIN_RECORDED = 60
"""Samples of the position below which nothing is said [-]."""
MAX_DELAY = 5
"""Samples that the recorded position may come late [-]."""
LAGS = (0.0, 2.0, 6.0)
"""Time constants of the position signal that are tried [samples]."""
TRIED_FITS = 4
"""Pairs of delay and lag that are searched closely [-]."""


@dataclass(frozen=True, eq=False)
class PositionFit:
    """What the recorded position says about the valve."""

    kind: str
    """good, deadband or stiction: the simplest valve that explains the position."""
    valve: Valve
    """The valve of that kind that fits best."""
    likelihood_ratio: float
    """Twice the log likelihood ratio of the best sticky valve over the best valve without slip jump [-]."""
    deadband_ratio: float
    """Twice the log likelihood ratio of the best valve with deadband over a good one [-]."""
    slope: float
    """Scale of the position [its unit per % of span]."""
    level: float
    """Position where the stem stands at 0 % [its unit]."""
    explained: float
    """Share of the variance of the position that the valve explains [%]."""
    position: NDArray[np.float64]
    """Simulated stem [% of span], shape (n_samples,)."""
    S_range: tuple[float, float]
    """95 % interval of S [% of span]."""
    J_range: tuple[float, float]
    """95 % interval of J [% of span]."""


def fit_position(
    op: NDArray[np.float64],
    position: NDArray[np.float64],
    *,
    min_S: float = 0.5,
    min_likelihood_ratio: float = 12.0,
    max_samples: int = 6000,
) -> PositionFit | None:
    """Fit a valve to a recorded position.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output without gaps [% of span].
    position : ndarray, shape (n_samples,)
        Recorded valve position [any unit]; NaN is missing.
    min_S : float
        Band up to which a valve in service is good [% of span].
    min_likelihood_ratio : float
        Evidence from which a more complex valve is taken [-].
    max_samples : int
        Samples compared at most, those in the middle [samples].

    Returns
    -------
    PositionFit or None
        None where the position was hardly recorded or does not move with OP.

    Notes
    -----
    The stem of each candidate valve is simulated over OP, and a straight line from stem to position is fitted for each
    delay and lag of the position signal. The residual is autocorrelated, so that the number of samples in the
    likelihood is divided by 1 + 2 times the sum of its autocorrelation up to the first zero.

    Examples
    --------
    >>> import stiction as st
    >>> op = 50.0 + 4.0 * np.sin(np.arange(1500.0) / 15.0)
    >>> stem = st.stroke(st.Kano(3.0, 1.5), op, dt=1.0).mv + np.random.default_rng(0).normal(0.0, 0.1, 1500)
    >>> found = fit_position(op, 4.0 + 0.16 * stem)
    >>> found.kind, round(found.valve.S, 1)
    ('stiction', 3.0)
    """
    known = np.isfinite(position)
    if known.sum() < MIN_RECORDED or not float(np.ptp(op)) > 0.0 or not float(np.nanstd(position)) > 0.0:
        return None
    searches = [_search(fit, min_S) for fit in _Fit.ranked(op, position, max_samples)[:TRIED_FITS]]
    fit, good, play, sticky = min(searches, key=lambda one: float(one[3].cost.min()))
    samples = fit.independent_share(sticky.best)
    ratios = [samples * (float(a.cost.min()) - float(b.cost.min())) for a, b in ((good, play), (play, sticky))]
    over_good = samples * (float(good.cost.min()) - float(sticky.cost.min()))
    jump = min(ratios[1], over_good)
    kind = "good"
    if max(ratios[0], over_good) > min_likelihood_ratio:
        kind = "stiction" if jump > min_likelihood_ratio else "deadband"
    chosen = {"good": good, "deadband": play, "stiction": sticky}[kind]
    valve = chosen.best
    slope, level, share = fit.line(valve)
    if share < 0.1:
        return None
    near = chosen.valves[samples * (chosen.cost - chosen.cost.min()) < 8.0]
    band = (float(near[:, 0].min()), float(near[:, 0].max()))
    jumps = (near[:, 0] * near[:, 1]).min(), (near[:, 0] * near[:, 1]).max()
    out = np.empty((1, op.size))
    valve_positions(np.ascontiguousarray(op), 1, *as_valve_arrays(np.array([valve])), out)
    floor = 0.015 * valve.S
    return PositionFit(
        kind, valve, jump, ratios[0], slope, level, 100.0 * share, out[0],
        (max(band[0] - floor, 0.0), band[1] + floor),
        (max(float(jumps[0]) - floor, 0.0), float(jumps[1]) + floor),
    )  # fmt: skip


def _search(fit: _Fit, min_S: float) -> tuple[_Fit, Candidates, Candidates, Candidates]:
    """Candidates of a good valve, of one with deadband alone and of a sticky one."""
    swing = float(np.ptp(fit.op))
    small = min(min_S, 0.1 * swing)
    S, zero, rules = np.geomspace(small, swing, 28), np.zeros(1), np.array([0.0, 1.0])
    starts = np.array([-0.6, 0.6])
    good = fit.evaluate(combinations(np.geomspace(1e-3 * small, small, 6), zero, zero, zero))
    play = fit.evaluate(combinations(S, zero, zero, np.array([-0.6, 0.0, 0.6])))
    sticky = fit.evaluate(combinations(S, np.array([0.2, 0.4, 0.6, 0.8, 1.0]), rules, zero))
    far = fit.evaluate(combinations(S[0.3 * swing < S], np.array([0.5]), rules, starts))
    return fit, good, _refine(fit, play, swing, jump=False), _refine(fit, joined(sticky, far), swing)


def _refine(fit: _Fit, found: Candidates, swing: float, *, jump: bool = True) -> Candidates:
    """Pattern searches about the best candidates; without a jump J / S stays 0."""
    steps = ((0.05, 0.1, 0.3, 6), (0.02, 0.05, 0.15, 4), (0.008, 0.02, 0.08, 3), (0.003, 0.008, 0.04, 2))
    plain = steps if jump else tuple((S, 0.0, start, count) for S, _, start, count in steps)
    return pattern_search(fit.evaluate, found, plain, swing)


@dataclass(frozen=True, eq=False)
class _Fit:
    """OP and position, and how the position follows the stem."""

    op: NDArray[np.float64]
    y: NDArray[np.float64]
    weight: NDArray[np.float64]
    delay: int
    lag: float

    @classmethod
    def ranked(cls, op: NDArray[np.float64], position: NDArray[np.float64], max_samples: int) -> list[_Fit]:
        """The part compared, with every delay and lag of the position, the best by a rough search first."""
        first = max((op.size - max_samples) // 2, 0)
        part = slice(first, first + max_samples)
        weight = np.isfinite(position[part]).astype(np.float64)
        y = np.where(weight > 0.0, position[part], 0.0)
        fits = [
            cls(np.ascontiguousarray(op[part]), y, weight, delay, lag) for delay in range(MAX_DELAY + 1) for lag in LAGS
        ]
        rough = combinations(
            np.geomspace(0.02, 0.9, 8) * float(np.ptp(op)), np.array([0.0, 0.6]), np.zeros(1), np.zeros(1)
        )
        return sorted(fits, key=lambda fit: float(fit.evaluate(rough).cost.min()))

    def stems(self, valves: NDArray[np.float64]) -> NDArray[np.float64]:
        """Stems as the position signal shows them, shape (n_valves, n_samples)."""
        out = np.empty((len(valves), self.op.size))
        valve_positions(self.op, 1, *as_valve_arrays(valves), out)
        if self.delay:
            out = np.concatenate([out[:, :1].repeat(self.delay, axis=1), out[:, : -self.delay]], axis=1)
        if self.lag > 0.0:
            from scipy.signal import lfilter

            keep = float(np.exp(-1.0 / self.lag))
            out = lfilter([1.0 - keep], [1.0, -keep], out, axis=1, zi=keep * out[:, :1])[0]
        return out

    def evaluate(self, valves: NDArray[np.float64]) -> Candidates:
        """Candidates with N ln(residual sum of squares / N)."""
        cost = [self._cost(self.stems(valves[i : i + 32])) for i in range(0, len(valves), 32)]
        return Candidates(valves, np.concatenate(cost))

    def _cost(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        w, y = self.weight, self.y
        n = float(w.sum())
        x_mean, y_mean = x @ w / n, float(y @ w) / n
        dx, dy = (x - x_mean[:, None]) * w, (y - y_mean) * w
        power = np.einsum("vk,vk->v", dx, dx)
        cross = dx @ dy
        energy = float(dy @ dy)
        left = energy - cross**2 / np.maximum(power, 1e-300)
        return n * np.log(np.maximum(left, 1e-8 * energy) / n)

    def line(self, valve: Valve) -> tuple[float, float, float]:
        """Slope, level and explained share of the straight line from stem to position."""
        seen = self.weight > 0.0
        x, y = self.stems(np.array([valve]))[0][seen], self.y[seen]
        slope, level = np.polyfit(x, y, 1) if float(np.ptp(x)) > 0.0 else (0.0, float(y.mean()))
        return float(slope), float(level), 1.0 - float(np.var(y - slope * x - level)) / float(np.var(y))

    def independent_share(self, valve: Valve) -> float:
        """Share of the samples that are independent, by the autocorrelation of the residual [-]."""
        slope, level, _ = self.line(valve)
        left = (self.y - slope * self.stems(np.array([valve]))[0] - level) * self.weight
        spectrum = np.fft.rfft(left, 2 * left.size)
        acf = np.fft.irfft(spectrum.real**2 + spectrum.imag**2)[: left.size]
        if not acf[0] > 0.0:
            return 1.0
        negative = np.flatnonzero(acf <= 0.0)
        return 1.0 / (1.0 + 2.0 * float(acf[1 : negative[0] if negative.size else left.size].sum()) / float(acf[0]))
