"""A step of retuning: the same for one record exported with other digits, and a help on loops that are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.compensation import build_twin
from stiction.compensation.retune_step import retune_step


def known_loop(number: int) -> tuple[st.Loop, st.LoopRecord]:
    """Loop number `number`, and what a plant records of it."""
    rng = np.random.default_rng(1000 + number)
    gain, tau = float(rng.uniform(0.8, 3.0)), float(rng.uniform(5.0, 30.0))
    dead_time = tau * float(rng.uniform(0.2, 1.0))
    S = float(rng.uniform(2.0, 6.0))
    J, noise = S * float(rng.uniform(0.1, 0.8)), float(rng.uniform(0.03, 0.15)) * gain
    Kc, Ti = float(rng.uniform(0.25, 0.6)) * tau / dead_time / gain / 1.5, tau * float(rng.uniform(0.7, 1.3))
    loop = st.Loop(st.PID(Kc, Ti), st.Kano(S, J), st.FOPDT(gain, tau, dead_time), dt=1.0, noise=noise)
    kick = np.where(np.arange(3000) < max(10, int(dead_time + tau)), 1.2 * S, 0.0)
    run = st.simulate(loop, 50.0, 3000.0, kick, number, pv_start=50.0, op_start=50.0, loop_type="flow")
    return loop, replace(run, mv=None)


def with_other_digits(record: st.LoopRecord, loop: st.Loop) -> st.LoopRecord:
    """PV and OP rounded to a tenth of their noise."""
    step = 0.1 * loop.noise
    op_step = abs(loop.controller.Kc) * step
    return replace(record, pv=np.round(record.pv / step) * step, op=np.round(record.op / op_step) * op_step)


def advised(record: st.LoopRecord) -> tuple[bool, float, float] | None:
    """Whether retuning helps, and Kc and Ti of the advice; None without a twin."""
    try:
        twin = build_twin(st.diagnose(record))
    except st.RecordError:
        return None
    if not twin.fits:
        return None
    found = retune_step(twin.loop, twin.measured.period).controller
    return found != twin.loop.controller, found.Kc, found.Ti


def compare_digits(numbers) -> tuple[int, int]:
    """Compare the advice of both records of some loops; return how many have one, and in how many it is no help."""
    compared = no_help = 0
    for number in numbers:
        loop, record = known_loop(number)
        one, other = advised(record), advised(with_other_digits(record, loop))
        if one is None or other is None:
            continue
        compared += 1
        if not (one[0] and other[0]):
            no_help += 1
            continue
        assert other[1] == pytest.approx(one[1], rel=0.15), number
        assert other[2] == pytest.approx(one[2], rel=0.15), number
    return compared, no_help


def test_other_digits_change_no_advice():
    assert compare_digits((9,)) == (1, 0)


@pytest.mark.slow
def test_other_digits_change_no_advice_of_forty_loops():
    compared, no_help = compare_digits(range(80))
    assert compared >= 40
    assert no_help <= 0.2 * compared


def deviation(loop: st.Loop) -> float:
    """PV deviation of a loop with noise and a load that steps, in the mean of three runs."""
    n = 6000
    load = loop.valve.S * np.repeat([0.23, -0.41, 0.08, -0.13, 0.37, -0.29, 0.47, -0.05], n // 8)
    load[:40] += 0.7 * loop.valve.S
    return float(np.mean([st.simulate(loop, 0.0, float(n), load, seed).pv[n // 8 :].std() for seed in range(3)]))


def test_the_step_lowers_the_deviation_of_most_known_loops():
    better = []
    for number in range(30):
        loop, _ = known_loop(number)
        found = retune_step(loop, 10.0 * loop.process.dead_time + 60.0).controller
        better.append(1.0 - deviation(replace(loop, controller=found)) / deviation(loop))
    assert np.mean(np.array(better) > 0.0) > 0.7
    assert np.mean(better) > 0.02


def test_a_step_beyond_the_limits_is_not_taken():
    """A loop near its limit of stability, an unstable one, and a controller without proportional action."""
    process, valve = st.FOPDT(3.0, 10.0, 10.0), st.Kano(5.0, 2.0)
    for pid, why in (
        (st.PID(0.37, 10.0), "maximum sensitivity"),
        (st.PID(2.0, 10.0), "unstable"),
        (st.PID(1e-7, 1e-5), "no proportional action"),
    ):
        found = retune_step(st.Loop(pid, valve, process, dt=1.0, noise=0.05), 140.0)
        assert found.controller == pid
        assert found.reason.startswith("Retuning does not help: ")
        assert why in found.reason
