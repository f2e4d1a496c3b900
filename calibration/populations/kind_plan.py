"""A loop of a kind that advice is about: what stands in it, what moves it, and its record."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from calibration.populations.faulty_loop import Faults, run_faulty
from calibration.populations.processes import log_uniform
from stiction.records.quality.quantisation import robust_range
from stiction.records.record import LoopRecord, Provenance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Loop

__all__ = ["GOOD_OUTPUT", "KindCase", "Plan", "record_plan"]

MAX_AT_LIMIT = 0.02
"""Largest share of the samples with OP at a limit where that is not the fault [-]."""
TRANSMITTER = (0.01, 0.3)
"""Standard deviation of the measurement noise over the PV's swing, or where nothing else moves the loop, OP's [-]."""
OPERATED, OPERATED_SIZE = 0.35, (0.05, 1.2)
"""Share of the loops whose set point an operator changes now and then, and size over the PV's swing [-]."""
GOOD_PLAY = 0.02, 0.3
"""Play of a good valve [% of span]; half of the good ones have none."""
GOOD_OUTPUT = Faults()
"""Nothing wrong between controller and process."""


@dataclass(frozen=True)
class KindCase:
    """A record and all that is true of its loop."""

    record: LoopRecord
    """The record."""
    kind: str
    """One of `KINDS`."""
    causes: tuple[str, ...]
    """All true causes that a record can show, by the names of the diagnosis; empty where it shows none."""
    S: float = 0.0
    """Deadband plus stickband [% of span]; infinite of a stuck stem."""
    J: float = 0.0
    """Slip jump [% of span]."""

    @property
    def sticky(self) -> bool:
        """Whether the valve sticks."""
        return self.S > 0.0 and 0.1 * min(self.S, 1e9) <= self.J


@dataclass(frozen=True)
class Plan:
    """A loop, its faults and what moves it; series are deviations, shape (n_samples,)."""

    loop: Loop
    """The loop; its valve is not used."""
    causes: tuple[str, ...]
    n: int
    faults: Faults = GOOD_OUTPUT
    sp: NDArray[np.float64] | float = 0.0
    load: NDArray[np.float64] | float = 0.0
    pv_load: NDArray[np.float64] | float = 0.0
    op_start: float = 50.0
    burn: int = 0
    noise: float | None = None
    logged: str = "op"
    at_limit: bool = False

    def run(self, noise: NDArray[np.float64] | float = 0.0) -> NDArray[np.float64]:
        """PV, OP and stem without the samples before the record."""
        sp, load, pv = (np.zeros(self.n) + x for x in (self.sp, self.load, self.pv_load))
        return run_faulty(self.loop, self.faults, sp, load, pv + noise, self.op_start)[:, self.burn :]


def operator_steps(rng: np.random.Generator, n: int, swing: float) -> NDArray[np.float64]:
    """One to three small changes of the set point, of which none drives the loop, shape (n_samples,)."""
    sp = np.zeros(n)
    for first in rng.integers(0, n, int(rng.integers(1, 4))):
        sp[first:] += float(rng.choice([-1.0, 1.0])) * log_uniform(rng, *OPERATED_SIZE) * swing
    return sp


def record_plan(rng: np.random.Generator, plan: Plan, tag: str) -> KindCase | None:
    """Run a plan with noise; None where it does not move, or runs into a limit that is not its fault."""
    if plan.faults.S == 0.0 and not plan.faults.pulse and rng.random() < 0.5:
        plan = replace(plan, faults=plan.faults._replace(S=log_uniform(rng, *GOOD_PLAY)))
    pv, op, _ = plan.run()
    if "set_point" not in plan.causes and rng.random() < OPERATED:
        plan = replace(plan, sp=operator_steps(rng, plan.n, robust_range(pv)))
        pv, op, _ = plan.run()
    level = plan.noise
    if level is None:
        controller = plan.loop.controller
        amplified = abs(controller.Kc) * (1.0 + (controller.N if controller.Td else 0.0))
        level = log_uniform(rng, *TRANSMITTER) * robust_range(pv)
        level = min(level, 0.08 * robust_range(op) / amplified)
    pv, op, mv = plan.run(level * rng.normal(size=plan.n))
    limited = float(np.mean((op <= 0.05) | (op >= 99.95)))
    if not np.isfinite(pv).all() or not np.ptp(op) > 0.01 or (limited > MAX_AT_LIMIT and not plan.at_limit):
        return None
    faults = plan.faults
    if plan.logged == "unmoved":
        faults = faults._replace(S=float(np.ptp(op)) * log_uniform(rng, 1.1, 5.0), J=faults.J)
        if not 0.5 < faults.S < 15.0:
            return None
        faults = faults._replace(J=faults.J * faults.S)
    if plan.logged == "stem":
        op = mv + 0.02 * robust_range(mv) * rng.normal(size=mv.size)
    if plan.logged == "pulses":
        op = mv
    step = float(rng.choice([0.001, 0.01, 0.05]))
    origin, integrating = Provenance(source="simulation", rows=pv.size), plan.loop.process.den[-1] == 0.0  # type: ignore[union-attr]
    sp = 50.0 + (np.zeros(plan.n) + plan.sp)[plan.burn :]
    sp_known = "set_point" in plan.causes or rng.random() < 0.85
    loop_type = str(rng.choice(["level", "pressure"] if integrating else ["flow", "pressure", "temperature"]))
    record = LoopRecord(
        tag, plan.loop.dt, op=np.round(op / step) * step, pv=pv, sp=sp if sp_known else None,
        loop_type=loop_type, integrating=bool(integrating), provenance=origin,
    )  # fmt: skip
    return KindCase(record, "", plan.causes, faults.S, faults.J)
