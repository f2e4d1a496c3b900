"""Time columns as plants name and write them, against the times that were written."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from stiction.apps.options import option_text
from stiction.errors import RecordError, Setting

START = datetime(2026, 2, 1, 10, 0, 0)
EPOCH = 1769940000  # date -u -d 2026-02-01T10:00:00 +%s

EPOCHS = ["t_stamp", "ts", "_time", "unix_time", "unix_timestamp", "Epoch Time", "timestamp_local", "Unix Time [ms]"]
SECONDS = ["seconds", "Seconds", "Elapsed Time (s)", "elapsed_time_s", "_time"]
STAMPED = ["t_stamp", "IP_TREND_TIME", "TimeString", "_time", "SourceTimestamp", "Server Timestamp", "Date & Time"]

FORMS = {
    "Java": lambda t: t.strftime("%a %b %d %H:%M:%S CET %Y"),
    "Unix date": lambda t: f"{t:%a %b} {t.day:2d} {t:%H:%M:%S %Y}",
    "dots in the clock": lambda t: t.strftime("%d.%m.%Y %H.%M.%S"),
    "dots in the clock, ISO day": lambda t: t.strftime("%Y-%m-%d %H.%M.%S"),
    "day and clock without marks": lambda t: t.strftime("%Y%m%d %H%M%S"),
    "clock first": lambda t: t.strftime("%H:%M:%S 2026-02-%d"),
    "clock first, month by name": lambda t: t.strftime("%I:%M:%S %p %d-Feb-26"),
}


def cells(form, n=120, step=1, start=START):
    return [form(start + timedelta(seconds=step * k)) for k in range(n)]


@pytest.mark.parametrize("name", EPOCHS)
def test_epochs_by_the_names_of_historians(name, signals, table, read_text):
    t, pv, op, _ = signals
    scale = 1000 if "ms" in name else 1
    [record] = read_text(table(f"{name},PV,OP", [str((EPOCH + 5 * int(k)) * scale) for k in t], pv, op))
    assert (record.dt, record.start, len(record)) == (5.0, START.replace(tzinfo=UTC), len(t))
    np.testing.assert_array_equal(record.op, op)


@pytest.mark.parametrize("name", SECONDS)
def test_seconds_by_the_names_of_historians(name, signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table(f"{name},PV,OP", 0.5 * t, pv, op))
    assert (record.dt, record.start, len(record)) == (0.5, None, len(t))


@pytest.mark.parametrize(
    ("name", "seconds"), [("secs", 1.0), ("Sec", 1.0), ("minutes", 60.0), ("Hours", 3600.0), ("ms", 1e-3)]
)
def test_a_column_named_by_its_unit_alone_is_time(name, seconds, signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table(f"{name},PV,OP", 30.0 * t / seconds, pv, op))
    assert record.dt == pytest.approx(30.0)
    np.testing.assert_array_equal(record.op, op)


@pytest.mark.parametrize("name", STAMPED)
def test_stamps_by_the_names_of_historians(name, signals, table, read_text):
    _, pv, op, _ = signals
    [record] = read_text(table(f"No,{name},PV,OP", ["7"] * len(pv), cells(str), pv, op))
    assert (record.dt, record.start, len(record)) == (1.0, START, len(pv))


def test_millionths_of_a_day_of_wincc(signals, table, read_text):
    # WinCC counts days as Excel does, and writes them times a million under a name that says milliseconds.
    days = (START - datetime(1899, 12, 30)) / timedelta(days=1)
    _, pv, op, _ = signals
    stamps = [f"{(days + k / 86400) * 1e6:.4f}" for k in range(len(pv))]
    [record] = read_text(table("Time_ms,PV,OP", stamps, pv, op))
    assert record.dt == pytest.approx(1.0, abs=1e-6)
    assert record.start is not None
    assert abs(record.start - START) < timedelta(milliseconds=2)
    assert any("millionths of a day" in guess for guess in record.provenance.assumptions)


def test_a_column_that_may_be_the_time_is_named(signals, table, read_text):
    t, pv, op, _ = signals
    says = (
        r"no column was recognised as the time; if it is 'Tick', name it with columns=\{'time': 'Tick'\}, "
        r"or give .* dt in seconds"
    )
    for column in (t, EPOCH + t, t[::-1], cells(str)):
        with pytest.raises(RecordError, match=says) as caught:
            read_text(table("PV,Tick,OP", pv, column, op))
    shown = caught.value.text(option_text)
    assert "if it is 'Tick', name it with --column time=Tick, or give the sampling period with --dt in seconds" in shown
    with pytest.raises(RecordError, match=r"columns=\{'time': 'Tick'\}"):
        read_text(table("Tick,PV,OP", t, pv, op), columns={"pv": "PV", "op": "OP"})
    [record] = read_text(table("Tick,PV,OP", t, pv, op), columns={"time": "Tick", "pv": "PV", "op": "OP"})
    assert record.dt == 1.0


def test_a_column_that_moves_both_ways_is_no_time(signals, table, read_text):
    _, pv, op, sp = signals
    with pytest.raises(RecordError, match=r"has no time column; give the sampling period with dt in seconds"):
        read_text(table("Flow,PV,OP,Level", pv + 1, pv, op, sp))


@pytest.mark.parametrize("form", FORMS)
def test_forms_of_stamps(form, signals, table, read_text):
    _, pv, op, _ = signals
    [record] = read_text(table("Time,PV,OP", cells(FORMS[form]), pv, op))
    assert (record.dt, record.start, len(record)) == (1.0, START, len(pv))
    np.testing.assert_array_equal(record.op, op)


def test_a_zone_by_its_name_is_a_wall_clock_and_said_so(signals, table, read_text):
    _, pv, op, _ = signals
    [record] = read_text(table("Time,PV,OP", cells(FORMS["Java"]), pv, op))
    assert record.start == START
    assert any("time zone CET is not known" in guess for guess in record.provenance.assumptions)
    [record] = read_text(table("Time,PV,OP", [cell.replace("CET", "UTC") for cell in cells(FORMS["Java"])], pv, op))
    assert record.start == START.replace(tzinfo=UTC)
    assert record.provenance.assumptions == ()


def test_forms_of_stamps_without_a_known_name(signals, table, read_text):
    _, pv, op, _ = signals
    for form in FORMS.values():
        [record] = read_text(table("Wann,PV,OP", cells(form), pv, op))
        assert (record.dt, record.start) == (1.0, START)


def test_the_clock_first_leaves_the_order_of_the_date_a_guess(signals, table, read_text):
    _, pv, op, _ = signals
    text = table("Time,PV,OP", cells(lambda t: t.strftime("%H:%M:%S %d/%m/%Y")), pv, op)
    [record] = read_text(text)
    assert record.start == START
    assert any("the day is not first (day_first)" in guess for guess in record.provenance.assumptions)
    assert read_text(text, day_first=False)[0].start == datetime(2026, 1, 2, 10)


COMPACT = {
    "both compact": ("%Y%m%d", "%H%M%S"),
    "clock compact": ("%Y-%m-%d", "%H%M%S"),
    "to the minute": ("%Y%m%d", "%H%M"),
    "dots": ("%d.%m.%Y", "%H.%M.%S"),
}


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("start", [datetime(2026, 2, 14, 7, 59), datetime(2026, 2, 14, 23, 59)])
@pytest.mark.parametrize("form", COMPACT)
def test_day_and_clock_without_marks_in_two_columns(form, start, cut, signals, table, read_text):
    _, pv, op, _ = signals
    day, clock = COMPACT[form]
    step = 60 if form == "to the minute" else 1
    clocks = [
        cell.lstrip("0") or "0" if cut and "." not in cell else cell
        for cell in cells(clock_of(clock), step=step, start=start)
    ]
    text = table("Date,Time,PV,OP", cells(clock_of(day), step=step, start=start), clocks, pv, op)
    [record] = read_text(text)
    assert (record.dt, record.start, len(record)) == (step, start, len(pv))
    np.testing.assert_array_equal(record.op, op)
    told = [guess for guess in record.provenance.assumptions if guess.startswith("Times such as")]
    assert len(told) == (cut and form != "dots")


def clock_of(form):
    return lambda t: t.strftime(form)


def test_two_columns_by_a_format(signals, table, read_text):
    _, pv, op, _ = signals
    text = table("Datum,Uhrzeit,PV,OP", cells(clock_of("%d%m%Y")), cells(clock_of("%H%M%S")), pv, op)
    [record] = read_text(text, time_format="%d%m%Y %H%M%S")
    assert (record.dt, record.start, len(record)) == (1.0, START, len(pv))


def test_a_temperature_beside_a_day_is_no_clock(signals, table, read_text):
    _, pv, op, _ = signals
    degrees = [str(45 + k % 3) for k in range(len(pv))]
    with pytest.raises(RecordError, match="all time stamps are equal"):
        read_text(table("Date,T,PV,OP", ["20260214"] * len(pv), degrees, pv, op))


def test_numbers_of_a_clock_without_marks_are_no_seconds(signals, table, read_text):
    _, pv, op, _ = signals
    for form, step in (("%H%M%S", 1), ("%H%M%S", 5), ("%H%M", 60)):
        clocks = [str(int(cell)) for cell in cells(clock_of(form), step=step, start=datetime(2026, 2, 14, 7, 59))]
        [record] = read_text(table("Time,PV,OP", clocks, pv, op))
        assert (record.dt, len(record)) == (step, len(pv))
        assert any("clock without marks" in guess for guess in record.provenance.assumptions)
    for counted in (range(len(pv)), range(0, 20 * len(pv), 20), range(0, 100 * len(pv), 100), range(7000, 7120)):
        [record] = read_text(table("Time,PV,OP", [str(k) for k in counted], pv, op))
        assert record.dt == counted[1] - counted[0]


@pytest.mark.parametrize("mark", [".", ","])
def test_minutes_and_seconds_as_excel_shows_them(mark, signals, table, read_text):
    t, pv, op, _ = signals
    stamps = [f"{int(s) // 60 % 60:02d}:{s % 60:04.1f}".replace(".", mark) for s in 45.5 * t]
    assert stamps[:3] == [f"00:00{mark}0", f"00:45{mark}5", f"01:31{mark}0"]
    [record] = read_text(table("Time;PV;OP", stamps, pv, op, delimiter=";", decimal=mark))
    assert (record.dt, record.start, len(record)) == (45.5, None, len(t))  # 90 minutes: twice over the hour
    assert any("minutes and seconds" in guess for guess in record.provenance.assumptions)


def test_timedeltas_of_pandas(signals, table, read_text):
    _, pv, op, _ = signals
    for step, form in ((900, "{0} days {1:02d}:{2:02d}:{3:02d}"), (900, "{0} days {1:02d}:{2:02d}:{3:02d}.500000")):
        spans = [divmod(step * k, 60) for k in range(len(pv))]
        stamps = [form.format(m // 1440, m // 60 % 24, m % 60, s) for m, s in spans]
        [record] = read_text(table("Time,PV,OP", stamps, pv, op))
        assert (record.dt, record.start, len(record)) == (900.0, None, len(pv))
    python = [str(timedelta(seconds=900 * k)) for k in range(len(pv))]
    assert python[-1] == "1 day, 5:45:00"
    [record] = read_text(table("Time;PV;OP", python, pv, op, delimiter=";"))
    assert (record.dt, len(record)) == (900.0, len(pv))


@pytest.mark.parametrize("first", [0, 20, 90])
def test_elapsed_hours_beyond_a_day(first, signals, table, read_text):
    _, pv, op, _ = signals
    minutes = [60 * first + 15 * k for k in range(len(pv))]
    stamps = [f"{m // 60:02d}:{m % 60:02d}:00" for m in minutes]
    [record] = read_text(table("Time,PV,OP", stamps, pv, op))
    assert (record.dt, record.start, len(record)) == (900.0, None, len(pv))
    np.testing.assert_array_equal(record.op, op)
    assert any("time elapsed" in guess for guess in record.provenance.assumptions)


def test_the_year_first_in_two_digits(signals, table, read_text):
    _, pv, op, _ = signals
    stamps = cells(lambda t: t.strftime("%y/%m/%d %H:%M:%S"))
    assert stamps[0] == "26/02/01 10:00:00"
    [record] = read_text(table("Time,PV,OP", stamps, pv, op))
    assert record.start == START
    assert any("26/02/01 are read year, month, day" in guess for guess in record.provenance.assumptions)
    # Over midnight 11/02/01 would be a year later, were the year last.
    late = datetime(2011, 2, 1, 23, 30)
    stamps = cells(lambda t: t.strftime("%y/%m/%d %H:%M:%S"), step=60, start=late)
    [record] = read_text(table("Time,PV,OP", stamps, pv, op))
    assert (record.dt, record.start, len(record)) == (60.0, late, len(pv))
    assert any("the days are then in order" in guess for guess in record.provenance.assumptions)
    # A last number above 31 can only be a year.
    stamps = cells(lambda t: t.strftime("%d/%m/%y %H:%M:%S"), start=datetime(1998, 2, 1, 10))
    assert read_text(table("Time,PV,OP", stamps, pv, op))[0].start == datetime(1998, 2, 1, 10)


def test_am_and_pm_point_to_the_month_first_where_nothing_else_tells(signals, table, read_text):
    _, pv, op, _ = signals
    stamps = cells(lambda t: f"{t.month}/{t.day}/{t:%Y %I:%M:%S %p}")
    assert stamps[0] == "2/1/2026 10:00:00 AM"
    [record] = read_text(table("Time,PV,OP", stamps, pv, op))
    assert record.start == START
    assert any("month before day" in guess and "AM" in guess for guess in record.provenance.assumptions)
    # Over midnight the days tell better than AM and PM do.
    late = datetime(2026, 2, 1, 23, 59)
    stamps = cells(lambda t: t.strftime("%d/%m/%Y %I:%M:%S %p"), start=late)
    [record] = read_text(table("Time,PV,OP", stamps, pv, op))
    assert (record.start, record.dt, len(record)) == (late, 1.0, len(pv))


def test_the_first_stamp_that_is_not_known_is_quoted(signals, table, read_text):
    _, pv, op, _ = signals
    with pytest.raises(RecordError) as caught:
        read_text(table(["Trend", "Time,PV,OP"], ["Q1-2026 #3"] * len(pv), pv, op))
    assert "line 3: 'Q1-2026 #3' is not a known form of time stamp; give time_format" in str(caught.value)
    shown = caught.value.text(option_text)
    assert shown.endswith("is not a known form of time stamp; give --time-format or --dt.")
    with pytest.raises(
        RecordError, match=r"time_format '%d\.%m' does not fit the stamps, such as '2026-02-01 10:00:00'"
    ):
        read_text(table("Time,PV,OP", cells(str), pv, op), time_format="%d.%m")


def test_a_column_name_with_spaces_is_one_argument():
    assert option_text(Setting("columns", {"time": "Local clock (s)"})) == '--column "time=Local clock (s)"'
