"""Each kind of loop that is not in control gets its state, whatever its units, size, action, sampling and noise."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.diagnosis.loop_state import assess_loop_state, describe_action, describe_state

from . import plant_cases as plant

SEEDS = range(10)
KINDS = {
    plant.stuck_in_service: "valve_not_responding",
    plant.stuck_from_start: "valve_not_responding",
    plant.selected_out: "not_in_command",
    plant.frozen_transmitter: "pv_frozen",
    plant.closed_block_valve: "shut_in",
    plant.vent: "saturated",
    plant.split_range_gap: "in_control",
    plant.healthy: "in_control",
}


@pytest.mark.parametrize("with_sp", [True, False], ids=["SP", "no SP"])
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_state_of_a_kind(kind, seed, with_sp):
    loop, signals = kind(seed)
    loop_type = "pressure" if kind is plant.vent else "flow"
    state = assess_loop_state(loop.record(signals, loop_type, with_sp=with_sp))
    assert state.state == KINDS[kind]
    if state.in_control:
        assert not describe_state(state)
        return
    assert state.share > 0.5
    assert describe_action(state).startswith(("Check", "Record", "Put"))
    assert "no action" not in describe_action(state).lower()
    assert any(character.isdigit() for character in describe_state(state))


def test_the_stretch_of_a_frozen_pv_is_where_it_is_frozen():
    loop, (op, pv, sp) = plant.frozen_transmitter(3)
    state = assess_loop_state(loop.record((op, pv, sp)))
    stop = int(np.flatnonzero(np.diff(pv))[-1]) + 1
    assert state.start_s == pytest.approx(stop * loop.dt)
    assert state.end_s == loop.n * loop.dt


def test_a_state_in_a_small_part_is_a_stretch():
    loop, (op, pv, sp) = plant.healthy(1)
    pv = pv.copy()
    first = loop.n // 2
    pv[first : first + loop.n // 5] = pv[first]
    state = assess_loop_state(loop.record((op, pv, sp)))
    assert state.in_control
    [stretch] = state.stretches
    assert (stretch.state, stretch.first) == ("pv_frozen", first)
    assert state.share == pytest.approx(0.8, abs=0.01)


@pytest.mark.parametrize("seed", range(6))
def test_signals_of_two_loops_are_unrelated(seed):
    (one, (op, _, _)), (two, (_, pv, sp)) = plant.healthy(seed), plant.healthy(seed + 50)
    n = min(one.n, two.n)
    record = one.record((op[:n], pv[:n], sp[:n]))
    assert assess_loop_state(record).state == "signals_unrelated"


@pytest.mark.parametrize("seed", range(6))
def test_swapped_columns_are_named(seed):
    loop, (op, pv, sp) = plant.healthy(seed)
    # OP as the controller computed it: rounding to two decimals would hide its equation.
    exact = np.cumsum(loop.Kc * loop.dt / loop.Ti * (sp - pv)) + loop.Kc * (sp - pv) + op[0]
    state = assess_loop_state(loop.record((pv, exact, None), with_sp=False))
    assert state.state == "signals_swapped"
    assert assess_loop_state(loop.record((exact, pv, sp))).state != "signals_swapped"


@pytest.mark.parametrize("seed", range(6))
def test_a_load_that_a_good_valve_meets_is_in_control(seed):
    loop = plant.PlantLoop.draw(seed)
    loop.loads[loop.n // 3 :] += 35.0 * loop.gain
    assert assess_loop_state(loop.record(loop.run(1.5 * loop.span))).in_control


@pytest.mark.parametrize("seed", range(6))
def test_a_set_point_that_ramps_is_in_control(seed):
    loop = plant.PlantLoop.draw(seed)
    ramp = np.linspace(0.0, 35.0 * loop.gain, loop.n)
    assert assess_loop_state(loop.record(loop.run(1.5 * loop.span + ramp))).in_control
