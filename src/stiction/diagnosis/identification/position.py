"""Stiction by the recorded valve position: band and slip jump in the signal itself, without a process between."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.candidates import Candidates, Valve, combinations, joined, pattern_search
from stiction.diagnosis.identification.corrected_stem import CorrectedStems, position_noise, usual_scale
from stiction.diagnosis.identification.model_fit import independent_share, likely_candidates, likely_range
from stiction.diagnosis.identification.position_regression import position_regression, position_signal
from stiction.diagnosis.identification.stems import whole_position

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.position_regression import PositionRegression
    from stiction.diagnosis.identification.result import Identification

__all__ = ["PositionFit", "fit_position", "with_position"]


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
    explained_linear: float
    """The same for a good valve [%]."""
    position: NDArray[np.float64]
    """Simulated stem [% of span], shape (n_samples,)."""
    S_range: tuple[float, float]
    """95 % interval of S [% of span]."""
    J_range: tuple[float, float]
    """95 % interval of J [% of span]."""
    regression: PositionRegression
    """What stems were compared with."""


def fit_position(
    op: NDArray[np.float64],
    position: NDArray[np.float64],
    *,
    min_S: float = 0.5,
    min_likelihood_ratio: float = 12.0,
    min_explained: float = 0.1,
) -> PositionFit | None:
    """Fit a valve to a recorded position; None where it is hardly recorded, frozen, unrelated to OP, or a copy of it.

    Up to a band of `min_S` [% of span] a valve in service is good; a more complex valve is taken from
    `min_likelihood_ratio` [-] on, and it must explain `min_explained` of the variance of the position [-].

    The stem of each candidate valve is simulated over OP and compared with the position through a straight line, a
    delay of up to five samples and a first-order lag. The residual is autocorrelated, so that the number of samples in
    the likelihood is divided by 1 + 2 times the sum of its autocorrelation up to the first zero. Where a search with
    corrected stems (`corrected_stem`) finds a better valve, S and J are those.

    Examples
    --------
    >>> import stiction as st
    >>> op = 50.0 + 4.0 * np.sin(np.arange(1500.0) / 15.0)
    >>> stem = st.stroke(st.Kano(3.0, 1.5), op, dt=1.0).mv + np.random.default_rng(0).normal(0.0, 0.1, 1500)
    >>> found = fit_position(op, 4.0 + 0.16 * stem)
    >>> found.kind, round(found.valve.S, 1)
    ('stiction', 3.0)
    """
    signal = position_signal(op, position)
    compared = None if signal is None else position_regression(signal)
    if compared is None or not float(np.ptp(compared.position)) > 1e-9 * abs(compared.level):
        return None
    regression, good, play, sticky, jump = _search(compared, min_S)
    residual = regression.residuals(regression.positions(np.array([sticky.best])))[0]
    share = independent_share(residual)
    cost = [float(found.cost.min()) for found in (good, play, sticky)]
    over_good, deadband_ratio = share * (cost[0] - cost[2]), share * (cost[0] - cost[1])
    jump_ratio = min(share * max(cost[1] - cost[2], jump), over_good)
    kind = "good"
    if max(deadband_ratio, over_good) > min_likelihood_ratio:
        kind = "stiction" if jump_ratio > min_likelihood_ratio else "deadband"
    chosen = {"good": good, "deadband": play, "stiction": sticky}[kind]
    valve = chosen.best
    line, linear = (regression.line(regression.positions(np.array([one]))[0]) for one in (valve, good.best))
    if line.explained < min_explained:
        return None
    S_range, J_range = _ranges(chosen, share)
    return PositionFit(
        kind, valve, jump_ratio, deadband_ratio, line.slope, line.level, explained=100.0 * line.explained,
        explained_linear=100.0 * linear.explained, position=whole_position(op, valve), S_range=S_range,
        J_range=J_range, regression=regression,
    )  # fmt: skip


def _search(
    wide: PositionRegression, min_S: float
) -> tuple[PositionRegression, Candidates, Candidates, Candidates, float]:
    """Good valves, valves with deadband alone, sticky ones, and the evidence of a slip jump by corrected stems."""
    swing = float(np.ptp(wide.op))
    small = min(min_S, 0.1 * swing)
    S, zero = np.geomspace(small, swing, 24), np.zeros(1)
    good = wide.evaluate(combinations(small * np.array([1e-3, 0.3, 0.6, 1.0]), zero, zero, zero))
    play = wide.evaluate(combinations(S, zero, zero, zero))
    sticky = wide.evaluate(combinations(S, np.array([0.3, 0.6, 1.0]), zero, zero))
    searches = [(one, one.search(small)) for one in _corrected_stems(wide, joined(play, sticky).best)]
    tops = [wide.evaluate(found.local_minima(6, 0.01, 0.02) * NO_START) for _, found in searches]
    corrected, found = searches[int(np.argmin([top.cost.min() for top in tops]))]
    jump = float(corrected.search(small, jump=False).cost.min() - found.cost.min())
    for top in tops:
        sticky = joined(sticky, top)
    for factor, steps in STAGES:
        lags = [wide.line(wide.positions(np.array([one.best]))[0]).lag for one in (good, play, sticky)]
        near = [wide.around({lag}, factor).evaluate for lag in lags]
        wide = wide.around(set(lags), factor)
        plain = tuple((S_step, 0.0, start, count) for S_step, _, start, count in steps)
        good = near[0](good.valves)
        play = pattern_search(near[1], near[1](play.local_minima(4, 0.02, 0.05)), plain, swing)
        sticky = pattern_search(near[2], near[2](sticky.local_minima(6, 0.01, 0.02)), steps, swing, diagonal=True)
    cost = float(wide.evaluate(np.array([found.best]) * NO_START).cost[0])
    residual = wide.residuals(wide.positions(np.array([sticky.best])))[0]
    exact = float(residual.std()) < 3.0 * position_noise(np.where(wide.weight > 0.0, wide.position, np.nan))
    if not exact and cost < play.cost.min() and found.cost.min() < corrected.evaluate(np.array([sticky.best])).cost[0]:
        return wide, good, play, Candidates(found.valves * NO_START, found.cost - found.cost.min() + cost), jump
    return wide, good, play, sticky, -np.inf


STAGES = ((1.5, ((0.05, 0.1, 0.3, 5), (0.02, 0.05, 0.15, 4))), (1.2, ((0.008, 0.02, 0.08, 3), (0.003, 0.008, 0.04, 2))))
"""Factor between the lags tried, and pattern searches: steps in ln S, in J / S and in the start, and candidates [-]."""
NO_START = np.array([1.0, 1.0, 1.0, 0.0])
"""Factors that set the start of candidates to OP: a search with correction has a shift in its place."""


def _corrected_stems(wide: PositionRegression, valve: Valve) -> list[CorrectedStems]:
    """Searches with correction on the scale of a valve that fits roughly: without delay, and with the likeliest one."""
    stem = wide.positions(np.array([valve]))[0]
    line = wide.line(stem)
    slope = usual_scale(line.slope) if line.slope != 0.0 else 1.0
    level = line.level + (line.slope - slope) * float(stem.mean())
    observed = (np.where(wide.weight > 0.0, wide.position + wide.level, np.nan) - level) / slope
    swing = float(np.ptp(wide.op))
    noise = max(position_noise(observed), 1e-3 * swing)
    rows = combinations(swing * np.geomspace(0.05, 1.0, 16), np.array([0.2, 0.9]), np.zeros(1), np.zeros(1))
    late = [
        CorrectedStems(np.ascontiguousarray(wide.op[: wide.op.size - delay]), observed[delay:].copy(), noise)
        for delay in wide.delays
    ]
    likeliest = int(np.argmin([float(one.evaluate(rows, 0.03 * swing).cost.min()) for one in late]))
    return [late[delay] for delay in sorted({0, likeliest})]


def _ranges(found: Candidates, share: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Intervals of S and J: those of the likely candidates, wider by a twentieth of S, the resolution of the search."""
    likely, margin = likely_candidates(found.cost, share), 0.05 * found.best.S
    S, ratio = found.valves[:, 0], found.valves[:, 1]
    return likely_range(S, likely, margin), likely_range(S * ratio, likely, margin)


NOT_USED = "The recorded valve position was not used: it has few values, does not follow OP, or is a copy of OP."
"""Remark on a record whose position says nothing about the stem."""


def with_position(found: Identification, position: PositionFit | None, *, recorded: bool) -> Identification:
    """Put S and J of the recorded position in place of those by the PV; the process stays the one by the PV.

    S and J with their intervals, the stem and the explained shares are those of the position. Where one was `recorded`
    that says nothing, a remark says so.
    """
    if position is None:
        return replace(found, reason=f"{found.reason} {NOT_USED}".strip()) if recorded else found
    S, J = position.valve.S, position.valve.S * position.valve.ratio
    return replace(
        found, S=S, J=J, S_low=position.S_range[0], S_high=position.S_range[1], J_low=position.J_range[0],
        J_high=position.J_range[1], mv=position.position, by_position=True, reason="", fit=position.explained,
        fit_linear=position.explained_linear,
    )  # fmt: skip
