"""Valves tried once, and stems side by side: the same numbers as one after the other."""

import numpy as np
import pytest

from stiction.diagnosis.identification import tried_once
from stiction.diagnosis.identification.likelihood import Prediction, errors_of, stem_of, trials_of, valves
from stiction.diagnosis.identification.likelihood import Trial as Valve
from stiction.diagnosis.identification.parts import lean
from stiction.diagnosis.identification.tried_once import NOTHING, tried_too

N, BEGIN = 240, 30


@pytest.fixture
def prediction():
    rng = np.random.default_rng(4)
    op = 50.0 + 3.0 * np.sin(np.arange(N) / 5.0) + rng.normal(0.0, 0.2, N)
    pv = np.convolve(op, 0.2 * 0.8 ** np.arange(30))[:N] + rng.normal(0.0, 0.1, N)
    scaled = ((x - x.mean()) / x.std() for x in (pv, op))
    edges, ends = np.array([1, 2, 3, 4, 6, 9]), np.array([N // 2, N])
    return Prediction(op, 1, *scaled, edges, BEGIN, ends)


def test_a_valve_that_comes_again_costs_what_it_did(prediction, monkeypatch):
    asked = []
    monkeypatch.setattr(tried_once, "trials_of", lambda of, valve: asked.append(len(valve)) or trials_of(of, valve))
    first, more = valves([1.0, 2.0], [0.2, 0.8], 0.0, 0.0, 9.0), valves([2.0, 3.0], [0.8, 0.2], 0.0, 0.0, 9.0)
    tried = tried_too(prediction, NOTHING, np.concatenate([first, first[1:2]]))
    tried = tried_too(prediction, tried, more)
    assert asked == [4, 2]
    every = np.concatenate([first, first[1:2], more])
    assert np.array_equal(tried.valve, every)
    assert tried.cost == pytest.approx(trials_of(prediction, every).cost, rel=1e-9)


@pytest.mark.parametrize("count", [1, 7, 33])
def test_stems_side_by_side_leave_what_they_leave_one_by_one(prediction, count):
    short = lean(prediction)
    S = np.linspace(0.5, 3.0, count)
    valve = np.concatenate([valves(S, 0.4, 0.0, 0.0, 9.0), valves(S, 0.4, 1.0, 0.3, 9.0)])
    stems = np.stack([stem_of(short, Valve(*row)) for row in valve.tolist()])
    left = errors_of(short, stems)[0]
    assert trials_of(short, valve).cost == pytest.approx(short.samples * np.log(left / short.samples), rel=1e-9)
