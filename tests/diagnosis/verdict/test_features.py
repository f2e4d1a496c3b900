"""Each feature by its formula, on results that are given."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest

from stiction.diagnosis.identification.result import ProcessFit
from stiction.diagnosis.verdict.features import FEATURES, FeatureInput, compute_features, sensitivity

from .results import RATIOS, make_controller, make_identification, make_oscillation

GIVEN = FeatureInput(make_identification(), make_controller(), make_oscillation(), 8.0, 0.02, 500.0)


def log_of(x):
    """asinh(x / 20) as a logarithm."""
    return math.log(x / 20.0 + math.sqrt((x / 20.0) ** 2 + 1.0))


EXPECTED = {
    "over_dead_zone": log_of(250.0),
    "over_closest": log_of(80.0),
    "kept_share": 80.0 / 300.0,
    "over_periodic_load": log_of(120.0),
    "beside_periodic_load": log_of(60.0),
    "over_deadband": log_of(40.0),
    "band_to_swing": 4.0 / 8.0,
    "stem_gain": math.asinh(9.0),
    "stem_gain_beside_op": math.asinh(4.0),
    "fit_gain": math.log(40.0 / 10.0),
    "position": log_of(500.0),
}
OF_INTEGRATING = ("over_deadband_integrating", "jump_ratio_integrating")


@pytest.mark.parametrize("name", EXPECTED)
def test_each_formula(name):
    assert compute_features(GIVEN)[name] == pytest.approx(EXPECTED[name], rel=1e-12)


def test_every_feature_is_tested_and_has_a_sign():
    assert {feature.name for feature in FEATURES} == {*EXPECTED, *OF_INTEGRATING, "tuning"}
    assert len(FEATURES) <= 15
    assert {feature.sign for feature in FEATURES} == {-1, 1}


def test_missing_results_are_nan():
    valve = make_identification(likelihood_ratios={"good": math.nan}, segments=(), S_low=0.0)
    unknown = make_controller(form="unknown", action=0.0)
    found = compute_features(FeatureInput(valve, unknown, make_oscillation(oscillating=False), 0.0, 0.0))
    defined = {name for name, value in found.items() if math.isfinite(value)}
    assert defined == {"fit_gain"}


def test_a_load_without_a_period_counts_as_a_good_valve():
    ratios = {name: RATIOS[name] for name in RATIOS if "periodic" not in name}
    found = compute_features(FeatureInput(make_identification(likelihood_ratios=ratios), *_rest()))
    assert found["over_periodic_load"] == found["beside_periodic_load"] == log_of(RATIOS["good"])


def test_features_of_the_slip_jump_belong_to_one_kind_of_process():
    plain = compute_features(GIVEN)
    valve = make_identification(process=replace(make_identification().process, integrating=True))
    integrating = compute_features(FeatureInput(valve, *_rest()))
    assert integrating["jump_ratio_integrating"] == 0.25
    assert integrating["over_deadband_integrating"] == plain["over_deadband"]
    assert math.isnan(integrating["over_deadband"])
    assert all(math.isnan(plain[name]) for name in OF_INTEGRATING)


def test_a_gain_against_the_action_of_the_controller_speaks_against_the_valve():
    reverse = replace(make_controller(), action=-1.0)
    found = compute_features(FeatureInput(make_identification(), reverse, *_rest()[1:]))
    assert found["stem_gain"] == pytest.approx(-math.asinh(9.0))


def test_ratios_are_limited():
    found = compute_features(FeatureInput(make_identification(S=99.0, fit=100.0), *_rest()))
    assert found["band_to_swing"] == 1.5
    assert found["fit_gain"] == pytest.approx(math.log(40.0))


@pytest.mark.parametrize(("closest", "good", "share"), [(-90.0, 300.0, -0.3), (-900.0, 300.0, -1.0), (5.0, 10.0, 0.25)])
def test_share_of_the_evidence_that_is_kept(closest, good, share):
    ratios = {"good": good, "relay_load": closest, "periodic_load": 200.0}
    found = compute_features(FeatureInput(make_identification(likelihood_ratios=ratios), *_rest()))
    assert found["kept_share"] == pytest.approx(share)
    assert found["over_closest"] == pytest.approx(math.asinh(closest / 20.0))


def _rest():
    return make_controller(), make_oscillation(), 8.0, 0.02


@pytest.mark.parametrize("period", [30.0, 60.0, 400.0])
def test_sensitivity_of_a_lag_with_dead_time(period):
    s = 2j * math.pi / period
    loop = 0.3 * (1.0 + 1.0 / (12.0 * s)) * 2.0 * cmath.exp(-3.0 * s) / (10.0 * s + 1.0)
    found = sensitivity(make_identification(), make_controller(), period)
    assert found == pytest.approx(1.0 / abs(1.0 + loop), rel=1e-12)
    expected = math.log(found)
    features = compute_features(
        FeatureInput(make_identification(), make_controller(), make_oscillation(period=period), 8.0, 0.0)
    )
    assert features["tuning"] == pytest.approx(expected)


def test_sensitivity_of_two_lags_and_derivative_action():
    s = 2j * math.pi / 50.0
    process = ProcessFit(-1.5, 14.0, 2.0, False, lag=4.0)
    loop = -0.4 * (1.0 + 1.0 / (20.0 * s) + 3.0 * s) * -1.5 * cmath.exp(-2.0 * s) / ((10.0 * s + 1.0) * (4.0 * s + 1.0))
    controller = make_controller(-0.4, 20.0, Td=3.0, form="PID")
    found = sensitivity(make_identification(process=process), controller, 50.0)
    assert found == pytest.approx(1.0 / abs(1.0 + loop), rel=1e-12)


def test_sensitivity_at_the_limit_of_stability():
    """An integrator with dead time L oscillates under P control at Kc = pi / (2 k L), with the period 4 L."""
    process = ProcessFit(0.05, 0.0, 5.0, True)
    limit = make_controller(math.pi / (2.0 * 0.05 * 5.0), math.inf, Ki=0.0, form="P")
    assert sensitivity(make_identification(process=process), limit, 20.0) > 1e5
    half = replace(limit, Kc=0.5 * limit.Kc)
    assert sensitivity(make_identification(process=process), half, 20.0) == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize(
    ("controller", "period"),
    [(make_controller(form="unknown"), 60.0), (make_controller(), math.nan), (make_controller(Ki=math.nan), 60.0)],
)
def test_sensitivity_is_unknown(controller, period):
    assert np.isnan(sensitivity(make_identification(), controller, period))
