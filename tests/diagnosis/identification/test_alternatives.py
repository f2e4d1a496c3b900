"""Explanations without stiction: each has the smallest cost where it is the truth."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.alternatives import ALTERNATIVES, alternative_costs
from stiction.diagnosis.identification.identify import search_record
from stiction.diagnosis.identification.regression import build_regression

N = 2000


def closed_loop(flow, *, load=None, seed=0, noise=0.05, Kc=0.3, Ti=12.0):
    """OP and PV of a PI loop about a process of 8 s lag and 4 s dead time; `flow` gives the valve's flow of OP."""
    rng = np.random.default_rng(seed)
    op, pv, state, integral = np.full(N, 50.0), np.zeros(N), 0.0, 50.0
    sp = np.repeat(rng.uniform(-3.0, 3.0, N // 40), 40)
    for k in range(1, N):
        through = flow(op[max(k - 5, 0)]) + (0.0 if load is None else load(k, pv))
        state += (1.5 * through - state) / 8.0
        pv[k] = state + noise * rng.normal()
        integral += Kc / Ti * (sp[k] - pv[k])
        op[k] = integral + Kc * (sp[k] - pv[k])
    return op, pv


def square_wave(k, pv):
    """A load that is the same in every period."""
    del pv
    return 4.0 * np.sign(np.sin(2.0 * np.pi * k / 61.3))


def pump():
    """A load that switches where the PV comes to a level."""
    on = [False]

    def load(k, pv):
        on[0] = pv[k - 1] < 2.0 if on[0] else pv[k - 1] < -2.0
        return 4.0 if on[0] else -4.0

    return load


TRUTHS = {
    "good": {"flow": lambda u: u - 50.0},
    "dead_zone": {"flow": lambda u: np.sign(u - 50.0) * max(abs(u - 50.0) - 1.0, 0.0)},
    "relay_load": {"flow": lambda u: u - 50.0, "load": pump()},
    "periodic_load": {"flow": lambda u: u - 50.0, "load": square_wave},
}


def costs_of(kind):
    op, pv = closed_loop(**TRUTHS[kind])
    regression = build_regression(op, pv, 1, 61.3)
    sticky = search_record(op, pv, 61.3).candidates
    costs, *_ = alternative_costs(regression, 61.3, regression.positions(np.array([sticky.best]))[0])
    return costs, float(sticky.cost.min())


@pytest.mark.parametrize("kind", [kind for kind in TRUTHS if kind != "good"])
def test_each_explanation_beats_a_good_valve_where_it_is_the_truth(kind):
    costs, sticky = costs_of(kind)
    assert costs[kind] < costs["good"] - 20.0
    assert costs[kind] < sticky


def test_a_good_valve_is_not_much_worse_than_any_other_explanation():
    costs, sticky = costs_of("good")
    assert set(costs) == set(ALTERNATIVES)
    assert costs["good"] < min(costs.values()) + 15.0
    assert costs["good"] < sticky + 15.0


def test_a_sticky_valve_beats_every_explanation_without_stiction():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(4.0, 2.0), st.FOPDT(2.0, 10.0, 5.0), dt=1.0, noise=0.1)
    sp = np.repeat(np.random.default_rng(0).uniform(7.0, 13.0, 50), 40)
    run = st.simulate(loop, sp, 2000.0, seed=1)
    ratios = search_record(run.op, run.pv, None).likelihood_ratios
    assert "periodic_load" not in ratios
    assert min(ratios.values()) > 30.0, ratios


def test_only_a_sticky_valve_has_a_gain_beside_op():
    op, pv = closed_loop(flow=lambda u: u - 50.0, load=square_wave)
    good = search_record(op, pv, 61.3).gains
    loop = st.Loop(st.PID(0.3, 12.0), st.Kano(4.0, 2.0), st.FOPDT(1.5, 8.0, 4.0), dt=1.0, noise=0.05)
    sp = np.repeat(np.random.default_rng(0).uniform(-3.0, 3.0, 50), 40)
    run = st.simulate(loop, sp, 2000.0, seed=1)
    sticky = search_record(run.op, run.pv, None).gains
    assert good["stem_beside_op"] < 3.0 < sticky["stem_beside_op"]
    assert sticky["stem"] > 5.0
