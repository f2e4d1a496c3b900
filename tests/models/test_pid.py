"""The controller against its slow twin and against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs
from tests import naive

import stiction as st
from stiction.models.controllers.pid import pid_at_rest, pid_step

pytestmark = pytest.mark.quick


def drive(controller, sp, pv, dt, manual=None):
    """The controller alone, over given set points and PVs."""
    p = controller.pack(dt)
    state, op = pid_at_rest(0.0, 0.0, p), []
    hand = np.full(len(sp), np.nan) if manual is None else manual
    for r, y, u in zip(sp, pv, hand, strict=True):
        state = pid_step(float(r), float(y), state, float(u), p)
        op.append(state.op)
    return np.array(op)


@settings(max_examples=60)
@given(
    Kc=hs.sampled_from([-2.0, 0.5, 1.0]),
    Ti=hs.sampled_from([2.0, 10.0, math.inf]),
    Td=hs.sampled_from([0.0, 1.5]),
    N=hs.sampled_from([4.0, math.inf]),
    b=hs.sampled_from([0.0, 1.0]),
    c=hs.sampled_from([0.0, 1.0]),
    limit=hs.sampled_from([2.0, math.inf]),
    integral=hs.sampled_from(["backward", "forward"]),
    seed=hs.integers(0, 10),
)
def test_controller_is_its_slow_twin(Kc, Ti, Td, N, b, c, limit, integral, seed):
    rng = np.random.default_rng(seed)
    sp, pv = rng.normal(0.0, 2.0, 60), rng.normal(0.0, 2.0, 60)
    controller = st.PID(Kc, Ti, Td, N, b, c, op_limits=(-limit, limit), integral=integral)
    twin = naive.pid(sp, pv, 0.5, Kc, Ti, Td, N, b, c, -limit, limit, integral)
    np.testing.assert_allclose(drive(controller, sp, pv, 0.5), twin, rtol=0.0, atol=1e-11)


def test_step_of_a_PI_controller():
    """e = 1 held: u(k) = Kc (1 + (k + 1) dt / Ti), one sample less with the forward rule."""
    k, one, zero = np.arange(50), np.ones(50), np.zeros(50)
    np.testing.assert_allclose(drive(st.PID(2.0, 8.0), one, zero, 0.5), 2.0 * (1.0 + (k + 1) * 0.5 / 8.0))
    np.testing.assert_allclose(drive(st.PID(2.0, 8.0, integral="forward"), one, zero, 0.5), 2.0 * (1.0 + k * 0.5 / 8.0))


def test_derivative_of_a_ramp():
    """de/dt = 1 held: the filtered derivative tends to Kc Td, the bare one is there at once."""
    e = 0.25 * np.arange(1, 401)
    derivative = drive(st.PID(2.0, math.inf, 3.0, N=5.0), e, 0.0 * e, 0.25) - 2.0 * e
    Tf = 3.0 / 5.0
    np.testing.assert_allclose(derivative, 6.0 * (1.0 - (Tf / (Tf + 0.25)) ** np.arange(1, 401)), atol=1e-9)
    np.testing.assert_allclose(drive(st.PID(2.0, math.inf, 3.0), e, 0.0 * e, 0.25) - 2.0 * e, 6.0, atol=1e-9)


def test_parallel_form_is_the_standard_form():
    one = st.PID.parallel(Kp=0.5, Ki=0.05, Kd=2.0, Tf=0.4, c=0.0)
    assert (one.Kc, one.Ti, one.Td, one.N, one.c) == (0.5, 10.0, 4.0, 10.0, 0.0)
    assert (one.Ki, one.Kd) == (0.05, 2.0)
    assert one.Tf == pytest.approx(0.4)


def test_transfer_function_is_the_sampled_controller_s_limit():
    """Gain and phase of the sampled controller at dt -> 0 are those of its transfer function."""
    controller = st.PID(1.5, 8.0, 2.0, N=6.0)
    omega, dt = 0.4, 0.002
    t = np.arange(round(20.0 * 2.0 * math.pi / omega / dt)) * dt
    op = drive(controller, np.sin(omega * t), 0.0 * t, dt)
    last = slice(-round(2.0 * math.pi / omega / dt), None)
    basis = np.stack([np.sin(omega * t[last]), np.cos(omega * t[last]), np.ones(t[last].size)], axis=1)
    a, b, _ = np.linalg.lstsq(basis, op[last], rcond=None)[0]
    num, den = controller.transfer_function()
    expected = np.polyval(num, 1j * omega) / np.polyval(den, 1j * omega)
    assert complex(a, b) == pytest.approx(complex(expected), rel=2e-3)


def test_limits_hold_the_output_and_the_integral():
    one, zero = np.ones(200), np.zeros(200)
    guarded = st.PID(1.0, 5.0, op_limits=(-2.0, 2.0))
    wound = st.PID(1.0, 5.0, op_limits=(-2.0, 2.0), anti_windup=False)
    error = np.concatenate([one, -one])
    there, late = (drive(c, error, np.concatenate([zero, zero]), 1.0) for c in (guarded, wound))
    assert there.max() == late.max() == 2.0
    assert there[200] < 2.0, "a guarded controller leaves its limit with the first error of the other sign"
    assert np.flatnonzero(late[200:] < 2.0)[0] > 100


@pytest.mark.parametrize(
    "controller", [st.PID(2.0, 8.0), st.PID(2.0, 8.0, 3.0, N=5.0), st.PID(-1.0, 20.0, b=0.3, integral="forward")]
)
def test_manual_to_automatic_is_bumpless(controller):
    """Back in automatic the output goes on from the hand's value, by no more than this sample's share."""
    sp, pv = np.full(60, 5.0), np.full(60, 3.0)
    hand = np.full(60, np.nan)
    hand[10:40] = 42.0
    op = drive(controller, sp, pv, 1.0, hand)
    assert set(op[10:40].tolist()) == {42.0}
    share = controller.Ki * 2.0
    assert abs(op[40] - 42.0) <= abs(share) * (1.0 + 1e-9)


def test_the_hand_is_limited_too():
    op = drive(st.PID(1.0, 5.0, op_limits=(0.0, 100.0)), [0.0] * 3, [0.0] * 3, 1.0, np.array([120.0, -5.0, 50.0]))
    assert op.tolist() == [100.0, 0.0, 50.0]


REFUSED = [
    ({"Kc": math.nan}, "Kc must be a finite number"),
    ({"Ti": 0.0}, "Ti = 0"),
    ({"Ti": math.nan}, "Ti must be a number in s, got nan"),
    ({"Td": -1.0}, "Td = -1 s is negative"),
    ({"N": -2.0}, "N = -2"),
    ({"b": math.inf}, "b must be a finite number"),
    ({"op_limits": (100.0, 0.0)}, r"op_limits = \(100, 0\) % is an empty range"),
    ({"integral": "trapezoid"}, "integral = 'trapezoid' is unknown; use 'backward' or 'forward'"),
    ({"Kc": "big"}, "Kc must be a number"),
    ({"Ti": "long"}, "Ti must be a number in s, got 'long'"),
    ({"op_limits": 5.0}, "op_limits = 5.0 is not a pair of numbers; give"),
]


@pytest.mark.parametrize(("options", "message"), REFUSED)
def test_bad_parameters_get_a_sentence(options, message):
    with pytest.raises(st.ParameterError, match=message):
        st.PID(**({"Kc": 1.0, "Ti": 10.0} | options))


@pytest.mark.parametrize("gains", [(0.0, 1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, -1.0)])
def test_parallel_gains_without_a_standard_form(gains):
    with pytest.raises(st.ParameterError, match="has no standard form"):
        st.PID.parallel(*gains)
