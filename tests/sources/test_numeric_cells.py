"""Cells to numbers, against numbers that were written and against rules applied cell by cell."""

from __future__ import annotations

import datetime as dt
import sys
from collections import Counter

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stiction.errors import RecordError
from stiction.sources.values.number_text import is_number, parse_number
from stiction.sources.values.numeric_cells import parse_numbers

NUMBERS = np.round(np.random.default_rng(1).normal(0.0, 4000.0, 900), 3)
WAYS = {
    "plain": (repr, "."),
    "exponent": (lambda x: f"{x:.12E}", "."),
    "sign": (lambda x: f"{x:+.3f}", "."),
    "blanks": (lambda x: f"  {x:.3f} ", "."),
    "minus sign": (lambda x: f"{x:.3f}".replace("-", "\u2212"), "."),
    "decimal comma": (lambda x: f"{x:.3f}".replace(".", ","), ","),
    "thousands": (lambda x: f"{x:,.3f}", "."),
    "German thousands": (lambda x: f"{x:,.3f}".translate(str.maketrans(",.", ".,")), ","),
    "Swiss thousands": (lambda x: f"{x:,.3f}".replace(",", "'"), "."),
    "French thousands": (lambda x: f"{x:,.3f}".replace(",", "\u202f").replace(".", ","), ","),
    "percent": (lambda x: f"{x:.3f} %", "."),
    "unit": (lambda x: f"{x:.3f}\u00a0m³/h", "."),
    "unit and comma": (lambda x: f"{x:.3f}bar".replace(".", ","), ","),
    "unit and thousands": (lambda x: f"{x:,.3f} kPa", "."),
}


@pytest.mark.parametrize("n", [60, 900])  # few and many distinct texts are parsed in different ways
@pytest.mark.parametrize("way", WAYS)
def test_every_way_of_writing_gives_the_number(way, n):
    write, decimal = WAYS[way]
    cells = [write(x) for x in NUMBERS[:n].tolist()]
    column = parse_numbers(pl.Series([*cells, "Bad", None, " - "]), decimal)
    np.testing.assert_array_equal(column.values, [*NUMBERS[:n], np.nan, np.nan, np.nan])
    assert column.texts == {"Bad": 1, "": 2}
    assert column.unit == {"percent": "%", "unit": "m³/h", "unit and comma": "bar", "unit and thousands": "kPa"}.get(
        way, ""
    )
    assert [parse_number(cell, decimal) for cell in cells] == NUMBERS[:n].tolist()


@pytest.mark.parametrize(
    "text", ["1_2", "0x10", "1e", "--5", "1.2.3", "5 6", "1,23", "12:30", "TRUE", "é", "１２", "1d5"]
)
def test_other_texts_are_counted_and_no_number(text):
    assert not is_number(text, ".")
    for filler in (["5"], [f"{k} " for k in range(400)]):
        column = parse_numbers(pl.Series([*filler, text, text]), ".")
        assert column.texts == {text: 2}
        assert np.isnan(column.values[-2:]).all()
        assert np.isfinite(column.values[:-2]).all()


@pytest.mark.parametrize("text", [repr(sys.float_info.max), "-1.797e308", "1e400", "-inf", "1.1e100"])
def test_numbers_beyond_1e100_are_infinite(text):
    column = parse_numbers(pl.Series(["5", text, "3e38"]), ".")
    np.testing.assert_array_equal(column.values, [5.0, np.nan, 3e38])
    assert column.texts == {"infinite": 1}


@pytest.mark.parametrize("text", ["", "NaN", "nan", "n/a", "#N/A", "NULL", "?", "-", None])
def test_empty_cells_in_all_words(text):
    assert parse_numbers(pl.Series(["5", text, "6"]), ".").texts == {"": 1}


@pytest.mark.parametrize(
    ("series", "values", "texts"),
    [
        (pl.Series([1, None, 3]), [1, np.nan, 3], {"": 1}),
        (pl.Series([1.5, float("nan"), float("inf")]), [1.5, np.nan, np.nan], {"": 1, "infinite": 1}),
        (pl.Series([True, False, None]), [1, 0, np.nan], {"": 1}),
        (pl.Series([None, None]), [np.nan, np.nan], {"": 2}),
        (pl.Series(["1.5", "Bad"], dtype=pl.Categorical), [1.5, np.nan], {"Bad": 1}),
        (pl.Series([dt.datetime(2026, 2, 1)]), [np.nan], {"Datetime(time_unit='us', time_zone=None)": 1}),
        (pl.Series([], dtype=pl.String), [], {}),
    ],
)
def test_columns_of_other_types(series, values, texts):
    column = parse_numbers(series, ".")
    np.testing.assert_array_equal(column.values, values)
    assert column.texts == texts


@pytest.mark.parametrize("n", [50, 500])
@pytest.mark.parametrize("other", [" mm", ""])
def test_two_units_are_refused(n, other):
    cells = [*(f"{k / 7:.3f} bar" for k in range(n)), f"5{other}"]
    other_values = "1 in mm" if other else "1 without a unit"
    with pytest.raises(RecordError, match=rf"x.csv, column PV: mixes units \({n} in bar, {other_values}\); export"):
        parse_numbers(pl.Series(cells), ".", where="x.csv, column PV")


@pytest.mark.parametrize("mark", [".", ","])
def test_whole_numbers_beside_thousands_are_refused(mark):
    cells = pl.Series([f"{900 + k:,}".replace(",", mark) for k in range(200)])
    with pytest.raises(
        RecordError,
        match=rf"'999' and '1\{mark}000', so '\{mark}' may be the decimal mark .*; give decimal=",
    ):
        parse_numbers(cells, mark, decimal_is_given=False)
    other = "," if mark == "." else "."
    np.testing.assert_array_equal(parse_numbers(cells, other, decimal_is_given=False).values, 900.0 + np.arange(200))
    assert parse_numbers(cells, mark).values.min() < 2.0


@pytest.mark.parametrize(
    "cells",
    [["7", "7.123"] * 50, ["999", *["7.123"] * 99], ["999", "1.01"] * 50, ["999", "0.123"] * 50, ["1.001"] * 99],
)
def test_decimals_beside_whole_numbers_are_no_thousands(cells):
    values = parse_numbers(pl.Series(cells), ".", decimal_is_given=False).values
    np.testing.assert_array_equal(values, list(map(float, cells)))


@settings(deadline=None, max_examples=150)
@given(
    words=st.lists(st.text(st.sampled_from("0123456789.,' -+eE%barkBd_\u00a0"), max_size=9), min_size=1, max_size=30),
    decimal=st.sampled_from(".,"),
)
def test_many_texts_are_parsed_as_few(words, decimal):
    """The regular expressions of polars and of Python agree."""
    try:
        few = parse_numbers(pl.Series(words), decimal)
    except RecordError:
        return
    many = parse_numbers(pl.Series([*words, *(f"x{k}" for k in range(300))]), decimal)
    np.testing.assert_array_equal(many.values[: len(words)], few.values)
    assert many.texts - Counter(f"x{k}" for k in range(300)) == few.texts
    assert many.unit == few.unit
    for word, value in zip(words, few.values, strict=True):
        assert np.isnan(value) == np.isnan(parse_number(word, decimal)) or not np.isfinite(value)
