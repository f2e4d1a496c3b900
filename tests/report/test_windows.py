"""The strip of windows on the page of a loop, on paper and in a terminal."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import numpy as np
import pytest

import stiction as st
from stiction.apps.diagnose import group_by_loop
from stiction.report.blocks import Heading
from stiction.report.figures import windows
from stiction.report.pages.loop import loop_blocks


@pytest.fixture(scope="module")
def record():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(4.0, 2.0), st.FOPDT(2.0, 10.0, 8.0), dt=1.0, noise=0.05)
    load = 0.5 * np.sin(np.arange(6000) / 900.0)
    made = st.simulate(loop, sp=10.0, duration=6000.0, disturbance=load, seed=3, loop_type="flow")
    return replace(made, mv=None, start=datetime(2026, 3, 1), tag="FIC-1")


def test_page_of_several_windows_shows_each(record):
    found = st.diagnose([record.window(0, 2000), record.window(2000, 4000), record.window(4000, 6000)])
    figure = windows(found)
    assert figure is not None
    assert figure.table is not None
    assert [row[0] for row in figure.table.rows] == ["2026-03-01 00:00", "2026-03-01 00:33:20", "2026-03-01 01:06:40"]
    assert [row[4] for row in figure.table.rows] == [one.S for one in found.windows]
    titles = [block.text for block in loop_blocks(found) if isinstance(block, Heading)]
    assert "Over time" in titles


def test_one_window_has_no_strip(record):
    assert windows(st.diagnose(record.window(0, 2000), methods=False)) is None


def test_files_of_one_loop_are_put_together(record):
    parts = [record.window(0, 2000), record.window(2000, 4000)]
    other = replace(record.window(4000, 6000), tag="FIC-2")
    loops, notes = group_by_loop([*parts, other])
    assert [len(loop.records) for loop in loops] == [2, 1]
    assert notes == []


def test_files_that_contradict_each_other_stay_apart(record):
    part = record.window(0, 2000)
    loops, [note] = group_by_loop([part, replace(part, pv=part.pv + 1.0)])
    assert [len(loop.records) for loop in loops] == [1, 1]
    assert "different values of PV" in note
    without_times = [replace(part, start=None), replace(part, start=None)]
    assert [len(loop.records) for loop in group_by_loop(without_times)[0]] == [1, 1]
