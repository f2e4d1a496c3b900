"""Loops simulated with nothing of ours come out as those that the tables were found on."""

from __future__ import annotations

import pytest

from .textbook import alarms, counted, drawn, judged, run, table


def test_a_loop_is_drawn_again_the_same():
    one, other = drawn(3, 7), drawn(3, 7)
    assert one.cause == "stiction"
    assert (one.record.pv == other.record.pv).all()
    assert one.S >= one.J > 0.0


@pytest.mark.slow
def test_textbook_loops_are_told():
    rows = run(240, 5, 2)
    told = counted(judged(rows))
    assert told["told"] >= 0.75, table(rows)
    assert told["S within 10 %"] >= 0.65, table(rows)
    assert told["interval holds S"] >= 0.9, table(rows)
    assert alarms(rows) <= 5, table(rows)
