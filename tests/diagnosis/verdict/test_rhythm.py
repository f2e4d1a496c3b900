"""The rhythm of an oscillation in numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.verdict.rhythm import rhythm_of


def recorded(amplitude):
    """A sine of 40 samples whose amplitude goes as given, one number for each period."""
    k = np.arange(40 * len(amplitude))
    wave = np.repeat(amplitude, 40) * np.sin(2.0 * np.pi * k / 40.0)
    return st.LoopRecord("FC1", 1.0, op=50.0 - wave, pv=50.0 + wave, sp=np.full(k.size, 50.0))


STEADY = recorded(np.ones(20))
EVERY_40 = find_oscillation(STEADY)


def test_a_steady_oscillation_does_not_wander():
    assert EVERY_40.period == pytest.approx(40.0, rel=0.01)
    assert rhythm_of(STEADY, EVERY_40).wander == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("unit", [1.0, 1e-12, 1e12])
def test_decay_does_not_depend_on_the_unit_of_the_pv(unit):
    dying = recorded(np.exp(-np.arange(20.0) / 9.0))
    found = rhythm_of(replace(dying, pv=unit * dying.pv, sp=unit * dying.sp), EVERY_40)
    # Seven periods of 20 in the first third, seven in the last, 13 from the one's median to the other's.
    assert found.decay == pytest.approx(14.0 / 9.0, rel=0.1)


@pytest.mark.filterwarnings("error")
def test_an_oscillation_that_stands_still_for_half_of_its_periods_wanders_as_far_as_any():
    # The first and the last period do not count: of the others more stand still than not.
    still = recorded(np.array([1.0] * 6 + [0.0] * 14 + [1.0] * 5))
    assert rhythm_of(still, EVERY_40).wander == 1.0
