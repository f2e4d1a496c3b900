"""Crossings of L with -1/N: the paper's loop, python-control's cases, stability, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.reference import limitcycle as known

import stiction as st
from stiction.limitcycle import Deadband, Relay, Saturation, harmonic_balance, predict_limit_cycles
from stiction.limitcycle.linear import linear_part
from stiction.limitcycle.predict import is_stable_without_friction
from stiction.paper.fig7 import EXAMPLE_LOOP, figure7


def test_paper_loop_linear_part():
    linear = linear_part(EXAMPLE_LOOP)
    assert complex(linear.at(0.740j)) == pytest.approx(-0.2877, abs=1e-4)
    assert complex(linear.at(1.911j)) == pytest.approx(-0.0290, abs=1e-4)


@pytest.fixture(scope="module")
def paper_cycles():
    return predict_limit_cycles(EXAMPLE_LOOP)


@pytest.mark.parametrize(("family", "levels", "amplitude", "period"), known.PAPER_DF)
def test_paper_loop_has_four_stable_cycles(paper_cycles, family, levels, amplitude, period):
    (cycle,) = [c for c in paper_cycles if c.kind == "cycle" and c.family == family and len(c.levels) == levels]
    assert cycle.amplitude == pytest.approx(amplitude, abs=1e-5)
    assert cycle.period == pytest.approx(period, abs=1.1e-3)
    assert cycle.stable
    assert cycle.exact is not None
    assert cycle.exact.stable
    assert abs(cycle.period_error) < 0.01
    assert "Good" in cycle.trust


def test_b_is_a_boundary_and_no_solution(paper_cycles):
    cycles = [c for c in paper_cycles if c.family == "half"]
    assert [c.kind for c in cycles] == ["cycle", "boundary", "cycle"]
    assert cycles[1].amplitude == pytest.approx(0.75)
    assert cycles[1].stable is False
    assert len(paper_cycles) == 6


def test_printed_second_branch_is_shown_wrong():
    *_, printed = figure7().printed
    assert printed.amplitude == pytest.approx(0.987, abs=5e-4)
    assert printed.period == pytest.approx(20.7, abs=0.05)
    exact = next(c.exact for c in figure7().corrected if len(c.levels) == 4)
    assert abs(printed.period / exact.period - 1.0) > 0.25


def _pairs(found):
    return [(c.amplitude, c.omega) for c in found]


def test_a_stem_of_many_levels_is_followed():
    """The larger the gain the more levels: at 2.3 times the paper's the exact cycles of 13 to 17 are predicted."""
    controller = replace(EXAMPLE_LOOP.controller, Kc=2.3 * EXAMPLE_LOOP.controller.Kc)
    found = predict_limit_cycles(replace(EXAMPLE_LOOP, controller=controller))
    predicted = {len(c.levels): c for c in found if c.method == "describing function" and c.kind == "cycle"}
    for n in range(13, 18):
        assert len(predicted[n].exact.levels) == n
        assert predicted[n].amplitude == pytest.approx(predicted[n].exact.amplitude, rel=0.01)


def test_python_control_saturation():
    assert _pairs(harmonic_balance(st.TransferFunction([8], [1, 2, 2, 1]), Saturation(1.0))) == [
        pytest.approx((3.343999, 1.414214), abs=1e-5)
    ]


def test_python_control_backlash_with_its_pade_approximation():
    control = pytest.importorskip("control")
    num, den = control.pade(5, 4)
    system = st.TransferFunction(4.0 * np.array(num), np.polymul([1, 2, 2, 1], den))
    first, second = _pairs(harmonic_balance(system, Deadband(1.0)))
    assert first == pytest.approx((0.626016, 0.310262), abs=1e-5)
    assert second == pytest.approx((0.874192, 1.215641), abs=1e-5)


def test_real_dead_time_moves_the_crossings_that_pade_has():
    system = st.TransferFunction([4], [1, 2, 2, 1], dead_time=5.0)
    first, second = _pairs(harmonic_balance(system, Deadband(1.0)))
    assert first == pytest.approx((0.626016, 0.310262), abs=1e-5)  # slow: there the approximation is good
    assert second[1] < 1.215641 - 0.02
    for a, w in (first, second):
        n = Deadband(1.0).describing_function(np.array([a]))[0]
        s = 1j * w
        assert abs(1.0 + 4.0 * np.exp(-5.0 * s) / (s**3 + 2 * s**2 + 2 * s + 1) * n) < 1e-9


def test_python_control_relay():
    """python-control crosses polylines: its amplitude 4.00716 is good to four digits. The balance itself is exact."""
    ((a, w),) = _pairs(harmonic_balance(st.TransferFunction([8], [1, 2, 2, 1]), Relay(1.0, 0.5)))
    assert w == pytest.approx(1.327034, abs=1e-5)
    assert a == pytest.approx(4.00716, abs=2e-4)
    s = 1j * w
    n = 4.0 / (np.pi * a) * (np.sqrt(1.0 - (0.5 / a) ** 2) - 0.5j / a)
    assert abs(1.0 + 8.0 / (s**3 + 2 * s**2 + 2 * s + 1) * n) < 1e-10


def test_self_regulating_loop_with_deadband_alone_has_no_cycle():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 0.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    assert predict_limit_cycles(loop) == ()


def test_describing_function_is_not_to_be_trusted_for_a_lag_with_dead_time():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    (cycle,) = predict_limit_cycles(loop)
    assert cycle.period == pytest.approx(238.0, rel=5e-3)
    assert cycle.period_error == pytest.approx(0.43, abs=0.01)
    assert "Do not trust" in cycle.trust
    assert "43" in cycle.summary()


@pytest.mark.parametrize("valve", [st.Ideal(), st.Stenman(0.0), st.Kano(0.0, 0.0), st.He(0.0, 0.0)])
def test_no_stiction_no_cycle(valve):
    loop = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    assert predict_limit_cycles(loop) == ()


def test_unstable_loop_is_said_to_be_unstable():
    loop = st.Loop(st.PID(2.0, 10.0), st.Kano(5.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    assert not is_stable_without_friction(linear_part(loop))
    assert all("unstable even without friction" in c.warning for c in predict_limit_cycles(loop, exact=False))


@pytest.mark.parametrize(("gain", "stable"), [(0.5, True), (1.5, True), (1.65, False), (3.0, False)])
def test_nyquist_count_of_the_frictionless_loop(gain, stable):
    """Kc e^{-s} / s is stable up to pi / 2; with an integrator in the controller that lies far off, the same."""
    loop = st.Loop(st.PID(gain, 1e9), st.Ideal(), st.Integrating(1.0, dead_time=1.0), dt=0.1)
    assert is_stable_without_friction(linear_part(loop)) is stable


def test_improper_and_algebraic_loops_are_refused():
    direct = st.Loop(st.PID(2.0, 10.0, 1.0), st.Stenman(1.0), st.TransferFunction([1.0, 1.0], [5.0, 1.0], 1.0), dt=1.0)
    with pytest.raises(st.ParameterError, match="improper"):
        predict_limit_cycles(direct)
    algebraic = st.Loop(st.PID(2.0, 10.0, 1.0), st.Stenman(1.0), st.FOPDT(1.0, 5.0), dt=1.0)
    with pytest.raises(st.ParameterError, match="algebraic"):
        predict_limit_cycles(algebraic)


def test_loop_without_a_point_of_rest_is_refused():
    loop = st.Loop(st.PID(1.0, 5.0), st.Stenman(1.0), st.TransferFunction([1.0, 0.0], [1.0, 2.0, 1.0]), dt=1.0)
    with pytest.raises(st.ParameterError, match="no steady state"):
        predict_limit_cycles(loop, sp=1.0)


def test_rate_dependent_valve_balances_in_amplitude_and_frequency():
    loop = st.Loop(st.PID(0.2, 10.0), st.Srinivasan(2.0, 1.0, 0.01), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    linear = linear_part(loop)
    (cycle,) = harmonic_balance(linear, loop.valve)
    n = complex(st.describing_function(loop.valve, cycle.amplitude, cycle.omega, method="numeric"))
    assert abs(1.0 + complex(linear.at(1j * cycle.omega)) * n) < 2e-3


def test_result_is_json_ready(paper_cycles):
    import json

    text = json.dumps([c.to_dict() for c in paper_cycles])
    assert json.loads(text)[0]["family"] == "half"
    assert all(c.summary() for c in paper_cycles)


@pytest.mark.parametrize("valve", [st.Kano(3.0, 1.0), st.Stenman(3.0)])
@pytest.mark.parametrize(
    "ask",
    [
        st.predict_limit_cycles,
        lambda loop: st.predict_limit_cycles(loop, exact=False),
        st.exact_limit_cycles,
        st.basin_map,
        lambda loop: st.bifurcation(loop, "gain", [0.9, 1.0]),
    ],
)
def test_a_compensator_is_refused_not_overlooked(ask, valve):
    """The cycles without it are not those of the loop: its pulses make the stem move before the band is crossed."""
    without = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    assert st.predict_limit_cycles(without, exact=False)
    with pytest.raises(st.ParameterError, match=r"has a compensator \(Knocker\)"):
        ask(replace(without, compensator=st.Knocker(1.5, 2.0, 5.0)))


def test_stability_without_friction_is_that_of_the_roots():
    """Without dead time 1 + L = 0 is a polynomial: random processes of order 1 to 4, an integrator among them."""
    seen = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        den = np.poly(rng.normal(-0.3, 0.5, rng.integers(1, 4)))
        if seed % 2:
            den = np.polymul(den, [1.0, 0.0])
        num = rng.normal(0.0, 2.0, rng.integers(1, den.size))
        pid = st.PID(float(rng.normal()), float(np.exp(rng.normal())) if seed % 3 else np.inf)
        above, below = pid.transfer_function()
        roots = np.roots(np.polyadd(np.polymul(above, num), np.polymul(below, den)))
        if abs(num[0]) < 0.05 or np.min(np.abs(roots.real)) < 0.02:
            continue
        loop = st.Loop(pid, st.Kano(3.0, 1.0), st.TransferFunction(num, den), dt=0.1)
        assert is_stable_without_friction(linear_part(loop)) == bool((roots.real < 0.0).all()), seed
        seen.append(bool((roots.real < 0.0).all()))
    assert len(seen) > 150
    assert sum(seen) > 20


def test_stability_of_a_gain_behind_a_dead_time():
    """exp(-10 s) under a P controller: every swing is Kc times the last one."""
    for gain, stable in ((0.2, True), (1.2, False)):
        loop = st.Loop(st.PID(gain, np.inf), st.Kano(3.0, 1.0), st.TransferFunction([1.0], [1.0], 10.0), dt=1.0)
        assert is_stable_without_friction(linear_part(loop)) == stable


def test_choudhury_beyond_its_band_is_run_in_samples():
    """For J > S it contradicts its own describing function (science.md A); simulated, this loop cycles at 58.67 s."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Choudhury(3.0, 5.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    (cycle,) = predict_limit_cycles(loop)
    op = st.simulate(loop, 1.0, 8000.0).op[2000:]
    ups = np.nonzero((op[1:] > 1.0 / 3.0) & (op[:-1] <= 1.0 / 3.0))[0]
    assert cycle.method == "sampled"
    assert cycle.period == pytest.approx((ups[-1] - ups[0]) / (ups.size - 1), rel=2e-3)
    assert predict_limit_cycles(loop, exact=False) == ()


def test_what_is_not_finite_is_refused():
    with pytest.raises(st.ParameterError, match="sp must be a finite number"):
        predict_limit_cycles(EXAMPLE_LOOP, sp=np.nan)
    with pytest.raises(st.ParameterError, match="disturbance must be a finite number"):
        predict_limit_cycles(EXAMPLE_LOOP, disturbance=np.inf)
