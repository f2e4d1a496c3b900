"""A loop with the faults that the plain driver does not know: limits of rate, a stuck stem, pulsed outputs, hunting."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.models.controllers.pid import pid_at_rest, pid_step
from stiction.models.numba_compile import kernel
from stiction.models.valves.kano import kano_at_rest, kano_step
from stiction.simulation.drivers import process_step

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Loop

__all__ = ["Faults", "run_faulty"]


class Faults(NamedTuple):
    """What is wrong between controller and process."""

    S: float = 0.0
    """Deadband plus stickband [% of span]; infinite of a stuck stem."""
    J: float = 0.0
    """Slip jump [% of span]."""
    rate: float = np.inf
    """Largest move of OP from sample to sample [% of span]."""
    pulse: int = 0
    """Period of a time-proportioned output [samples]; 0 of a continuous one."""


def run_faulty(
    loop: Loop,
    faults: Faults,
    sp: NDArray[np.float64],
    load: NDArray[np.float64],
    pv_load: NDArray[np.float64],
    op_start: float = 50.0,
) -> NDArray[np.float64]:
    """Run a loop from rest at PV 50.

    Parameters
    ----------
    loop : Loop
        Controller and process; its valve is not used.
    faults : Faults
        What is wrong.
    sp, pv_load : ndarray, shape (n_samples,)
        Deviation of the set point, and what is added to the PV [PV units].
    load : ndarray, shape (n_samples,)
        Load at the process inlet [% of span].
    op_start : float
        OP at rest [% of span].

    Returns
    -------
    ndarray, shape (3, n_samples)
        PV, OP and stem, that of a pulsed output 0 or 100 %.
    """
    found, out = loop.discrete, np.empty((3, sp.size))
    stuck = not np.isfinite(faults.S)
    _run(
        loop.controller.pack(loop.dt), 0.0 if stuck else faults.S, faults.J, faults.rate, faults.pulse, stuck,
        found.A, found.b_new, found.b_old, found.c, found.delay, 50.0 + sp, load, pv_load, op_start, *out,
    )  # fmt: skip
    return out


@kernel
def _run(pid, S, J, rate, pulse, stuck, A, b_new, b_old, c, delay, sp, load, pv_load, op0, pv, op, mv):
    """Fill `pv`, `op` and `mv`."""
    settings = (pid[0], pid[1], pid[2], pid[3], pid[4], pid[5], pid[6], pid[7], pid[8], pid[9])
    controller = pid_at_rest(op0, 50.0, settings)
    fd = (S - J) / 2.0
    valve = kano_at_rest(op0, op0, fd)
    state = A[:, 0] * 0.0
    work = state.copy()
    older, last = 0.0, op0
    for k in range(pv.shape[0]):
        y = 50.0 + pv_load[k]
        for i in range(c.shape[0]):
            y += c[i] * state[i]
        pv[k] = y
        controller = pid_step(sp[k], y, controller, float("nan"), settings)
        last = min(max(controller.op, last - rate), last + rate)
        op[k] = last
        valve = kano_step(last, valve, S, J, fd)
        mv[k] = op0 if stuck else valve.position
        if pulse > 0:
            mv[k] = 100.0 if (k % pulse) < 0.01 * last * pulse else 0.0
        newer = 0.0
        if k >= delay:
            newer = mv[k - delay] - op0 + load[k - delay]
        process_step(A, b_new, b_old, newer, older, state, work)
        older = newer
