"""Numbers as text: nothing that is something is shown as 0, and no probability as certain."""

from __future__ import annotations

import time

import pytest
from hypothesis import given
from hypothesis import strategies as some

from stiction.display.duration_format import format_time
from stiction.display.number_format import format_interval, format_probability

pytestmark = pytest.mark.quick


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        # S of a plant's analyser loop, whose OP hardly moves, and J of it.
        ("0.0057 0.0040 0.0792", (0.005668, 0.004041, 0.07918)),
        ("0.0015 0.0000 0.0791", (0.0015, 0.0, 0.07906)),
        ("0.61 0.05 0.86", (0.614, 0.05341, 0.8596)),
        ("21 15 29", (20.54, 14.67, 28.76)),
        ("0.00 0.00 0.69", (0.0001, 0.0, 0.69)),
        ("0 0 0", (0.0, 0.0, 0.0)),
        ("5.00 5.00 5.00", (5.0, 5.0, 5.0)),
        ("5.000 5.000 5.000", (5.0, 4.99999, 5.00001)),
        ("100 95 105", (100.0, 95.0, 105.0)),
    ],
)
def test_an_interval_by_hand(text, numbers):
    assert " ".join(format_interval(*numbers)) == text


@given(low=some.floats(0.0, 1.0), value=some.floats(1e-4, 1e3), wide=some.floats(1.0, 900.0))
def test_number_other_than_zero_is_not_shown_as_zero(low, value, wide):
    ends = format_interval(value, low * value, wide * value)
    assert float(ends[0]) == pytest.approx(value, rel=0.5)
    assert len({len(text.partition(".")[2]) for text in ends}) == 1


@pytest.mark.parametrize(
    ("text", "probability"),
    [
        (">0.99", 1.0), (">0.99", 0.9956), ("0.99", 0.9949), ("0.90", 0.9), ("0.10", 0.1), ("0.01", 0.0051),
        ("<0.01", 0.0049), ("<0.01", 0.0), ("–", float("nan")),
    ],
)  # fmt: skip
def test_no_probability_is_shown_as_certain(text, probability):
    assert format_probability(probability) == text


@pytest.mark.skipif(not hasattr(time, "tzset"), reason="the zone of the process cannot be changed here")
def test_a_time_of_the_program_is_shown_in_the_zone_of_the_computer(monkeypatch):
    """Berlin is 1 h ahead of UTC in winter and 2 h in summer; a time without a zone stays as it is."""
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    try:
        assert format_time("2026-11-28T09:09:28+00:00", local=True) == "2026-11-28 10:09:28 CET"
        assert format_time("2026-07-01T23:30:00+00:00", local=True) == "2026-07-02 01:30 CEST"
        assert format_time("2026-03-02T06:00:00", local=True) == "2026-03-02 06:00"
    finally:
        monkeypatch.undo()
        time.tzset()
