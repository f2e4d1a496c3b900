"""Whatever the dialect, the numbers come back: delimiter x decimal mark x encoding x line end x time form."""

from __future__ import annotations

import io
from datetime import datetime, timedelta

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.errors import RecordError
from stiction.sources import read

TIME_FORMS = ("%Y-%m-%d %H:%M:%S", "%d.%m.%Y %H:%M:%S", "%d-%b-%y %H:%M:%S", "%Y-%m-%dT%H:%M:%SZ", "seconds")


@settings(deadline=None, max_examples=60)
@given(
    delimiter=some.sampled_from([",", ";", "\t", "|"]),
    decimal=some.sampled_from([".", ","]),
    encoding=some.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"]),
    end=some.sampled_from(["\n", "\r\n"]),
    form=some.sampled_from(TIME_FORMS),
    dt=some.sampled_from([1, 2, 5, 10, 60]),
    digits=some.integers(0, 4),
    holes=some.sets(some.integers(1, 38), max_size=6),
    seed=some.integers(0, 1000),
)
def test_round_trip(delimiter, decimal, encoding, end, form, dt, digits, holes, seed):
    rng = np.random.default_rng(seed)
    pv, op = np.round(rng.normal(50, 20, 40), digits), np.round(rng.uniform(2, 98, 40), digits)
    quote = '"' if delimiter == decimal == "," else ""
    start = datetime(2026, 2, 1, 22, 30)

    def cell(x):
        return f"{quote}{x:.{digits}f}{quote}".replace(".", decimal)

    def stamp(k):
        return str(dt * k) if form == "seconds" else (start + timedelta(seconds=dt * k)).strftime(form)

    lines = [delimiter.join(("Time", "LIC-7.PV [m³]", "LIC-7.OP"))]
    cells = ((stamp(k), "No Data" if k in holes else cell(pv[k]), cell(op[k])) for k in range(40))
    lines.extend(map(delimiter.join, cells))
    # Nobody can tell whether a quoted "56,867" between commas is 56.867 or 56867: there the user has to say.
    told = {"decimal": ","} if quote and digits == 3 else {}
    [record] = read(io.BytesIO((end.join(lines) + end).encode(encoding)), **told)
    expected = pv.copy()
    expected[list(holes)] = np.nan
    assert (record.tag, record.dt, record.loop_type) == ("LIC-7", dt, "level")
    np.testing.assert_array_equal(record.op, op)
    np.testing.assert_array_equal(record.pv, expected)
    assert record.provenance.bad_values.get("No Data", 0) == len(holes) == record.provenance.missing_samples


def read_or_sentence(data: bytes) -> bool:
    """Whether bytes are read as a record of some length, or refused by a sentence that names the file."""
    try:
        return all(len(record) >= 2 for record in read(io.BytesIO(data)))
    except RecordError as error:
        return str(error).startswith("stream") and "\n" not in str(error)


@settings(deadline=None, max_examples=150)
@given(data=some.one_of(some.binary(max_size=400), some.text(max_size=300).map(lambda text: text.encode())))
def test_any_bytes_are_read_or_refused_in_one_sentence(data):
    assert read_or_sentence(data)


@settings(deadline=None, max_examples=150)
@given(
    cells=some.lists(
        some.lists(
            some.sampled_from(["1", "2.5", "-3", "1,5", "", "Bad", "x", '"', "NaN", "1e999", "12:00:01"]), max_size=5
        ),
        max_size=30,
    ),
    header=some.sampled_from(["time_s,PV,OP", "PV,OP,Time,MODE", "Date,Time,PV,OP", "sample;PV;OP"]),
)
def test_any_table_is_read_or_refused_in_one_sentence(cells, header):
    text = "\n".join([header, *(",".join(row) for row in cells)])
    assert read_or_sentence(text.encode())
