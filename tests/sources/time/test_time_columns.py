"""Which columns are the time, and columns that databases and frames store as dates."""

from __future__ import annotations

from datetime import date, datetime, time, timedelta
from zoneinfo import ZoneInfo

import numpy as np
import polars as pl
import pytest

from stiction.errors import RecordError
from stiction.sources.options import ReadOptions
from stiction.sources.time.time_columns import find_time_columns, is_time_heading, missing_time_error, seconds_per_unit

START = datetime(2026, 2, 14, 7, 59)
N = 120
VALUES = [f"{50 + (k * 7) % 5}.25" for k in range(N)]


def cells(form, step=1.0, start=START):
    moments = [start + timedelta(seconds=step * k) for k in range(N)]
    return [moment.strftime(form) if isinstance(form, str) else form(moment) for moment in moments]


def positions(table, header, *columns, **options):
    found = find_time_columns(header, [""] * len(header), table(header, *columns), ReadOptions(**options))
    return found.positions, found.index


NAMES = ["t_stamp", "IP_TREND_TIME", "TimeString", "_time", "SourceTimestamp", "Server Timestamp", "Date & Time",
         "Datum", "Time [s]", "Zeitstempel", '"Time"']  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_columns_by_the_names_of_historians(name, table):
    assert is_time_heading(name)
    assert positions(table, ["No", name, "PV"], ["7"] * N, cells(str), VALUES) == ((1,), None)


def test_units_of_a_time_column():
    assert [seconds_per_unit(name) for name in ("Time [ms]", "time_h", "Time", "Minutes")] == [1e-3, 3600.0, None, 60.0]
    assert seconds_per_unit("Time", "min") == 60.0


@pytest.mark.parametrize("form", ["%Y-%m-%d %H:%M:%S", "%m/%d/%Y %H:%M:%S", "%d-%b-%y %H:%M:%S", "%Y-%jT%H:%M:%SZ"])
@pytest.mark.parametrize("name", ["", " ", "Unnamed: 0", "Wann"])
def test_a_first_column_of_stamps_under_any_heading(name, form, table):
    assert positions(table, [name, "PV"], cells(form), VALUES) == ((0,), None)


def test_stamps_after_an_index(table):
    counted = [str(k) for k in range(N)]
    assert positions(table, ["", "", "PV"], counted, cells(str), VALUES) == ((1,), 0)
    assert positions(table, ["", "PV"], counted, VALUES) == ((), 0)
    assert positions(table, ["Sample", "PV"], counted, VALUES) == ((), 0)
    assert positions(table, [], counted, VALUES) == ((), None)


@pytest.mark.parametrize(
    ("name", "scale"), [("Milliseconds", 1e-3), ("ms", 1e-3), ("MSEC", 1e-3), ("Microseconds", 1e-6)]
)
@pytest.mark.parametrize("step", [1.5, 0.25, 0.125, 2.0])
@pytest.mark.parametrize("place", [1, 2])
def test_the_fraction_of_the_second_in_a_column_of_its_own(name, scale, step, place, stamps_of, since_1970):
    moments = [START + timedelta(seconds=step * k) for k in range(N)]
    header, columns = ["Time", "PV"], [[f"{moment:%d/%m/%Y %H:%M:%S}" for moment in moments], VALUES]
    header.insert(place, name)
    columns.insert(place, [str(round(moment.microsecond * 1e-6 / scale)) for moment in moments])
    found = stamps_of(header, *columns)
    np.testing.assert_allclose(found.seconds, [since_1970(moment) for moment in moments], atol=1e-6)


def test_milliseconds_that_count_on_are_the_time(stamps_of):
    for step in (5, 500):
        found = stamps_of(["ms", "PV"], [str(step * k) for k in range(N)], VALUES)
        np.testing.assert_allclose(found.seconds, step * 1e-3 * np.arange(N))


FORMS = {
    "usual": ("%d.%m.%Y", "%H:%M:%S"),
    "both compact": ("%Y%m%d", "%H%M%S"),
    "clock compact": ("%Y-%m-%d", "%H%M%S"),
    "to the minute": ("%Y%m%d", "%H%M"),
    "dots": ("%d.%m.%Y", "%H.%M.%S"),
    "day of year": ("%Y.%j", "%H:%M:%S"),
    "half days": ("%m/%d/%Y", "%I:%M:%S %p"),
    "midnight": ("%Y-%m-%d 00:00:00", "%H:%M:%S"),
}


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("start", [START, datetime(2026, 2, 14, 23, 59)])
@pytest.mark.parametrize("form", FORMS)
def test_a_date_and_a_time_of_day(form, start, cut, stamps_of, since_1970):
    day, clock = FORMS[form]
    step = 60 if form == "to the minute" else 1
    clocks = cells(clock, step, start)
    if cut and not set(clock) & set(":. "):
        clocks = [cell.lstrip("0") or "0" for cell in clocks]
    found = stamps_of(["Date", "Time", "PV"], cells(day, step, start), clocks, VALUES)
    np.testing.assert_array_equal(found.seconds, since_1970(start) + step * np.arange(N))
    assert any(note.startswith("Times such as") for note in found.notes) == any(
        len(c) < 4 + 2 * (step == 1) for c in clocks
    )


def test_two_columns_by_a_format(stamps_of, since_1970):
    options = {"time_format": "%d%m%Y %H%M%S"}
    found = stamps_of(["Datum", "Uhrzeit", "PV"], cells("%d%m%Y"), cells("%H%M%S"), VALUES, **options)
    np.testing.assert_array_equal(found.seconds, since_1970(START) + np.arange(N))


def test_a_temperature_beside_a_day_is_no_clock(table):
    degrees = [str(45 + k % 3) for k in range(N)]
    assert positions(table, ["Date", "T", "PV"], ["20260214"] * N, degrees, VALUES) == ((0,), None)


def test_a_column_that_the_user_names(table):
    header = ["Tick", "PV"]
    for column in ("Tick", "tick", "0", 0):
        assert positions(table, header, cells(str), VALUES, columns={"time": column}) == ((0,), None)
    with pytest.raises(RecordError, match=r"has no column 'When' for the time; its columns are Tick, PV"):
        positions(table, header, cells(str), VALUES, columns={"time": "When"})
    with pytest.raises(RecordError, match="has no column 7 for the time; they are numbered 0 to 1"):
        positions(table, header, cells(str), VALUES, columns={"time": 7})


def test_the_error_names_a_column_that_may_be_the_time(table):
    text = (
        r"no column was recognised as the time; if it is 'Tick', name it with columns=\{'time': 'Tick'\}, "
        r"or give .* dt in seconds"
    )
    for column in ([str(k) for k in range(N)], [str(-k) for k in range(N)], cells(str)):
        made = table(["PV", "Tick"], VALUES, column)
        with pytest.raises(RecordError, match=text):
            raise missing_time_error(made, ["PV", "Tick"], [0])
    made = table(["PV", "Level"], VALUES, VALUES[::-1])
    assert "has no time column; give the sampling period" in str(missing_time_error(made, ["PV", "Level"], [0]))
    made = table(["Sample", "PV"], [str(k) for k in range(N)], VALUES)
    assert "has only a sample index; give" in str(missing_time_error(made, ["Sample", "PV"], [1]))


NATIVE = {
    "datetime": (pl.Series([START + timedelta(seconds=k) for k in range(N)]), "local"),
    "milliseconds": (pl.Series([START + timedelta(seconds=k) for k in range(N)]).cast(pl.Datetime("ms")), "local"),
    "UTC": (pl.Series([START + timedelta(seconds=k) for k in range(N)]).dt.replace_time_zone("UTC"), "utc"),
    "Berlin": (
        pl.Series([START + timedelta(seconds=k) for k in range(N)]).dt.replace_time_zone("Europe/Berlin"),
        "utc",
    ),
    "duration": (pl.Series([timedelta(seconds=k) for k in range(N)]), "relative"),
    "time of day": (
        pl.Series([(datetime(2026, 1, 1, 23, 59) + timedelta(seconds=k)).time() for k in range(N)]),
        "relative",
    ),
}


@pytest.mark.parametrize("native", NATIVE)
def test_columns_that_are_stored_as_times(native, stamps_of, since_1970):
    column, kind = NATIVE[native]
    found = stamps_of(["Time", "PV"], column, VALUES)
    assert found.kind == kind
    np.testing.assert_array_equal(np.diff(found.seconds), 1.0)
    if kind != "relative":
        aware = START.replace(tzinfo=ZoneInfo("Europe/Berlin")) if native == "Berlin" else START
        assert found.seconds[0] == since_1970(aware)


def test_stored_dates_beside_stored_times_of_day(stamps_of, since_1970):
    found = stamps_of(
        ["Date", "Time"], pl.Series([date(2026, 2, 14)] * 60), pl.Series([time(7, 59, k) for k in range(60)])
    )
    np.testing.assert_array_equal(found.seconds, since_1970(START) + np.arange(60.0))


@pytest.mark.parametrize("form", ["0001-01-01 00:00:00", "9999-12-31 23:59:59", "01.01.0001 00:00", "1.1.2999 0:00"])
def test_a_date_that_stands_for_none_is_no_stamp(form, stamps_of):
    found = stamps_of(["Time", "PV"], [*cells(str)[:-2], form, form], VALUES)
    assert np.flatnonzero(np.isnan(found.seconds)).tolist() == [N - 2, N - 1]
    assert found.first_unread == (N - 2, form)
    stored = [START + timedelta(seconds=k) for k in range(N - 1)]
    found = stamps_of(["Time", "PV"], pl.Series([datetime(1, 1, 1), *stored]), VALUES)
    assert np.flatnonzero(np.isnan(found.seconds)).tolist() == [0]
