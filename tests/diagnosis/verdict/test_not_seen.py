"""A valve that is not seen: OP explains next to nothing of the PV, and the verdict says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identified import ControllerFit, Rival
from stiction.diagnosis.verdict.cause import not_seen
from stiction.diagnosis.verdict.contradiction import (
    MUCH_MORE,
    NOT_OF_ONE_LOOP,
    explains_much_more,
    explains_nothing,
)
from stiction.records.record import LoopRecord


def test_where_op_does_not_move_pv_nothing_is_said_of_the_valve():
    rng = np.random.default_rng(0)
    apart = LoopRecord("FC1", 1.0, op=50.0 + rng.normal(size=600), pv=rng.normal(size=600), loop_type="flow")
    found = st.identify(apart, closer=False)
    assert max(found.fit, found.fit_linear) < 20.0
    assert "not of one loop" in explains_nothing(found)
    lawful, lawless = (ControllerFit(0.2, 10.0, 1.0 - left, 1.0, left=left) for left in (0.3, 0.31))
    assert "not of one loop" not in explains_nothing(found, lawful)
    assert "not of one loop" in explains_nothing(found, lawless)
    assert "no more than 12 %" in explains_nothing(replace(found, fit=11.0, fit_linear=12.0))
    assert explains_nothing(replace(found, fit=20.0, fit_linear=12.0)) == ""
    assert explains_nothing(replace(found, fit=-5.0, fit_linear=40.0)) == ""
    better = replace(found, fit=40.0 + MUCH_MORE + 1.0, fit_linear=40.0, rivals={"good": Rival(likelier=1.0)})
    assert explains_much_more(better)
    assert explains_much_more(replace(better, fit=0.0, rough=better))
    assert not explains_much_more(replace(better, fit_linear=42.0))
    assert not explains_much_more(replace(better, rivals={"good": Rival(likelier=-1.0)}))


@pytest.mark.parametrize(
    ("shares", "name", "said"),
    [
        ({"stiction": 0.3, "none": 0.6, "sensor": 0.1}, "none", "Nothing else seems wrong with the loop (0.60)."),
        (
            {"stiction": 0.1, "none": 0.2, "external disturbance": 0.7},
            "external disturbance",
            "is external disturbance",
        ),
        ({"stiction": 0.6, "none": 0.4}, "unknown", "Why."),
    ],
)
def test_what_moves_the_pv_is_named_where_it_is_plain(shares, name, said):
    found = not_seen("Why.", shares)
    assert found.name == name
    assert said in found.reason
    assert "stroke the valve" in found.action
    assert "of one loop" not in found.action
    assert not_seen(f"Why: {NOT_OF_ONE_LOOP}.", shares).action.startswith("Check that OP and PV are of one loop. Look")


def test_a_real_record_that_neither_valve_explains(records):
    # An hour of a healthy actuator of a sugar plant, whose OP hardly moves the PV.
    (record,) = st.read(records / "damadics" / "A3_20011011_1h.csv")
    found = st.diagnose(record).identification
    assert found is not None
    assert explains_nothing(found)
