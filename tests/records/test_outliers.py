"""Outliers: they count as missing, are reported, and change no verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.records import LoopRecord, assess_quality
from stiction.records.quality.outliers import find_outliers
from stiction.records.record import mask_outliers


@pytest.fixture(scope="module")
def sticky():
    loop = st.Loop(st.PID(0.4, 5.0), st.Kano(5.0, 3.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    run = st.simulate(loop, 70.0, 2000.0, 6.0, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow")
    return replace(run, mv=None)


@pytest.mark.parametrize("name", ["op", "pv"])
@pytest.mark.parametrize("code", [100.0, 0.0, -9999.0, 1e38])
def test_one_bad_value_in_two_thousand_turns_no_verdict(sticky, name, code):
    x = getattr(sticky, name).copy()
    x[700] = code
    spoilt = replace(sticky, **{name: x})
    plain, found = st.diagnose(sticky), st.diagnose(spoilt)
    assert plain.verdict == found.verdict == "stiction"
    assert found.probability == pytest.approx(plain.probability, abs=0.02)
    assert [check.name for check in found.quality.warnings if check.name == "outliers"]
    assert pytest.approx(plain.identification.S, rel=0.03) == found.identification.S
    if name == "op" or abs(code) > 200.0:
        assert pytest.approx(5.0, rel=0.05) == st.identify(spoilt, period=83.0).S


def test_good_record_has_no_outliers(sticky):
    assert mask_outliers(sticky) is sticky


@pytest.mark.parametrize(("length", "count"), [(1, 1), (2, 2), (3, 0), (40, 0)])
def test_an_upset_of_more_than_two_samples_is_none(length, count):
    x = np.random.default_rng(0).normal(50.0, 1.0, 2000)
    x[900 : 900 + length] += 80.0
    assert find_outliers(x).sum() == count


@pytest.mark.parametrize("way", [(43.9, 43.6), (43.5, 44.0, 43.6)])
@pytest.mark.parametrize("at", [0, 700])
def test_what_goes_back_in_steps_is_an_upset(way, at):
    x = np.random.default_rng(0).normal(43.3, 0.01, 1500)
    x[at : at + len(way)] = way
    assert not find_outliers(x).any()


def test_what_comes_often_is_none():
    x = np.random.default_rng(0).normal(50.0, 1.0, 2000)
    x[::40] += 80.0
    assert not find_outliers(x).any()


def test_a_spike_of_the_transmitter_that_the_controller_hands_on_stays():
    rng = np.random.default_rng(0)
    pv = 60.0 + np.sin(np.arange(1500) / 9.0) + rng.normal(0.0, 0.1, 1500)
    pv[[300, 800, 1200]] += 6.0
    record = LoopRecord("FIC-1", 1.0, op=50.0 - 2.0 * (pv - 60.0), pv=pv)
    assert mask_outliers(record) is record


def test_check_counts_outliers_and_read_summary_names_one():
    x = np.sin(np.arange(600) / 9.0)
    op = 50.0 + x
    op[[100, 400]] = 0.0
    quality = assess_quality(LoopRecord("FIC-1", 1.0, op=op, pv=x))
    assert [(check.value, check.severity) for check in quality.checks if check.name == "outliers"] == [(2, "warn")]
    assert mask_outliers(LoopRecord("FIC-1", 1.0, op=op, pv=x)).provenance.assumptions == (
        "2 values far from all others are taken as missing (such as OP 0).",
    )


def test_a_code_that_the_reader_holds_is_one(sticky):
    every = np.arange(len(sticky)) // 3 * 3
    op = sticky.op.copy()
    op[699] = -9999.0
    held = replace(sticky, op=op[every], provenance=replace(sticky.provenance, held_samples=1333))
    assert np.flatnonzero(np.isnan(mask_outliers(held).op)).tolist() == [699, 700, 701]


def test_a_kick_at_a_step_of_the_set_point_is_a_move_of_the_valve():
    rng = np.random.default_rng(0)
    sp = np.where(np.arange(1500) < 700, 60.0, 63.0)
    op = 50.0 + rng.normal(0.0, 0.3, 1500)
    op[700] += 20.0
    record = LoopRecord("TIC-1", 1.0, op=op, pv=sp + rng.normal(0.0, 0.1, 1500), sp=sp)
    assert mask_outliers(record) is record
    assert np.isnan(mask_outliers(replace(record, sp=None, pv=60.0 + rng.normal(0.0, 0.1, 1500))).op[700])


def test_a_trip_in_the_last_samples_and_a_constant_stay():
    x = np.random.default_rng(0).normal(50.0, 1.0, 2000)
    x[-2:] = 0.0
    assert not find_outliers(x).any()
    x[-2:] = -9999.0
    assert np.flatnonzero(find_outliers(x)).tolist() == [1998, 1999]
    still = np.full(2000, 20.0)
    still[900] = 20.1
    assert not find_outliers(still).any()


def test_a_set_point_that_moves_all_the_time_explains_no_bad_value():
    rng = np.random.default_rng(0)
    sp = 60.0 + np.cumsum(rng.normal(0.0, 0.01, 1500))
    op = 50.0 + rng.normal(0.0, 0.3, 1500)
    op[[300, 700]] = -9999.0
    record = LoopRecord("FIC-1", 1.0, op=op, pv=sp + rng.normal(0.0, 0.1, 1500), sp=sp)
    assert np.flatnonzero(np.isnan(mask_outliers(record).op)).tolist() == [300, 700]


@pytest.mark.parametrize("code", [-9999.0, 1e6])
def test_bad_value_does_not_change_the_scale_of_op(read_text, code):
    k = np.arange(600)
    op = 12.0 + 2.0 * np.sin(k / 9.5)
    op[300] = code
    rows = [f"{i},{200 + np.cos(i / 9.5):.3f},{x:.4f}" for i, x in zip(k, op, strict=True)]
    [record] = read_text("\n".join(["time_s,PV,OP [mA]", *rows]))
    good = np.delete(record.op, 300)
    assert good.min() == pytest.approx(37.5, abs=0.01)
    assert good.max() == pytest.approx(62.5, abs=0.01)
    assert any("OP is given in mA" in guess for guess in record.provenance.assumptions)


@pytest.mark.parametrize("name", ["op", "pv"])
@pytest.mark.parametrize("gap", [699, 701])
def test_code_next_to_a_gap_is_an_outlier(sticky, name, gap):
    x = getattr(sticky, name).copy()
    x[700], x[gap] = -9999.0, np.nan
    found = st.diagnose(replace(sticky, **{name: x}))
    assert found.verdict == "stiction"
    assert pytest.approx(5.0, rel=0.05) == found.identification.S


@pytest.mark.parametrize("seed", range(20))
def test_time_has_no_direction(seed):
    rng = np.random.default_rng(seed)
    x = rng.normal(50.0, 1.0, 600)
    x[rng.integers(0, 600, 4)] = rng.choice([-9999.0, 0.0, 100.0], 4)
    x[rng.integers(0, 600, 60)] = np.nan
    assert find_outliers(x[::-1]).tolist() == find_outliers(x)[::-1].tolist()


@pytest.mark.parametrize("name", ["op", "pv"])
@pytest.mark.parametrize("code", [-9999.0, 1e30, 0.0, -1.0, 255.0])
@pytest.mark.parametrize("every", [40, 10, 4])
def test_a_code_that_comes_again_and_again_is_one_at_any_share(sticky, name, code, every):
    x = getattr(sticky, name).copy()
    x[3::every] = code
    spoilt = mask_outliers(replace(sticky, **{name: x}))
    assert np.isnan(getattr(spoilt, name)[3::every]).all()
    assert spoilt.provenance.outliers == x[3::every].size
    if code in (-9999.0, 0.0):
        found = st.diagnose(replace(sticky, **{name: x}))
        assert found.verdict == "stiction"
        assert pytest.approx(5.0, rel=0.05) == found.identification.S


def test_codes_that_stand_side_by_side_by_chance_are_codes(sticky):
    bad = np.random.default_rng(0).random(len(sticky)) < 0.2
    op, pv = np.where(bad, -9999.0, sticky.op), np.where(bad, -9999.0, sticky.pv)
    found = st.diagnose(replace(sticky, op=op, pv=pv))
    assert found.verdict == "stiction"


@pytest.mark.parametrize("code", [-9999.0, 0.0])
@pytest.mark.parametrize("length", [3, 10])
def test_a_code_of_op_that_stands_for_some_samples_turns_no_verdict(sticky, code, length):
    op = sticky.op.copy()
    op[700 : 700 + length] = code
    found = st.diagnose(replace(sticky, op=op))
    assert found.verdict == "stiction"
    assert pytest.approx(5.0, rel=0.05) == found.identification.S


def test_limits_that_op_goes_to_are_none():
    rng = np.random.default_rng(0)
    op = np.clip(50.0 + 40.0 * rng.normal(size=2000), 0.0, 100.0)
    assert not find_outliers(op).any()
    op = 50.0 + 8.0 * rng.normal(size=2000)
    op[::50] = 100.0
    assert not find_outliers(op).any()


@pytest.mark.parametrize("seed", range(3))
def test_what_is_left_is_not_looked_at_again(seed):
    """Values that a historian stored by exception: without the first that stand alone others would."""
    rng = np.random.default_rng(seed)
    x = np.repeat(rng.normal(size=90), 8) * np.repeat(rng.exponential(size=90), 8) ** 3
    x[rng.choice(x.size, 6, replace=False)] += 500.0 * rng.exponential(size=6)
    once = mask_outliers(LoopRecord("FIC-101", 1.0, op=50.0 + x / 100.0, pv=x))
    assert once.provenance.outliers > 0
    assert mask_outliers(once) is once
    assert assess_quality(once).rows == len(once)


@pytest.mark.parametrize(("far", "count"), [(19.9, 0), (20.1, 1)])
def test_outlier_at_an_end_or_next_to_a_gap_is_twenty_widths_away(far, count):
    """All others are half a width above or below 0."""
    x = np.where(np.arange(2000) % 2, 0.5, -0.5)
    for k in (0, 1000, 1999):
        spoilt = x.copy()
        spoilt[k] = far
        if k == 1000:
            spoilt[k + 1] = np.nan
        assert np.flatnonzero(find_outliers(spoilt)).tolist() == [k] * count
