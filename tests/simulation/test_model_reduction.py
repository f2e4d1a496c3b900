"""From physics to data-driven: bands by hand, errors that say what is lost, the paper's section V."""

from __future__ import annotations

import json

import pytest
from tests.reference import physical as reference

import stiction as st
from stiction.models.parameter_sets import nominal, published_valve, table1_reading_b


def test_bands_by_hand():
    row = reference.NOMINAL_BANDS
    found = st.reduce_valve(published_valve(row.given["set"]), samples=100)
    for name, value in row.expected.items():
        assert getattr(found, name) == pytest.approx(value, rel=row.tolerance), name
    assert (found.sb, found.sj, found.K) == (found.fs, found.J, 1.0)


def test_bands_are_those_the_stem_shows():
    """A slow triangle, read at the stem: fs to break away, S to come back, J in one slip."""
    valve = table1_reading_b(hold="linear")
    found = st.reduce_valve(valve, samples=100)
    op = [50.0 + 0.01 * k for k in range(4000)]
    op += op[::-1]
    mv = st.stroke(valve, op, 0.2).mv
    first = next(k for k in range(len(mv)) if mv[k] != 50.0)
    assert op[first] - 50.0 == pytest.approx(found.fs, abs=0.02)
    assert mv[first + 5] - 50.0 == pytest.approx(found.J, rel=0.02)


def test_three_parameters_lose_least_where_inertia_is_small():
    """Reading B: only the model with r is right below and above it; without inertia or lag nearly nothing is lost."""
    found = st.reduce_valve(table1_reading_b())
    worst = {name: max(e.rms for e in found.errors if e.model == name) for name in found.valves()}
    assert min(worst, key=worst.get) == "Srinivasan"
    assert worst["Srinivasan"] < 0.6
    assert all(worst[name] > 2.0 * worst["Srinivasan"] for name in worst if name != "Srinivasan")


def test_two_parameters_do_as_well_above_r():
    """On ramps faster than r the two-parameter models and the three-parameter one are the same valve."""
    found = st.reduce_valve(table1_reading_b())
    fast = {e.model: e.rms for e in found.errors if e.signal.startswith("ramp") and e.rate > found.r}
    assert fast["Kano"] == pytest.approx(fast["Srinivasan"], abs=1e-6)
    assert fast["Choudhury"] == pytest.approx(fast["Srinivasan"], abs=1e-6)


def test_lag_is_lost():
    """No data-driven model has a lag: the I/P converter's 3.6 s times the rate is the error of a fast ramp."""
    found = st.reduce_valve(nominal())
    without = st.reduce_valve(nominal(lag=0.0))
    fastest = max(e.rate for e in found.errors)
    pick = {e.model: e for e in found.errors if e.rate == fastest and e.signal.startswith("ramp")}
    bare = {e.model: e for e in without.errors if e.rate == fastest and e.signal.startswith("ramp")}
    lost = pick["Kano"].maximum - bare["Kano"].maximum
    assert lost == pytest.approx(3.571 * fastest * found.gain, rel=0.15)


def test_reduction_is_json():
    found = st.reduce_valve(table1_reading_b(), samples=100)
    assert json.loads(json.dumps(found.to_dict()))["S"] == pytest.approx(found.S)
    assert found.best(found.errors[0].signal).model in found.valves()
    assert "S = 39.11 %" in found.summary()


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        (0, "samples = 0 is not positive"),
        (1, "samples = 1 is out of range"),
        (99.5, "not a whole number"),
        (10**9, "give 2 to"),
    ],
)
def test_a_signal_has_two_samples_at_least(samples, message):
    with pytest.raises(st.ParameterError, match=message):
        st.reduce_valve(table1_reading_b(), samples=samples)


def test_a_whole_number_of_samples_may_be_a_float():
    assert st.reduce_valve(table1_reading_b(), samples=100.0) == st.reduce_valve(table1_reading_b(), samples=100)
