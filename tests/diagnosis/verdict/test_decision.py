"""The call with the smallest expected cost."""

from __future__ import annotations

import math

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.verdict.decision import Costs, decide

pytestmark = pytest.mark.quick


@pytest.mark.parametrize(
    ("probability", "costs", "call"),
    [
        (0.69, Costs(), "undecided"),
        (0.71, Costs(), "stiction"),
        (0.31, Costs(), "undecided"),
        (0.29, Costs(), "no_stiction"),
        (0.5, Costs(ask=0.5), "stiction"),
        (0.30, Costs(missed=0.1), "no_stiction"),
        (0.05, Costs(missed=10.0), "undecided"),
        (0.81, Costs(false_alarm=5.0), "undecided"),
        (0.97, Costs(false_alarm=5.0), "stiction"),
        (0.0, Costs(ask=0.0), "no_stiction"),
        (1.0, Costs(ask=0.0), "stiction"),
        (0.5, Costs(ask=0.0), "undecided"),
    ],
)
def test_calls(probability, costs, call):
    assert decide(probability, costs) == call


def test_no_valve_is_good_whose_stiction_would_not_have_shown():
    assert decide(0.05, excluded=False) == "undecided"
    assert decide(0.95, excluded=False) == "stiction"


def test_no_other_call_costs_less():
    rng = np.random.default_rng(0)
    for _ in range(300):
        p, costs = rng.random(), Costs(*rng.uniform(0.0, 2.0, 3))
        expected = {
            "stiction": (1.0 - p) * costs.false_alarm, "no_stiction": p * costs.missed, "undecided": costs.ask,
        }  # fmt: skip
        assert expected[decide(p, costs)] == pytest.approx(min(expected.values()))


@pytest.mark.parametrize("name", ["false_alarm", "missed", "ask"])
@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_costs_out_of_range_are_errors(name, value):
    with pytest.raises(st.ParameterError, match=name):
        Costs(**{name: value})
