"""A sticky valve that is plainly likelier than all that could pass for one: "no stiction" is not said."""

import math
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identified import Rival
from stiction.diagnosis.verdict.contradiction import BEATS_EVERY, STEADILY, beats_every_rival
from stiction.diagnosis.verdict.doubt import LEAST

from .found import FOUND

MORE, LESS = BEATS_EVERY + 0.1, BEATS_EVERY
BEATS_ALL = {
    "good": Rival(STEADILY + 5.0, 500.0),
    "wave": Rival(STEADILY + 0.01, MORE),
    "beside_wave": Rival(likelier=MORE),
}


@pytest.mark.parametrize(
    ("changed", "over_play", "told"),
    [
        ({}, MORE, True),
        ({"wave": Rival(STEADILY + 0.01, LESS)}, MORE, False),
        ({"beside_wave": Rival(likelier=LESS)}, MORE, False),
        ({}, LESS, False),
        ({"wave": Rival(STEADILY, MORE)}, MORE, False),
        ({"beside_wave": Rival()}, MORE, True),
        ({"beside_wave": Rival()}, LESS, False),
        ({"good": Rival(), "wave": Rival(beats=STEADILY + 0.01), "beside_wave": Rival()}, math.nan, False),
    ],
)
def test_the_least_of_all_margins_decides(changed, over_play, told):
    assert beats_every_rival(replace(FOUND, rivals=BEATS_ALL | changed, likelier_than_play=over_play)) is told


def test_a_valve_compared_with_nothing_beats_nothing():
    assert beats_every_rival(FOUND) is False


def sticky_loop(n=3000):
    """A loop by the balance of forces whose load wanders: no cycle of its own, and a valve that plainly slips."""
    rng = np.random.default_rng(1)
    S, J, K, T, Kc, Ti = 4.0, 2.0, 1.5, 12.0, 0.6, 12.0
    x = stem = total = 0.0
    load = np.convolve(rng.normal(size=n), np.exp(-np.arange(1500) / 500.0))[:n]
    load *= 3.0 / load.std()
    op, pv = np.empty((2, n))
    for k in range(n):
        pv[k] = x + 0.1 * rng.normal()
        total -= Kc * pv[k] / Ti
        op[k] = 50.0 + total - Kc * pv[k]
        if abs(op[k] - 50.0 - stem) > 0.5 * (S + J):
            stem = op[k] - 50.0 - math.copysign(0.5 * (S - J), op[k] - 50.0 - stem)
        x += (K * (stem + load[k]) - x) / T
    return st.LoopRecord("FIC-101", 1.0, op=op, pv=pv + 100.0, sp=np.full(n, 100.0))


@pytest.mark.parametrize(
    ("to_blame", "verdict"), [("none", "undecided"), ("saturation", "undecided"), ("sensor", "no_stiction")]
)
def test_whatever_the_loop_looks_like_it_is_undecided_and_not_surely_good(monkeypatch, to_blame, verdict):
    """Unless the transmitter is to blame: what it makes of the PV is anyone's. An OP at its limit frees no valve."""
    record, page = sticky_loop(), import_module("stiction.diagnosis.verdict.diagnose")
    weigh = page.causes

    def calm(row):
        shares = dict.fromkeys(weigh(row), 0.0)
        return shares | {"stiction": 0.05, to_blame: 0.95}

    found = st.diagnose(record)
    assert beats_every_rival(found.identification)
    monkeypatch.setattr(page, "causes", calm)
    found = st.diagnose(record)
    assert found.verdict == verdict
    assert (found.probability >= LEAST) is (verdict == "undecided")
    assert ("a sticky valve beats every rival" in found.reason) is (verdict == "undecided")
