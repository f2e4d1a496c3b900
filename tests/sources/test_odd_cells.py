"""Quotes that break a file and quotes that do not, and numbers that no instrument ever measured."""

from __future__ import annotations

import csv
import io
import sys

import numpy as np
import pytest

import stiction as st
from stiction.errors import ParameterError, RecordError

N = 900


def cells():
    k = np.arange(N)
    return [[str(i), f"{50 + i % 7}.5", f"{40 + i % 5}"] for i in k]


def lines(rows, delimiter=","):
    return "\n".join(["time_s,PV,OP".replace(",", delimiter), *(delimiter.join(row) for row in rows)]) + "\n"


@pytest.mark.parametrize(
    ("row", "again"), [(30, None), (400, None), (880, None), (30, 34), (400, 700)], ids=lambda place: f"row {place}"
)
def test_a_quote_that_is_not_closed_is_refused_where_it_opens(read_text, row, again):
    rows = cells()
    rows[row][1] = f'"{rows[row][1]}'
    if again is not None:  # a second one closes it, and hides the rows between in one cell
        rows[again][1] = f'{rows[again][1]}"'
    with pytest.raises(RecordError, match=f"line {row + 2}: cannot be split into columns .a cell in quotes goes on"):
        read_text(lines(rows))


def test_a_quote_left_open_in_the_last_row_costs_that_row_and_is_reported(read_text):
    rows = cells()
    rows[-1][1] = f'"{rows[-1][1]}'
    [record] = read_text(lines(rows))
    assert (len(record), record.provenance.missing_samples) == (N, 1)
    assert any(f"near line {N + 1}" in note for note in record.provenance.assumptions)


@pytest.mark.parametrize("quoting", [csv.QUOTE_ALL, csv.QUOTE_NONNUMERIC, csv.QUOTE_MINIMAL])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_what_the_standard_library_writes_is_read(read_text, quoting, delimiter):
    text = io.StringIO()
    writer = csv.writer(text, delimiter=delimiter, quoting=quoting)
    writer.writerow(["time_s", "PV", "OP", "Comment"])
    writer.writerows([*map(float, row), 'he said "6"" pipe", twice; \t so'] for row in cells())
    [record] = read_text(text.getvalue())
    assert record.pv.tolist() == [float(row[1]) for row in cells()]
    assert record.op.tolist() == [float(row[2]) for row in cells()]
    assert not any("cells" in note for note in record.provenance.assumptions)


@pytest.mark.parametrize(
    "written", ['"{}"', ' "{}"', '"{}" ', ' "{}" '], ids=["quoted", "space before", "space after", "spaces"]
)
def test_quotes_with_spaces_about_them_are_read(read_text, written):
    [record] = read_text(lines([[written.format(cell) for cell in row] for row in cells()]))
    assert record.pv.tolist() == [float(row[1]) for row in cells()]
    assert record.provenance.bad_values == {}


def test_a_header_of_several_lines_in_quotes_costs_no_row_of_data(read_text):
    text = 'time_s,"PV\n[m3/h]","OP\n[%]"\n' + lines(cells()).partition("\n")[2]
    [record] = read_text(text)
    assert (len(record), record.provenance.rows, record.provenance.missing_samples) == (N, N, 0)
    assert record.provenance.columns == {"pv": "PV [m3/h]", "op": "OP [%]"}


def test_lines_are_counted_after_a_title_of_several(read_text):
    rows = cells()
    rows[500][1] = f'"{rows[500][1]}'
    with pytest.raises(RecordError, match="line 505: cannot be split"):  # the title takes three more
        read_text('"A ""report"",\nof November"\n\n' + lines(rows))


@pytest.mark.parametrize("column", [1, 2], ids=["PV", "OP"])
@pytest.mark.parametrize("text", [repr(sys.float_info.max), "-1.797e308", "1e400", "-inf"])
def test_the_largest_number_a_machine_knows_is_a_missing_value(read_text, column, text):
    rows = cells()
    rows[100][column] = text
    [record] = read_text(lines(rows))
    assert np.flatnonzero(~np.isfinite([record.pv, record.op][column - 1])).tolist() == [100]
    assert (record.provenance.missing_samples, record.provenance.bad_values) == (1, {"infinite": 1})
    assert any("1 x 'infinite'" in note for note in record.provenance.assumptions)


@pytest.mark.parametrize("signal", ["pv", "op"])
def test_a_record_with_such_a_number_is_judged_like_one_with_a_gap(signal):
    k = np.arange(N)
    rng = np.random.default_rng(3)
    signals = {
        "op": 50 + 6 * np.sin(k / 9.5) + rng.normal(0, 0.2, N),
        "pv": 200 + 9 * np.cos(k / 9.5) + rng.normal(0, 0.5, N),
    }
    signals[signal][100] = np.nan
    gap = st.diagnose(st.LoopRecord("FIC-1", 1.0, **signals))
    signals[signal] = np.where(k == 100, sys.float_info.max, signals[signal])
    huge = st.diagnose(st.LoopRecord("FIC-1", 1.0, **signals))
    assert (huge.verdict, huge.probability, huge.record) == (gap.verdict, gap.probability, gap.record)


@pytest.mark.parametrize("op_range", [(0, 1, 2), (4,), (), 20.0])
def test_a_range_that_is_no_pair(read_text, op_range):
    with pytest.raises(ParameterError, match=r"op_range = .* is not a pair of numbers; give"):
        read_text(lines(cells()), op_range=op_range)
