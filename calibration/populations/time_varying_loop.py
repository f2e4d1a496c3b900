"""A loop that the plain driver does not know: its valve sticks at times only, or its transmitter is at fault."""

from __future__ import annotations

from stiction.models.controllers.pid import pid_at_rest, pid_step
from stiction.models.numba_compile import kernel
from stiction.models.valves.kano import kano_at_rest, kano_step
from stiction.simulation.drivers import process_step

__all__ = ["changing_loop"]


@kernel
def changing_loop(pid, sticks, J_over_S, A, b_new, b_old, c, delay, sensor, sp, load, pv_load, start, pv, op, mv):
    """Run one loop of Kano's valve, filling `pv`, `op` and the stem `mv` (n_samples,).

    `sticks` is S in each sample [% of span], 0 where the valve follows; `sensor` is (resolution, dead band) of the
    transmitter [PV units]: it reports a new value, rounded to the resolution, when the true one has left the last
    one reported by more than the dead band. The controller sees what is reported. `sp`, `load` and `pv_load` hold
    one value for each sample, `start` is (pv, op) at rest.
    """
    order = c.shape[0]
    settings = (pid[0], pid[1], pid[2], pid[3], pid[4], pid[5], pid[6], pid[7], pid[8], pid[9])
    pv0, op0 = start[0], start[1]
    controller = pid_at_rest(op0, pv0, settings)
    valve = kano_at_rest(op0, op0, 0.5 * (1.0 - J_over_S) * sticks[0])
    state = A[:, 0] * 0.0
    work = state.copy()
    older = 0.0
    last = pv0
    for k in range(pv.shape[0]):
        y = pv0 + pv_load[k]
        for i in range(order):
            y += c[i] * state[i]
        if abs(y - last) > sensor[1]:
            last = y
        y = last
        if sensor[0] > 0.0:
            y = round(y / sensor[0]) * sensor[0]
        pv[k] = y
        controller = pid_step(sp[k], y, controller, float("nan"), settings)
        op[k] = controller.op
        S = sticks[k]
        J = J_over_S * S
        valve = kano_step(controller.op, valve, S, J, (S - J) / 2.0)
        mv[k] = valve.position
        newer = 0.0
        if k >= delay:
            newer = mv[k - delay] - op0 + load[k - delay]
        process_step(A, b_new, b_old, newer, older, state, work)
        older = newer
