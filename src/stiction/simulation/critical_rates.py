"""The ramp rate that separates stairs from stick-jump-follow, and a map of both behaviours."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from stiction.display.json_form import Result
from stiction.errors import MAX_SAMPLES, ParameterError, require_positive
from stiction.models.valves.physical import PhysicalValve
from stiction.simulation.stroke import stroke

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "CriticalRate",
    "RampBehaviour",
    "critical_rate",
    "inertial_rate",
    "ramp_behaviour",
    "stribeck_rates",
]

Mechanism = Literal["inertial", "stribeck", "none"]
_BRACKET_FACTOR = 4.0
"""Factor by which the search for a bracket widens [-]."""


@dataclass(frozen=True, slots=True)
class RampBehaviour:
    """Behaviour of a stem on a ramp after it first breaks away."""

    rate: float
    """Rate of the ramp [% of span / s]."""
    kind: Literal["staircase", "follow", "stuck"]
    """`staircase` when the stem sticks repeatedly, `follow` when it follows, `stuck` when it never moves."""
    slips: int
    """Times the stem started from rest [-]."""
    slip: float
    """Median travel from start to rest, of the finished slips [% of travel]; NaN when there is none."""
    stuck: float
    """Share of the time at rest after the first start [-]."""


@dataclass(frozen=True, slots=True)
class CriticalRate(Result):
    """The rate that separates stairs from stick-jump-follow, and its mechanism."""

    rate: float
    """Ramps slower than this give stairs, faster ones follow [% of span / s]; 0 when no ramp gives stairs."""
    mechanism: Mechanism
    """Mechanism: the inertia of the stem, the falling part of Stribeck's curve, or none."""
    inertial: float
    """Rate below which a stem that oscillates after a slip comes to rest, in closed form [% of span / s]."""
    stribeck: float
    """Rate below which a steady slide is unstable, in closed form [% of span / s]."""
    stribeck_low: float
    """Rate below which a steady slide is stable again, far below the Stribeck velocity [% of span / s]."""
    velocity: float
    """Speed of the stem at `rate` [m/s]."""
    method: Literal["simulation", "closed form"]
    """How `rate` was computed."""

    def summary(self) -> str:
        """Summary in a sentence."""
        if self.mechanism == "none":
            return "No ramp gives stairs: static friction is not above Coulomb friction, or damping is high."
        why = {"inertial": "the stem's inertia", "stribeck": "the falling part of Stribeck's curve"}[self.mechanism]
        return f"Ramps below {self.rate:.3g} % of span / s give stairs, faster ones follow. The cause is {why}."


def stribeck_rates(valve: PhysicalValve) -> tuple[float, float]:
    r"""Rates between which a steady slide is unstable because friction falls faster than damping rises.

    The slide at speed v is stable where :math:`F_v > (F_s - F_c)\frac{2v}{v_s^2} e^{-(v/v_s)^2}`. With
    :math:`c = F_v v_s / (2 (F_s - F_c))` the two ends are :math:`v = v_s \sqrt{-W(-2c^2) / 2}`, W being Lambert's
    function on its two branches.

    Returns lower and upper end [% of span / s]; (0, 0) when every slide is stable.

    Examples
    --------
    >>> from stiction.models.parameter_sets import table1_reading_b
    >>> from stiction.simulation.critical_rates import stribeck_rates
    >>> round(0.18 * stribeck_rates(table1_reading_b())[1], 4)
    0.0916
    """
    from scipy.special import lambertw

    excess = valve.static - valve.coulomb
    if excess == 0.0:
        return (0.0, 0.0)
    c = valve.viscous * valve.stribeck_velocity / (2.0 * excess)
    if 2.0 * c * c >= math.exp(-1.0):
        return (0.0, 0.0)
    if c == 0.0:
        return (0.0, math.inf)
    low, high = (
        valve.stribeck_velocity * math.sqrt(-0.5 * float(lambertw(-2.0 * c * c, branch).real)) for branch in (0, -1)
    )
    return (low / _speed_per_rate(valve), high / _speed_per_rate(valve))


def inertial_rate(valve: PhysicalValve) -> float:
    r"""Rate below which a stem that oscillates after its first slip comes to rest.

    After the break-away the friction is F_c (the Stribeck velocity is small compared with the speed of the ramp).
    In units of the ramp's speed and of :math:`1/\omega` the stem's speed w then obeys
    :math:`w'' + 2\zeta w' + w = 1, w(0) = 0, w'(0) = q` with :math:`q = (F_s - F_c) / (\sqrt{K m}\,v)`; at the
    rate returned the first minimum of w is 0, which gives q as a function of the damping ratio alone.

    Returns rate [% of span / s]; 0 for a damping ratio of 1 or more, infinity without damping.

    Examples
    --------
    >>> from stiction.models.parameter_sets import table1_reading_a
    >>> from stiction.simulation.critical_rates import inertial_rate
    >>> round(0.18 * inertial_rate(table1_reading_a()), 2)
    6.36
    """
    from scipy.optimize import brentq

    excess, zeta = valve.static - valve.coulomb, valve.damping_ratio
    if excess == 0.0 or zeta >= 1.0:
        return 0.0
    if zeta == 0.0:
        return math.inf
    high = 1.0
    while _first_minimum(high, zeta) > 0.0:
        high *= 2.0
        if high > 1e12:
            return 0.0
    q = float(brentq(_first_minimum, 0.0, high, args=(zeta,), xtol=1e-14, rtol=1e-12))  # type: ignore[arg-type]
    return excess / (math.sqrt(valve.spring_rate * valve.mass) * q) / _speed_per_rate(valve)


def _first_minimum(q: float, zeta: float) -> float:
    """First minimum of w over the ramp's speed [-]."""
    beta = math.sqrt(1.0 - zeta * zeta)
    angle = math.atan2(q, (q * zeta - 1.0) / beta) + math.pi
    swing = -math.cos(angle) + (q - zeta) / beta * math.sin(angle)
    return 1.0 + math.exp(-zeta * angle / beta) * swing


def _speed_per_rate(valve: PhysicalValve) -> float:
    """Speed of a following stem [m/s] per rate of the input [% of span / s]."""
    return 0.01 * valve.gain * valve.stroke


def ramp_behaviour(valve: PhysicalValve, rate: float, slips: float = 8.0) -> RampBehaviour:
    """Simulate a ramp and classify the motion of the stem.

    `valve`: the valve, without its lag, positioner and end stops. `rate`: rate of the ramp [% of span / s]. `slips`:
    length of the ramp after the first start, in slips (F_s - F_c) / K [-]. Returns staircase when the stem rests at
    least twice after its first start. Raises ParameterError when the valve is not a `PhysicalValve` or the rate is not
    positive, or so slow or fast that the ramp would have too many samples.

    Examples
    --------
    >>> from stiction.models.parameter_sets import table1_reading_a
    >>> from stiction.simulation.critical_rates import ramp_behaviour
    >>> ramp_behaviour(table1_reading_a(), rate=4.0 / 0.18).kind
    'staircase'
    """
    rate = require_positive("rate", rate, "% of span / s")
    bare = _without_actuator(valve)
    fs = 100.0 * bare.static / bare.force_span
    jump = 100.0 * (bare.static - bare.coulomb) / bare.force_span
    wait = max(jump, 0.02 * fs) / rate
    dt = min(wait / 20.0, bare.time_constant)
    start = 0.95
    length = (1.0 - start) * fs / rate + max(slips * jump / rate, 50.0 * bare.time_constant)
    if length > MAX_SAMPLES * dt:
        other = "faster" if dt == bare.time_constant else "slower"
        raise ParameterError(
            f"rate = {rate:g} % of span / s needs a ramp of more than {MAX_SAMPLES:,} samples; give a {other} ramp."
        )
    op = rate * dt * np.arange(math.ceil(length / dt) + 1)
    op_from_rest = op + start * fs
    position = bare.gain * -bare.offset
    mv = stroke(bare, op_from_rest, dt, mv_start=position).mv
    assert mv is not None
    moving = np.diff(mv) > 0.02 * bare.gain * rate * dt
    return _count_slips(rate, moving, mv)


def _count_slips(rate: float, moving: NDArray[np.bool_], mv: NDArray[np.float64]) -> RampBehaviour:
    """Count starts and rests; `moving` is (n_samples - 1,), `mv` (n_samples,)."""
    change = np.diff(moving.astype(np.int8), prepend=0)
    starts, rests = np.flatnonzero(change > 0), np.flatnonzero(change < 0)
    if starts.size == 0:
        return RampBehaviour(rate, "stuck", 0, math.nan, 1.0)
    finished = mv[rests] - mv[starts[: rests.size]]
    kind = "staircase" if rests.size >= 2 else "follow"
    slip = float(np.median(finished)) if rests.size else math.nan
    return RampBehaviour(rate, kind, int(starts.size), slip, float(1.0 - moving[starts[0] :].mean()))


def _without_actuator(valve: PhysicalValve) -> PhysicalValve:
    """The valve without lag, positioner and end stops, its input a continuous ramp."""
    if not isinstance(valve, PhysicalValve):
        raise ParameterError(f"valve is a {type(valve).__name__}; only a PhysicalValve has mass, spring and damping.")
    return replace(valve, lag=0.0, positioner=None, travel=(-math.inf, math.inf), hold="linear")


def critical_rate(valve: PhysicalValve, *, simulate: bool = True, tolerance: float = 1e-3) -> CriticalRate:
    """Find the ramp rate that separates stairs from stick-jump-follow.

    `valve`: the valve; the rate refers to the signal to its actuator, so lag and positioner have no effect. `simulate`:
    find the rate by bisection on the simulated valve; otherwise take the larger of the closed forms. `tolerance`:
    relative width of the last bracket [-]. Returns the rate, both closed forms and the mechanism. Raises ParameterError
    when the valve is not a `PhysicalValve`.

    Two mechanisms cause stairs. A stem with little damping oscillates after its slip and can come to rest on the way
    back (inertial). A steady slide on the falling part of Stribeck's curve is unstable if damping is too small
    (Stribeck). Each closed form covers one mechanism alone; the bisection covers both.

    References
    ----------
    srinivasan2008, sections II and III; the mechanisms and closed forms are derived in this project.

    Examples
    --------
    >>> from stiction.models.parameter_sets import table1_reading_a
    >>> from stiction.simulation import critical_rate
    >>> found = critical_rate(table1_reading_a())
    >>> round(0.18 * found.rate, 1), found.mechanism
    (6.8, 'inertial')
    """
    bare = _without_actuator(valve)
    tolerance = require_positive("tolerance", tolerance, "-")
    inertial = inertial_rate(bare)
    low, high = stribeck_rates(bare)
    guess = max(inertial, high)
    mechanism: Mechanism = "none" if guess == 0.0 else "inertial" if inertial >= high else "stribeck"
    rate, method = guess, "closed form"
    if simulate and 0.0 < guess < math.inf:
        rate, method = _bisect(bare, guess, tolerance), "simulation"
        mechanism = mechanism if rate else "none"
    return CriticalRate(rate, mechanism, inertial, high, low, rate * _speed_per_rate(bare), method)


def _bisect(valve: PhysicalValve, guess: float, tolerance: float) -> float:
    """Rate between stairs below and following above; 0 when no rate near the guess gives stairs."""
    low = high = guess
    if ramp_behaviour(valve, guess).kind == "staircase":
        while ramp_behaviour(valve, high).kind == "staircase":
            low, high = high, high * _BRACKET_FACTOR
    else:
        while ramp_behaviour(valve, low).kind != "staircase":
            low, high = low / _BRACKET_FACTOR, low
            if low < guess / _BRACKET_FACTOR**3:
                return 0.0
    while high > low * (1.0 + tolerance):
        middle = math.sqrt(low * high)
        if ramp_behaviour(valve, middle).kind == "staircase":
            low = middle
        else:
            high = middle
    return math.sqrt(low * high)
