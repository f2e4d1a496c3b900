"""Loops of the kinds that advice is about: what is drawn is what its truth says."""

from __future__ import annotations

import numpy as np
import pytest

from calibration.populations.kinds import KINDS, draw_kind
from calibration.second_simulator.kinds import SECOND_KINDS, sample_kind

NAMES = {"valve", "tuning", "external", "set_point", "rate_limit", "dead_zone", "sensor"}


def first(kind, seed=3):
    return draw_kind(np.random.default_rng([seed, 1]), kind, "x")


@pytest.mark.parametrize("kind", ["set point", "rate limit", "unmoved", "stuck", "between limits", "pulses logged"])
def test_record_of_a_kind_shows_it(kind):
    case = first(kind)
    op = case.record.op
    assert set(case.causes) <= NAMES
    assert case.kind == kind
    if kind == "set point":
        assert np.ptp(case.record.sp) > 0.0
    if kind == "rate limit":
        moves = np.abs(np.diff(op))
        assert np.mean(moves > 0.8 * moves.max()) > 0.2
    if kind == "unmoved":
        assert np.ptp(op) < case.S
    if kind == "stuck":
        assert np.isinf(case.S)
    if kind == "between limits":
        assert np.mean(op == op.max()) + np.mean(op == op.min()) > 0.01
    if kind == "pulses logged":
        assert set(np.unique(op)) == {0.0, 100.0}


@pytest.mark.parametrize("kind", ["near limit", "unmoved", "rate limit"])
def test_second_simulator_draws_the_kind(kind):
    case = sample_kind(kind, 2)
    assert set(case.causes) <= NAMES
    assert case.kind in SECOND_KINDS
    assert case.kind in KINDS
    if kind == "unmoved":
        assert np.ptp(case.record.op) < case.S
    if kind == "rate limit":
        moves = np.abs(np.diff(case.record.op))
        assert np.quantile(moves, 0.8) > 0.9 * moves.max()
