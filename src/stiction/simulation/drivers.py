"""Compiled drivers: one valve or one loop over all samples."""

from __future__ import annotations

import math

from stiction.models.compensators.component import compensator_at_rest
from stiction.models.controllers.pid import pid_at_rest, pid_step
from stiction.models.dispatch import (
    KANO,
    NO_COMPENSATOR,
    PHYSICAL,
    STENMAN,
    compensator_step,
    data_driven_parameters,
    data_driven_step,
    is_data_driven,
    kano_at_rest,
    kano_step,
    physical_parameters,
    physical_step,
    stenman_step,
    valve_at_rest,
    valve_step,
)
from stiction.models.numba_compile import inline_kernel, kernel

__all__ = ["closed_loop", "fast_closed_loop", "process_output", "process_step", "stroke_one"]


@kernel
def stroke_one(model, p, op, position, mv):
    """Drive one valve over `op` (n_samples,) from rest at `position`; writes the stem to `mv` (n_samples,)."""
    if op.shape[0] == 0:
        return
    s = valve_at_rest(model, op[0], position, p)
    low, high = p[0], p[1]
    if model == STENMAN:
        for k in range(op.shape[0]):  # a loop of its own: its step costs less than the choice of a model
            s = stenman_step(min(max(op[k], low), high), s, p[2])
            mv[k] = min(max(s.position, low), high)
        return
    if is_data_driven(model):
        q = data_driven_parameters(p)
        for k in range(op.shape[0]):
            s = data_driven_step(model, op[k], s, q)
            mv[k] = min(max(s.position, low), high)
        return
    if model == PHYSICAL:
        named = physical_parameters(p)
        for k in range(op.shape[0]):
            s = physical_step(op[k], s, named)
            mv[k] = s.position
        return
    for k in range(op.shape[0]):
        s = valve_step(model, op[k], s, p)
        mv[k] = min(max(s.position, low), high)


@inline_kernel
def process_output(c, state):
    """Output of a process from its states."""
    y = 0.0
    for i in range(c.shape[0]):
        y += c[i] * state[i]
    return y


@inline_kernel
def _process_input(k, delay, mv, mv0, load, load_step):
    """Input of a process, `delay` samples late: deviation of the stem from its start, plus the load."""
    if k < delay:
        return 0.0
    return mv[k - delay] - mv0 + load[(k - delay) * load_step]


@inline_kernel
def process_step(A, b_new, b_old, newer, older, state, work):
    """Advance the states of a process by one sample."""
    order = state.shape[0]
    for i in range(order):
        total = 0.0
        for j in range(order):
            total += A[i, j] * state[j]
        work[i] = total + b_new[i] * newer + b_old[i] * older
    for i in range(order):
        state[i] = work[i]


def fast_closed_loop(pid, model, p, A, b_new, b_old, c, d, delay, direct, sp, load, pv_load, manual, start, pv, op, mv):
    """Run one loop with a data-driven valve and no compensator, as `closed_loop` does.

    A PI controller in automatic with Kano's valve and a first-order process, without load, end stops, weights of the
    set point or a fraction of a sample in its dead time, has a kernel of its own: there most of the time would go into
    what such a loop does not have. The order of operations is that of the other kernels.
    """
    pi = pid[2] == 0.0 and pid[4] == 1.0 and pid[8] == 0.0
    free = p[0] == -math.inf and p[1] == math.inf
    undisturbed = load.shape[0] == 1 and load[0] == 0.0 and manual.shape[0] == 1 and math.isnan(manual[0])
    first_order = c.shape[0] == 1 and d == 0.0 and b_old[0] == 0.0
    if model == KANO and first_order and pi and free and undisturbed:
        _kano_loop(pid, p, A, b_new, c, delay, sp, pv_load, start, pv, op, mv)
        return
    _data_driven_loop(
        pid, model, p, A, b_new, b_old, c, d, delay, direct, sp, load, pv_load, manual, start, pv, op, mv
    )  # fmt: skip


@kernel
def _kano_loop(pid, p, A, b_new, c, delay, sp, pv_load, start, pv, op, mv):
    n = pv.shape[0]
    pv0, op0, mv0 = start[0], start[1], start[2]
    sp_step = 1 if sp.shape[0] > 1 else 0
    pv_step = 1 if pv_load.shape[0] > 1 else 0
    settings = (pid[0], pid[1], 0.0, 0.0, 1.0, 1.0, pid[6], pid[7], 0.0, pid[9])
    controller = pid_at_rest(op0, pv0, settings)
    S, J, lag = p[2], p[3], p[4]
    valve = kano_at_rest(op0, mv0, lag)
    x = 0.0
    a, bn, gain = A[0, 0], b_new[0], c[0]
    for k in range(n):
        y = pv0 + gain * x + pv_load[k * pv_step]
        controller = pid_step(sp[k * sp_step], y, controller, math.nan, settings)
        valve = kano_step(controller.op, valve, S, J, lag)
        pv[k] = y
        op[k] = controller.op
        mv[k] = valve.position
        newer = mv[k - delay] - mv0 if k >= delay else 0.0
        x = a * x + bn * newer


@kernel
def _data_driven_loop(
    pid, model, p, A, b_new, b_old, c, d, delay, direct, sp, load, pv_load, manual, start, pv, op, mv
):
    """Run the loop, apart from `closed_loop`, which takes long to compile; a first-order process runs on scalars."""
    n, order = pv.shape[0], c.shape[0]
    pv0, op0, mv0 = start[0], start[1], start[2]
    low, high = p[0], p[1]
    sp_step = 1 if sp.shape[0] > 1 else 0
    load_step = 1 if load.shape[0] > 1 else 0
    pv_step = 1 if pv_load.shape[0] > 1 else 0
    manual_step = 1 if manual.shape[0] > 1 else 0
    settings = (pid[0], pid[1], pid[2], pid[3], pid[4], pid[5], pid[6], pid[7], pid[8], pid[9])
    controller = pid_at_rest(op0, pv0, settings)
    valve = valve_at_rest(model, op0, mv0, p)
    q = data_driven_parameters(p)
    older = 0.0
    if order == 1 and d == 0.0:
        x = 0.0
        a, bn, bo, gain = A[0, 0], b_new[0], b_old[0], c[0]
        for k in range(n):
            y = pv0 + gain * x + pv_load[k * pv_step]
            controller = pid_step(sp[k * sp_step], y, controller, manual[k * manual_step], settings)
            valve = data_driven_step(model, controller.op, valve, q)
            pv[k] = y
            op[k] = controller.op
            mv[k] = min(max(valve.position, low), high)
            newer = _process_input(k, delay, mv, mv0, load, load_step)
            x = a * x + bn * newer + bo * older
            older = newer
        return
    state = A[:, 0] * 0.0 if order else c
    work = state.copy()
    for k in range(n):
        y = pv0 + process_output(c, state) + pv_load[k * pv_step]
        if d != 0.0:
            y += d * _process_input(k, direct, mv, mv0, load, load_step)
        controller = pid_step(sp[k * sp_step], y, controller, manual[k * manual_step], settings)
        valve = data_driven_step(model, controller.op, valve, q)
        pv[k] = y
        op[k] = controller.op
        mv[k] = min(max(valve.position, low), high)
        newer = _process_input(k, delay, mv, mv0, load, load_step)
        process_step(A, b_new, b_old, newer, older, state, work)
        older = newer


@kernel
def closed_loop(
    pid,
    kind,
    h,
    model,
    p,
    A,
    b_new,
    b_old,
    c,
    d,
    delay,
    direct,
    sp,
    load,
    pv_load,
    manual,
    start,
    pv,
    op,
    valve_signal,
    mv,
):
    """Run one loop over `pv` (n_samples,), with the compensator `kind` of parameters `h`, if any.

    `sp`, `load`, `pv_load` and `manual` hold one value per sample, or one value for all of them. `load` is added
    to the stem position at the process inlet [% of span], `pv_load` to the process output (measurement noise
    included). `start` is (pv, op, position) at rest before the first sample. The signal of the compensator goes to
    `valve_signal`, which is not used without a compensator.
    """
    n, order = pv.shape[0], c.shape[0]
    pv0, op0, mv0 = start[0], start[1], start[2]
    low, high = p[0], p[1]
    sp_step = 1 if sp.shape[0] > 1 else 0
    load_step = 1 if load.shape[0] > 1 else 0
    pv_step = 1 if pv_load.shape[0] > 1 else 0
    manual_step = 1 if manual.shape[0] > 1 else 0
    settings = (pid[0], pid[1], pid[2], pid[3], pid[4], pid[5], pid[6], pid[7], pid[8], pid[9])
    holding = (pid[0], 0.0, pid[2], pid[3], pid[4], pid[5], pid[6], pid[7], pid[8], pid[9])
    controller = pid_at_rest(op0, pv0, settings)
    valve = valve_at_rest(model, op0, mv0, p)
    compensator = compensator_at_rest(op0, sp[0])
    older = 0.0
    state = A[:, 0] * 0.0 if order else c
    work = state.copy()
    for k in range(n):
        y = pv0 + process_output(c, state) + pv_load[k * pv_step]
        if d != 0.0:
            y += d * _process_input(k, direct, mv, mv0, load, load_step)
        pv[k] = y
        target, manual_op = sp[k * sp_step], manual[k * manual_step]
        if kind == NO_COMPENSATOR:
            controller = pid_step(target, y, controller, manual_op, settings)
            signal = controller.op
        else:
            tracked_op = valve_signal[k - 1] if compensator.track != 0.0 and manual_op != manual_op else manual_op
            controller = pid_step(target, y, controller, tracked_op, holding if compensator.hold != 0.0 else settings)
            if manual_op == manual_op:
                compensator = compensator_at_rest(controller.op, target)
            else:
                compensator = compensator_step(kind, controller.op, target, y, compensator, h)
            signal = min(max(compensator.valve_signal, pid[6]), pid[7])
            valve_signal[k] = signal
        op[k] = controller.op
        valve = valve_step(model, signal, valve, p)
        mv[k] = min(max(valve.position, low), high)
        newer = _process_input(k, delay, mv, mv0, load, load_step)
        process_step(A, b_new, b_old, newer, older, state, work)
        older = newer
