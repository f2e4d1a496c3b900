from __future__ import annotations

import numpy as np
import pytest

from stiction.paper import figure3, figure4, figure5

CORRECTED = "three parameters, corrected (eq. 5)"
PRINTED = "three parameters, printed (eq. 5)"


def test_only_three_parameters_show_both_figures():
    # srinivasan2008, section V: the one-parameter model misses Fig. 3, the two-parameter model Fig. 4.
    ramps = (*figure3(), *figure4())
    assert [ramp.rate for ramp in ramps] == [0.0667, 0.0167, 0.0125, 0.01]
    seen = [ramp.paper for ramp in ramps]
    assert seen == ["follow", "follow", "staircase", "staircase"]
    assert [ramp.behaviour[CORRECTED] for ramp in ramps] == seen
    assert [ramp.behaviour[PRINTED] for ramp in ramps] == seen
    assert {ramp.behaviour["one parameter (eq. 4)"] for ramp in ramps} == {"staircase"}
    assert {ramp.behaviour["two parameters"] for ramp in ramps} == {"follow"}


def test_the_first_slip_comes_at_d_above_the_start():
    for ramp in (*figure3(), *figure4()):
        for stem in ramp.position.values():
            first = int(np.flatnonzero(np.diff(stem) != 0.0)[0]) + 1
            assert ramp.op[first] == pytest.approx(5.0 + 5.1, abs=1.5 * ramp.rate)


def test_figure_5_is_read_from_the_flow():
    figure = figure5()
    assert {ramp.behaviour for ramp in figure.test.ramps} == {"staircase"}
    for stretch in figure.test.travel:
        middle = 0.5 * (stretch.low + stretch.high)
        assert stretch.sb == pytest.approx(np.interp(middle, figure.travel, figure.sb), rel=0.15)
    up = [event for event in figure.test.events if event.kind == "slip" and event.direction == 1]
    jumps = np.diff(figure.position["corrected"][60:860])
    # The last slip comes ten seconds before the end, too late to be seen through the sensor's lag.
    assert len(up) == int((jumps[:-10] > 0.5).sum())
