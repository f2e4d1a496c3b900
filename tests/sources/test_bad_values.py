"""Values that are no measurements: texts, quality codes, sentinel numbers, digital states, in all signals alike."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import polars as pl
import pytest

from stiction.sources.values.bad_values import find_bad_values, find_common_states, find_sentinels
from stiction.sources.values.quality_codes import automatic_mask

N = 600
T = np.arange(N)
BAD = np.isin(T, [0, 1, 60, 61, 62, 300, 599])


def loop(**changed):
    rng = np.random.default_rng(4)
    signals = {
        "pv": np.round(150 + 8 * np.sin(T / 9) + rng.normal(size=N), 2),
        "sp": np.full(N, 150.0),
        "op": np.round(50 + 6 * np.cos(T / 9), 2),
    }
    return {role: np.array(changed.get(role, x), dtype=float) for role, x in signals.items()}


def with_code(code, rows: Any = BAD, roles=("pv", "sp", "op"), **changed):
    signals = loop(**changed)
    for role in roles:
        signals[role][rows] = code
    return signals


@pytest.mark.parametrize("code", [-9999, -999.25, -99, 9999, 32767, -32768, 65535, -1e30, 1e31, -99999, 3.4028235e38])
def test_a_sentinel_is_bad_in_each_signal(code):
    found = find_bad_values(with_code(code))
    for mask in found.masks.values():
        np.testing.assert_array_equal(mask, BAD)
    assert found.counts == {f"number {code:.8g}": 3 * BAD.sum()}
    alone = find_bad_values(with_code(code, roles=["sp"]))
    assert {role: int(mask.sum()) for role, mask in alone.masks.items()} == {"pv": 0, "sp": BAD.sum(), "op": 0}


@pytest.mark.parametrize("code", [246, 253, 248, 307, -1000, 1234.5])
def test_a_common_number_is_a_state(code):
    found = find_bad_values(with_code(code))
    for mask in found.masks.values():
        np.testing.assert_array_equal(mask, BAD)
    assert found.counts == {f"state {code:.8g}": 3 * BAD.sum()}
    assert "the same number in all signals" in found.notes[0]


def test_a_state_counts_in_one_signal_alone_too():
    signals = with_code(246)
    signals["op"][100:105] = 246
    signals["pv"][200] = 253
    masks = find_bad_values(signals).masks
    assert np.flatnonzero(masks["op"] & ~BAD).tolist() == [100, 101, 102, 103, 104]
    assert not (masks["pv"] & ~BAD).any()  # 253 is no state of this source


def test_a_state_inside_the_range_of_the_pv_is_no_percentage():
    pv = 250 + 20 * np.sin(T / 9)
    signals = with_code(246, pv=pv, sp=np.full(N, 250.0))
    masks = find_common_states(signals)
    assert all((mask == BAD).all() for mask in masks.values())


def test_zeros_in_all_signals_are_a_state_only_for_a_moment():
    brief, long = (T > 100) & (T < 110), (T > 100) & (T < 200)
    assert find_bad_values(with_code(0, brief)).counts == {"state 0": 27}
    assert find_bad_values(with_code(0, long)).counts == {}
    assert find_bad_values(with_code(0, T > 590)).counts == {}


@pytest.mark.parametrize(
    "changed",
    [
        {"op": np.where(T < 300, 0.0, 50 + 6 * np.cos(T / 9))},
        {"op": np.where(T % 100 < 40, 100.0, 60 + 10 * np.cos(T / 9))},
        {"pv": np.where(T > 200, 0.0, 150.0)},
        {"pv": np.full(N, 999.0), "sp": np.full(N, 999.0)},
        {"pv": 9990.0 + T / 30.0},
        {"pv": -95.0 - (T % 9)},
        {"pv": 32000.0 + 40 * (T % 20)},
        {"sp": np.where(T < 300, 100.0, 150.0)},
        {"pv": np.round(50 + 6 * np.sin(T / 9)), "sp": np.full(N, 50.0), "op": np.round(50 + 6 * np.cos(T / 9))},
        {"pv": np.full(N, 50.0), "sp": np.full(N, 50.0), "op": np.full(N, 50.0)},
        {"pv": 50 + 6 * np.cos(T / 9), "sp": np.full(N, np.nan)},
    ],
)
def test_what_is_normal_stays(changed):
    found = find_bad_values(loop(**changed))
    assert found.counts == {}
    assert not any(mask.any() for mask in found.masks.values())


def test_copies_of_one_signal_are_no_states():
    x = 300 + np.sin(T / 9)
    assert not any(mask.any() for mask in find_common_states({"pv": x, "op": x, "sp": x}).values())


def test_a_signal_of_nothing_but_a_sentinel():
    assert find_sentinels(np.full(50, -9999.0)).all()
    assert not find_sentinels(np.full(50, -99.0)).any()
    assert not find_sentinels(np.full(50, np.nan)).any()


def test_texts_flags_and_numbers_count_once_each():
    signals = with_code(-9999, rows=[5, 6])
    signals["pv"][10:13] = np.nan
    found = find_bad_values(
        signals,
        texts={"pv": Counter({"Bad Input": 2, "": 1})},
        flags={"quality": np.isin(T, [6, 20]), "op quality": T == 30, "bad": T == 7},
        labels={"op": "FIC1.OP"},
    )
    assert found.counts == {"Bad Input": 2, "bad quality": 3 * 3 + 1, "number -9999": 3}
    assert np.flatnonzero(found.masks["op"]).tolist() == [5, 6, 7, 20, 30]
    assert "Missing: 1 value of FIC1.OP, flagged as bad." in found.notes
    assert "Missing: 2 rows, flagged as bad." in found.notes


@pytest.mark.parametrize(
    ("cells", "expected"),
    [
        (["AUTO", "", "MAN", "", "CAS"], [1, 1, 0, 0, 1]),
        (["", "", "MAN", "AUT"], [0, 0, 0, 1]),
        (["Auto local", "MAN-IMAN", "RCAS"], [1, 0, 1]),
        ([1, 0, None, 1], [1, 0, 0, 1]),
        ([True, False, None], [1, 0, 0]),
        (["AUTO", "AUTO", "AUTO", "HOLD"], [1, 1, 1, 0]),
        (["16", "16", "8"], None),
        (["", ""], None),
    ],
)
def test_modes(cells, expected):
    mask, notes = automatic_mask(pl.Series(cells))
    assert (None if mask is None else mask.tolist()) == (None if expected is None else [bool(k) for k in expected])
    assert bool(notes) == (expected is None or "HOLD" in cells)
