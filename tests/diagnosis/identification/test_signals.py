"""Gaps held, long records thinned, the scale of slow disturbances chosen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.model_signals import signals_of
from stiction.diagnosis.identification.signals import bridge_gaps, hold_gaps, prepare
from stiction.errors import RecordError
from stiction.records.record import LoopRecord

from .twin import about_local_mean

nan = np.nan


@pytest.mark.parametrize(
    ("x", "held"),
    [
        ([1.0, nan, nan, 2.0, nan], [1.0, 1.0, 1.0, 2.0, 2.0]),
        ([nan, nan, 3.0, nan, 4.0], [3.0, 3.0, 3.0, 3.0, 4.0]),
        ([nan, 5.0], [5.0, 5.0]),
        ([5.0, np.inf, -np.inf, 6.0], [5.0, 5.0, 5.0, 6.0]),
        ([1.0, 2.0], [1.0, 2.0]),
    ],
)
def test_gaps_hold_the_last_value(x, held):
    x = np.array(x)
    before = x.copy()
    np.testing.assert_array_equal(hold_gaps(x), held)
    np.testing.assert_array_equal(x, before)


@pytest.mark.parametrize(
    ("x", "bridged"),
    [
        ([1.0, nan, nan, 4.0, nan], [1.0, 2.0, 3.0, 4.0, 4.0]),
        ([nan, nan, 3.0, nan, 4.0], [3.0, 3.0, 3.0, 3.5, 4.0]),
        ([5.0, np.inf, -np.inf, 8.0], [5.0, 6.0, 7.0, 8.0]),
        ([1.0, 2.0], [1.0, 2.0]),
    ],
)
def test_gaps_are_bridged(x, bridged):
    np.testing.assert_allclose(bridge_gaps(np.array(x)), bridged, rtol=1e-12)


@pytest.mark.parametrize("fill", [hold_gaps, bridge_gaps])
def test_nothing_to_fill_with(fill):
    with pytest.raises(RecordError, match="no valid sample"):
        fill(np.full(9, nan))


def record(n, dt=1.0, seed=0):
    rng = np.random.default_rng(seed)
    return LoopRecord("FC1", dt, op=50.0 + rng.normal(size=n), pv=300.0 + np.cumsum(rng.normal(size=n)))


def test_a_pv_is_needed():
    with pytest.raises(RecordError, match="FC1 has no PV"):
        prepare(LoopRecord("FC1", 1.0, op=np.arange(99.0)), None)


@pytest.mark.parametrize("model", ["kano", "stenman", "three_parameter"])
@pytest.mark.parametrize("missing", ["op", "pv"])
def test_rows_without_values_are_no_samples(missing, model):
    given = record(2000)
    few = np.where(np.isin(np.arange(2000), [3, 400, 900, 1300, 1999]), getattr(given, missing), nan)
    with pytest.raises(RecordError, match=r"FC1 has 5 samples with both OP and PV, of 2000; .* at least 30"):
        st.identify(replace(given, **{missing: few}), model)


def test_samples_are_counted_where_both_are_there():
    given, k = record(60), np.arange(60)
    together = replace(given, op=np.where(k < 45, given.op, nan), pv=np.where(k >= 15, given.pv, nan))
    assert prepare(together, None).pv.size == 60
    with pytest.raises(RecordError, match="FC1 has 29 samples"):
        prepare(replace(together, pv=np.where(k >= 16, given.pv, nan)), None)


def test_a_model_is_not_fitted_to_a_position_of_a_few_samples():
    given = record(2000)
    with pytest.raises(RecordError, match="FC1 has 5 samples with both OP and MV"):
        signals_of(replace(given, mv=np.where(np.arange(2000) < 5, given.op, nan)), None)


@pytest.mark.parametrize("period", [None, 40.0, 41.0])
def test_short_records_keep_every_sample(period):
    given = record(390)
    signals = prepare(given, period)
    assert (signals.thinned, signals.dt) == (1, 1.0)
    np.testing.assert_array_equal(signals.op, given.op)
    np.testing.assert_array_equal(signals.pv, given.pv)
    np.testing.assert_allclose(signals.target, about_local_mean(given.pv, signals.half), atol=1e-9)


@pytest.mark.parametrize(("period", "half"), [(None, 0), (40.0, 20), (41.2, 21), (3.0, 2)])
def test_local_mean_spans_one_period(period, half):
    assert prepare(record(500), period).half == half


@pytest.mark.parametrize(("n", "period", "every"), [(20_000, 500.0, 6), (12_000, 1000.0, 13), (9_001, 2000.0, 22)])
def test_long_records_are_thinned_by_averages_of_the_pv(n, period, every):
    given = record(n, dt=2.0)
    signals = prepare(given, period)
    assert signals.thinned == every
    assert signals.dt == 2.0 * every
    assert signals.pv.size == n // every
    # The stem follows every move of OP, so OP is never thinned.
    np.testing.assert_array_equal(signals.op, given.op[: n // every * every])
    assert given.pv is not None
    for k in (0, 1, 7, signals.pv.size - 1):
        assert signals.pv[k] == pytest.approx(given.pv[k * every : (k + 1) * every].mean(), abs=1e-9)
    # A period keeps as many samples as the search needs.
    assert period / signals.dt >= 36.0
