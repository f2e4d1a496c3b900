"""Prediction of all limit cycles of a loop, with the exact cycle for each."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError
from stiction.limitcycle.continuous_form import continuous_form, is_frictionless
from stiction.limitcycle.describing.staircase import require_families, rest_level_offset
from stiction.limitcycle.exact.packed_loop import pack_loop
from stiction.limitcycle.exact.search import solve_packed
from stiction.limitcycle.harmonic_balance_search import harmonic_balance
from stiction.limitcycle.linear import LinearPart, linear_part
from stiction.limitcycle.nyquist_crossings import frequency_grid
from stiction.limitcycle.sampled_cycles import sampled_limit_cycles
from stiction.models.dispatch import is_data_driven

if TYPE_CHECKING:
    from collections.abc import Iterable

    from stiction.limitcycle.result import LimitCycle
    from stiction.models import Loop

__all__ = ["UNSTABLE_TEXT", "explain_no_cycle", "is_stable_without_friction", "is_unstable", "predict_limit_cycles"]

UNSTABLE_TEXT = "The loop is unstable even without friction"
"""Beginning of every message about such a loop."""


def predict_limit_cycles(
    loop: Loop,
    *,
    exact: bool = True,
    sp: float = 0.0,
    disturbance: float = 0.0,
    families: Iterable[str | float] | None = None,
) -> tuple[LimitCycle, ...]:
    """Predict every limit cycle of a loop with a sticky valve, with its stability and reliability.

    Parameters
    ----------
    loop : Loop
        The loop. Controller and process are taken in continuous time with their real dead time; `dt`, noise,
        output limits and end stops have no effect.
    exact : bool
        Also solve each cycle exactly (`LimitCycle.exact`), and add the cycles that the describing function misses.
        For a data-driven valve without an exact form (Choudhury's with J > S), add those of `sampled_limit_cycles`.
    sp : float
        Set point [PV units].
    disturbance : float
        Constant load at the process inlet [% of span].
    families : iterable of str or float, optional
        Families of a staircase valve, by name or by a rest level [% of span], see `exact_limit_cycles`.

    Returns
    -------
    tuple of LimitCycle
        Solutions of 1 + L(j omega) N(A) = 0 and the boundaries at jumps of N, each with its exact cycle; then
        exact cycles without a prediction (`method` "continuous", or "sampled"). Empty for a valve without stiction.

    Raises
    ------
    ParameterError
        When controller and process are improper or make an algebraic loop, the loop has no point of rest, or it
        has a compensator; when `sp` or `disturbance` is not finite, or a family is unknown.

    References
    ----------
    srinivasan2008, section V.B-C; its eq. 6 corrected and both families of rest levels searched.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID.parallel(0.5, 1.0, 0.1), st.Stenman(0.5), st.TransferFunction([1], [5, 6, 1]), dt=0.01)
    >>> for c in st.predict_limit_cycles(loop):
    ...     if c.kind == "cycle":
    ...         print(c.family, round(c.amplitude, 4), round(c.period, 2), round(c.exact.period, 2), c.stable)
    half 0.573 21.11 21.12 True
    half 0.9448 16.28 16.24 True
    integer 0.7789 17.66 17.6 True
    integer 1.0887 15.66 15.66 True
    """
    linear = linear_part(loop, sp=sp, disturbance=disturbance)
    families = None if families is None else require_families(families)
    if is_frictionless(loop.valve):
        return ()
    valve_form = continuous_form(loop.valve)
    if families is not None and valve_form is not None and valve_form.staircase:
        offsets = tuple(
            f if isinstance(f, str) else rest_level_offset(valve_form.jump, f, linear.rest) for f in families
        )
    else:
        offsets = None
    warning = "" if is_stable_without_friction(linear) else (
        f"{UNSTABLE_TEXT}: oscillations above the largest unstable cycle grow without limit."
    )  # fmt: skip
    predicted = [replace(cycle, warning=warning) for cycle in harmonic_balance(linear, loop.valve, offsets)]
    if not exact:
        return tuple(predicted)
    if valve_form is None:
        note = f"{type(loop.valve).__name__} has no exact form; check the prediction with a simulation."
        sampled = sampled_limit_cycles(loop, sp=sp, disturbance=disturbance) if is_data_driven(loop.valve.code) else ()
        return (*(replace(cycle, warning=warning or note) for cycle in predicted), *sampled)
    solved = [replace(cycle, warning=cycle.warning or warning) for cycle in
              solve_packed(pack_loop(loop, sp=sp, disturbance=disturbance), loop, families, predicted)]  # fmt: skip
    return _pair_with_exact_cycles(predicted, solved)


def _pair_with_exact_cycles(predicted: list[LimitCycle], solved: list[LimitCycle]) -> tuple[LimitCycle, ...]:
    """Assign the nearest exact cycle to each prediction, each exact cycle once, and append the others."""
    pairs = sorted(
        (distance, i, k)
        for i, guess in enumerate(predicted)
        if guess.kind == "cycle"
        for k, cycle in enumerate(solved)
        if (distance := _distance(guess, cycle)) < math.inf
    )
    partner: dict[int, int] = {}
    for _, i, k in pairs:
        if i not in partner and k not in partner.values():
            partner[i] = k
    out = [
        replace(guess, exact=solved[partner[i]], offset=solved[partner[i]].offset)
        if i in partner
        else replace(guess, warning=guess.warning or _no_exact_cycle_text(guess))
        for i, guess in enumerate(predicted)
    ]
    return (*out, *(cycle for k, cycle in enumerate(solved) if k not in partner.values()))


def _no_exact_cycle_text(guess: LimitCycle) -> str:
    return "" if guess.kind == "boundary" else "No exact cycle was found for this prediction: do not trust it."


def _distance(guess: LimitCycle, cycle: LimitCycle) -> float:
    """Distance of an exact cycle from a prediction; infinite for another family or stability."""
    if guess.family in ("half", "integer") and (guess.family != cycle.family):
        return math.inf
    if guess.stable is not None and cycle.stable is not None and guess.stable != cycle.stable:
        return math.inf
    distance = abs(math.log(guess.amplitude / cycle.amplitude)) + abs(math.log(guess.period / cycle.period))
    if guess.family and len(guess.levels) != len(cycle.levels):
        distance += 0.5
    return distance if distance < 1.2 else math.inf


def explain_no_cycle(loop: Loop) -> str:
    """Explain in a sentence why no limit cycle was found.

    `loop`: a loop for which `predict_limit_cycles` is empty. Returns the reason: a valve without friction, an unstable
    loop, a controller without gain, or a search without result.

    Examples
    --------
    >>> import stiction as st
    >>> explain_no_cycle(st.Loop(st.PID(-0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0))
    'The loop is unstable even without friction. Change the sign of the controller gain, or lower it.'
    """
    if is_unstable(loop):
        return f"{UNSTABLE_TEXT}. Change the sign of the controller gain, or lower it."
    if is_frictionless(loop.valve):
        return "No limit cycle: the valve does not stick."
    if loop.controller.Kc == 0.0:
        return "No limit cycle: the controller has no gain, so the OP does not react to the PV."
    if continuous_form(loop.valve) is None:
        return (
            "No limit cycle was found by the describing function, and "
            f"{type(loop.valve).__name__} has no exact form. Simulate the loop to see whether it oscillates."
        )
    return "No limit cycle was found, neither by the describing function nor by simulation from several starts."


def is_unstable(loop: Loop) -> bool:
    """Whether the loop is unstable even without friction; False when it has no linear part."""
    try:
        linear = linear_part(replace(loop, compensator=None))
    except ParameterError:
        return False
    return not is_stable_without_friction(linear)


def is_stable_without_friction(linear: LinearPart) -> bool:
    """Whether the loop with an ideal valve is stable, by Nyquist's count with the real dead time."""
    if linear.dead_time and abs(linear.D) >= 1.0:
        return False
    poles = linear.poles
    at_origin = int(np.sum(np.abs(poles) < 1e-9 * max(float(np.abs(poles).max(initial=0.0)), 1e-300)))
    outside = int(np.sum(poles.real > 1e-9))
    omega = frequency_grid(linear, 50.0)
    if omega.size < 2:
        return outside == 0
    phase = np.unwrap(np.angle(1.0 + linear.at(1j * omega)))
    # At either end 1 + L is real, except that each pole at the origin turns it by a quarter.
    start = round(float(phase[0]) / math.pi + at_origin / 2.0)
    end = round(float(phase[-1]) / math.pi)
    return outside - (end - start) == 0
