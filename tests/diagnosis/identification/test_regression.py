"""The ARX regression against NumPy's least squares on the full design matrix."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.alternatives import process_gains
from stiction.diagnosis.identification.regression import build_regression, orthonormal_rows, standardise

VALVES = np.array([[3.0, 0.4, 0.0, 0.0], [2.0, 1.0, 1.0, 0.3], [1.0, 0.0, 0.0, -0.6]])


def record(n=600, per_block=1, seed=0):
    """OP that wanders and a PV that follows the position of a sticky valve, as block means."""
    rng = np.random.default_rng(seed)
    op = 50.0 + 4.0 * np.sin(np.arange(n * per_block) / (6.0 * per_block)) + 0.2 * rng.normal(size=n * per_block)
    stem = st.stroke(st.Kano(3.0, 1.2), op, dt=1.0).mv.reshape(n, per_block).mean(axis=1)
    pv = np.convolve(stem - 50.0, np.exp(-np.arange(40) / 5.0) / 5.0)[:n] + 0.05 * rng.normal(size=n)
    return op, 100.0 + 3.0 * pv


def full_design(regression, position, pv_lags=12, op_lags=4):
    """Rows of all regressors, one for each predicted sample, and the PV that they predict."""
    op = standardise(regression.op.reshape(-1, regression.per_block).mean(axis=1))
    n, first = regression.pv.size, regression.first
    x = position - position.mean()
    rows = []
    for k in range(first, n):
        groups = [
            sum(x[k - lag] for lag in range(low, high))
            for low, high in zip(regression.edges[:-1], regression.edges[1:], strict=True)
        ]
        past = [regression.pv[k - lag] for lag in range(1, pv_lags + 1)]
        rows.append([1.0, *past, *(op[k - lag] for lag in range(1, op_lags + 1)), *groups])
    return np.array(rows), regression.pv[first:]


@pytest.mark.parametrize("per_block", [1, 3])
def test_costs_and_residuals_equal_least_squares_on_the_full_design_matrix(per_block):
    regression = build_regression(*record(per_block=per_block), per_block, 38.0)
    found = regression.evaluate(VALVES)
    positions = regression.positions(VALVES)
    for cost, position, residual in zip(found.cost, positions, regression.residuals(positions), strict=True):
        design, target = full_design(regression, position)
        weights = np.linalg.lstsq(design, target, rcond=None)[0]
        left = target - design @ weights
        assert cost == pytest.approx(target.size * np.log(np.mean(left**2)), rel=1e-6)
        np.testing.assert_allclose(residual, left, atol=1e-5)


def test_the_gain_over_its_error_is_that_of_least_squares():
    regression = build_regression(*record(), 1, 38.0)
    position = regression.positions(VALVES[:1])[0]
    design, target = full_design(regression, position, op_lags=0)
    weights = np.linalg.lstsq(design, target, rcond=None)[0]
    lags = np.zeros(weights.size)
    lags[-len(regression.edges) + 1 :] = np.diff(regression.edges)
    variance = np.mean((target - design @ weights) ** 2) * lags @ np.linalg.inv(design.T @ design) @ lags
    gains = process_gains(regression, position)
    assert gains["stem"] == pytest.approx(lags @ weights / np.sqrt(variance), rel=1e-4)
    assert gains["stem"] > 5.0


def test_a_position_that_rests_has_no_gain():
    regression = build_regression(*record(), 1, 38.0)
    assert process_gains(regression, np.full(600, 50.0)) == {"stem": 0.0, "stem_beside_op": 0.0}


def test_the_positions_are_those_of_the_valve_models():
    op, pv = record()
    regression = build_regression(op, pv, 1, 38.0)
    kano = st.stroke(st.Kano(3.0, 1.2), op, dt=1.0, mv_start=op[0]).mv
    stenman = st.stroke(st.Stenman(2.0), op, dt=1.0, mv_start=op[0] + 0.6).mv
    np.testing.assert_allclose(regression.positions(VALVES)[:2], [kano, stenman], atol=1e-9)


def test_the_units_of_pv_and_op_do_not_matter():
    op, pv = record()
    plain = build_regression(op, pv, 1, 38.0).evaluate(VALVES).cost
    other = build_regression(10.0 * op - 7.0, 4.0 - 0.3 * pv, 1, 38.0).evaluate(VALVES * [10.0, 1.0, 1.0, 1.0]).cost
    np.testing.assert_allclose(other, plain, rtol=1e-6)


def test_the_true_valve_costs_least():
    regression = build_regression(*record(), 1, 38.0)
    cost = regression.evaluate(VALVES).cost
    assert cost[0] < min(cost[1:]) - 100.0


def test_a_resting_valve_costs_as_much_as_none():
    regression = build_regression(*record(), 1, 38.0)
    still = regression.cost_of_positions(np.full((1, regression.pv.size), 50.0))[0]
    n = regression.n_predicted
    assert still == pytest.approx(n * np.log(float(regression.target @ regression.target) / n))


def test_rows_that_depend_on_others_are_left_out_of_the_basis():
    rows = np.random.default_rng(0).normal(size=(4, 50))
    rows = np.vstack([rows, rows[0] - 2.0 * rows[3]])
    basis, weights = orthonormal_rows(rows)
    assert basis.shape == (4, 50)
    np.testing.assert_allclose(weights.T @ rows, basis, atol=1e-12)
    np.testing.assert_allclose(basis @ basis.T, np.eye(4), atol=1e-12)


def test_a_gap_leaves_out_the_samples_that_have_it_among_their_earlier_pv():
    op, pv = record()
    gaps = np.zeros(600, dtype=bool)
    gaps[300:312] = True
    filled = np.where(gaps, 1e3, pv)
    regression = build_regression(op, filled, 1, 36.0, gaps=gaps)
    position = st.stroke(st.Kano(3.0, 1.2), op, dt=1.0).mv
    design, target = full_design(regression, position)
    kept = [k - regression.first for k in range(regression.first, 600) if not 300 <= k < 312 + 12]
    weights, *_ = np.linalg.lstsq(design[kept], target[kept], rcond=None)
    error = np.sum((target[kept] - design[kept] @ weights) ** 2)
    assert regression.n_predicted == len(kept)
    cost = regression.cost_of_positions(position[np.newaxis])[0]
    assert cost == pytest.approx(len(kept) * np.log(error / len(kept)), rel=1e-6)


def test_gaps_hardly_change_what_is_identified():
    op, pv = record(n=2400, seed=3)
    gaps = np.zeros(2400, dtype=bool)
    for first in (500, 1100, 1900):
        gaps[first : first + 15] = True
    holes = [np.where(gaps, np.nan, x) for x in (op, pv)]
    whole, torn = (st.diagnose(st.LoopRecord("FIC-1", 1.0, op=x, pv=y)) for x, y in ((op, pv), holes))
    assert (torn.quality.first, torn.quality.last) == (0, 2400)
    assert whole.identification.S_low < 3.0 < whole.identification.S_high
    assert pytest.approx(whole.identification.S, rel=0.1) == torn.identification.S
