"""The contest of valves: what its half cycles say one by one, on errors made up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.contest import Contest
from stiction.diagnosis.identification.interval import student

from .loops import KNOWN, run_of

N = 120
VALVES = np.array([[2.0, 0.5, 0.0, 0.0, 0.0], [3.0, 0.5, 0.0, 0.0, 0.0], [1e-6, 1.0, 0.0, 0.0, 0.0]])


def contest(error, beyond=0.0):
    """Valves of S = 2 % and S = 3 %, and a good one that leaves five more in each half cycle."""
    error = np.vstack([error, np.asarray(error)[0] + 5.0])
    return Contest(VALVES, error, np.zeros(3), (0.0, 0.0), (0.0, 0.0), 2.0, 0.0, beyond)


@pytest.mark.parametrize("beyond", [0.0, 0.3])
def test_draws_of_half_cycles_of_which_all_say_the_same(beyond):
    found = contest(np.array([np.full(N, 1.0), np.full(N, 1.1)]), beyond)
    assert found.bootstrap() == (2.0 + beyond, 2.0 + beyond)


def test_draws_of_half_cycles_that_do_not_agree():
    # Half say the one and half the other, so that either wins half of the draws: binomial, far from 2.5 %.
    ways = np.where(np.arange(N) % 2 == 0, 1.0, 2.0)
    assert contest(np.array([ways, 3.0 - ways])).bootstrap() == (2.0, 3.0)
    # Of 60 % for the one the other wins where fewer than half are drawn of them: beyond 2.2 standard deviations.
    ways = np.where(np.arange(N) < 0.6 * N, 1.0, 2.0)
    assert contest(np.array([ways, 3.0 - ways])).bootstrap(20_000) == (2.0, 2.0)
    assert contest(np.array([ways, 3.0 - ways])[:, ::4]).bootstrap(20_000) == (2.0, 3.0)


@pytest.mark.parametrize("name", sorted(KNOWN))
def test_no_good_valve_predicts_what_a_sticky_one_does(name):
    """Neither a straight one, nor one with a bend, nor told the past without noise, nor beside a wave from outside; and
    what turns where the PV comes to a level predicts no more, though in these loops nothing but the valve moves it."""
    found = st.identify(replace(run_of(KNOWN[name], 0.05), mv=None), period=KNOWN[name].period)
    rivals = (found.over("bent").likelier, found.over("gated").likelier, found.over("relaxation").likelier)
    assert min(*rivals, found.over("wave").likelier) == found.likelier_than_any > 0.4 * found.over("good").likelier
    assert found.over("good").likelier > 100.0
    assert found.beats_any > 2.0


def test_what_a_part_of_the_half_cycles_is_worth():
    found = contest(np.array([np.full(N, 1.0), np.full(N, 2.0)]))
    assert found.likelier_in(slice(10, 20)) == pytest.approx(10 * 5.0 / 2.0)
    assert found.likelier_than_good(3) == pytest.approx(N / 3 * 5.0 / 2.0)


def test_student_is_that_of_scipy():
    from scipy.stats import t

    degrees = [1, 2, 5, 10, 11, 15, 16, 17, 20, 30, 60, 1000]
    np.testing.assert_allclose([student(n) for n in degrees], t.ppf(0.975, degrees), rtol=1e-3)
