"""Retune: the controller settings for which no limit cycle is left, or the mildest one.

A limit cycle needs 1 + N(A) L(j omega) = 0 at some amplitude A. Lowering Kc or raising Ti moves L away from -1/N; the
smallest |1 + N L| over amplitudes and frequencies is the margin. With J = 0 and a self-regulating process under PI no
cycle exists, since -1/N tends to infinity along the negative imaginary axis; with a slip jump and integral action
there is always one, as the stem can seldom rest where the PV meets its set point, and retuning only makes it slower
or smaller (after `mohammad2012`; J = 0 derived, see docs/understand/remedies.md). The describing function is
only the first look: it is up to half off in period for a PI on first order with dead time. Every setting is simulated.

Detuning costs control. A setting may take no more than `load_limit` times the IAE of the present one after a step of
load with a good valve, and its maximum sensitivity Ms = max |1 / (1 + L)| stays below `Ms_limit`. Both, and the cycle
that is left, are the trade-off that is reported.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.compensation.exchange import exchange
from stiction.compensation.repair import stiction_of
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

__all__ = ["Retuning", "TradeOff", "df_margin", "retune", "sensitivity"]

GAINS = (0.1, 0.15, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0)
"""Factors on Kc that are tried."""
TIMES = (0.5, 0.7, 1.0, 1.5, 2.5, 4.0, 8.0)
"""Factors on Ti that are tried."""
CYCLES, LOADS = 20.0, (0.23, -0.41, 0.08)
"""Present periods over which the cycle left is judged, after as many to settle, and the constant loads over S [-]."""
GONE = 0.02
"""Share of the present PV deviation below which no cycle is left [-]."""


@dataclass(frozen=True)
class TradeOff:
    """One setting of the controller and what it gives and takes."""

    Kc: float
    """Proportional gain [% of span per PV unit]."""
    Ti: float
    """Integral time [s]."""
    pv_std: float
    """Standard deviation of the PV in the cycle that is left, without noise [PV units]."""
    travel: float
    """Stem travel in that cycle [% of span per h]."""
    load_iae: float
    """IAE of a step of load with a good valve over that of the present setting [-]."""
    Ms: float
    """Maximum sensitivity with a good valve [-]."""
    allowed: bool
    """Whether it is within the limits."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "Kc": self.Kc, "Ti_s": self.Ti, "pv_std": self.pv_std, "travel_per_h": self.travel,
            "load_iae_ratio": self.load_iae if np.isfinite(self.load_iae) else None,
            "Ms": self.Ms if np.isfinite(self.Ms) else None, "allowed": self.allowed,
        }  # fmt: skip


@dataclass(frozen=True)
class Retuning:
    """The mildest setting within the limits, and all that were tried."""

    controller: PID
    """The setting; the present one where none is better."""
    cycle_left: bool
    """Whether a limit cycle is left."""
    margin: float
    """Smallest |1 + N L| over amplitudes and frequencies [-]; 0 where the describing function predicts a cycle."""
    predicted: int
    """Stable cycles that the describing function predicts with it [-]."""
    improvement: float
    """Share by which the PV deviation of the cycle falls, without noise [-]."""
    curve: tuple[TradeOff, ...] = field(repr=False, default=())
    """All settings tried, the mildest cycle first."""
    reason: str = ""
    """What was found, in a sentence."""

    def summary(self) -> str:
        """The finding in a sentence."""
        return self.reason

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "Kc": self.controller.Kc, "Ti_s": self.controller.Ti, "Td_s": self.controller.Td,
            "cycle_left": self.cycle_left, "margin": self.margin, "predicted_cycles": self.predicted,
            "improvement": self.improvement, "curve": [one.to_dict() for one in self.curve], "reason": self.reason,
        }  # fmt: skip


def retune(loop: Loop, period: float, *, load_limit: float = 2.0, Ms_limit: float = 2.0) -> Retuning:
    """Find the PI or PID setting with the mildest limit cycle within limits on control.

    Parameters
    ----------
    loop : Loop
        The loop as it is, its valve sticky.
    period : float
        Period of its cycle, or another time scale to simulate over [s].
    load_limit : float
        Largest IAE of a load step with a good valve over the present one's [-].
    Ms_limit : float
        Largest maximum sensitivity [-]; a loop that exceeds it already may keep its own.

    Returns
    -------
    Retuning
        The setting, whether a cycle is left, and the trade-off as data.

    Raises
    ------
    ParameterError
        When `period` or a limit is not positive, 40 periods are more samples than can be made, or the valve has no
        S and J.

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
    require_samples(f"{2.0 * CYCLES:.0f} periods", 2.0 * CYCLES * period, loop.dt)
    load_limit, Ms_limit = require_positive("load_limit", load_limit), require_positive("Ms_limit", Ms_limit)
    quiet = exchange(loop, noise=0.0, compensator=None)
    now = loop.controller
    base_iae, base_Ms = _load_iae(quiet, now, period), sensitivity(quiet, now)
    pv_now, _ = _cycle(quiet, now, period)
    curve = []
    for gain, time in product(GAINS, TIMES):
        pid = replace(now, Kc=now.Kc * gain, Ti=now.Ti * time)
        Ms = sensitivity(quiet, pid)
        iae = _load_iae(quiet, pid, period) / base_iae if Ms < 10.0 else float("inf")
        allowed = bool(Ms <= max(Ms_limit, base_Ms) and iae <= load_limit)
        if not allowed and Ms > 3.0 * Ms_limit:
            continue
        pv_std, travel = _cycle(quiet, pid, period)
        curve.append(TradeOff(pid.Kc, pid.Ti, pv_std, travel, iae, Ms, allowed))
    curve.sort(key=lambda one: one.pv_std)
    fine = [one for one in curve if one.allowed]
    mild = fine[0].pv_std if fine else pv_now
    # Among settings that are about as mild, the one that controls best.
    best = min(
        (one for one in fine if one.pv_std <= 1.05 * mild + GONE * pv_now), key=lambda one: one.load_iae, default=None
    )
    pid = now if best is None else replace(now, Kc=best.Kc, Ti=best.Ti)
    left = pv_now if best is None else best.pv_std
    scale = max(pv_now, _jump(loop))
    better = 1.0 - left / pv_now if pv_now > GONE * scale else 0.0
    with_it = exchange(quiet, controller=pid)
    stable = sum(1 for c in predict_limit_cycles(with_it, exact=False) if c.kind == "cycle" and c.stable is not False)
    setting = f"Kc = {pid.Kc:.3g} and Ti = {pid.Ti:.3g} s"
    gone = left <= GONE * scale and stable == 0
    if gone:
        reason = f"With {setting} no limit cycle is left, neither predicted nor simulated."
    elif left <= GONE * scale:
        reason = f"With {setting} none shows within {2.0 * CYCLES:.0f} periods, but a slow one is predicted."
    elif best is None or better <= 0.0:
        reason = "A limit cycle is left with every setting within the limits; none is milder than the present one."
    else:
        reason = (
            f"A limit cycle is left with every setting within the limits; the mildest, {setting}, lowers the PV's "
            f"deviation by {100.0 * better:.0f} % in a cycle without noise and disturbances."
        )
    return Retuning(pid, not gone, df_margin(with_it), stable, better, tuple(curve), reason)


def sensitivity(loop: Loop, controller: PID | None = None) -> float:
    """Maximum sensitivity Ms of the loop with a good valve [-]; infinite where that loop is unstable.

    Parameters
    ----------
    loop : Loop
        The loop; half a sample is added to the dead time for the hold.
    controller : PID, optional
        Another controller than the loop's.

    Returns
    -------
    float
        Ms [-].
    """
    _, L = _open_loop(loop, controller or loop.controller)
    crossing = np.unwrap(np.angle(L))
    below = np.flatnonzero((crossing[:-1] > -np.pi) & (crossing[1:] <= -np.pi))
    if below.size and np.abs(L[below[0]]) >= 1.0:
        return float("inf")
    return float(1.0 / np.abs(1.0 + L).min())


def df_margin(loop: Loop) -> float:
    """Smallest |1 + N(A) L(j omega)| over amplitudes and frequencies [-]: how far the loop is from a predicted cycle.

    Parameters
    ----------
    loop : Loop
        The loop with its sticky valve.

    Returns
    -------
    float
        The margin [-].
    """
    if is_frictionless(loop.valve):
        return 1.0 / sensitivity(loop)
    omega, L = _open_loop(loop, loop.controller)
    sizes = _band(loop.valve) * np.geomspace(0.505, 50.0, 120)
    N = describing_function(loop.valve, sizes[:, np.newaxis], omega if is_rate_dependent(loop.valve) else None)
    return float(np.abs(1.0 + N * L[np.newaxis, :]).min())


def _open_loop(loop: Loop, pid: PID) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    omega = np.geomspace(1e-4, np.pi, 600) / loop.dt
    s = np.asarray(1j * omega, dtype=np.complex128)
    num, den = pid.transfer_function()
    return omega, np.polyval(num, s) / np.polyval(den, s) * loop.process.at(s) * np.exp(-0.5 * s * loop.dt)


def _load_iae(loop: Loop, pid: PID, period: float) -> float:
    n = max(round(10.0 * period / loop.dt), 200)
    run = simulate(exchange(loop, controller=_free(pid), valve=Ideal()), 0.0, n * loop.dt, np.ones(n))
    assert run.pv is not None
    return float(np.abs(run.pv).mean())


def _cycle(loop: Loop, pid: PID, period: float) -> tuple[float, float]:
    """PV deviation [PV units] and stem travel [% of span per h] once the loop has settled after a pulse of load.

    Means over constant loads: where the load puts the stem's place decides between a cycle and a lucky rest.
    """
    n = max(round(2.0 * CYCLES * period / loop.dt), 400)
    S, late, tuned = _band(loop.valve), slice(n // 2, n), exchange(loop, controller=_free(pid))
    rows = []
    for share in LOADS:
        load = np.full(n, share * S)
        load[: max(round(period / 3.0 / loop.dt), 3)] += 0.7 * S
        run = simulate(tuned, 0.0, n * loop.dt, load)
        assert run.pv is not None
        assert run.mv is not None
        rows.append((float(run.pv[late].std()), float(np.abs(np.diff(run.mv[late])).sum())))
    pv_std, travel = np.mean(rows, axis=0)
    return float(pv_std), float(travel) * 3600.0 / ((n - n // 2) * loop.dt)


def _free(pid: PID) -> PID:
    return replace(pid, op_limits=(-np.inf, np.inf))


def _jump(loop: Loop) -> float:
    """PV deviation that a slip of S through the process's steady gain would make [PV units]; 0 where it integrates."""
    slow = abs(complex(loop.process.at(np.array([1e-9j / loop.dt]))[0]))
    return slow * _band(loop.valve) if slow < 1e6 else 0.0


def _band(valve: Valve) -> float:
    """S of the valve [% of span], J where S is 0; 1 of one that does not stick."""
    if is_frictionless(valve):
        return 1.0
    found = stiction_of(valve)
    if found is None:
        raise ParameterError(
            f"{type(valve).__name__} has no S and J, by which settings are judged; give a valve that has, such as "
            "Kano(S, J)."
        )
    return found[0] or found[1]
