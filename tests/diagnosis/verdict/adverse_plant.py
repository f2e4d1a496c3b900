"""A closed loop by plain recursions, written without anything of stiction.simulation.

Time runs in samples of the controller. In each sample the PV is read, the controller sets the OP, the valve moves the
stem as its friction lets it, and the process goes on by five steps. What real loops have and textbook ones leave out is
here: crooked controllers, trims, transmitters and actuators.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stiction.models.compiled import inlined, kernel

STEPS = 5
"""Steps of the process to a sample."""
STEP = 1.0 / STEPS
MIDDLE = 50.0
"""Stem position at which every trim has the slope 1 and every friction its nominal size [% of span]."""
LINEAR, EQUAL_PERCENTAGE, SPLIT_RANGE, SPLIT_GAP = range(4)
TRIMS = ("linear", "equal percentage", "split range", "split gap")
"""Flow over stem position."""
STRAIGHT, TITRATION, HEAD = range(3)
CURVES = ("straight", "titration", "head")
"""What is measured over what the process holds."""


def share(time: float, lag: float) -> float:
    """The share of a step that a first-order lag lets through in a time; all of it where there is no lag."""
    return 1.0 - math.exp(-time / lag) if lag > 0.0 else 1.0


@dataclass(frozen=True)
class Controller:
    """A PI controller in standard form."""

    Kc: float
    """Gain [% of span per PV unit]."""
    Ti: float
    """Integral time [samples]; infinity for a proportional controller."""
    gap: float = 0.0
    """Error that counts as none [PV units]; of a larger one counts what is beyond."""
    square: float = 0.0
    """Error at which one that is squared counts as much as one that is not [PV units]; 0 squares none."""
    lag: float = 0.0
    """Time constant of the filter before the controller, which the recorded PV does not show [samples]."""
    step: float = 0.0
    """The OP goes in multiples of this [% of span]."""
    low: float = 0.0
    high: float = 100.0
    anti_windup: bool = True

    def packed(self) -> tuple[float, ...]:
        Ki, seen = self.Kc / self.Ti, share(1.0, self.lag)
        return (self.Kc, Ki, self.gap, self.square, seen, self.step, self.low, self.high, float(self.anti_windup))


@dataclass(frozen=True)
class Valve:
    """Kano's valve, its actuator and its trim; by default a good linear one."""

    S: float = 0.0
    """Deadband plus stickband [% of span]."""
    J: float = 0.0
    """Slip jump [% of span]; with S but without J the valve plays."""
    down: float = 1.0
    """S and J on the way down, as a share of those on the way up [-]."""
    slope: float = 0.0
    """Share of S and J by which they are larger at 100 % and smaller at 0 % [-]."""
    rests: bool = False
    """Whether the stem rests after every sample, as He's does, and Stenman's where S = J."""
    rate: float = math.inf
    """The fastest that the stem goes [% of span per sample]."""
    step: float = 0.0
    """The stem goes in multiples of this [% of span]."""
    seat: float = -math.inf
    """Stem position below which the flow stays what it is there [% of span]."""
    trim: str = "linear"
    number: float = 0.0
    """Rangeability [-] of equal percentage, gain [-] above the middle of split range, half [%] of a split gap."""

    def packed(self) -> tuple[float, ...]:
        S_down, J_down = self.S * self.down, self.J * self.down
        bands = (self.S + self.J) / 2.0, (self.S - self.J) / 2.0, (S_down + J_down) / 2.0, (S_down - J_down) / 2.0
        actuator = self.slope, float(self.rests), self.rate * STEP, self.step
        return (*bands, *actuator, self.seat, float(TRIMS.index(self.trim)), self.number)


@dataclass(frozen=True)
class Process:
    """Gain, lags and dead time."""

    tau: float
    """Time constant [samples]."""
    dead_time: float
    """Dead time [samples], to the nearest step."""
    tau2: float = 0.0
    """Second time constant [samples]; without meaning where the process integrates."""
    K: float = 1.0
    """Gain [PV units per % of span], or rate gain [PV units per % of span and sample]."""
    integrating: bool = False
    inverse: float = 0.0
    """How far the response first goes the other way: the zero is in the right half plane at 1 / (inverse * tau2)."""

    @property
    def delay(self) -> int:
        """The dead time in steps."""
        return round(self.dead_time / STEP)

    def packed(self) -> tuple[float, ...]:
        return self.K, share(STEP, self.tau), share(STEP, self.tau2), float(self.integrating), self.inverse


@dataclass(frozen=True)
class Transmitter:
    """What stands between the process and the PV."""

    curve: str = "straight"
    scale: float = 1.0
    """Size at which a titration curve flattens, or head at rest of which the root is taken [PV units]."""
    step: float = 0.0
    """The PV goes in multiples of this [PV units]."""
    hold: int = 1
    """Samples for which a value is shown."""

    def packed(self) -> tuple[float, ...]:
        return float(CURVES.index(self.curve)), self.scale, self.step


class Signals(NamedTuple):
    """What a loop did."""

    op: np.ndarray
    pv: np.ndarray
    sp: np.ndarray
    mv: np.ndarray


@inlined
def _rounded(x, step):
    return np.round(x / step) * step if step > 0.0 else x


@inlined
def _flow(stem, trim, number):
    """Flow, but for a constant, through a trim."""
    if trim == EQUAL_PERCENTAGE:
        return number ** ((stem - MIDDLE) / 100.0) * 100.0 / np.log(number)
    if trim == SPLIT_RANGE:
        return stem - MIDDLE if stem < MIDDLE else number * (stem - MIDDLE)
    if trim == SPLIT_GAP:
        return np.sign(stem - MIDDLE) * max(abs(stem - MIDDLE) - number, 0.0)
    return stem


@inlined
def _measured(y, curve, scale):
    if curve == TITRATION:
        return np.tanh(y / scale) * scale + 0.08 * y
    if curve == HEAD:
        return (np.sqrt(max(1.0 + y / scale, 0.0)) - 1.0) * 2.0 * scale
    return y


@kernel
def _run(controller, valve, process, delay, transmitter, hold, op_start, friction, sp, load, drift, noise, op, pv, mv):
    """Fill `op`, `pv` and `mv` (n_samples,)."""
    Kc, Ki, gap, square, seen, op_step, low, high, guarded = controller
    stick_up, slide_up, stick_down, slide_down, slope, rests, most, stem_step, seat, trim, number = valve
    K, share1, share2, integrating, inverse = process
    curve, scale, pv_step = transmitter
    integral = before = held = stem = op_start
    way = first = second = shown = filtered = flow_at_rest = 0.0
    pipe, place, rest = np.zeros(delay + 1), 0, 0
    for k in range(op.size):
        if k % hold == 0:
            y = second - inverse * (first - second)
            shown = _rounded(_measured(y, curve, scale) + drift[k] + noise[k], pv_step)
        pv[k] = shown

        if k == 0:
            filtered = shown
        filtered += seen * (shown - filtered)
        error = sp[k] - filtered
        error = np.sign(error) * max(abs(error) - gap, 0.0)
        if square > 0.0:
            error = error * abs(error) / square
        integral += Ki * error
        u = integral + Kc * error
        if u < low or u > high:
            if guarded != 0.0:
                integral -= Ki * error
            u = min(max(u, low), high)
        u = _rounded(u, op_step)
        op[k] = u

        if rests != 0.0 or way * (u - before) <= 0.0:
            rest += way != 0.0
            way = 0.0
        size = friction[rest] * (1.0 + slope * (held - MIDDLE) / MIDDLE)
        if way == 0.0:
            if u - held > size * stick_up:
                way = 1.0
            elif held - u > size * stick_down:
                way = -1.0
        if way != 0.0:
            held = u - way * size * (slide_up if way > 0.0 else slide_down)
        before = u
        aim = _rounded(held, stem_step)

        for step in range(STEPS):
            stem += min(max(aim - stem, -most), most)
            flow = _flow(max(stem, seat), trim, number)
            if k == 0 and step == 0:
                flow_at_rest = flow  # the process rests at the flow of the first OP, whatever that is
            pipe[place] = flow - flow_at_rest + load[k]
            place = (place + 1) % (delay + 1)
            if integrating != 0.0:
                first += share1 * (pipe[place] - first)
                second += K * first * STEP
            else:
                first += share1 * (K * pipe[place] - first)
                second += share2 * (first - second)
        mv[k] = stem


def run(
    n: int,
    controller: Controller,
    process: Process,
    valve: Valve | None = None,
    transmitter: Transmitter | None = None,
    *,
    op_start: float = MIDDLE,
    friction=1.0,
    sp=0.0,
    load=0.0,
    drift=0.0,
    noise=0.0,
) -> Signals:
    """Run a loop for `n` samples from rest at `op_start` and a PV of 0.

    `sp` [PV units], `load` at the process inlet [% of span], `drift` and `noise` of the transmitter [PV units] are one
    number for all samples or one for each; `friction`, what S and J are over what the valve says [-], for all rests of
    the stem or for each in turn. Without a valve or a transmitter it has a good one.
    """
    valve, transmitter = valve or Valve(), transmitter or Transmitter()
    friction, sp, load, drift, noise = (np.zeros(n) + x for x in (friction, sp, load, drift, noise))
    op, pv, mv = np.empty((3, n))
    _run(
        controller.packed(), valve.packed(), process.packed(), process.delay, transmitter.packed(), transmitter.hold,
        float(op_start), friction, sp, load, drift, noise, op, pv, mv,
    )  # fmt: skip
    return Signals(op, pv, sp, mv)
