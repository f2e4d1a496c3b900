"""Which valve model a record supports."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.compare_models import ModelComparison, ModelShare

TRUTHS = {
    "kano": st.Kano(3.0, 1.0),
    "stenman": st.Stenman(2.0),
    "three_parameter": st.Srinivasan(2.0, 1.0, 0.05),
    "good": st.Ideal(),
}


def record_of(valve, noise=0.1):
    sp = np.repeat(np.random.default_rng(0).uniform(7.0, 13.0, 40), 35)
    loop = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=noise)
    return replace(st.simulate(loop, sp, 1400.0, seed=3), mv=None)


@cache
def compared(model):
    return st.compare_models(record_of(TRUTHS[model]), period=130.0)


@pytest.mark.parametrize("model", TRUTHS)
def test_the_record_supports_the_model_that_made_it(model):
    found = compared(model)
    assert (found.best, found.decided) == (model, True), found.summary()
    assert found.compared == "pv"
    shares = {one.model: one for one in found.models}
    # A model that contains another explains as much, but for its penalty.
    for name in ("kano", "stenman"):
        penalty = (shares["three_parameter"].free - shares[name].free) * np.log(found.samples)
        assert shares["three_parameter"].bic <= shares[name].bic + penalty + 1e-6
    assert json.loads(json.dumps(found.to_dict()))["best"] == model


def test_the_parameters_are_those_of_the_valve():
    found = {one.model: one.parameters for one in compared("kano").models}
    assert found["kano"] == pytest.approx({"S": 3.0, "J": 1.0}, rel=0.05)
    assert found["three_parameter"]["sb"] == pytest.approx(2.0, rel=0.05)
    assert found["good"] == {}


def test_a_bad_value_of_op_does_not_change_the_comparison():
    record = record_of(st.Kano(3.0, 1.0), noise=0.0)
    op = record.op.copy()
    op[1000] = 9999.0
    found = st.compare_models(replace(record, op=op), period=130.0)
    assert (found.best, found.decided) == ("kano", True), found.summary()


def test_a_recorded_position_is_compared_itself():
    record = record_of(st.Stenman(2.0))
    position = st.stroke(st.Stenman(2.0), record.op, dt=1.0).mv
    noise = 0.02 * np.random.default_rng(0).normal(size=position.size)
    found = st.compare_models(replace(record, mv=4.0 + 0.16 * (position + noise)), period=130.0)
    assert (found.best, found.compared) == ("stenman", "mv")


def comparison(**bics):
    free = {"good": 0, "stenman": 1, "kano": 2, "three_parameter": 3}
    shares = [ModelShare(name, free[name], {}, 90.0, bic) for name, bic in bics.items()]
    return ModelComparison(tuple(sorted(shares, key=lambda one: one.bic)), 20.0, "pv", 6.0)


@pytest.mark.parametrize(
    ("bics", "best", "decided"),
    [
        ((90.0, 80.0, 10.0, 13.0), "kano", True),
        ((90.0, 10.0, 80.0, 5.0), "stenman", True),
        ((90.0, 12.0, 10.0, 15.0), "stenman", False),
        ((90.0, 30.0, 20.0, 10.0), "three_parameter", True),
        ((12.0, 11.0, 10.0, 15.0), "good", False),
        ((10.0, 11.0, 12.0, 15.0), "good", True),
    ],
)
def test_the_simplest_model_that_is_enough_is_named(bics, best, decided):
    found = comparison(**dict(zip(("good", "stenman", "kano", "three_parameter"), bics, strict=True)))
    assert (found.best, found.decided) == (best, decided)
    assert ("does not decide" in found.summary()) is not decided
