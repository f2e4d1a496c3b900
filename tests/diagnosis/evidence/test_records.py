"""Records of one loop: how they are cut, ordered and refused, and what is pooled of them."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.evidence.one_loop import order_records
from stiction.diagnosis.evidence.windows import cut_grid, cut_record, window_target
from stiction.diagnosis.verdict.history import Window
from stiction.records import LoopRecord

START = datetime(2026, 3, 1)


@pytest.fixture(scope="module")
def day() -> LoopRecord:
    """A sticky valve for 16 200 s, with a load."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(4.0, 2.0), st.FOPDT(2.0, 10.0, 8.0), dt=1.0, noise=0.05)
    load = 0.5 * np.sin(np.arange(16_200) / 900.0)
    record = st.simulate(loop, sp=10.0, duration=16_200.0, disturbance=load, seed=3, loop_type="flow")
    return replace(record, mv=None, start=START, tag="FIC-1")


@pytest.fixture(scope="module")
def found(day):
    return st.diagnose(day)


def test_long_record_is_pooled_from_its_windows(day, found):
    assert [(one.start_s, one.end_s) for one in found.windows] == [
        (0.0, 5400.0),
        (5400.0, 10_800.0),
        (10_800.0, 16_200.0),
    ]
    assert [one.start for one in found.windows] == [START + timedelta(seconds=5400.0 * k) for k in range(3)]
    assert found.verdict == "stiction"
    assert found.identification.S_low <= 4.0 <= found.identification.S_high
    widths = [one.S_high - one.S_low for one in found.windows]
    assert found.identification.S_high - found.identification.S_low < min(widths)
    alone = st.diagnose(day.window(5400, 10_800), methods=False)
    assert found.windows[1].probability == alone.probability
    assert found.windows[1].S == alone.identification.S


def test_contributions_add_up_to_the_pooled_probability(found):
    total = found.average_log_odds + sum(one.log_odds for one in found.contributions) + np.log(0.25 / 0.75)
    assert total == pytest.approx(np.log(found.probability / (1.0 - found.probability)), abs=1e-9)


def test_records_and_the_record_that_they_make_give_the_same(day, found):
    parts = [day.window(*pair) for pair in ((5400, 10_800), (0, 5400), (10_800, 16_200))]
    pooled = st.diagnose(parts)
    assert pooled.probability == found.probability
    assert [one.to_row() for one in pooled.windows] == [one.to_row() for one in found.windows]


def test_one_short_record_is_judged_as_it_is(day):
    part = day.window(0, 3000)
    alone, listed = st.diagnose(part), st.diagnose([part])
    assert alone.to_dict() == listed.to_dict()
    assert len(alone.windows) == 1
    assert alone.windows[0].probability == alone.probability
    assert alone.history == ()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"tag": "FIC-2"}, "different loops"),
        ({"dt": 2.0}, "sampling period differs"),
        ({"start": None}, "has no times"),
        ({"pv": np.ones(1000)}, "different values of PV"),
        ({"op": np.full(1000, 0.4)}, "unit of OP differs"),
    ],
)
def test_records_that_do_not_belong_together_are_refused(day, change, text):
    first = day.window(0, 1000)
    with pytest.raises(st.RecordError, match=text):
        st.diagnose([first, replace(first, **change)])


def test_equal_times_count_once(day):
    first, second = order_records([day.window(500, 2000), day.window(0, 1000)])
    assert (len(first), len(second)) == (1000, 1000)
    assert second.start == START + timedelta(seconds=1000.0)


def test_gap_and_manual_time_part_the_windows():
    op = np.sin(np.arange(20_000.0))
    op[6000:7000] = np.nan
    auto = np.ones(20_000, dtype=bool)
    auto[12_000:13_000] = False
    cuts = cut_record(LoopRecord("FIC-1", 1.0, op=op, pv=op, auto=auto), window_target(1.0))
    assert [cut[:2] for cut in cuts] == [(0, 6000), (7000, 12_000), (13_000, 20_000)]


def test_grid_does_not_depend_on_what_is_read():
    op = np.sin(np.arange(3 * 17_280.0))
    whole = LoopRecord("FIC-1", 5.0, op=op, pv=op, start=START + timedelta(hours=2))
    cuts = cut_grid(whole, 21_600.0)
    assert [cut.start for cut in cuts][:2] == [START, START + timedelta(hours=6)]
    assert [cut.complete for cut in cuts] == [False, *(True,) * 11]
    for first in range(0, len(whole), 2880):
        for cut in cut_grid(whole.window(first, len(whole)), 21_600.0):
            if cut.complete:
                same = next(one for one in cuts if one.start == cut.start)
                assert (cut.first + first, cut.last + first) == same[:2]


def test_window_survives_a_ledger(found):
    for one in found.windows:
        assert Window.from_row(one.to_row()) == replace(one, contributions=())
