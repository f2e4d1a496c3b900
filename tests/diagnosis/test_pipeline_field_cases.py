"""Loops as plants produce them, in which a good or an unseen valve was blamed or cleared; each drawn five times."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st

from .loop_state import plant_cases as plant

SEEDS = range(5)
OUT_OF_CONTROL = {
    plant.stuck_in_service: "valve_not_responding",
    plant.stuck_from_start: "valve_not_responding",
    plant.frozen_transmitter: "pv_frozen",
    plant.closed_block_valve: "shut_in",
    plant.selected_out: "not_in_command",
}


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", OUT_OF_CONTROL, ids=lambda kind: kind.__name__)
def test_a_loop_out_of_control_is_not_cleared(kind, seed):
    loop, signals = kind(100 + seed)
    found = st.diagnose(loop.record(signals))
    assert found.loop_state.state == OUT_OF_CONTROL[kind]
    assert (found.verdict, found.probability, found.oscillation_cause.main) == ("undecided", 0.25, "none")
    assert found.to_dict()["stiction"] is None
    text = found.summary().lower()
    assert not any(words in text for words in ("no action", "lower the controller gain", "packing and", "sizing"))


def draw_split_range(seed, *, crossings):
    """Two good valves with a gap between them, in a slow PI loop whose load moves OP across the gap."""
    rng = np.random.default_rng(seed)
    n, dt = int(rng.integers(1200, 2800)), float(rng.choice([1.0, 5.0]))
    half, middle, dead = rng.uniform(1.5, 4.0), rng.uniform(47.0, 53.0), int(rng.integers(2, 12))
    keep, gain = np.exp(-1.0 / rng.uniform(15.0, 80.0)), 10.0 ** rng.uniform(-0.5, 1.0)
    Kc, Ti = min(-0.3 / (np.log(keep) * gain * (dead + 1.0)), 2.0 / gain), -0.7 / np.log(keep)
    load = 1.4 * half * np.sin(np.pi * crossings * np.arange(n) / n + rng.uniform(0.0, 6.0))
    load += np.cumsum(rng.normal(0.0, 0.002, n))
    op, pv, flow = np.full(n, middle), np.empty(n), np.zeros(n + dead + 1)
    state, integral = 0.0, middle
    for k in range(n):
        off = op[k - 1] - middle
        flow[k + dead + 1] = np.sign(off) * max(abs(off) - half, 0.0)
        state = keep * state + (1.0 - keep) * gain * (flow[k] + load[k])
        pv[k] = 80.0 + state + 0.012 * gain * half * rng.normal()
        integral += Kc / Ti * (80.0 - pv[k])
        op[k] = integral + Kc * (80.0 - pv[k])
    record = st.LoopRecord("TIC-1", dt, op=op.round(2), pv=pv.round(3), sp=np.full(n, 80.0), loop_type="temperature")
    return record, middle - half, middle + half


@pytest.mark.parametrize("seed", SEEDS)
def test_a_dead_zone_crossed_often_is_named_with_its_range(seed):
    record, low, high = draw_split_range(seed, crossings=10)
    found = st.diagnose(record)
    assert found.verdict != "stiction"
    assert found.oscillation_cause.dead_zone >= 0.5
    zone = found.identification.dead_zone
    assert (zone.low, zone.high) == pytest.approx((low, high), abs=0.7)
    if "dead_zone" in found.oscillation_cause.named:
        assert f"between {zone.low:.1f} and {zone.high:.1f} %" in found.reason
        assert "split-range" in found.action
    else:
        assert found.finding in ("external", "cause_unknown", "cannot_tell")  # a wave moves OP across the zone


@pytest.mark.parametrize("seed", SEEDS)
def test_a_dead_zone_crossed_once_is_not_called_stiction(seed):
    record, _, _ = draw_split_range(seed, crossings=1.6)
    found = st.diagnose(record)
    assert found.verdict != "stiction"
    assert found.oscillation_cause.dead_zone >= 0.5
    assert "split range" in found.reason


@pytest.mark.parametrize("seed", SEEDS)
def test_a_sticky_valve_has_no_dead_zone(seed):
    rng = np.random.default_rng(seed)
    S = rng.uniform(3.0, 8.0)
    loop = st.Loop(st.PID(0.25, 10.0), st.Kano(S, 0.4 * S), st.FOPDT(2.0, 10.0, 5.0), dt=1.0, noise=0.1)
    run = st.simulate(loop, sp=np.where(np.arange(1500) < 40, 2.0 * S, 0.0), duration=1500.0, seed=seed)
    found = st.diagnose(st.LoopRecord("FIC-1", 1.0, op=run.op + 50.0, pv=run.pv, loop_type="flow"))
    assert found.verdict != "no_stiction"
    assert found.oscillation_cause.dead_zone < 0.1


@pytest.mark.parametrize("seed", SEEDS)
def test_a_sticky_vent_is_not_cleared(seed):
    """A vent is shut most of the time and opens in bursts; its valve sticks."""
    loop = plant.PlantLoop.draw(200 + seed)
    gain, rng = loop.span / 100.0, loop.rng
    phase = 2.0 * np.pi * np.arange(loop.n) / rng.uniform(60.0, 200.0)
    loop.loads = loop.span * (0.15 * np.sin(phase) - rng.uniform(0.04, 0.06))
    loop.gain, loop.Kc = -gain, -0.5 / gain
    valve, stem = st.Kano(rng.uniform(3.0, 6.0), 2.0), [0.0]

    def stem_of(k, op):
        half, gap = 0.5 * (valve.S + valve.J), 0.5 * (valve.S - valve.J)
        if abs(op - stem[0]) > half:
            stem[0] = op - np.sign(op - stem[0]) * gap
        return max(stem[0], 0.0)

    found = st.diagnose(loop.record(loop.run(1.5 * loop.span, op_start=0.0, stem_of=stem_of), "pressure"))
    assert found.verdict != "no_stiction"
    assert found.probability > 0.2
    assert "no action" not in found.summary().lower()
