"""Wall clocks of a named zone, against `zoneinfo`."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.sources.time.parse import localise
from stiction.sources.time.stamps import Stamps

ZONES = [
    "Europe/Berlin",
    "America/New_York",
    "Australia/Sydney",
    "America/St_Johns",
    "Asia/Kolkata",
    "UTC",
    "Europe/London",
]
ENDS = {  # one hour before clocks go back or forward, UTC
    "Europe/Berlin": [datetime(2026, 10, 25, 0), datetime(2026, 3, 29, 0)],
    "Europe/London": [datetime(2026, 10, 25, 0), datetime(2026, 3, 29, 0)],
    "America/New_York": [datetime(2026, 11, 1, 5), datetime(2026, 3, 8, 6)],
    "Australia/Sydney": [datetime(2026, 4, 4, 15), datetime(2026, 10, 3, 15)],
}


def wall_clock(utc, zone):
    shown = [datetime.fromtimestamp(second, ZoneInfo(zone)).replace(tzinfo=UTC).timestamp() for second in utc]
    return Stamps(np.array(shown), "local")


@settings(deadline=None, max_examples=100)
@given(
    zone=some.sampled_from(ZONES),
    start=some.datetimes(datetime(1990, 1, 1), datetime(2036, 1, 1)),
    step=some.sampled_from([1.0, 10.0, 60.0, 300.0, 900.0]),
    reverse=some.booleans(),
)
def test_moments_come_back(zone, start, step, reverse):
    utc = np.floor(start.replace(tzinfo=UTC).timestamp()) + step * np.arange(400)
    utc = utc[::-1] if reverse else utc
    found = localise(wall_clock(utc, zone), zone)
    assert found.kind == "utc"
    np.testing.assert_array_equal(found.seconds, utc)


@pytest.mark.parametrize("zone", ENDS)
@pytest.mark.parametrize("lost", [0, 20, 55])
@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("reverse", [False, True])
def test_changes_of_the_clock(zone, lost, which, reverse):
    # Rows every minute from half an hour before the first repeated hour, some of which are lost.
    utc = ENDS[zone][which].replace(tzinfo=UTC).timestamp() - 1800.0 + 60.0 * np.arange(240)
    utc = np.delete(utc, slice(35, 35 + lost))
    utc = utc[::-1] if reverse else utc
    found = localise(wall_clock(utc, zone), zone)
    np.testing.assert_array_equal(found.seconds, utc)
    assert (found.clock_jumps, found.dst_changes) == ((1, 1) if which == 0 else (0, 0))
    assert any("twice" in note for note in found.notes) == (which == 0)


@pytest.mark.parametrize("by_tag", [True, False])
def test_rows_of_several_tags_repeat_the_hour_once(by_tag):
    change = ENDS["Europe/Berlin"][0].replace(tzinfo=UTC).timestamp()
    own = change - 1800.0 + 60.0 * np.arange(240)
    tags = [own, own + 7.0, own + 3.0]  # rows of one minute are not in the order of time
    utc = np.concatenate(tags) if by_tag else np.column_stack(tags).ravel()
    found = localise(wall_clock(utc, "Europe/Berlin"), "Europe/Berlin")
    np.testing.assert_array_equal(found.seconds, utc)
    assert (found.clock_jumps, found.dst_changes, len(found.notes)) == (1, 1, 1)


@pytest.mark.parametrize("begins", [True, False])
def test_a_record_that_begins_or_ends_in_a_repeated_hour(begins):
    change = ENDS["Europe/Berlin"][0].replace(tzinfo=UTC).timestamp()
    utc = (change + 5400.0 if begins else change - 3600.0) + 60.0 * np.arange(90)
    found = localise(wall_clock(utc, "Europe/Berlin"), "Europe/Berlin")
    np.testing.assert_array_equal(found.seconds, utc)


def test_an_hour_that_the_clock_skips_is_a_note():
    wall = np.array([datetime(2026, 3, 29, 1, 30, tzinfo=UTC).timestamp() + 1800.0 * k for k in range(6)])
    found = localise(Stamps(wall, "local"), "Europe/Berlin")
    assert found.seconds[1] == datetime(2026, 3, 29, 1, 0, tzinfo=UTC).timestamp()  # 02:00 CET
    assert "2 stamps in an hour that the clock of Europe/Berlin skips" in found.notes[0]


def test_stamps_with_a_zone_keep_it(stamps_of):
    cells = [(datetime(2026, 2, 1, 10) + timedelta(seconds=k)).isoformat() + "Z" for k in range(20)]
    found = stamps_of(["Time", "PV"], cells, ["1"] * 20, timezone="Europe/Berlin")
    assert found.seconds[0] == datetime(2026, 2, 1, 10, tzinfo=UTC).timestamp()
    assert "is not used" in found.notes[-1]
    naive = stamps_of(["Time", "PV"], [cell[:-1] for cell in cells], ["1"] * 20, timezone="Europe/Berlin")
    assert (naive.kind, naive.seconds[0]) == ("utc", datetime(2026, 2, 1, 9, tzinfo=UTC).timestamp())
    elapsed = stamps_of(["Time", "PV"], [str(k) for k in range(20)], ["1"] * 20, timezone="Europe/Berlin")
    assert elapsed.kind == "relative"
