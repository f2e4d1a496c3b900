"""What the plain moves of a position tell, against the valves that made them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import stiction as st
from stiction.diagnosis.identification.moves import told_by_moves

N = 3000
OP = 50.0 + 4.0 * np.sin(np.arange(N) / 40.0) + 1.0 * np.sin(np.arange(N) / 17.0)


@given(
    fs=some.floats(1.0, 3.0), ratio=some.floats(0.05, 0.8), slope=some.sampled_from([1.0, 0.16, 0.01, -1.0]),
    level=some.floats(-20.0, 20.0),
)  # fmt: skip
def test_the_moves_of_a_resting_stem_tell_its_friction(fs, ratio, slope, level):
    y = level + slope * st.stroke(st.He(fs, ratio * fs), OP, dt=1.0).mv
    S, J, a = told_by_moves(OP, y, slope, 1e-3 * abs(slope))
    step = np.abs(np.diff(OP)).max()
    assert pytest.approx(fs * (1.0 + ratio), abs=step) == S
    assert pytest.approx(fs * (1.0 - ratio), abs=step) == J
    assert pytest.approx(level, abs=step * abs(slope)) == a


def test_noise_is_no_move():
    stem = st.stroke(st.He(2.0, 0.5), OP, dt=1.0).mv
    S, J, _ = told_by_moves(OP, stem + 0.1 * np.random.default_rng(0).normal(size=N), 1.0, 0.1)
    assert pytest.approx((2.5, 1.5), abs=0.15) == (S, J)


@pytest.mark.parametrize("y", [np.floor(np.linspace(40.0, 60.0, N)), np.full(N, 50.0), np.full(N, np.nan)])
def test_moves_one_way_alone_tell_no_valve(y):
    assert told_by_moves(OP, y, 1.0, 0.01) is None
