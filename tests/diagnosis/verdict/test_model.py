"""The model: a sum of trees, computed by hand, and the stored one by its promises."""

from __future__ import annotations

import math

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.verdict.features import FEATURES
from stiction.diagnosis.verdict.model import TreeModel, TreeNode, stiction_model

TWO_TREES = TreeModel(
    intercept=-1.0,
    training_prior=0.25,
    features=("a", "b"),
    trees=(
        (TreeNode(0.1, "a", 2.0, True, 1, 2), TreeNode(-0.5), TreeNode(0.4, "b", 0.0, False, 3, 4), TreeNode(0.2),
         TreeNode(0.9)),
        (TreeNode(-0.1, "b", 1.0, False, 1, 2), TreeNode(-0.3), TreeNode(0.6)),
    ),
    provenance={},
)  # fmt: skip


@pytest.mark.parametrize(
    ("a", "b", "from_a", "from_b"),
    [
        (1.0, 0.5, -0.5 - 0.1, -0.3 + 0.1),
        (2.0, 3.0, -0.5 - 0.1, 0.6 + 0.1),
        (3.0, 0.0, 0.4 - 0.1, (0.2 - 0.4) + (-0.3 + 0.1)),
        (3.0, 5.0, 0.4 - 0.1, (0.9 - 0.4) + (0.6 + 0.1)),
        (math.nan, 5.0, -0.5 - 0.1, 0.6 + 0.1),
        (3.0, math.nan, 0.4 - 0.1, (0.9 - 0.4) + (0.6 + 0.1)),
    ],
)
def test_contributions_and_probability(a, b, from_a, from_b):
    parts = {one.feature: one.log_odds for one in TWO_TREES.contributions({"a": a, "b": b})}
    assert parts == pytest.approx({"a": from_a, "b": from_b})
    expected = 1.0 / (1.0 + math.exp(1.0 - from_a - from_b))
    assert TWO_TREES.probability({"a": a, "b": b}) == pytest.approx(expected, rel=1e-12)


def test_the_strongest_contribution_comes_first():
    assert [one.feature for one in TWO_TREES.contributions({"a": 3.0, "b": 5.0})] == ["b", "a"]


def test_an_absent_feature_is_missing():
    assert TWO_TREES.probability({"b": 5.0}) == TWO_TREES.probability({"a": math.nan, "b": 5.0})


@pytest.mark.parametrize("prior", [0.01, 0.1, 0.25, 0.6, 0.99])
def test_prior_by_bayes_rule(prior):
    features = {"a": 3.0, "b": 5.0}
    trained = TWO_TREES.probability(features, 0.25)
    sticky, good = trained / 0.25 * prior, (1.0 - trained) / 0.75 * (1.0 - prior)
    assert TWO_TREES.probability(features, prior) == pytest.approx(sticky / (sticky + good), rel=1e-12)


@pytest.mark.parametrize("prior", [0.0, 1.0, -0.1, 1.5, math.nan])
def test_a_prior_out_of_range_is_an_error(prior):
    with pytest.raises(st.ParameterError, match="above 0 and below 1"):
        TWO_TREES.probability({}, prior)


def draw_features(rng):
    values = {feature.name: rng.normal(0.0, 3.0) for feature in FEATURES}
    return {name: math.nan if rng.random() < 0.15 else value for name, value in values.items()}


@pytest.mark.parametrize("feature", FEATURES, ids=lambda one: one.name)
def test_the_stored_model_is_monotone(feature):
    model, rng = stiction_model(), np.random.default_rng(len(feature.name))
    for _ in range(60):
        features = draw_features(rng)
        grid = [model.probability({**features, feature.name: x}) for x in np.linspace(-6.0, 6.0, 9)]
        assert (feature.sign * np.diff(grid) >= -1e-12).all()


def test_contributions_of_the_stored_model_add_up():
    model, rng = stiction_model(), np.random.default_rng(3)
    assert set(model.features) == {feature.name for feature in FEATURES}
    for _ in range(20):
        features = draw_features(rng)
        score = model.intercept + sum(one.log_odds for one in model.contributions(features))
        assert model.probability(features, model.training_prior) == pytest.approx(1.0 / (1.0 + math.exp(-score)))


def test_the_stored_model_knows_a_clear_case():
    clear = dict.fromkeys((feature.name for feature in FEATURES), 4.0)
    clear |= {"tuning": 0.0, "kept_share": 0.9, "band_to_swing": 0.7, "jump_ratio_integrating": 0.6, "fit_gain": 2.0}
    clear["position"] = math.nan
    against = {
        **dict.fromkeys(clear, -2.0),
        "tuning": 3.0,
        "kept_share": -1.0,
        "band_to_swing": 0.05,
        "jump_ratio_integrating": 0.0,
    }
    assert stiction_model().probability(clear) > 0.9
    assert stiction_model().probability(against) < 0.1


def test_a_contribution_is_ready_for_json():
    [first, _] = TWO_TREES.contributions({"b": 5.0})
    assert first.to_dict() == {"feature": "b", "value": 5.0, "log_odds": pytest.approx(0.7)}
    assert TWO_TREES.contributions({"b": 5.0})[1].to_dict()["value"] is None
