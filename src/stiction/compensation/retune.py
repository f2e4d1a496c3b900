"""Retune the controller: find settings without a limit cycle, or with the smallest one.

A limit cycle needs 1 + N(A) L(j omega) = 0 at some amplitude A. A lower Kc or a longer Ti moves L away from -1/N; the
smallest |1 + N L| over amplitudes and frequencies is the margin. With J = 0, a self-regulating process and PI control
there is no limit cycle, because -1/N tends to infinity along the negative imaginary axis. With a slip jump and integral
action there is always one, because the stem can seldom rest exactly where PV equals the set point; retuning only makes
it slower or smaller (after `mohammad2012`; J = 0 derived, see docs/understand/remedies.md). The describing function is
only a first estimate: its period can be wrong by half for a PI on first order with dead time. So every setting is
simulated.

Slower settings control less tightly. With a good valve, the IAE after a load step may be at most `load_limit` times the
present one, and the maximum sensitivity Ms = max |1 / (1 + L)| at most `Ms_limit`. Both are reported for every setting.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from stiction.compensation.repair import stiction_of
from stiction.compensation.replace_parts import replace_parts
from stiction.display.json_form import Result, json_as
from stiction.errors import ParameterError, require_positive, require_samples
from stiction.limitcycle import describing_function, predict_limit_cycles
from stiction.limitcycle.continuous_form import is_frictionless
from stiction.limitcycle.describing.valve_df import is_rate_dependent
from stiction.models import PID, Ideal
from stiction.models.loop import require_loop
from stiction.simulation import simulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Loop, Valve

__all__ = [
    "Retuning",
    "TradeOff",
    "describing_function_margin",
    "load_response",
    "maximum_sensitivity",
    "retune",
    "without_limits",
]

KC_FACTORS = (0.1, 0.15, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0)
"""Factors on Kc that are tried [-]."""
TI_FACTORS = (0.5, 0.7, 1.0, 1.5, 2.5, 4.0, 8.0)
"""Factors on Ti that are tried [-]."""
MEASURED_PERIODS, LOADS_OVER_S = 20.0, (0.23, -0.41, 0.08)
"""Present periods in which the remaining cycle is measured, after as many for settling, and constant loads / S [-]."""
MAX_REMAINING_SHARE = 0.02
"""Share of the present PV deviation up to which the cycle counts as gone [-]."""


@dataclass(frozen=True)
class TradeOff(Result):
    """One setting of the controller, with the remaining cycle and the control performance."""

    Kc: float
    """Proportional gain [% of span per PV unit]."""
    Ti: float = field(metadata=json_as("Ti_s"))
    """Integral time [s]."""
    pv_std: float
    """Standard deviation of the PV in the remaining cycle, without noise [PV units]."""
    travel: float = field(metadata=json_as("travel_per_h"))
    """Stem travel in that cycle [% of span per h]."""
    load_iae: float = field(metadata=json_as("load_iae_ratio"))
    """IAE of a load step with a good valve, relative to the present setting [-]."""
    Ms: float
    """Maximum sensitivity with a good valve [-]."""
    allowed: bool
    """Whether both limits are met."""


@dataclass(frozen=True)
class Retuning(Result):
    """The setting with the smallest cycle within the limits, and all settings that were tried."""

    _json_keys = (
        "controller.Kc as Kc", "controller.Ti as Ti_s", "controller.Td as Td_s", "cycle_left", "margin",
        "predicted as predicted_cycles", "improvement", "curve", "reason",
    )  # fmt: skip

    controller: PID
    """The setting; the present one when none is better."""
    cycle_left: bool
    """Whether a limit cycle remains."""
    margin: float
    """Smallest |1 + N L| over amplitudes and frequencies [-]; 0 when the describing function predicts a cycle."""
    predicted: int
    """Number of stable cycles that the describing function predicts with this setting [-]."""
    improvement: float
    """Share by which it lowers the PV deviation of the cycle, without noise [-]."""
    curve: tuple[TradeOff, ...] = field(repr=False, default=())
    """All settings that were tried, the smallest cycle first."""
    reason: str = ""
    """The result as a sentence."""

    def summary(self) -> str:
        """Return the result as a sentence."""
        return self.reason


def retune(loop: Loop, period: float, *, load_limit: float = 2.0, Ms_limit: float = 2.0) -> Retuning:
    """Find the PI or PID setting with the smallest limit cycle within limits on control performance.

    Parameters
    ----------
    loop : Loop
        The loop with its sticky valve.
    period : float
        Period of its limit cycle, or another time scale of the loop [s].
    load_limit : float
        Largest IAE of a load step with a good valve, relative to the present setting [-].
    Ms_limit : float
        Largest maximum sensitivity [-]; if the present one is larger, it is the limit.

    Returns
    -------
    Retuning
        The setting, whether a cycle remains, and the trade-off of all settings.

    Raises
    ------
    ParameterError
        When `period` or a limit is not positive, 40 periods are too many samples, or the valve has no S and J.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.compensation import retune
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 0.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> retune(loop, period=100.0).cycle_left
    False
    """
    require_loop(loop)
    period = require_positive("period", period, "s")
    require_samples(f"{2.0 * MEASURED_PERIODS:.0f} periods", 2.0 * MEASURED_PERIODS * period, loop.dt)
    load_limit, Ms_limit = require_positive("load_limit", load_limit), require_positive("Ms_limit", Ms_limit)
    quiet = replace_parts(loop, noise=0.0, compensator=None)
    now = loop.controller
    base_iae, base_Ms = load_response(quiet, now, period), maximum_sensitivity(quiet, now)
    pv_now, _ = _simulate_cycle(quiet, now, period)
    curve = []
    for gain, time in product(KC_FACTORS, TI_FACTORS):
        pid = replace(now, Kc=now.Kc * gain, Ti=now.Ti * time)
        Ms = maximum_sensitivity(quiet, pid)
        iae = load_response(quiet, pid, period) / base_iae if Ms < 10.0 else float("inf")
        allowed = bool(Ms <= max(Ms_limit, base_Ms) and iae <= load_limit)
        if not allowed and Ms > 3.0 * Ms_limit:
            continue
        pv_std, travel = _simulate_cycle(quiet, pid, period)
        curve.append(TradeOff(pid.Kc, pid.Ti, pv_std, travel, iae, Ms, allowed))
    curve.sort(key=lambda one: one.pv_std)
    fine = [one for one in curve if one.allowed]
    mild = fine[0].pv_std if fine else pv_now
    # Among settings with about the same cycle, the one with the best control.
    best = min(
        (one for one in fine if one.pv_std <= 1.05 * mild + MAX_REMAINING_SHARE * pv_now),
        key=lambda one: one.load_iae,
        default=None,
    )
    pid = now if best is None else replace(now, Kc=best.Kc, Ti=best.Ti)
    left = pv_now if best is None else best.pv_std
    scale = max(pv_now, _slip_deviation(loop))
    better = 1.0 - left / pv_now if pv_now > MAX_REMAINING_SHARE * scale else 0.0
    with_it = replace_parts(quiet, controller=pid)
    stable = sum(1 for c in predict_limit_cycles(with_it, exact=False) if c.kind == "cycle" and c.stable is not False)
    setting = f"Kc = {pid.Kc:.3g} and Ti = {pid.Ti:.3g} s"
    gone = left <= MAX_REMAINING_SHARE * scale and stable == 0
    if gone:
        reason = f"With {setting} there is no limit cycle, neither predicted nor simulated."
    elif left <= MAX_REMAINING_SHARE * scale:
        reason = (
            f"With {setting} no limit cycle appears within {2.0 * MEASURED_PERIODS:.0f} present periods, but a slow "
            "one is predicted."
        )
    elif best is None or better <= 0.0:
        reason = "A limit cycle remains with every setting within the limits; none has a smaller one than the present."
    else:
        reason = (
            f"A limit cycle remains with every setting within the limits; the best, {setting}, lowers the PV deviation "
            f"by {100.0 * better:.0f} %, without noise and disturbances."
        )
    return Retuning(pid, not gone, describing_function_margin(with_it), stable, better, tuple(curve), reason)


def maximum_sensitivity(loop: Loop, controller: PID | None = None) -> float:
    """Return the maximum sensitivity Ms of the loop with a good valve [-]; infinite when that loop is unstable.

    `loop`: the loop; half a sample is added to the dead time for the zero-order hold. `controller`: controller to use
    instead of the loop's. Returns ms [-].
    """
    _, L = _open_loop(loop, controller or loop.controller)
    crossing = np.unwrap(np.angle(L))
    below = np.flatnonzero((crossing[:-1] > -np.pi) & (crossing[1:] <= -np.pi))
    if below.size and np.abs(L[below[0]]) >= 1.0:
        return float("inf")
    return float(1.0 / np.abs(1.0 + L).min())


def describing_function_margin(loop: Loop) -> float:
    """Return the smallest |1 + N(A) L(j omega)| over amplitudes and frequencies, the distance from a limit cycle [-].

    `loop`: the loop with its sticky valve. Returns the margin [-].
    """
    if is_frictionless(loop.valve):
        return 1.0 / maximum_sensitivity(loop)
    omega, L = _open_loop(loop, loop.controller)
    sizes = _valve_band(loop.valve) * np.geomspace(0.505, 50.0, 120)
    N = describing_function(loop.valve, sizes[:, np.newaxis], omega if is_rate_dependent(loop.valve) else None)
    return float(np.abs(1.0 + N * L[np.newaxis, :]).min())


def _open_loop(loop: Loop, pid: PID) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    omega = np.geomspace(1e-4, np.pi, 600) / loop.dt
    s = np.asarray(1j * omega, dtype=np.complex128)
    num, den = pid.transfer_function()
    return omega, np.polyval(num, s) / np.polyval(den, s) * loop.process.at(s) * np.exp(-0.5 * s * loop.dt)


def load_response(loop: Loop, pid: PID, period: float) -> float:
    """Return the mean absolute PV over ten periods after a load step of 1 %, with a good valve [PV units]."""
    n = max(round(10.0 * period / loop.dt), 200)
    run = simulate(replace_parts(loop, controller=without_limits(pid), valve=Ideal()), 0.0, n * loop.dt, np.ones(n))
    assert run.pv is not None
    return float(np.abs(run.pv).mean())


def _simulate_cycle(loop: Loop, pid: PID, period: float) -> tuple[float, float]:
    """Return PV deviation [PV units] and stem travel [% of span per h] after the loop has settled from a load pulse.

    Both are means over constant loads, because the load decides whether the stem can come to rest.
    """
    n = max(round(2.0 * MEASURED_PERIODS * period / loop.dt), 400)
    S, late, tuned = _valve_band(loop.valve), slice(n // 2, n), replace_parts(loop, controller=without_limits(pid))
    rows = []
    for share in LOADS_OVER_S:
        load = np.full(n, share * S)
        load[: max(round(period / 3.0 / loop.dt), 3)] += 0.7 * S
        run = simulate(tuned, 0.0, n * loop.dt, load)
        assert run.pv is not None
        assert run.mv is not None
        rows.append((float(run.pv[late].std()), float(np.abs(np.diff(run.mv[late])).sum())))
    pv_std, travel = np.mean(rows, axis=0)
    return float(pv_std), float(travel) * 3600.0 / ((n - n // 2) * loop.dt)


def without_limits(pid: PID) -> PID:
    """Return the controller without limits of OP, for runs about zero."""
    return replace(pid, op_limits=(-np.inf, np.inf))


def _slip_deviation(loop: Loop) -> float:
    """Return the PV change for a slip of S at the steady process gain [PV units]; 0 for an integrating process."""
    slow = abs(complex(loop.process.at(np.array([1e-9j / loop.dt]))[0]))
    return slow * _valve_band(loop.valve) if slow < 1e6 else 0.0


def _valve_band(valve: Valve) -> float:
    """Return S of the valve [% of span], or J when S is 0; 1 for a valve that does not stick."""
    if is_frictionless(valve):
        return 1.0
    stiction = stiction_of(valve)
    if stiction is None:
        raise ParameterError(
            f"The valve {type(valve).__name__} has no S and J, and retuning needs them; give another valve, such as "
            "Kano(S, J)."
        )
    return stiction[0] or stiction[1]
