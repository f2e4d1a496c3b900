"""The simulated plant: its cascades against single loops, its truth against its signals."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.errors import ParameterError
from stiction.simulation.plant import simulate_plant
from stiction.simulation.plant.cascade import simulate_cascade

N, DT = 800, 5.0


def test_cascade_is_two_loops_in_a_row():
    """The secondary is a single loop whose set point is the OP of the primary; its PV drives the primary's process."""
    secondary = st.Loop(st.PID(0.6, 12.0), st.Kano(4.0, 2.5), st.FOPDT(1.1, 12.0, 7.0), DT)
    primary = st.Loop(st.PID(1.5, 120.0), st.Ideal(), st.FOPDT(0.9, 120.0, 20.0), DT)
    rng = np.random.default_rng(0)
    sp = np.where(np.arange(N) > 100, 53.0, 50.0)
    load1, load2 = np.cumsum(rng.normal(0.0, 0.1, (2, N)), axis=1)
    pv1, op1, pv2, op2 = simulate_cascade(primary, secondary, sp, load1, load2, seed=0)

    alone = st.simulate(secondary, op1, N * DT, load2, pv_start=50.0, op_start=50.0)
    np.testing.assert_allclose(alone.pv, pv2, atol=1e-9)
    np.testing.assert_allclose(alone.op, op2, atol=1e-9)
    driven = st.simulate(primary, sp, N * DT, load1, manual=pv2, pv_start=50.0, op_start=50.0)
    np.testing.assert_allclose(driven.pv, pv1, atol=1e-9)


def test_same_seed_same_plant():
    one, again, other = simulate_plant(3, hours=1.0), simulate_plant(3, hours=1.0), simulate_plant(4, hours=1.0)
    assert one == again
    assert one.records[0] != other.records[0]


@pytest.fixture(scope="module")
def plant():
    return simulate_plant(0)


def test_each_kind_of_loop_is_there(plant):
    states = [loop.state for loop in plant.loops]
    causes = [loop.cause for loop in plant.loops]
    assert [states.count(state) for state in ("manual", "saturated", "pv_frozen")] == [1, 1, 1]
    assert (causes.count("stiction"), causes.count("tight tuning"), causes.count("sensor")) == (2, 2, 1)
    assert len({loop.record.tag for loop in plant.loops}) == len(plant.loops) == 56
    assert all(loop.record.tag.startswith("UNIT") for loop in plant.loops)


def test_states_show_in_the_records(plant):
    by_state = {loop.state: loop.record for loop in plant.loops}
    assert not by_state["manual"].auto.any()
    assert (by_state["saturated"].op == 100.0).mean() > 0.95
    assert np.ptp(by_state["pv_frozen"].pv) == 0.0


def test_primary_names_its_secondary_whose_set_point_it_moves(plant):
    records = {record.tag: record for record in plant.records}
    primaries = [record for record in plant.records if record.provenance.secondary_tag]
    spans = plant.spans
    assert len(primaries) == 8
    for primary in primaries:
        secondary = records[primary.provenance.secondary_tag]
        low, high = spans[secondary.tag]
        np.testing.assert_allclose((secondary.sp - low) / (high - low) * 100.0, primary.op, atol=0.02)


def test_members_follow_their_source(plant):
    """At the period of the group a member's spectrum has more power than the noise beside it."""
    records = {record.tag: record for record in plant.records}
    for root, tags in plant.groups.items():
        assert root in tags
        power = np.abs(np.fft.rfft(records[root].pv - records[root].pv.mean())) ** 2
        peak = 20 + int(np.argmax(power[20:]))
        for tag in tags:
            own = [np.abs(np.fft.rfft(x - x.mean())) ** 2 for x in (records[tag].pv, records[tag].op)]
            assert max(x[peak - 3 : peak + 4].max() / np.median(x[peak : 2 * peak]) for x in own) > 10.0


@pytest.mark.parametrize("options", [{"hours": 0.0}, {"dt": 60.0}, {"units": 3}, {"seed": -1}])
def test_numbers_outside_their_limits_are_refused(options):
    with pytest.raises(ParameterError):
        simulate_plant(**options)
