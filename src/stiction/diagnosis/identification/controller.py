"""The controller behind the OP: its form, gain and times by least squares from OP and error."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.controller_forms import (
    INTEGRAL,
    PARTS,
    FormFit,
    Regression,
    best_form,
    energy_of,
    moves,
    neighbour_correlation,
    positions,
)
from stiction.diagnosis.identification.result import ControllerFit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from stiction.diagnosis.segment import JudgedSegment

__all__ = ["COMPUTED", "EXACT", "at_limit", "fit_controller"]

FEWEST_ROWS = 20
"""Samples [-] below which no controller is fitted."""
ENOUGH = 0.5
"""Share of the OP's variation [-] that a controller must explain to be named."""
ROUNDED = -0.25
"""Correlation of neighbouring residuals of the moves [-]: halfway from 0 (bumps) to -1/2 (rounding)."""
EXACT, COMPUTED = 1e-6, 1e-9
"""Unexplained shares of the moves [-]: up to which a form of controller explains them, and up to which only the
rounding of computed numbers is left."""
AS_ROUNDED = 1.5
"""How many times what rounding leaves [-] may be left of the moves that a form of controller explains."""
SMOOTHER, STANDARD_ERRORS = 4.0, 4.0
"""Factor by which the interpolation error may be overestimated when smooth [-], and standard errors by which a residual
must stand out [-]."""
NEIGHBOURS = 3
"""Samples on either side that predict a sample of the PV [-]: enough for three sines."""


def fit_controller(segment: JudgedSegment) -> ControllerFit:
    """Fit OP = Kc (e + int e dt / Ti + Td de/dt) and name the form.

    Without a set point a P controller is named, and its sign told, only where it explains all moves of OP: a PV that
    follows a set point which was not recorded looks like one of the wrong sign.

    The moves of OP from sample to sample are compared unless their residuals alternate, as those of a rounded OP
    do; then OP itself is compared. Gaps, samples in manual, at a limit of OP, and single bumps are left out.

    Parameters
    ----------
    segment : JudgedSegment
        The judged part of a record; without SP, a constant one is assumed.

    Returns
    -------
    ControllerFit
        The controller and how much of the OP it explains.

    Notes
    -----
    Derived in ``docs/understand/controller.md``; tests compare with simulated controllers. A loop that swings as one
    sine is explained by any PI-like relation of OP and PV: ``explained`` proves no causality.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.diagnosis.identification import fit_controller
    >>> from stiction.diagnosis.segment import judge_segment
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> found = fit_controller(judge_segment(st.simulate(loop, sp=10.0, duration=2000.0)))
    >>> found.form, round(found.Kc, 3), round(found.Ti, 2)
    ('PI', 0.2, 10.0)
    """
    op, pv, record = segment.op, segment.pv, segment.part
    if not op.size:
        return _none("No samples of OP and PV can be used.")
    sp = np.full_like(pv, pv.mean()) if record.sp is None else record.sp
    valid = ~segment.signals.missing
    if record.auto is not None:
        valid &= record.auto
    limited = at_limit(op)
    valid &= ~limited
    moving = bool(np.ptp(sp[valid]) > 0.0) if valid.any() else False
    error, mean = sp - pv, pv.mean()
    sp, pv = sp - mean, pv - mean

    data, bumps = _without_bumps(moves(op, error, pv, valid, record.dt, 0.0, moving), moving)
    if data.y.size < FEWEST_ROWS:
        return _none(f"Only {data.y.size} moves of OP between gaps, limits and manual; {FEWEST_ROWS} are needed.")
    if not np.any(data.y):
        return _none("OP does not move.")
    full = data.unexplained(moving)
    left = energy_of(full) / energy_of(data.y)
    own, as_rounded = left <= COMPUTED, False
    steps = segment.signals.op_step, segment.signals.pv_step
    if not own and any(steps):
        law = best_form(data, moving, 0.0, record.dt, exact=True).weights
        rounding = _rounding(law, record.dt, *steps)
        as_rounded = energy_of(full) <= AS_ROUNDED * rounding * full.size
        own = as_rounded and _stands_out(_between(law, record.dt, pv, steps[1]), full, rounding)
    if own:  # a filter of both leaves the law as it is
        own = not segment.is_averaged
    exact = as_rounded or left <= EXACT
    trapezoid = 0.0 if exact else 0.5
    data.columns[1] -= trapezoid * record.dt * data.columns[0]
    rho = neighbour_correlation(full)
    found, compared = best_form(data, moving, max(rho, 0.0), record.dt, exact), "moves of OP"
    # Where the moves leave no more than the rounding of computed numbers, their correlation says nothing.
    if left > COMPUTED and (rho < ROUNDED or found.share < ENOUGH or ("D" in found.form and not exact)):
        whole = positions(op, error, pv, valid, record.dt, trapezoid, moving)
        if whole.y.size >= FEWEST_ROWS and np.any(whole.y):
            rho = min(max(neighbour_correlation(whole.unexplained(moving)), 0.0), 0.99)
            other = best_form(whole, moving, rho, record.dt, exact)
            if other.share > found.share:
                found, compared, bumps = other, "OP itself", 0
    rate = "at the controller's rate" if exact else "the integral by trapezoids"
    why = f"{compared} compared, {rate}"
    if limited.any():
        why += f"; {int(limited.sum())} samples at a limit left out"
    if bumps:
        why += f"; {bumps} bumps left out"
    if not moving:
        why += "; the set point is constant, so that a term of the error and a term of the PV are the same"
    named = replace(_named(found, why + "."), exact=own, unexplained=left)
    if record.sp is None and not exact and "I" not in found.form:
        # PV that follows a set point which was not recorded moves with OP, as it does under no controller.
        unseen = " The set point was not recorded; if it moves, PV and OP go together because of it."
        return replace(named, form="unknown", action=0.0, why=named.why + unseen)
    return named


def _named(found: FormFit, why: str) -> ControllerFit:
    """Turn weights into gain and times, with errors by linear propagation."""
    uses = list(found.weights)
    integral = uses.index(1) if 1 in uses else -1
    proportional = -1 if found.form == "I" else 0
    weights = np.array([found.weights[use] for use in uses])
    Kc = float(weights[proportional]) if proportional >= 0 else 0.0
    Ki = float(weights[integral]) if integral >= 0 else 0.0
    Kc_error = math.sqrt(max(found.covariance[0, 0], 0.0)) if proportional >= 0 else 0.0
    Ti, Ti_error = (Kc / Ki if Ki else math.inf), 0.0
    if Kc and Ki:
        slope = np.zeros(len(uses))
        slope[proportional], slope[integral] = 1.0 / Ki, -Kc / Ki**2
        Ti_error = math.sqrt(max(float(slope @ found.covariance @ slope), 0.0))
    Td = float(weights[2]) / Kc if len(uses) == 3 and Kc else 0.0
    form, action = found.form, float(np.sign(Ki or Kc))
    if found.share <= ENOUGH:
        form, action = "unknown", 0.0
        why += f" It explains {found.share:.2f} of it, {ENOUGH:g} is needed to name a controller."
    return ControllerFit(Kc, Ti, found.share, action, form, Td, Ki=Ki, Kc_error=Kc_error, Ti_error=Ti_error, why=why)


def _none(why: str) -> ControllerFit:
    return ControllerFit(math.nan, math.nan, 0.0, 0.0, why=why)


def _without_bumps(data: Regression, moving: bool) -> tuple[Regression, int]:
    """Leave out moves that no form explains: more than six robust deviations, at most one in twenty."""
    if data.y.size < FEWEST_ROWS:
        return data, 0
    least = 1e-6 * math.sqrt(energy_of(data.y) / data.y.size)
    kept, bumps = data, 0
    # Twice, because a first fit that bumps have pulled away calls good moves bumps.
    for _ in range(2):
        left = data.unexplained(moving, kept)
        left = np.abs(left - np.median(left))
        keep = left <= 6.0 * max(1.4826 * float(np.median(left)), least)
        bumps = int(keep.size - keep.sum())
        if not 0 < bumps <= 0.05 * keep.size:
            return data, 0
        y, columns = data.y[keep], data.columns[:, keep]
        kept = Regression(y - y.mean(), columns - columns.mean(axis=1, keepdims=True), data.taken)
    return kept, bumps


def at_limit(op: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Samples where OP rests at its largest or smallest value at least three times, and as it rests nowhere else."""
    edges = np.flatnonzero(np.diff(op) != 0.0) + 1
    first = np.concatenate([[0], edges])
    length = np.diff(np.concatenate([first, [op.size]]))
    usual = float(np.mean(length))
    value = op[first]
    rests = (length >= max(3.0, 3.0 * usual)) & ((value == value.max()) | (value == value.min()))
    out = np.isin(op, np.unique(value[rests])) if rests.any() else np.zeros(op.size, dtype=bool)
    # An OP of a few rounded values has rests, not limits.
    return out if _has_three_values(op[~out]) else np.zeros(op.size, dtype=bool)


def _has_three_values(x: NDArray[np.float64]) -> bool:
    """Whether a signal has three different values or more; much faster than sorting it."""
    others = x[x != x[:1]]
    return bool(np.any(others != others[:1]))


def _rounding(law: Mapping[int, float], dt: float, op_step: float, pv_step: float) -> float:
    """Variance of the moves by the rounding of OP and PV to steps.

    Rounding to a step q has the variance q^2 / 12; a move of OP has two, and those of the PV pass the controller.
    """
    Kc, Ki, Kd = (sum(law.get(use, 0.0) for use in uses) for uses in PARTS)
    through = (Kc + Ki * dt + Kd / dt, -Kc - 2.0 * Kd / dt, Kd / dt)
    return (2.0 * op_step**2 + sum(part**2 for part in through) * pv_step**2) / 12.0


def _between(law: Mapping[int, float], dt: float, pv: NDArray[np.float64], pv_step: float) -> float:
    """Variance of the moves that the errors between the samples would leave, were this every second sample.

    Each adds Ki dt / 2 of what its neighbours do not predict: of noise all, and of a random walk three quarters, of
    what is found here between a sample and its own neighbours. By the median: where the PV bends once in a while, it
    bends between the samples as seldom.
    """
    x, n = pv - pv.mean(), pv.size
    middle = slice(NEIGHBOURS, n - NEIGHBOURS)
    beside = np.stack([(np.roll(x, lag) + np.roll(x, -lag))[middle] for lag in range(1, NEIGHBOURS + 1)])
    products = np.einsum("ik,jk->ij", beside, beside)
    weights = np.linalg.pinv(products, hermitian=True) @ np.einsum("ik,k->i", beside, x[middle])
    predicted = np.einsum("i,ik->k", weights, beside)
    unpredicted = (float(np.median(np.abs(x[middle] - predicted))) / 0.6745) ** 2
    # The neighbours' own noise and rounding is in what they predict.
    unpredicted = unpredicted / (1.0 + 2.0 * energy_of(weights)) - pv_step**2 / 12.0
    return (0.5 * dt * law.get(INTEGRAL, 0.0)) ** 2 * max(unpredicted, 0.0)


def _stands_out(between: float, left: NDArray[np.float64], rounding: float) -> bool:
    """Whether what is left is so near to what rounding leaves that the errors between the samples were seen.

    The mean square of n differences of rounding errors has the relative standard error sqrt(1.8 / n).
    """
    beyond = abs(energy_of(left) / left.size - rounding)
    return between > SMOOTHER * (beyond + STANDARD_ERRORS * math.sqrt(1.8 / left.size) * rounding)
