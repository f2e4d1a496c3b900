r"""Stick band, jump and the frictionless line from slips and following, by least squares.

A spring-opposed valve rests where its input and its friction balance. With the frictionless line
:math:`u = a + b\,x` and the direction of the OP :math:`m = \pm 1`,

.. math::

    u = a + b\,x_{before} + m\,sb, \qquad u = a + b\,x_{after} + m\,(sb - sj), \qquad u = a + b\,x + m\,f_D

at a slip, right after it, and while the stem follows. While it follows, the stem also lags by the rate times a time
constant (viscous friction, flow sensor), which two followed rates determine. A flow also shows each slip late, by a
time that slips at two rates determine. All are linear in a, b, sb, sb - sj, fD and the two times. Ramps in both
directions determine the line; from one direction it has to be assumed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.quantiles import robust_std
from stiction.valvetests.ramp_intervals import SystematicError, make_estimate, slip_covariance
from stiction.valvetests.result import Estimate

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["FrictionFit", "SlipRows", "fit_friction"]

MIN_SLOPE_TRAVEL = 5.0
"""Smallest travel over which the slope of the frictionless line of a position is fitted [% of span]."""
MIN_SLIP_ERROR = 0.02
"""Error of a slip on the slowest ramp [% of span]."""
MIN_RATE_RATIO = 1.3
"""Ratio of two rates above which lag and friction can be separated [-]."""
OUTLIER_LIMIT_STD = 5.0
"""Distance of a slip from the fit above which it is an outlier, in robust standard deviations [-]."""


@dataclass(frozen=True, slots=True)
class SlipRows:
    """Slips and points of following as arrays; a point of following belongs to the slip before it."""

    direction: NDArray[np.float64]
    """1 when the OP rose, -1 when it fell [-], shape (n_slips,)."""
    op: NDArray[np.float64]
    """OP at the slip [% of span], shape (n_slips,)."""
    before: NDArray[np.float64]
    """Stem before the slip [unit of the stem signal], shape (n_slips,)."""
    after: NDArray[np.float64]
    """Stem right after it [unit of the stem signal], shape (n_slips,)."""
    rate: NDArray[np.float64]
    """Rate of the OP [% of span / s], shape (n_slips,)."""
    followed: NDArray[np.bool_]
    """Whether the stem then followed, shape (n_slips,)."""
    hidden_jump: NDArray[np.float64]
    """Jump of hidden stairs that began with the slip [% of span]; NaN when the jump itself is visible, (n_slips,)."""
    rise: NDArray[np.float64]
    """Visible duration of the slip [s], shape (n_slips,)."""
    follow_slip: NDArray[np.int64]
    """Slip before each point of following [-], shape (n_points,)."""
    follow_mean: NDArray[np.bool_]
    """Whether the point is on the mean line of hidden stairs, shape (n_points,)."""
    follow_op: NDArray[np.float64]
    """OP at the point [% of span], shape (n_points,)."""
    follow_stem: NDArray[np.float64]
    """Stem at the point [unit of the stem signal], shape (n_points,)."""


@dataclass(frozen=True, slots=True)
class FrictionFit:
    """The frictionless line and the friction about it."""

    offset: float
    """OP of the frictionless valve at stem 0, a [% of span]."""
    slope: float
    """OP per stem, b [% of span per unit of the stem signal]."""
    sb: Estimate
    """Stick band [% of span]."""
    sj: Estimate
    """Jump [% of span]."""
    lag: Estimate
    """Distance from the frictionless line while following, fD, at rate 0 [% of span]."""
    deadband: Estimate
    """Twice the distance from the frictionless line while following or after a jump [% of span]."""
    S: Estimate
    """Deadband plus stickband, 2 sb - sj [% of span]."""
    delay: float
    """Lag of the following stem [s]; 0 when fewer than two rates were followed."""
    late: float
    """Time by which a flow shows a slip late [s]; 0 for a position, NaN for a flow that slipped at one rate only."""
    systematic_error: SystematicError
    """Systematic error of all slips."""
    stick_bands: NDArray[np.float64]
    """Stick band of each slip [% of span], shape (n_slips,)."""
    jumps: NDArray[np.float64]
    """Jump of each slip [% of span], shape (n_slips,)."""
    both_directions: bool
    """Whether there are slips in both directions."""


def fit_friction(rows: SlipRows, is_position: bool, *, dt: float, op_step: float, rounding: float) -> FrictionFit:
    """Fit the line and the friction.

    Parameters
    ----------
    rows : Rows
        One slip or more.
    is_position : bool
        True when the stem signal is a position, whose line is taken as u = x where the test does not determine it.
    dt : float
        Sampling period [s].
    op_step : float
        Step to which OP is rounded [% of span].
    rounding : float
        Step to which the stem signal is rounded [its unit].

    Returns
    -------
    FrictionFit
        Without sb and lag when a flow has slips in one direction only: its zero is unknown.
    """
    n = rows.op.size
    both = np.unique(rows.direction).size == 2
    span = float(np.ptp(np.concatenate([rows.before, rows.after, rows.follow_stem])))
    free_slope = not is_position or (both and span >= MIN_SLOPE_TRAVEL)
    visible = np.flatnonzero(np.isnan(rows.hidden_jump))
    hidden = np.flatnonzero(np.isfinite(rows.hidden_jump))
    follow, mean = np.flatnonzero(~rows.follow_mean), np.flatnonzero(rows.follow_mean)
    sizes = n, visible.size, follow.size, mean.size, hidden.size
    sort = np.repeat(np.arange(5), sizes)
    slip = np.concatenate([np.arange(n), visible, rows.follow_slip[follow], rows.follow_slip[mean], hidden])
    op = np.concatenate(
        [rows.op, rows.op[visible], rows.follow_op[follow], rows.follow_op[mean], rows.hidden_jump[hidden]]
    )
    stem = np.concatenate(
        [rows.before, rows.after[visible], rows.follow_stem[follow], rows.follow_stem[mean], np.zeros(hidden.size)]
    )
    # Columns sb, sb - sj and fD: the mean line of stairs lies half way between the first two, a jump is the
    # difference of these.
    share = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0], [1.0, -1.0, 0.0]])[sort]
    balance = sort < 4
    points = 3 if follow.size else 2
    sign = np.where(balance, rows.direction[slip], 1.0)
    columns = [sign * share[:, k] for k in range(points)]
    moving = (sort == 2) | (sort == 3) | ((sort == 1) & rows.followed[slip])
    speeds = np.abs(rows.rate[slip][moving])
    free_lag = speeds.size > 0 and float(speeds.max()) > MIN_RATE_RATIO * float(speeds.min())
    columns += [rows.rate[slip] * moving] if free_lag else []
    speeds = np.abs(rows.rate)
    free_late = not is_position and float(speeds.max()) > MIN_RATE_RATIO * float(speeds.min())
    shown = (sort == 0) | ((sort == 1) & ~rows.followed[slip])
    columns += [rows.rate[slip] * shown] if free_late else []
    columns += [balance.astype(np.float64)] if both else []
    columns += [stem] if free_slope else []
    design, target = np.stack(columns, axis=1), op if free_slope else op - stem

    # OP moves on during a sample or a slip, so a slow ramp is more exact than a fast one.
    # A stem that follows after its slip does not stop late.
    slides = np.abs(rows.rate) * (rows.rise + dt * ~(rows.followed & is_position))
    weight = 1.0 / (MIN_SLIP_ERROR + slides)
    valid = np.ones(n, bool)
    best = _solve(design, target, weight[slip])
    for _ in range(2):
        miss = np.abs(target - design @ best)
        worst = np.zeros(n)
        np.maximum.at(worst, slip[sort < 2], miss[sort < 2])
        valid = worst <= max(OUTLIER_LIMIT_STD * robust_std(worst, centre=0.0), 0.05)
        best = _solve(design[valid[slip]], target[valid[slip]], weight[slip[valid[slip]]])
    inside = valid[slip]
    weights = weight[slip[inside], np.newaxis]
    spread = slip_covariance(slip[inside], weights * design[inside], weights[:, 0] * target[inside], best)

    slope = float(best[-1]) if free_slope else 1.0
    offset = float(best[len(best) - 1 - free_slope]) if both else 0.0
    delay = float(best[points]) if free_lag else 0.0
    late = float(best[points + free_lag]) if free_late else 0.0
    bands = rows.direction * (rows.op - late * rows.rate - offset - slope * rows.before)
    jumps = rows.direction * (slope * (rows.after - rows.before) + delay * rows.rate * rows.followed)
    jumps = np.where(np.isnan(rows.hidden_jump), jumps, rows.hidden_jump)
    slide = float(np.average(slides[valid], weights=weight[valid] ** 2))
    pace = float(np.average(np.abs(rows.rate[valid]), weights=weight[valid] ** 2))
    # A flow shows a slip by its slope, up to one sample early or late.
    grain = (0.5 if is_position else 1.0) * pace * dt + 0.5 * (op_step + abs(slope) * rounding)
    # The lag of a stem that follows can act before the friction, and then delays a slip as well.
    late_by = pace * max(delay, 0.0) if is_position else 0.0 if free_late else slide
    doubt = SystematicError(grain, slide, late_by, 0.0 if is_position or free_lag else slide, not is_position)

    def estimate_of(
        name: str, weights: tuple[float, ...], readings: NDArray[np.float64], times: float = 1.0
    ) -> Estimate:
        contrast = np.zeros(best.size)
        contrast[: len(weights)] = weights
        below, above = doubt.bounds(name)
        return make_estimate(
            times * float(contrast @ best),
            times * times * float(contrast @ spread @ contrast),
            times * readings,
            int(valid.sum()),
            (times * below, times * above),
        )

    sb, sj = estimate_of("sb", (1.0,), bands[valid]), estimate_of("sj", (1.0, -1.0), jumps[valid])
    S = estimate_of("S", (1.0, 1.0), 2.0 * bands[valid] - jumps[valid])
    lag, deadband = Estimate(), estimate_of("behind", (0.0, 1.0), bands[valid] - jumps[valid], 2.0)
    began = rows.follow_slip[follow]
    # Without a valid row the column of fD is empty and its solution 0, which is not a reading.
    if valid[began].any():
        trail = rows.follow_op[follow] - delay * rows.rate[began]
        lags = rows.direction[began] * (trail - offset - slope * rows.follow_stem[follow])
        lag = estimate_of("follow", (0.0, 0.0, 1.0), lags)
        following = estimate_of("follow", (0.0, 0.0, 1.0), lags, 2.0)
        # Take the narrower interval: among many stairs, a period of following can be stairs that were not detected.
        deadband = min(following, deadband, key=_width)
    if not both and not is_position:
        bands, sb, lag, deadband, S = np.full(n, math.nan), Estimate(n=n), Estimate(), Estimate(), Estimate()
    late = late if is_position or free_late else math.nan
    return FrictionFit(
        offset, slope, sb, sj, lag, deadband, S, delay, late=late, systematic_error=doubt, stick_bands=bands,
        jumps=jumps, both_directions=both,
    )  # fmt: skip


def _width(estimate: Estimate) -> float:
    return estimate.high - estimate.low if math.isfinite(estimate.low) else math.inf


def _solve(
    design: NDArray[np.float64], target: NDArray[np.float64], weight: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.asarray(np.linalg.lstsq(weight[:, np.newaxis] * design, weight * target, rcond=None)[0], dtype=np.float64)
