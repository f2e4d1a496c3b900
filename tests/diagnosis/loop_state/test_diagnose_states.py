"""What `diagnose` makes of a loop that is not in control."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.loop_state import HEADLINES
from stiction.report import labels

from . import plant_cases as plant

KINDS = {
    plant.stuck_in_service: ("valve_not_responding", "stem"),
    plant.selected_out: ("not_in_command", "override"),
    plant.frozen_transmitter: ("pv_frozen", "transmitter"),
    plant.closed_block_valve: ("shut_in", "block valves"),
}


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_the_state_is_the_headline_and_no_valve_is_identified(kind):
    name, look_at = KINDS[kind]
    loop, signals = kind(2)
    found = st.diagnose(loop.record(signals))
    assert (found.verdict, found.probability, found.identification) == ("undecided", 0.25, None)
    assert labels.headline(found).startswith(HEADLINES[name])
    assert look_at in found.action
    assert "no action" not in found.summary().lower()
    told = found.to_dict()
    assert told["stiction"] is None
    assert told["loop_state"]["state"] == name
    assert told["loop_state"]["why"] == found.reason
    assert told["loop_state"]["action"] == found.action
    assert set(told["loop_state"]) == {"state", "start_s", "end_s", "why", "action", "stretches"}
    assert told["loop_state"]["stretches"][-1]["end_s"] == loop.n * loop.dt


def test_times_are_those_of_the_record():
    loop, (op, pv, sp) = plant.frozen_transmitter(2)
    record = st.LoopRecord("C1", loop.dt, op=op, pv=pv, sp=sp, loop_type="flow", start=datetime(2026, 3, 2, 6, 0))
    reason = st.diagnose(record).reason
    stop = int(np.flatnonzero(np.diff(pv))[-1]) + 1
    assert f"from {datetime.fromtimestamp(record.start.timestamp() + stop * loop.dt):%H:%M} to" in reason


def test_a_loop_in_control_is_judged():
    loop, signals = plant.healthy(2)
    found = st.diagnose(loop.record(signals))
    assert found.loop_state.in_control
    assert found.to_dict()["loop_state"]["state"] == "in_control"
    assert found.identification is not None


def test_manual_by_the_mode():
    loop, (op, pv, sp) = plant.healthy(2)
    auto = np.arange(loop.n) < loop.n // 4
    record = st.LoopRecord("C1", loop.dt, op=op, pv=pv, sp=sp, auto=auto, loop_type="flow")
    found = st.diagnose(record)
    assert found.loop_state.state == "manual"
    assert found.action == "Put the controller in automatic and record the loop again."


def test_a_record_that_the_data_checks_reject_is_bad_data():
    loop, (op, pv, sp) = plant.healthy(2)
    found = st.diagnose(st.LoopRecord("C1", loop.dt, op=op[:25], pv=pv[:25], sp=sp[:25]))
    assert found.quality.rejections
    assert found.loop_state.state == "bad_data"
    assert found.to_dict()["loop_state"]["why"]


def test_a_record_without_pv_is_an_error():
    with pytest.raises(st.RecordError, match="has no PV"):
        st.diagnose(st.LoopRecord("C1", 1.0, op=np.arange(100.0)))
