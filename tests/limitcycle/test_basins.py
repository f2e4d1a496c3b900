"""Basins, pulses, branches and records: what the map says against single runs and the sampled simulation."""

from __future__ import annotations

import json

import numpy as np
import pytest

import stiction as st
from stiction.limitcycle import basin_map, bifurcation, exact_limit_cycles, smallest_pulse
from stiction.paper.fig6 import figure6
from stiction.paper.fig7 import EXAMPLE_LOOP
from stiction.paper.fig8 import figure8


@pytest.fixture(scope="module")
def a_and_c():
    return exact_limit_cycles(EXAMPLE_LOOP, families=["half"])


def test_pulses_of_the_paper_move_the_loop_from_a_to_c(a_and_c):
    """Check N11: 5 s of 0.5, 1 or 2 at the process inlet."""
    found = basin_map(EXAMPLE_LOOP, after=a_and_c[0], pulse=[0.0, 0.5, 1.0, 2.0], pulse_length=5.0)
    assert found.label.tolist() == [0, 1, 1, 1]
    assert [a.name for a in found.attractors] == ["2 levels", "4 levels"]
    assert found.period == pytest.approx([a_and_c[0].period] + 3 * [a_and_c[1].period], rel=1e-4)


def test_smallest_pulse_is_smallest(a_and_c):
    size, phase = smallest_pulse(EXAMPLE_LOOP, *a_and_c, 5.0, phases=8, sizes=40)
    just = basin_map(
        EXAMPLE_LOOP, after=a_and_c[0], pulse=np.array([0.999, 1.001]) * size, pulse_length=5.0, phase=phase
    )
    assert just.amplitude == pytest.approx([a_and_c[0].amplitude, a_and_c[1].amplitude], rel=1e-3)
    assert smallest_pulse(EXAMPLE_LOOP, *a_and_c, 5.0, largest=0.5 * abs(size), phases=8, sizes=10) is None


def test_map_agrees_with_the_sampled_simulation():
    """Starts of the continuous map, redone by `simulate` at 2 ms: number of levels of the stem."""
    for op in (0.3, 0.9, 1.5):
        (found,) = basin_map(EXAMPLE_LOOP, op_start=[op], mv_start=[0.25]).attractors
        levels = int(found.name.split()[0])
        fine = st.Loop(EXAMPLE_LOOP.controller, EXAMPLE_LOOP.valve, EXAMPLE_LOOP.process, dt=0.002)
        start = 0.25 if abs(op - 0.25) <= 0.5 else op
        record = st.simulate(fine, sp=0.0, duration=200.0, op_start=op, mv_start=start, disturbance=start)
        assert len(np.unique(np.round(record.mv[-20_000:] / 0.5, 1))) == levels


def test_map_does_not_depend_on_threads_and_reports_progress():
    starts = np.linspace(-2.0, 2.0, 70)
    seen = []
    one = basin_map(
        EXAMPLE_LOOP, op_start=starts, mv_start=0.25, threads=1, progress=lambda done, n: seen.append((done, n))
    )
    two = basin_map(EXAMPLE_LOOP, op_start=starts, mv_start=0.25, threads=2)
    assert np.array_equal(one.label, two.label)
    assert np.array_equal(one.period, two.period)
    assert seen[-1] == (70, 70)
    assert sum(a.share for a in one.attractors) + np.mean(one.label < 0) == pytest.approx(1.0)
    assert json.loads(json.dumps(one.to_dict()))["label"] == one.label.tolist()
    assert "levels" in one.summary()


def test_loop_at_its_point_of_rest_stays_there():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    assert basin_map(loop).label.item() == -1
    assert basin_map(loop, disturbance=[1.0]).label.tolist() == [0]


def test_bad_starts_are_refused(a_and_c):
    with pytest.raises(st.ParameterError, match="finite"):
        basin_map(EXAMPLE_LOOP, op_start=np.nan)
    with pytest.raises(st.ParameterError, match="pulse_length"):
        basin_map(EXAMPLE_LOOP, pulse_length=-1.0)
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    with pytest.raises(st.ParameterError, match="after"):
        basin_map(loop, after=a_and_c[0])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"op_start": "a"}, "op_start must be a number"),
        ({"op_start": [1.0, 2.0], "pv_start": [1.0, 2.0, 3.0]}, r"op_start \(2,\), pv_start \(3,\)"),
        ({"mv_start": 1j}, "mv_start must be a number"),
        ({"most_turns": -5}, "most_turns = -5 is not positive"),
        ({"most_turns": 50.5}, "most_turns = 50.5 is not a whole number"),
        ({"threads": -1}, "threads = -1 is not positive"),
        ({"threads": np.nan}, "threads must be a finite number"),
        ({"tolerance": np.nan}, "tolerance must be a finite number"),
        ({"after": "a cycle"}, "after is not an exact cycle"),
    ],
)
def test_a_map_asked_for_in_a_way_that_cannot_be_is_refused(given, message):
    with pytest.raises(st.ParameterError, match=message):
        basin_map(EXAMPLE_LOOP, **given)


def test_a_whole_number_of_turns_may_be_a_float():
    one, two = (basin_map(EXAMPLE_LOOP, op_start=[0.3], mv_start=0.25, most_turns=turns) for turns in (50, 50.0))
    assert one.period.tolist() == two.period.tolist()


def test_branches_scale_with_d():
    diagram = bifurcation(EXAMPLE_LOOP, "d", [0.25, 0.5, 1.0])
    assert len(diagram.branches) == 4
    for branch in diagram.branches:
        assert branch.born is None
        assert branch.dies is None
        assert np.ptp(branch.period) < 1e-8 * branch.period[0]
        assert branch.amplitude / branch.values == pytest.approx(branch.amplitude[0] / 0.25, rel=1e-8)


def test_cycle_a_dies_where_the_search_no_longer_finds_it():
    diagram = bifurcation(EXAMPLE_LOOP, "gain", np.linspace(1.6, 2.2, 4), families=["half"], searches=2)
    small = min(diagram.branches, key=lambda b: b.amplitude[0])
    assert 1.6 < small.dies < 2.2

    def smallest(gain):
        pid = EXAMPLE_LOOP.controller
        loop = st.Loop(st.PID(gain * pid.Kc, pid.Ti, pid.Td), EXAMPLE_LOOP.valve, EXAMPLE_LOOP.process, dt=0.01)
        return min(len(c.levels) for c in exact_limit_cycles(loop, families=["half"]))

    assert smallest(small.dies - 0.01) == 2
    assert smallest(small.dies + 0.01) > 2
    assert "dies" in diagram.summary()


def test_jump_is_what_makes_a_self_regulating_loop_cycle():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    (branch,) = bifurcation(loop, "J", [1.0, 2.0, 3.0], searches=2).branches
    assert np.all(np.diff(branch.period) < 0.0)
    with pytest.raises(st.ParameterError, match="not a parameter of this loop"):
        bifurcation(loop, "d", [1.0])


@pytest.mark.parametrize(("parameter", "values"), [("gain", [0.0, 1.0]), ("Kc", [0.0, 0.2])])
def test_no_branch_reaches_a_loop_without_gain(parameter, values):
    """With Kc = 0 the OP does not answer the stem."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    (branch,) = bifurcation(loop, parameter, values).branches
    assert branch.values.tolist() == values[1:]
    assert branch.born > 0.0


def test_figure_6_cycles_with_the_paper_s_band():
    data = figure6()
    late = data.record.mv[-4000:]
    assert np.ptp(late) == pytest.approx(5.1, rel=0.02)
    assert data.record.op[-4000:].max() - data.record.op[-4000:].min() == pytest.approx(
        2 * data.cycles[0].amplitude, rel=0.03
    )


def test_figure_8_moves_from_two_levels_to_four():
    data = figure8()
    mv = np.round(data.record.mv / 0.5, 1)
    assert len(np.unique(mv[10_000:19_900])) == 2
    assert len(np.unique(mv[30_000:])) == 4
    assert 0.0 < abs(data.smallest[0]) < 0.5
    assert len(data.cycles) == 4
