"""Reasons that can be checked on the trend, against what the simulation did."""

from __future__ import annotations

import re

import numpy as np
import pytest

import stiction as st
from stiction.report import figures
from stiction.report.loop_view import LoopView
from stiction.report.visible_reasons import find_rests, visible_reasons


def simulate(valve, **more):
    loop = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    return st.simulate(loop, 150.0, 2000.0, seed=1, pv_start=148.0, op_start=50.0, tag="FIC-1", **more)


@pytest.fixture(scope="module")
def sticky():
    return LoopView(st.diagnose(simulate(st.Kano(5.0, 2.0)), methods=False))


def test_rests_are_where_the_true_valve_rests(sticky):
    """The simulation recorded the stem: of the marked samples it rests in nearly all."""
    rests, true = find_rests(sticky), sticky.diagnosis.record.mv
    assert true is not None
    still = np.concatenate([np.abs(np.diff(true[first:last])) < 1e-9 for first, last in rests])
    assert np.mean(still) > 0.9
    plot = figures.trends(sticky).plot
    [shaded] = [one for one in plot["data"] if one["name"] == "valve at rest while OP moves"]
    assert shaded["yaxis"] == "y4"
    assert np.isnan(shaded["x"]).sum() <= len(rests)  # rests that touch are one stretch
    period = sticky.diagnosis.oscillation.period
    assert len(rests) == pytest.approx(2.0 * 2000.0 / period, rel=0.25)  # two reversals in a cycle


def test_sentences_say_rests_size_and_fit(sticky):
    text = " ".join(visible_reasons(sticky)).replace("\u00a0", " ")
    [times, move] = re.search(
        r"rests (\d+) times while OP goes on moving, each time by about ([\d.]+) %", text
    ).groups()  # type: ignore[union-attr]
    assert int(times) == len(find_rests(sticky))
    assert float(move) == pytest.approx(5.0, rel=0.3)
    assert "With a good valve the same loop would explain" in text


def test_good_valve_has_no_rests():
    view = LoopView(st.diagnose(simulate(st.Ideal()), methods=False))
    assert find_rests(view) == []
    assert all("rests" not in line for line in visible_reasons(view))
