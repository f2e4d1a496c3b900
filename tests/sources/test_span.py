"""OP and valve position in % of span: by unit, range and data, and never silently."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.errors import RecordError
from stiction.records.provenance import UNKNOWN_UNIT
from stiction.sources.values.span import op_to_percent, position_to_percent

T = np.arange(400)
OP = 50 + 5 * np.sin(T / 9)
POSITION = OP + 0.6 * np.sign(np.cos(T / 9))


def in_span(percent, low, high):
    return low + percent * (high - low) / 100


@pytest.mark.parametrize(
    ("unit", "span"),
    [("mA", (4, 20)), ("psi", (3, 15)), ("PSIG", (3, 15)), ("bar", (0.2, 1)), ("kPa", (20, 100)), ("0-1", (0, 1))],
)
def test_a_standard_signal_is_converted_and_reported(unit, span):
    found = op_to_percent(in_span(OP, *span), unit)
    np.testing.assert_allclose(found.values, OP, rtol=1e-12)
    assert found.unit == ""
    assert len(found.notes) == 1


@pytest.mark.parametrize(("unit", "values"), [("mA", OP), ("psi", OP), ("V", OP / 10), ("t/h", OP), ("bar", OP)])
def test_a_unit_that_does_not_fit_is_left_and_reported(unit, values):
    found = op_to_percent(values, unit)
    assert found.values is values
    assert found.unit == unit
    assert "(op_range)" in found.notes[0]
    np.testing.assert_allclose(op_to_percent(values, unit, op_range=(values.min(), values.max())).values.max(), 100.0)


@pytest.mark.parametrize("values", [in_span(OP, 4, 20), OP / 10, OP / 2000, (OP - 50) / 3, 10 * OP - 600])
def test_without_a_unit_it_is_in_doubt(values):
    found = op_to_percent(values)
    assert found.values is values
    assert found.unit == UNKNOWN_UNIT
    assert "(op_range)" in found.notes[0]


@pytest.mark.parametrize("values", [OP, OP - 42, OP / 10 - 2.0, OP - 30])
def test_a_percentage_is_left_without_a_word(values):
    assert op_to_percent(values) == (values, "", [])
    assert op_to_percent(OP / 10, "%")[1:] == ("", [])


@pytest.mark.parametrize("span", [(4, 20), (0, 1)])
def test_a_position_in_percent_shows_the_signal(span):
    found = op_to_percent(in_span(OP, *span), position=POSITION, position_unit="%")
    np.testing.assert_allclose(found.values, OP, rtol=1e-12)
    assert found.unit == ""
    assert "valve position" in found.notes[0]
    low = OP - 40
    assert op_to_percent(low, position=POSITION - 40, position_unit="%") == (low, "", [])
    assert op_to_percent(low, position=in_span(POSITION, 4, 20)).unit == UNKNOWN_UNIT


def test_a_current_that_rests_at_both_ends_is_one():
    current = in_span(np.clip(50 + 80 * np.sin(T / 30), 0, 100), 4, 20)
    found = op_to_percent(current)
    assert (found.values.min(), found.values.max(), found.unit) == (0.0, 100.0, "")
    assert "taken as mA" in found.notes[0]


@pytest.mark.parametrize("full", [4095, 27648, 1000])
def test_counts_that_rest_at_both_ends_or_follow_the_position(full):
    clipped = np.clip(50 + 80 * np.sin(T / 30), 0, 100)
    for unit in ("", "counts"):
        found = op_to_percent(in_span(clipped, 0, full), unit)
        np.testing.assert_allclose(found.values, clipped, atol=1e-9)
        assert f"rests at 0 and at {full}: it is taken as counts" in found.notes[0]
    found = op_to_percent(in_span(OP, 0, full), position=POSITION, position_unit="%")
    np.testing.assert_allclose(found.values, OP, atol=1e-9)
    assert op_to_percent(in_span(OP, 0, full), "counts").unit == "counts"


def test_a_fraction_is_converted_and_reported():
    found = op_to_percent(OP / 100)
    np.testing.assert_allclose(found.values, OP)
    assert (found.unit, "fraction of span" in found.notes[0]) == ("", True)


@pytest.mark.parametrize(
    ("span", "values"), [((0, 1), OP), ((4, 20), OP), ((0, 1), in_span(OP, 4, 20)), ((0, 50), OP - 60)]
)
def test_a_range_that_op_leaves_is_refused(span, values):
    with pytest.raises(RecordError, match=rf"op_range=\({span[0]}, {span[1]}\) does not fit OP, which lies between"):
        op_to_percent(values, op_range=span)


def test_one_bad_value_says_nothing_of_the_range():
    current = in_span(OP, 4, 20)
    current[77] = 250.0
    assert op_to_percent(current).unit == UNKNOWN_UNIT
    assert op_to_percent(current, "mA").unit == ""
    assert op_to_percent(np.full(9, np.nan)).unit == ""


def test_a_position_in_another_range_is_reported():
    assert position_to_percent(in_span(POSITION, 4, 20), "mA", OP).values == pytest.approx(POSITION)
    assert position_to_percent(in_span(POSITION, 2, 9), "V", OP, mv_range=(2, 9)).values == pytest.approx(POSITION)
    [note] = position_to_percent(in_span(POSITION, 4, 20), "", OP).notes
    assert "as a signal of 4 to 20: it is converted" in note
    assert position_to_percent(in_span(POSITION, 4, 20), "", OP).values == pytest.approx(POSITION)
    [note] = position_to_percent(POSITION, "mm", OP).notes
    assert "(mv_range), low to high" in note
    assert position_to_percent(POSITION, "%", OP).notes == []
