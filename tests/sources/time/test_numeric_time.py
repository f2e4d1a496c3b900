"""Time columns of numbers, against dates of the standard library."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

START = datetime(2026, 2, 1, 10)
N = 120
K = np.arange(N)
ONE = timedelta(seconds=1)
VALUES = ["1.5"] * N


def since(year, month=1, day=1):
    return (START - datetime(year, month, day)) / ONE


EPOCHS = {
    "Unix seconds": (lambda s: f"{since(1970) + s:.0f}", "utc"),
    "Unix milliseconds": (lambda s: f"{(since(1970) + s) * 1e3:.0f}", "utc"),
    "Unix microseconds": (lambda s: f"{(since(1970) + s) * 1e6:.0f}", "utc"),
    "Unix nanoseconds": (lambda s: str((int(since(1970)) + s) * 10**9), "utc"),
    "FILETIME": (lambda s: str((int(since(1601)) + s) * 10**7), "utc"),
    "NET ticks": (lambda s: str((int(since(1)) + s) * 10**7), "local"),
    "LabVIEW": (lambda s: f"{since(1904) + s:.1f}", "utc"),
    "Excel": (lambda s: f"{(since(1899, 12, 30) + s) / 86400:.10f}", "local"),
    "MATLAB": (lambda s: f"{(since(1) + s) / 86400 + 367:.9f}", "local"),  # datenum(1, 1, 1) = 367
    "yyyymmddhhmmss": (lambda s: f"{START + s * ONE:%Y%m%d%H%M%S}", "local"),
}


@pytest.mark.parametrize("epoch", EPOCHS)
@pytest.mark.parametrize("step", [1, 5, 60])
def test_numbers_that_count_from_a_date(epoch, step, stamps_of, since_1970):
    write, kind = EPOCHS[epoch]
    found = stamps_of(["Time", "PV"], [write(step * int(k)) for k in K], VALUES)
    assert found.kind == kind
    np.testing.assert_allclose(found.seconds - since_1970(START), step * K, rtol=0, atol=1e-3)
    assert len(found.notes) == 1


def test_millionths_of_a_day_of_wincc(stamps_of, since_1970):
    days = (START - datetime(1899, 12, 30)) / timedelta(days=1)
    found = stamps_of(["Time_ms", "PV"], [f"{(days + k / 86400) * 1e6:.4f}" for k in K], VALUES)
    np.testing.assert_allclose(found.seconds - since_1970(START), K, atol=2e-3)


@pytest.mark.parametrize("name", ["t_stamp", "ts", "_time", "unix_time", "Epoch Time", "Unix Time [ms]", ""])
def test_epochs_by_the_names_of_historians(name, stamps_of, since_1970):
    scale = 1000 if "ms" in name else 1
    cells = [str((int(since_1970(START)) + 5 * int(k)) * scale) for k in K]
    found = stamps_of([name, "PV"], cells, VALUES)
    np.testing.assert_array_equal(found.seconds, since_1970(START) + 5.0 * K)


@pytest.mark.parametrize(
    ("name", "seconds"),
    [("time_ms", 1e-3), ("Time [min]", 60.0), ("time_h", 3600.0), ("secs", 1.0), ("minutes", 60.0), ("Hours", 3600.0),
     ("ms", 1e-3), ("Elapsed Time (s)", 1.0), ("_time", 1.0), ("time", 1.0)],
)  # fmt: skip
def test_units_in_the_heading(name, seconds, stamps_of):
    found = stamps_of([name, "PV"], [repr(float(x)) for x in 30.0 * K / seconds], VALUES)
    assert found.kind == "relative"
    np.testing.assert_allclose(np.diff(found.seconds), 30.0)


@pytest.mark.parametrize(
    ("name", "step", "dt", "word"),
    [("time", 1000, 1.0, "milliseconds"), ("time", 5000, 5.0, "milliseconds"), ("time", 60, 60.0, "seconds"),
     ("time", 900, 900.0, "seconds"), ("time_s", 1000, 1000.0, None)],
)  # fmt: skip
def test_milliseconds_without_a_unit_are_recognised_by_their_size(name, step, dt, word, stamps_of):
    found = stamps_of([name, "PV"], [str(step * int(k)) for k in K], VALUES)
    np.testing.assert_allclose(np.diff(found.seconds), dt)
    assert found.notes == [] if word is None else f"taken as {word}" in found.notes[0]


def test_numbers_of_a_clock_without_marks_are_no_seconds(stamps_of):
    for form, step in (("%H%M%S", 1), ("%H%M%S", 5), ("%H%M", 60)):
        clocks = [str(int((datetime(2026, 2, 14, 7, 59) + step * int(k) * ONE).strftime(form))) for k in K]
        found = stamps_of(["Time", "PV"], clocks, VALUES)
        assert set(np.diff(found.seconds)) == {step}
        assert any("clock without marks" in note for note in found.notes)
    for counted in (range(N), range(0, 20 * N, 20), range(0, 100 * N, 100), range(7000, 7000 + N)):
        found = stamps_of(["Time", "PV"], [str(k) for k in counted], VALUES)
        assert set(np.diff(found.seconds)) == {counted[1] - counted[0]}


@pytest.mark.parametrize("decimals", [4, 5, 6])
def test_rounded_serial_days_tell_their_resolution(decimals, stamps_of):
    found = stamps_of(["Time", "PV"], [f"{46054.54 + k / 86400:.{decimals}f}" for k in K], VALUES)
    assert found.resolution == pytest.approx(86400 * 10.0**-decimals)
    exact = stamps_of(["Time", "PV"], [repr(46054.54 + k / 86400) for k in K], VALUES)
    assert exact.resolution == 0.0


def test_a_decimal_comma(stamps_of):
    found = stamps_of(["Time [min]", "PV"], [f"{k / 2:.1f}".replace(".", ",") for k in K], VALUES, decimal=",")
    np.testing.assert_allclose(np.diff(found.seconds), 30.0)


def test_native_numbers_are_read_as_text_is(stamps_of, since_1970):
    import polars as pl

    found = stamps_of(["Time", "PV"], pl.Series((int(since_1970(START)) + K) * 10**3), VALUES)
    assert (found.kind, found.seconds[0]) == ("utc", START.replace(tzinfo=UTC).timestamp())
