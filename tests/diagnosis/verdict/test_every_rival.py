"""A sticky valve that is plainly likelier than all that could pass for one: "no stiction" is not said."""

import math
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.verdict.contradiction import BEATS_EVERY, STEADILY, beats_every_rival
from stiction.diagnosis.verdict.doubt import LEAST

MORE, LESS = BEATS_EVERY + 0.1, BEATS_EVERY
BEATS_ALL = {
    "likelier_than_good": 500.0,
    "likelier_than_any": MORE,
    "likelier_beside_wave": MORE,
    "likelier_than_play": MORE,
    "beats_any": STEADILY + 0.01,
}


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({}, True),
        ({"likelier_than_any": LESS}, False),
        ({"likelier_beside_wave": LESS}, False),
        ({"likelier_than_play": LESS}, False),
        ({"beats_any": STEADILY}, False),
        ({"likelier_beside_wave": math.nan}, True),
        ({"likelier_beside_wave": math.nan, "likelier_than_play": LESS}, False),
        (
            {
                "likelier_than_good": math.nan,
                "likelier_than_any": math.nan,
                "likelier_beside_wave": math.nan,
                "likelier_than_play": math.nan,
            },
            False,
        ),
    ],
)
def test_the_least_of_all_margins_decides(changed, told):
    assert beats_every_rival(SimpleNamespace(**(BEATS_ALL | changed))) is told


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
