"""`identify` from a record: valve and process of known loops, and what cannot be identified."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.errors import ParameterError, RecordError

from .loops import KNOWN, run_of


@pytest.fixture(scope="module")
def record():
    return replace(run_of(KNOWN["first order"], 0.02, 0.3), mv=None)


@pytest.mark.parametrize("name", KNOWN)
def test_valve_and_process_of_a_known_loop_are_found(name):
    known = KNOWN[name]
    found = st.identify(replace(run_of(known, 0.02, 0.3), mv=None), period=known.period)
    assert found.model == "kano"
    assert pytest.approx(known.S, rel=0.15) == found.S
    assert found.S_low <= found.S <= found.S_high
    assert found.J_low <= found.J <= found.J_high
    assert found.process.integrating == known.integrating
    assert found.process.gain == pytest.approx(known.gain, rel=0.25)
    assert found.fit > found.fit_linear
    assert found.likelihood_ratios["good"] > 12.0


def test_the_period_is_found_as_diagnose_finds_it(record):
    found = st.identify(record)
    diagnosed = st.diagnose(record).identification
    assert (found.S, found.J, found.fit) == pytest.approx((diagnosed.S, diagnosed.J, diagnosed.fit))


def test_a_recorded_position_gives_the_valve_and_the_pv_the_process(record):
    known = KNOWN["first order"]
    run = run_of(known, 0.02, 0.3)
    noise = 0.05 * np.random.default_rng(0).normal(size=len(run))
    found = st.identify(replace(run, mv=100.0 - run.mv + noise))
    assert found.by_position
    assert pytest.approx(known.S, rel=0.06) == found.S
    assert pytest.approx(known.J, rel=0.15) == found.J
    assert found.process == st.identify(record).process


@pytest.mark.parametrize("model", ["kano", "stenman", "three_parameter"])
def test_a_position_that_says_nothing_changes_only_the_reason(record, model):
    without = st.identify(record, model)
    copied = st.identify(replace(record, mv=record.op), model)
    assert not copied.by_position
    assert "position was not used" in copied.reason
    one, other = without.to_dict(), copied.to_dict()
    assert one.pop("reason") != other.pop("reason")
    assert one == other


def test_outliers_and_gaps_hardly_matter(record):
    op, pv = record.op.copy(), record.pv.copy()
    op[300], pv[500:503] = 9999.0, np.nan
    assert pytest.approx(st.identify(record).S, rel=0.05) == st.identify(replace(record, op=op, pv=pv)).S


@pytest.mark.parametrize("model", ["kano", "three_parameter"])
def test_the_result_is_json_ready(record, model):
    found = json.loads(json.dumps(st.identify(record, model).to_dict()))
    assert found["model"] == model
    assert set(found["process"]) == {"gain", "time_constant", "dead_time", "lag", "integrating"}


def test_nothing_oscillates_where_the_period_is_infinite(record):
    found = st.identify(record, period=np.inf)
    assert "periodic_load" not in found.likelihood_ratios
    assert "periodic_load" in st.identify(record, period=105.0).likelihood_ratios


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"pv": None, "sp": None}, "no PV"),
        ({"op": np.full(1000, 50.0)}, "loop state is manual"),
        ({"pv": np.full(1000, 50.0)}, "loop state is pv_frozen"),
        ({"pv": np.where(np.arange(1000) < 20, np.arange(1000.0), np.nan)}, "loop state is bad_data"),
    ],
)
@pytest.mark.parametrize("take", [st.identify, st.compare_models])
def test_a_record_that_cannot_be_identified_is_named(record, take, change, message):
    with pytest.raises(RecordError, match=message):
        take(replace(record, **change))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"model": "lugre"}, "'three_parameter'"),
        ({"period": -3.0}, "not positive"),
        ({"period": np.nan}, "not positive"),
        ({"period": 2.0}, "shorter than 4 samples"),
    ],
)
def test_bad_arguments_are_named(record, arguments, message):
    with pytest.raises(ParameterError, match=message):
        st.identify(record, **arguments)


def test_a_path_is_no_record():
    with pytest.raises(RecordError):
        st.identify("loop.csv")
