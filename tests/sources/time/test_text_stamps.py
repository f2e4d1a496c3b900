"""Time stamps as text, against datetimes of the standard library."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.errors import RecordError
from stiction.sources.time.text_column import parse_text_stamps
from stiction.sources.time.text_stamps import is_clock, is_date, is_timestamp

START = datetime(2026, 2, 1, 13, 0, 5)
FORMS = {
    "%Y-%m-%d %H:%M:%S": {},
    "%Y-%m-%dT%H:%M:%S": {},
    "%Y/%m/%d %H:%M:%S": {},
    "%Y.%m.%d %H:%M:%S": {},
    "%d.%m.%Y %H:%M:%S": {},
    "%d.%m.%y, %H:%M:%S": {},
    "%d/%m/%Y %H:%M:%S": {"day_first": True},
    "%d/%m/%Y %I:%M:%S %p": {"day_first": True},
    "%m/%d/%Y %I:%M:%S %p": {"day_first": False},
    "%m/%d/%Y %I:%M:%S%p": {"day_first": False},
    "%d-%b-%y %H:%M:%S": {},
    "%d %b %Y %H:%M:%S": {},
    "%d-%b-%Y %H:%M:%S.%f": {},
    "%b %d %Y %H:%M:%S": {},
    "%b %d, %Y %I:%M:%S %p": {},
    "%A %d %B %Y %H:%M:%S": {},
    "%A, %B %d, %Y %I:%M:%S %p": {},
    "%a %b %d %H:%M:%S %Y": {},
    "%a %b %d %H:%M:%S CET %Y": {},
    "%Y%m%d%H%M%S": {},
    "%Y%m%dT%H%M%S": {},
    "%Y%m%d %H%M%S": {},
    "%d.%m.%Y %H.%M.%S": {},
    "%Y-%m-%d %H.%M.%S": {},
    "%H:%M:%S %Y-%m-%d": {},
    "%I:%M:%S %p %d-%b-%y": {},
    "%H:%M:%S %d/%m/%Y": {"day_first": True},
    "%Y-%j %H:%M:%S": {},
    "%Y.%j %H:%M:%S": {},
    "%Y-%jT%H:%M:%S": {},
    '="%Y-%m-%d %H:%M:%S"': {},
    "'%Y-%m-%d %H:%M:%S": {},
    "%Y-%m-%d %H:%M:%S,%f": {},
    "%d.%m.%Y %H:%M:%S:%f": {},
    "%H.%M.%S %d.%m.%Y": {"time_format": "%H.%M.%S %d.%m.%Y"},
    "%d%m%Y %H%M%S": {"time_format": "%d%m%Y %H%M%S"},
    "%d.%m.%Y at %H:%M:%S.%f": {"time_format": "%d.%m.%Y at %H:%M:%S.%f"},
}


@pytest.mark.parametrize("form", FORMS)
@settings(deadline=None, max_examples=15)
@given(
    start=some.datetimes(datetime(1990, 1, 1), datetime(2059, 1, 1)).map(lambda t: t.replace(microsecond=0)),
    step=some.sampled_from([0.5, 1.0, 7.0, 60.0, 3601.0, 86400.0]),
)
def test_each_form_gives_the_moments_that_were_written(form, start, step, since_1970):
    step = step if "%f" in form else max(1.0, step)
    moments = [start + timedelta(seconds=step * k) for k in range(250)]
    cells = [moment.strftime(form) for moment in moments]
    found = parse_text_stamps(pl.Series(cells), **FORMS[form])
    np.testing.assert_allclose(found.seconds, [since_1970(moment) for moment in moments], rtol=0, atol=1e-6)
    assert (found.kind, found.first_unread) == ("local", None)
    assert "time_format" in FORMS[form] or is_timestamp(cells[0]) or cells[0].isdigit()


ZONES = [("Z", 0), ("+00:00", 0), ("+02:00", 2), ("-0530", -5.5), (" UTC", 0), ("+01", 1), (" +01:00", 1), (" GMT", 0)]


@pytest.mark.parametrize(("zone", "hours"), [*ZONES, (" GMT+0100 (CET)", 1)])
@pytest.mark.parametrize(
    "form", ["%Y-%m-%dT%H:%M:%S", "%Y-%m-%d %H:%M:%S.%f", "%d-%b-%y %I:%M:%S %p", "%b %d %Y %H:%M:%S"]
)
def test_zones_become_utc(form, zone, hours, since_1970):
    cells = [f"{(START + timedelta(seconds=k)).strftime(form)}{zone}" for k in range(5)]
    found = parse_text_stamps(pl.Series(cells))
    expected = since_1970(START.replace(tzinfo=UTC) - timedelta(hours=hours)) + np.arange(5.0)
    assert found.kind == "utc"
    np.testing.assert_allclose(found.seconds, expected, atol=1e-6)


def test_a_zone_by_its_name_is_a_wall_clock_with_a_note(since_1970):
    found = parse_text_stamps(pl.Series(["Sun Feb 01 13:00:05 CET 2026"]))
    assert (found.kind, found.seconds[0]) == ("local", since_1970(START))
    assert "time zone CET is not known" in found.notes[0]
    found = parse_text_stamps(pl.Series(["Sun Feb 01 13:00:05 UTC 2026"]))
    assert (found.kind, found.notes) == ("utc", [])


def test_stamps_without_a_zone_among_others_count_as_utc():
    found = parse_text_stamps(pl.Series(["2026-02-01T13:00:05Z", "2026-02-01T13:00:06", "2026-02-01T13:00:07+00:00"]))
    assert np.diff(found.seconds).tolist() == [1.0, 1.0]
    assert found.notes == ["2 of 3 stamps have a time zone; the others are taken as UTC."]


MONTHS = {
    "German": "Januar Februar März April Mai Juni Juli August September Oktober November Dezember",
    "German, short": "Jan. Feb. Mrz. Apr. Mai Jun. Jul. Aug. Sept. Okt. Nov. Dez.",
    "French": "janvier février mars avril mai juin juillet août septembre octobre novembre décembre",
    "French, short": "janv. févr. mars avr. mai juin juil. août sept. oct. nov. déc.",
    "Spanish": "enero febrero marzo abril mayo junio julio agosto septiembre octubre noviembre diciembre",
    "Spanish, short": "ene feb mar abr may jun jul ago sep oct nov dic",
    "Italian": "gennaio febbraio marzo aprile maggio giugno luglio agosto settembre ottobre novembre dicembre",
    "Italian, short": "gen feb mar apr mag giu lug ago set ott nov dic",
    "Portuguese": "janeiro fevereiro março abril maio junho julho agosto setembro outubro novembro dezembro",
    "Portuguese, short": "jan fev mar abr mai jun jul ago set out nov dez",
    "Dutch": "januari februari maart april mei juni juli augustus september oktober november december",
    "Dutch, short": "jan. feb. mrt. apr. mei jun. jul. aug. sep. okt. nov. dec.",
    "Swedish": "januari februari mars april maj juni juli augusti september oktober november december",
    "Finnish": "tammikuuta helmikuuta maaliskuuta huhtikuuta toukokuuta kesäkuuta heinäkuuta elokuuta syyskuuta "
    "lokakuuta marraskuuta joulukuuta",
    "Finnish, short": "tammi helmi maalis huhti touko kesä heinä elo syys loka marras joulu",
}


@pytest.mark.parametrize("language", MONTHS)
@pytest.mark.parametrize(
    "form", ["{d}. {m} {y} 08:05:00", "{d:02d}-{m}-{y} 08:05:00", "{d} de {m} de {y} 8:05", "{m} {d}, {y} 08:05"]
)
def test_months_by_their_names(language, form, since_1970):
    for number, name in enumerate(MONTHS[language].split(), 1):
        for text in (name, name.upper(), name.capitalize()):
            cell = form.format(d=21, m=text, y=2026)
            found = parse_text_stamps(pl.Series([cell, cell]))
            assert found.seconds[0] == since_1970(datetime(2026, number, 21, 8, 5)), cell
            assert is_timestamp(cell)


HALF_DAYS = [
    ("a. m.", "p. m."),
    ("a.m.", "p.m."),
    ("am", "pm"),
    ("AM", "PM"),
    ("a.\u00a0m.", "p.\u00a0m."),
    ("A.M.", "P.M."),
]


@pytest.mark.parametrize("words", HALF_DAYS)
@pytest.mark.parametrize("space", [" ", "\u00a0", "\u202f"])
def test_halves_of_the_day(words, space, since_1970):
    moments = [datetime(2026, 11, 21) + timedelta(minutes=7 * k) for k in range(300)]
    cells = [f"{t:%d/%m/%Y} {t.hour % 12 or 12}:{t:%M:%S}{space}{words[t.hour // 12]}" for t in moments]
    found = parse_text_stamps(pl.Series(cells))
    assert found.seconds.tolist() == [since_1970(moment) for moment in moments]
    assert is_timestamp(cells[0])


def test_what_the_format_of_the_first_cell_does_not_read_is_read_one_by_one(since_1970):
    cells = [
        "2026-02-01 23:59:59",
        "2026-02-01 24:00:00",
        "2026-02-02",
        "2.2.2026 00:00:01",
        "",
        None,
        "soon",
        "02-Feb-26 0:00",
    ]
    found = parse_text_stamps(pl.Series(cells))
    midnight = since_1970(datetime(2026, 2, 2))
    np.testing.assert_array_equal(found.seconds - midnight, [-1, 0, 0, 1, np.nan, np.nan, np.nan, 0])
    assert found.first_unread == (6, "soon")


@pytest.mark.parametrize(
    "cell", ["2026-02-30 10:00:00", "2026-13-01 10:00", "10:61", "25.13.2026 10:00", "Q1-2026 #3", "Feb 2026 x"]
)
def test_what_is_no_moment_is_not_read(cell):
    found = parse_text_stamps(pl.Series([cell, cell]))
    assert np.isnan(found.seconds).all()
    assert found.first_unread == (0, cell)


def test_the_other_dates_tell_the_order_of_day_and_month(since_1970):
    late = datetime(2026, 2, 1, 23, 59)
    for form in ("%d/%m/%Y %H:%M", "%m/%d/%Y %H:%M", "%d-%m-%y %H:%M", "%d/%m/%Y %I:%M %p"):
        cells = [(late + timedelta(minutes=k)).strftime(form) for k in range(2900)]
        found = parse_text_stamps(pl.Series(cells))
        assert (found.seconds[0], set(np.diff(found.seconds))) == (since_1970(late), {60.0}), form
        assert "because the days are then in order" in found.notes[0]
    for form in ("%d/%m/%y %H:%M:%S", "%m/%d/%y %H:%M:%S"):
        found = parse_text_stamps(pl.Series([datetime(2026, 2, 25, 1).strftime(form)] * 3))
        assert found.seconds[0] == since_1970(datetime(2026, 2, 25, 1))
        assert not any("day_first" in note for note in found.notes)


@pytest.mark.parametrize(
    ("cell", "start", "note"),
    [
        ("01/02/2026 10:00:00", datetime(2026, 2, 1, 10), "day before month (nothing in the file shows the order)"),
        ("2/1/2026 10:00:00 AM", datetime(2026, 2, 1, 10), "month before day (because AM and PM are usual in America)"),
        ("26/02/01 10:00:00", datetime(2026, 2, 1, 10), "year, month, day (because the year is then plausible)"),
        ("01/02/98 10:00:00", datetime(1998, 2, 1, 10), "day before month"),
    ],
)
def test_an_order_that_nothing_settles_is_a_note_with_its_remedy(cell, start, note, since_1970):
    found = parse_text_stamps(pl.Series([cell, cell]))
    assert found.seconds[0] == since_1970(start)
    assert note in found.notes[0]
    assert "; if that is wrong " in found.notes[0]


def test_a_clock_without_a_date_runs_over_midnight():
    cells = [(datetime(2026, 2, 1, 23, 55) + timedelta(seconds=10 * k)).strftime("%H:%M:%S") for k in range(20000)]
    found = parse_text_stamps(pl.Series(cells))
    assert (found.kind, set(np.diff(found.seconds))) == ("relative", {10.0})


def test_elapsed_times():
    for step in (900, 0.5):
        spans = [timedelta(seconds=step * k) for k in range(300)]
        days = [f"{s.days} days {s.seconds // 3600:02d}:{s.seconds // 60 % 60:02d}:{s.seconds % 60:02d}" for s in spans]
        cells = [f"{day}.{s.microseconds:06d}" for day, s in zip(days, spans, strict=True)]
        found = parse_text_stamps(pl.Series(cells))
        np.testing.assert_allclose(found.seconds, step * np.arange(300))
    python = parse_text_stamps(pl.Series([str(timedelta(seconds=900 * k)) for k in range(300)]))
    assert set(np.diff(python.seconds)) == {900.0}
    hours = parse_text_stamps(pl.Series([f"{k // 4:02d}:{k % 4 * 15:02d}:00" for k in range(120)]))
    assert (hours.kind, set(np.diff(hours.seconds))) == ("relative", {900.0})
    for mark in ".,":
        cells = [f"{int(s) // 60 % 60:02d}:{s % 60:04.1f}".replace(".", mark) for s in 45.5 * np.arange(120)]
        found = parse_text_stamps(pl.Series(cells))
        np.testing.assert_allclose(np.diff(found.seconds), 45.5)
        assert "minutes and seconds" in found.notes[0]


def test_a_format_that_is_none_or_does_not_fit_is_refused():
    cells = pl.Series(["2026-02-01 10:00:00"] * 3)
    with pytest.raises(RecordError, match=r"'%Q' is not a format of strptime"):
        parse_text_stamps(cells, time_format="%Q")
    with pytest.raises(
        RecordError, match=r"time_format '%d\.%m' does not fit the stamps, such as '2026-02-01 10:00:00'"
    ):
        parse_text_stamps(cells, time_format="%d.%m")


def test_what_is_a_stamp_a_date_and_a_clock():
    for cell in ("3.5", "FIC-101", "Bad Input", "", "2026.325", "12", "1e5", "Auto", "-", "50.5 %", "1,234.5"):
        assert not is_timestamp(cell), cell
    assert [is_date(cell) for cell in ("2026-02-01", "1.2.26", "20260201", "10:00", "Feb 2026")] == [True] * 3 + [
        False
    ] * 2
    assert [is_clock(cell) for cell in ("10:00", "1:00:00 p. m.", "10:00:00.5Z", "2026-02-01")] == [True] * 3 + [False]
