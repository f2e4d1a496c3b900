"""Gaps, runs and ranges of signals, by hand."""

from __future__ import annotations

import numpy as np

from stiction.diagnosis.oscillation.phase_average import average_by_phase
from stiction.records import LoopRecord
from stiction.records.analysis_window import forward_fill_sp
from stiction.records.gaps import fill_short_gaps, forward_fill, interpolate_gaps, missing_mask
from stiction.records.masks import RecordMasks
from stiction.records.quality.compression import is_stored_on_change
from stiction.records.quality.quantisation import count_values, robust_range
from stiction.records.record import mask_outliers
from stiction.records.runs import run_bounds, runs

NAN = np.nan


def test_gaps_are_filled_in_three_ways():
    x = np.array([NAN, 1.0, NAN, 2.0, NAN, NAN])
    np.testing.assert_array_equal(forward_fill(x), [NAN, 1.0, 1.0, 2.0, 2.0, 2.0])
    np.testing.assert_array_equal(forward_fill(x, fill_start=True), [1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    np.testing.assert_array_equal(interpolate_gaps(x), [1.0, 1.0, 1.5, 2.0, 2.0, 2.0])
    np.testing.assert_array_equal(fill_short_gaps(x, max_gap=1), [NAN, 1.0, 1.0, 2.0, NAN, NAN])
    assert missing_mask(x, np.array([1.0, 2.0, 3.0, np.inf, 4.0, 5.0])).tolist() == [
        True,
        False,
        True,
        True,
        True,
        True,
    ]


def test_set_point_keeps_its_last_value():
    record = LoopRecord("FIC-101", 1.0, op=np.arange(4.0), sp=np.array([NAN, 3.0, NAN, 4.0]))
    sp, assumption = forward_fill_sp(record)
    assert sp is not None
    assert sp.tolist() == [3.0, 3.0, 3.0, 4.0]
    assert assumption == "The set point of the first 1 of 4 samples is assumed to be the first stored one."


def test_runs_of_a_mask():
    mask = np.array([True, False, True, True])
    assert runs(mask) == [(0, 1), (2, 4)]
    assert run_bounds(mask).tolist() == [[0, 1], [2, 4]]


def test_masks_of_a_record():
    op = np.concatenate([np.linspace(80.0, 100.0, 20), np.full(11, 100.0), [90.0, 80.0]])
    assert RecordMasks(LoopRecord("FIC-101", 1.0, op=op)).at_limit.sum() == 12
    wave = 50.0 + np.sin(np.arange(400.0))
    wave[100] = -9999.0
    (note,) = mask_outliers(LoopRecord("FIC-101", 1.0, op=wave)).provenance.assumptions
    assert note == "1 value far from all others is taken as missing (such as OP -9999)."


def test_range_and_values_of_a_signal():
    assert round(robust_range(np.array([*np.linspace(0.0, 100.0, 101), 900.0])), 9) == 98.98
    assert count_values(np.array([1.0, 2.0, 1.0, 3.0]), 10) == 3
    assert count_values(np.arange(900.0), 10) == 10


def test_stored_on_change():
    t, x = np.arange(400.0), np.round(5.0 * np.sin(np.arange(400) / 30))
    kept = np.flatnonzero(np.diff(x, prepend=-1.0))
    assert is_stored_on_change(x[kept], t[kept])
    assert not is_stored_on_change(x, t)


def test_mean_cycle_of_a_sine():
    wave = np.sin(2 * np.pi * np.arange(4000) / 400)
    found = average_by_phase(3.0 * wave + 1.0, wave, 400.0)
    assert found.n_cycles == 9
    np.testing.assert_allclose(found.values(), 3.0 * wave[found.inside], atol=0.05)
