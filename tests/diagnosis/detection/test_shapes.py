"""The shape methods against closed forms: one half period of each canonical shape (table C.2 of the sources, derived).

Closed forms used, for a half period of unit length and y(t) of unit height:

- square: least-squares sine leaves 1 - 8/pi^2, least-squares triangle 1/4;
- exponential rise 1 - exp(-t/tau): its best triangle has the apex at the end, leaving int y^2 - 3 (int t y)^2;
- triangle with the apex at p: R = p / (1 - p).
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from stiction.diagnosis.detection.haegglund_shape import square_indices
from stiction.diagnosis.detection.he_curve_fit import stiction_indices
from stiction.diagnosis.detection.rossi_scali import relay_indices
from stiction.diagnosis.detection.shapes import relay_misfit, relay_shapes, sine_misfit, triangle_misfit
from stiction.diagnosis.detection.singhal_salsbury import area_ratios

pytestmark = pytest.mark.quick

M = 2001
T = (np.arange(M) + 0.5) / M
TAU = 0.3
SHAPES = {
    "half sine": np.sin(np.pi * T),
    "triangle": 1.0 - np.abs(2.0 * T - 1.0),
    "late triangle": np.where(T < 0.8, T / 0.8, (1.0 - T) / 0.2),
    "square": np.ones(M),
    "exponential": 1.0 - np.exp(-T / TAU),
}
WHOLE = np.array([[0, M]])


def _exponential_si() -> float:
    e1, e2 = math.exp(-1 / TAU), math.exp(-2 / TAU)
    power = 1 - 2 * TAU * (1 - e1) + TAU / 2 * (1 - e2)
    moment = 0.5 - (TAU**2 - TAU * e1 - TAU**2 * e1)
    # int exp(-t/tau) sin(pi t) dt over 0..1
    by_sine = 2 / math.pi - math.pi * (1 + e1) / (1 / TAU**2 + math.pi**2)
    sine, triangle = power - 2 * by_sine**2, power - 3 * moment**2
    return sine / (sine + triangle)


HE = {
    "half sine": 0.0,
    "triangle": 1.0,
    "late triangle": 1.0,
    "square": (1 - 8 / math.pi**2) / (1 - 8 / math.pi**2 + 0.25),
    "exponential": _exponential_si(),
}
HAEGGLUND = {"half sine": -1.0, "triangle": -0.884, "late triangle": -0.188, "square": 1.0, "exponential": 0.286}
SINGHAL = {"half sine": 1.0, "triangle": 1.0, "late triangle": 4.0}


@pytest.mark.parametrize("shape", HE)
def test_he_index(shape):
    assert stiction_indices(SHAPES[shape], WHOLE)[0] == pytest.approx(HE[shape], abs=2e-3)


def test_he_index_of_an_exponential_agrees_with_the_table():
    """The table's 0.761 comes from an apex kept 1 % off the ends; free to the last sample it is 0.768."""
    assert _exponential_si() == pytest.approx(0.761, abs=0.01)


@pytest.mark.parametrize("shape", HAEGGLUND)
def test_haegglund_index(shape):
    assert square_indices(SHAPES[shape], WHOLE)[0] == pytest.approx(HAEGGLUND[shape], abs=1.5e-3)


@pytest.mark.parametrize("shape", SINGHAL)
def test_singhal_ratio(shape):
    assert area_ratios(SHAPES[shape], WHOLE)[0] == pytest.approx(SINGHAL[shape], rel=3e-3)


def test_rossi_index_runs_from_sine_to_relay():
    assert relay_indices(SHAPES["half sine"], WHOLE)[0] == pytest.approx(-1.0, abs=1e-3)
    assert relay_indices(SHAPES["triangle"], WHOLE)[0] == pytest.approx(1.0, abs=1e-3)
    assert relay_indices(SHAPES["square"], WHOLE)[0] > 0.9


@pytest.mark.parametrize("tau", [0.05, 0.2, 1.0])
def test_relay_shape_is_the_steady_response_of_a_lag(tau):
    """A first-order lag driven by a square wave until it repeats, integrated step by step, fits the closed form."""
    half, x, trace = 2000, 0.0, []
    for k in range(40 * half):
        drive = 1.0 if (k // half) % 2 == 0 else -1.0
        x += (drive - x) / half / tau
        trace.append(x)
    y = np.array(trace[20 * half :])
    ups = np.flatnonzero((y[:-1] <= 0) & (y[1:] > 0)) + 1
    start, stop = int(ups[3]), int(ups[3]) + half
    power = float(y[start:stop] @ y[start:stop])
    shapes = np.empty((12, half + 1))
    relay_shapes(half, shapes)
    assert relay_misfit(y, start, stop, shapes) < 2e-3 * power < sine_misfit(y, start, stop)


@pytest.mark.parametrize("m", [4, 7, 30])
def test_triangle_misfit_is_the_least_over_all_apexes(m):
    """Against a slow search over a fine grid of apexes, on random half periods."""
    rng = np.random.default_rng(m)
    t = np.arange(m) + 0.5
    for _ in range(20):
        y = np.sin(np.pi * t / m) + 0.4 * rng.standard_normal(m)
        slow = np.inf
        for apex in np.linspace(0.5, m - 0.5, 4001):
            shape = np.where(t <= apex, t / apex, (m - t) / (m - apex))
            slow = min(slow, float(((y - (shape @ y) / (shape @ shape) * shape) ** 2).sum()))
        assert triangle_misfit(y, 0, m) == pytest.approx(slow, rel=1e-3, abs=1e-9)
        assert triangle_misfit(y, 0, m) <= slow + 1e-9


def test_noise_has_no_preferred_shape_in_short_half_periods():
    """Over the degrees of freedom a short half period of noise is as near a triangle as a sine on average."""
    rng = np.random.default_rng(0)
    y = np.sin(np.pi * (np.arange(8) + 0.5) / 8) + 0.3 * rng.standard_normal((4000, 8))
    cuts = np.arange(4000)[:, None] * 8 + np.array([[0, 8]])
    assert np.median(stiction_indices(y.ravel(), cuts)) == pytest.approx(0.5, abs=0.05)
