"""The search driver on functions with a known minimum, and the valve of simulated loops with known S and J."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.candidates import Candidates, combinations, pattern_search
from stiction.diagnosis.identification.identify import search_record

STEPS = ((0.1, 0.1, 0.2, 4), (0.03, 0.03, 0.05, 3), (0.01, 0.01, 0.02, 2), (0.003, 0.003, 0.005, 2)) * 4


def bowl(S, ratio, start, slope=0.0):
    """A cost whose minimum is known; with `slope` a valley that runs across the axes."""

    def evaluate(rows):
        a, b = np.log(rows[:, 0] / S), rows[:, 1] - ratio
        return Candidates(
            rows, 100.0 * (a + slope * b) ** 2 + 30.0 * (b - slope * a) ** 2 + 30.0 * (rows[:, 3] - start) ** 2
        )

    return evaluate


@pytest.mark.parametrize(("slope", "diagonal"), [(0.0, False), (1.0, True), (-1.0, True)])
def test_the_minimum_of_a_bowl_is_found(slope, diagonal):
    evaluate = bowl(3.3, 0.42, -0.2, slope)
    start = evaluate(combinations(np.array([1.0, 2.5, 6.0]), np.array([0.0, 0.5]), np.zeros(1), np.zeros(1)))
    found = pattern_search(evaluate, start, STEPS, 10.0, diagonal=diagonal).best
    assert pytest.approx(3.3, rel=0.02) == found.S
    assert found.ratio == pytest.approx(0.42, abs=0.03)
    assert found.start == pytest.approx(-0.2, abs=0.05)


def test_candidates_stay_within_their_bounds():
    found = pattern_search(bowl(50.0, 3.0, 4.0), bowl(50.0, 3.0, 4.0)(np.array([[9.0, 0.9, 0.0, 0.9]])), STEPS, 10.0)
    assert found.valves[:, 0].max() == 10.0
    assert found.valves[:, 1].max() == 1.0
    assert found.valves[:, 3].max() == 0.95


def test_local_minima_are_apart_and_in_order():
    rows = np.array([[2.0, 0.5, 0.0, 0.0], [2.01, 0.5, 0.0, 0.0], [4.0, 0.5, 0.0, 0.0], [2.0, 0.5, 1.0, 0.0]])
    found = Candidates(rows, np.array([2.0, 1.0, 4.0, 3.0]))
    assert found.local_minima(9, 0.02, 0.1).tolist() == rows[[1, 3, 2]].tolist()
    assert found.local_minima(1, 0.02, 0.1).tolist() == rows[[1]].tolist()


def test_costs_that_differ_by_rounding_alone_leave_the_first_candidate_the_best():
    rows = np.array([[2.0, 0.5, 0.0, 0.0], [1.0, 0.5, 0.0, 0.0]])
    assert Candidates(rows, np.array([7.0, 7.0 - 1e-9])).best.S == 2.0


def loop(seed):
    """A loop with stiction and a set point that moves; every third process integrates, the valves of odd ones rest."""
    rng = np.random.default_rng(seed)
    S, ratio = rng.uniform(2.0, 6.0), rng.uniform(0.2, 0.8)
    valve = st.He(0.5 * S * (1.0 + ratio), 0.5 * S * (1.0 - ratio)) if seed % 2 else st.Kano(S, ratio * S)
    if seed % 3 == 2:
        process, controller, swing = st.Integrating(0.02, 4.0), st.PID(4.0, 40.0), 0.2 * S
    else:
        process, controller = st.FOPDT(2.0, rng.uniform(6.0, 15.0), rng.uniform(2.0, 8.0)), st.PID(0.25, 9.0)
        swing = 2.0 * S
    sp = 50.0 + 0.3 * swing * np.repeat(rng.uniform(-1.0, 1.0, 60), 30)
    run = st.simulate(
        st.Loop(controller, valve, process, dt=1.0, noise=0.01 * swing), sp, 1800.0, seed=seed, op_start=50.0,
        pv_start=50.0,
    )  # fmt: skip
    return run, S, ratio * S


def test_the_valve_of_most_simulated_loops_is_found():
    errors = []
    for seed in range(20):
        run, S, J = loop(seed)
        found = search_record(run.op, run.pv, None).candidates.best
        errors.append((abs(found.S / S - 1.0), abs(found.S * found.ratio - J) / S))
    S_error, J_error = np.array(errors).T
    assert np.median(S_error) < 0.05
    assert np.mean(S_error < 0.15) >= 0.7, S_error.round(2)
    assert np.median(J_error) < 0.1
