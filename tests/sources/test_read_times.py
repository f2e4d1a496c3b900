"""Time stamps, against datetimes of the standard library."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.errors import RecordError

START = datetime(2026, 2, 1, 13, 0, 0)
FORMS = {
    "%Y-%m-%d %H:%M:%S": {},
    "%Y-%m-%dT%H:%M:%S": {},
    "%Y/%m/%d %H:%M:%S": {},
    "%d.%m.%Y %H:%M:%S": {},
    "%d/%m/%Y %H:%M:%S": {"day_first": True},
    "%m/%d/%Y %I:%M:%S %p": {"day_first": False},
    "%d-%b-%y %H:%M:%S": {},
    "%d-%b-%Y %H:%M:%S.%f": {},
    "%b %d %Y %H:%M:%S": {},
    "%A %d %B %Y %H:%M:%S": {},
    "%Y%m%d%H%M%S": {},
    "%Y%m%dT%H%M%S": {},
    "%H.%M.%S %d.%m.%Y": {"time_format": "%H.%M.%S %d.%m.%Y"},
}


def stamps(n, seconds, form, start=START):
    return [(start + timedelta(seconds=seconds * k)).strftime(form) for k in range(n)]


@pytest.mark.parametrize("form", FORMS)
def test_forms_of_time_stamps(form, signals, table, read_text):
    _, pv, op, _ = signals
    [record] = read_text(table("Timestamp,PV,OP", stamps(len(pv), 10, form), pv, op), **FORMS[form])
    assert (record.dt, record.start) == (10.0, START)
    np.testing.assert_array_equal(record.op, op)


@pytest.mark.parametrize(("zone", "hours"), [("Z", 0), ("+00:00", 0), ("+02:00", 2), ("-0530", -5.5), (" UTC", 0)])
def test_zones_become_utc(zone, hours, signals, table, read_text):
    _, pv, op, _ = signals
    cells = [f"{cell}{zone}" for cell in stamps(len(pv), 10, "%Y-%m-%dT%H:%M:%S")]
    [record] = read_text(table("Timestamp,PV,OP", cells, pv, op))
    assert record.start == START.replace(tzinfo=UTC) - timedelta(hours=hours)


@pytest.mark.parametrize(
    ("name", "per_second", "zero", "kind"),
    [
        ("time_ms", 1e3, 0.0, None),
        ("Time [min]", 1 / 60, 0.0, None),
        ("time_h", 1 / 3600, 0.0, None),
        ("time", 1.0, 0.0, None),
        ("Timestamp", 1.0, 1.7699508e9, UTC),
        ("Timestamp", 1e3, 1.7699508e9, UTC),
        ("Timestamp", 1e6, 1.7699508e9, UTC),
        ("Timestamp", 1 / 86400, 46054.5416666667 * 86400, "excel"),
    ],
)
def test_times_as_numbers(name, per_second, zero, kind, signals, table, read_text):
    _, pv, op, _ = signals
    cells = [repr((zero + 30.0 * k) * per_second) for k in range(len(pv))]
    [record] = read_text(table(f"{name},PV,OP", cells, pv, op))
    assert record.dt == pytest.approx(30.0, rel=1e-5)
    # 1 769 950 800 s after 1970 and Excel's 46 054.541666 are both the first of February 2026, 13:00.
    assert record.start == {None: None, "excel": START}.get(kind, START.replace(tzinfo=UTC))
    np.testing.assert_array_equal(record.pv, pv)


@pytest.mark.parametrize(
    ("name", "step", "dt", "said"),
    [
        ("time", 1000, 1.0, "milliseconds"),
        ("time", 5000, 5.0, "milliseconds"),
        ("time", 60, 60.0, "seconds"),
        ("time", 900, 900.0, "seconds"),
        ("time_s", 1000, 1000.0, None),
    ],
)
def test_milliseconds_without_a_unit_are_reported_by_their_size(name, step, dt, said, signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table(f"{name},PV,OP", [str(int(step * k)) for k in t], pv, op))
    assert record.dt == pytest.approx(dt)
    told = [guess for guess in record.provenance.assumptions if "time column" in guess]
    assert told == [] if said is None else f"taken as {said}" in told[0]


def test_ambiguous_dates_follow_the_data(signals, table, read_text):
    _, pv, op, _ = signals
    # Two hours over midnight: 01/02 -> 02/02 is the next day only when the day comes first.
    late = datetime(2026, 2, 1, 23, 59, 0)
    [record] = read_text(table("Time,PV,OP", stamps(len(pv), 60, "%d/%m/%Y %H:%M", late), pv, op))
    assert (record.dt, record.start, len(record)) == (60.0, late, len(pv))
    [record] = read_text(table("Time,PV,OP", stamps(len(pv), 60, "%m/%d/%Y %H:%M", late), pv, op))
    assert (record.dt, record.start, len(record)) == (60.0, late, len(pv))


def test_ambiguous_dates_without_a_hint_are_a_stated_guess(signals, table, read_text):
    _, pv, op, _ = signals
    [record] = read_text(table("Time,PV,OP", stamps(len(pv), 10, "%d/%m/%Y %H:%M:%S"), pv, op))
    assert any("the day is not first (day_first)" in guess for guess in record.provenance.assumptions)


def test_days_above_twelve_settle_the_order(signals, table, read_text):
    _, pv, op, _ = signals
    start = datetime(2026, 2, 25, 1, 0)
    for form in ("%d/%m/%y %H:%M:%S", "%m/%d/%y %H:%M:%S"):
        [record] = read_text(table("Time,PV,OP", stamps(len(pv), 5, form, start), pv, op))
        assert record.start == start
        assert not any("day_first" in guess for guess in record.provenance.assumptions)


def test_date_and_clock_in_two_columns(signals, table, read_text):
    _, pv, op, _ = signals
    days, clocks = stamps(len(pv), 10, "%d.%m.%Y"), stamps(len(pv), 10, "%H:%M:%S")
    [record] = read_text(table("Date;Time;PV;OP", days, clocks, pv, op, delimiter=";"))
    assert (record.start, record.dt) == (START, 10.0)
    [record] = read_text(table("Time PV OP", days, clocks, pv, op, delimiter=" "))
    assert (record.start, record.dt) == (START, 10.0)
    np.testing.assert_array_equal(record.op, op)


def test_clock_without_a_date_runs_over_midnight(signals, table, read_text):
    _, pv, op, _ = signals
    cells = stamps(len(pv), 10, "%H:%M:%S", datetime(2026, 2, 1, 23, 55))
    [record] = read_text(table("Time,PV,OP", cells, pv, op))
    assert (record.dt, record.start, len(record)) == (10.0, None, len(pv))
    np.testing.assert_array_equal(record.op, op)


def test_sample_index_needs_dt(signals, table, read_text):
    t, pv, op, _ = signals
    text = table("sample,PV,OP", t, pv, op)
    with pytest.raises(RecordError, match="sample index; give the sampling period with dt in seconds"):
        read_text(text)
    assert read_text(text, dt=2.5)[0].dt == 2.5
    with pytest.raises(RecordError, match="no time column"):
        read_text(table("PV,OP", pv, op))


def test_gaps_become_missing_samples(signals, table, read_text):
    t, pv, op, _ = signals
    keep = np.r_[0:50, 57:120]
    [record] = read_text(table("time_s,PV,OP", 10 * t[keep], pv[keep], op[keep]))
    assert (record.dt, len(record), record.provenance.missing_samples) == (10.0, 120, 7)
    assert np.isnan(record.pv[50:57]).all()
    np.testing.assert_array_equal(record.pv[57:], pv[57:])
    assert any("7 samples in 1 gap of" in guess for guess in record.provenance.assumptions)


def test_newest_first_unsorted_and_repeated_rows(signals, table, read_text):
    t, pv, op, _ = signals
    [record] = read_text(table("time_s,PV,OP", t[::-1], pv[::-1], op[::-1]))
    np.testing.assert_array_equal(record.op, op)
    order = np.arange(len(t))
    order[[10, 11]] = 11, 10
    order = np.insert(order, 30, 29)
    [record] = read_text(table("time_s,PV,OP", t[order], pv[order], op[order]))
    np.testing.assert_array_equal(record.op, op)
    assert record.provenance.clock_jumps == 1
    assert any("with the same time stamp as the next" in guess for guess in record.provenance.assumptions)


def test_shuffled_rows_are_sorted_and_not_said_to_be_turned_round(signals, table, read_text):
    t, pv, op, _ = signals
    for seed in range(4):  # more steps back than forward in some
        order = np.random.default_rng(seed).permutation(len(t))
        [record] = read_text(table("time_s,PV,OP", t[order], pv[order], op[order]))
        np.testing.assert_array_equal(record.op, op)
        [told] = [guess for guess in record.provenance.assumptions if "order" in guess]
        assert told.startswith("The rows are not in the order of time")
        assert told.endswith("they were sorted.")


def test_uneven_stamps_are_held_never_interpolated(table, read_text):
    rng = np.random.default_rng(3)
    t = np.round(np.cumsum(rng.uniform(0.2, 3.0, 300)), 2)
    op, pv = np.round(rng.normal(50, 5, 300), 3), np.round(rng.normal(5, 1, 300), 3)
    [record] = read_text(table("time_s,PV,OP", t, pv, op))
    assert set(record.op) <= set(op)
    for k in range(0, len(record), 17):  # the last value at or before each moment, found the slow way
        moment = t[0] + record.time[k]
        last = max(i for i in range(300) if t[i] <= moment + 1e-6)
        assert (record.op[k], record.pv[k]) == (op[last], pv[last])
    assert any("each value is used until the next one" in guess for guess in record.provenance.assumptions)


def test_jittering_stamps_keep_every_row(signals, table, read_text):
    t, pv, op, _ = signals
    jitter = np.random.default_rng(1).uniform(-0.9, 0.9, len(t))
    [record] = read_text(table("time_s,PV,OP", np.round(10 * t + jitter, 3), pv, op))
    assert record.dt == pytest.approx(10.0, rel=2e-3)
    np.testing.assert_array_equal(record.op, op)


def test_stamps_rounded_to_the_minute_are_spread(signals, table, read_text):
    _, pv, op, _ = signals
    cells = stamps(len(pv), 10, "%Y-%m-%d %H:%M")
    [record] = read_text(table("Time,PV,OP", cells, pv, op))
    assert record.dt == 10.0
    np.testing.assert_array_equal(record.op, op)
    assert any("share each stamp" in guess for guess in record.provenance.assumptions)


def test_summer_time(table, read_text):
    zoneinfo = pytest.importorskip("zoneinfo")
    try:
        berlin = zoneinfo.ZoneInfo("Europe/Berlin")
    except zoneinfo.ZoneInfoNotFoundError:
        pytest.skip("no time zone data on this machine")
    for utc in (datetime(2026, 10, 24, 22, tzinfo=UTC), datetime(2026, 3, 28, 22, tzinfo=UTC)):
        k = np.arange(300)
        cells = [(utc + timedelta(minutes=int(i))).astimezone(berlin).strftime("%d.%m.%Y %H:%M:%S") for i in k]
        pv, op = np.round(np.sin(k / 9.0), 3), np.round(50 + np.cos(k / 9.0), 3)
        [record] = read_text(table("Time,PV,OP", cells, pv, op))
        assert (record.dt, len(record), record.provenance.clock_jumps) == (60.0, 300, 1)
        assert record.provenance.summer_time == 1
        np.testing.assert_array_equal(record.op, op)
        assert any("summer time" in guess for guess in record.provenance.assumptions)


def test_unreadable_stamps_are_left_out_and_said(signals, table, read_text):
    _, pv, op, _ = signals
    cells = stamps(len(pv), 10, "%Y-%m-%d %H:%M:%S")
    cells[7] = "soon"
    [record] = read_text(table("Time,PV,OP", cells, pv, op))
    assert np.isnan(record.op[7])
    assert any("1 row without a readable time stamp" in guess for guess in record.provenance.assumptions)


@pytest.mark.parametrize("seconds", [7, 8, 9, 11, 13, 14.5, 17, 25, 40, 42.5])
def test_stamps_rounded_to_a_minute_that_no_whole_number_of_rows_fills(seconds, signals, table, read_text):
    _, pv, op, _ = signals
    cells = stamps(len(pv), seconds, "%Y-%m-%d %H:%M", START + timedelta(seconds=3))
    [record] = read_text(table("Time,PV,OP", cells, pv, op))
    assert record.dt == pytest.approx(seconds, rel=0.01)
    np.testing.assert_array_equal(record.op, op)
    assert any("share each stamp" in guess for guess in record.provenance.assumptions)


def test_rounded_stamps_that_tell_no_period_are_refused_and_dt_cures_it(signals, table, read_text):
    _, pv, op, _ = signals
    moments = np.cumsum(np.random.default_rng(2).uniform(5, 40, len(pv)))
    cells = [(START + timedelta(seconds=s)).strftime("%Y-%m-%d %H:%M") for s in moments]
    text = table("Time,PV,OP", cells, pv, op)
    with pytest.raises(RecordError, match=r"of 120 rows have the same time stamp .* are rounded; .* dt in seconds"):
        read_text(text)
    [record] = read_text(text, dt=20.0)
    assert (record.dt, record.start) == (20.0, START)
    np.testing.assert_array_equal(record.op, op)


def test_a_few_rows_of_one_stamp_and_other_values_are_left_out_and_said(signals, table, read_text):
    t, pv, op, _ = signals
    t = t.copy()
    t[[20, 60]] = t[[21, 61]]
    [record] = read_text(table("time_s,PV,OP", t, pv, op))
    assert np.isnan(record.op[20])
    assert any(
        "2 rows with the same time stamp as the next row, 2 rows of them with" in guess
        for guess in record.provenance.assumptions
    )


def test_a_given_dt_stands_above_wrong_stamps_and_keeps_every_row(signals, table, read_text):
    t, pv, op, _ = signals
    drunk = np.cumsum(np.random.default_rng(4).uniform(0.01, 9.0, len(t)))
    for wrong in (t, 7.0 * t, t // 2, t // 7, drunk, t[::-1], np.where(t < 60, t, t + 1e7)):
        [record] = read_text(table("time_s,PV,OP", wrong, pv, op), dt=2.5)
        assert record.dt == 2.5
        np.testing.assert_array_equal(record.op, op[::-1] if wrong[0] > wrong[-1] else op)
        assert any("taken as 2.5 s apart" in guess and "not used" in guess for guess in record.provenance.assumptions)
    [record] = read_text(table("Time,PV,OP", ["x"] * len(t), pv, op), dt=3.0)
    assert (record.dt, len(record)) == (3.0, len(t))


def test_a_given_dt_that_the_stamps_bear_out_keeps_their_gaps(signals, table, read_text):
    t, pv, op, _ = signals
    there = np.r_[0:50, 57 : len(t)]
    [record] = read_text(table("time_s,PV,OP", 10.002 * t[there], pv[there], op[there]), dt=10.0)
    assert (record.dt, len(record)) == (10.0, len(t))
    assert np.flatnonzero(np.isnan(record.op)).tolist() == list(range(50, 57))
    np.testing.assert_array_equal(record.op[57:], op[57:])
    minutes = [(START + timedelta(seconds=10 * k)).strftime("%Y-%m-%d %H:%M") for k in range(len(t))]
    np.testing.assert_array_equal(read_text(table("Time,PV,OP", minutes, pv, op), dt=10.0)[0].op, op)


def test_rows_that_a_file_has_twice_are_read_once(signals, table, read_text):
    t, pv, op, _ = (np.repeat(x, 2) for x in signals)
    [record] = read_text(table("time_s,PV,OP", t, pv, op))
    assert (record.dt, record.pv.tolist(), record.op.tolist()) == (1.0, *(x.tolist() for x in signals[1:3]))
    assert any("120 rows" in guess for guess in record.provenance.assumptions)


SERIAL = 46054.0 + 13.0 / 24.0 + 0.3 / 86400.0
"""START as a day of Excel, and a little."""


def serials(k, seconds, places):
    return [f"{SERIAL + seconds * i / 86400.0:.{places}f}" for i in k]


@pytest.mark.parametrize(
    ("seconds", "places"), [(0.8, 5), (1, 5), (1.2, 5), (1.5, 5), (2, 5), (5, 5), (10, 4), (12, 4), (60, 4), (0.5, 6)]
)
def test_serial_days_rounded_to_a_few_decimals_are_even_behind(seconds, places, table, read_text):
    k = np.arange(600)
    pv, op = np.round(np.sin(k / 9.0), 4), np.round(50 + np.cos(k / 9.0), 4)
    [record] = read_text(table("Date,PV,OP", serials(k, seconds, places), pv, op))
    assert (record.dt, len(record)) == (pytest.approx(seconds, rel=1e-4), 600)
    assert abs((record.start - START).total_seconds()) <= 0.5 * 86400.0 * 10.0**-places + 0.3
    np.testing.assert_array_equal(record.op, op)
    assert any(f"rounded to {86400.0 * 10.0**-places:g} s" in guess for guess in record.provenance.assumptions)


@settings(deadline=None, max_examples=30)
@given(
    seconds=some.sampled_from([1.0, 1.2, 1.5, 2.0, 3.0, 5.0]),
    lost=some.sets(some.integers(1, 398), max_size=40),
    gap=some.tuples(some.integers(40, 340), some.integers(0, 30)),
)
def test_rows_lost_between_rounded_serial_days_are_gaps_and_no_more(seconds, lost, gap, table, read_text):
    n = 400
    there = np.array([i for i in range(n) if i not in lost and not gap[0] <= i < sum(gap)])
    pv, op = np.round(np.sin(np.arange(n) / 9.0), 4), np.round(50 + np.cos(np.arange(n) / 9.0), 4)
    [record] = read_text(table("Date,PV,OP", serials(there, seconds, 5), pv[there], op[there]))
    assert (record.dt, len(record)) == (seconds, n)
    np.testing.assert_array_equal(record.op[there], op[there])
    assert np.isfinite(record.op).sum() == there.size


def test_serial_days_that_tell_no_period_are_left_as_they_are(table, read_text):
    k = np.arange(300)
    moments = np.cumsum(np.random.default_rng(2).uniform(1.0, 8.0, 300))
    pv, op = np.round(np.sin(k / 9.0), 4), np.round(50 + np.cos(k / 9.0), 4)
    [record] = read_text(table("Date,PV,OP", serials(moments, 1.0, 5), pv, op))
    assert not any("rounded to" in guess for guess in record.provenance.assumptions)
    [whole] = read_text(table("Date,PV,OP", serials(0.864 * k, 1.0, 5), pv, op))  # a period of one tick
    assert (whole.dt, len(whole)) == (0.864, 300)


def test_in_columns_with_times_of_their_own_rounded_serial_days_are_even_too(table, read_text):
    k = np.arange(300)
    pv, op = np.round(np.sin(k / 9.0), 4), np.round(50 + np.cos(k / 9.0), 4)
    days = serials(k, 1.0, 5)
    [record] = read_text(table("Time,FIC.PV,Time,FIC.OP", days, pv, days, op))
    assert (record.dt, len(record)) == (1.0, 300)
    np.testing.assert_array_equal(record.op, op)


def test_an_uneven_value_is_held_for_ten_periods(table, read_text):
    """Steps of 10 s, some of 4 s and then 16 s, and one of 200 s: known at 100 s after the last row, not at 110 s."""
    steps = np.full(299, 10.0)
    steps[10:290:20], steps[11:291:20] = 4.0, 16.0
    steps[200] = 200.0
    t = np.concatenate([[0.0], np.cumsum(steps)])
    op, pv = np.random.default_rng(4).normal(50.0, 5.0, (2, 300)).round(3)
    [record] = read_text(table("time_s,PV,OP", t, pv, op))
    last = round(t[200] / 10.0)
    assert record.dt == 10.0
    assert record.op[last : last + 11].tolist() == [op[200]] * 11
    assert np.isnan(record.op[last + 11 : last + 20]).all()
    assert record.op[last + 20] == op[201]


@pytest.mark.parametrize("shared", [20, 21])
def test_a_tenth_of_the_rows_may_share_a_stamp_and_differ(shared, table, read_text):
    t = np.sort(np.concatenate([np.arange(200.0 - shared), 5.0 + 7.0 * np.arange(shared)]))
    op, pv = np.random.default_rng(4).normal(50.0, 5.0, (2, 200)).round(3)
    text = table("time_s,PV,OP", t, pv, op)
    if shared == 20:
        [record] = read_text(text)
        assert len(record) == 180
        assert any("20 rows with the same time stamp as the next" in guess for guess in record.provenance.assumptions)
    else:
        with pytest.raises(
            RecordError, match="21 of 200 rows have the same time stamp as the next row but other values"
        ):
            read_text(text)
