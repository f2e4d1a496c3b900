"""The parameter map, and which valve may be written as which."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as hs
from tests.strategies import ORDERED, inputs

import stiction as st
from stiction.models.parameter_conversion import BANDS, convert_bands, convert_valve


@given(pair=ORDERED)
def test_bands_there_and_back(pair):
    for source in BANDS:
        start = convert_bands(*pair, "S, J", source)
        for target in BANDS:
            assert convert_bands(*convert_bands(*start, source, target), target, "S, J") == pair


def test_numbers_of_a_published_valve():
    """After the USP valve: fs 12.644 %, fd 11.347 % are S 23.990 %, J 1.2968 % (check N20)."""
    S, J = convert_bands(12.6437, 11.3469, "fs, fd", "S, J")
    assert pytest.approx(23.990, abs=1e-3) == S
    assert pytest.approx(1.2968, abs=1e-4) == J


def test_stick_bands_may_overshoot_where_friction_bands_may_not():
    assert convert_bands(1.0, 3.0, "S, J", "sb, sj") == (2.0, 3.0)
    assert convert_bands(2.0, 3.0, "sb, sj", "S, J") == (1.0, 3.0)
    with pytest.raises(st.ParameterError, match=r"S = 1 % and J = 3 % have no \(fs, fd\): fd would be -1 %.*keep"):
        convert_bands(1.0, 3.0, "S, J", "fs, fd")
    with pytest.raises(st.ParameterError, match=r"sb = 2 % and sj = 3 % have no \(fs, fd\)"):
        convert_bands(2.0, 3.0, "sb, sj", "fs, fd")
    with pytest.raises(st.ParameterError, match=r"sb = 1 % and sj = 3 % have no \(S, J\): S would be -1 %"):
        convert_bands(1.0, 3.0, "sb, sj", "S, J")


TABLED = st.Srinivasan(st.Table([0.0, 100.0], [1.0, 2.0]), 0.5, 0.0)

REFUSED = [
    (st.Kano(1.0, 3.0), "He", {}, "have no .fs, fd.: fd would be -1"),
    (st.Kano(1.0, 3.0), "Choudhury", {}, "differs from Kano's"),
    (st.Choudhury(1.0, 3.0), "Srinivasan", {}, "use Kano"),
    (st.Kano(3.0, 1.0), "Stenman", {}, "S = J = d"),
    (st.Kano(3.0, 1.0), "Ideal", {}, "an ideal valve has no friction"),
    (st.He(2.0, 1.0), "Srinivasan", {}, "give dt"),
    (st.He(2.0, 1.0), "Srinivasan", {"dt": -1.0}, "dt = -1 s is not positive"),
    (st.He(2.0, 1.0), "Kano", {"r": 1.0}, "is not a parameter of Kano"),
    (st.Srinivasan(2.0, 1.0, 0.5), "Kano", {}, "Set r = 0 first"),
    (st.Srinivasan(2.0, 1.0, 0.5), "Choudhury", {}, "Set r = 0 first"),
    (st.Srinivasan(2.0, 2.0, 0.5), "Stenman", {}, "Set r to infinity"),
    (st.Srinivasan(2.0, 1.0, math.inf), "Stenman", {}, "S = J = d"),
    (st.Srinivasan(2.0, 1.0, 0.5), "He", {}, "give dt"),
    (st.Srinivasan(2.0, 1.0, 0.5), "He", {"dt": 1.0}, "is not the threshold sj / dt = 1 %/s"),
    (st.Srinivasan(2.0, 1.0, 1.01), "He", {"dt": 1.0}, "is not the threshold sj / dt = 1 %/s"),
    (st.Srinivasan(2.0, 1.0, 0.0, as_printed=True), "Kano", {}, "as printed"),
    (TABLED, "Kano", {}, "table"),
    (st.Kano(3.0, 1.0), "HeWang", {}, "HeWang cannot be converted"),
    (st.HeWang(2.0, 1.0), "Kano", {}, "HeWang cannot be converted"),
    (st.Kano(3.0, 1.0), "Kanoo", {}, "Kanoo cannot be converted; use one of Choudhury, He"),
]


@pytest.mark.parametrize(("valve", "model", "options", "message"), REFUSED)
def test_impossible_conversion_is_an_error_with_a_remedy(valve, model, options, message):
    with pytest.raises(st.ParameterError, match=message):
        convert_valve(valve, model, **options)


CONVERTED = [
    (st.Kano(3.0, 1.0), st.Srinivasan, {}, st.Srinivasan(2.0, 1.0, 0.0)),
    (st.Kano(1.0, 3.0), st.Srinivasan, {}, st.Srinivasan(2.0, 3.0, 0.0)),
    (st.Kano(3.0, 1.0), st.Srinivasan, {"r": 0.25}, st.Srinivasan(2.0, 1.0, 0.25)),
    (st.Srinivasan(2.0, 1.0, 0.0), st.Kano, {}, st.Kano(3.0, 1.0)),
    (st.Srinivasan(2.0, 1.0, 0.0), st.Choudhury, {}, st.Choudhury(3.0, 1.0)),
    (st.Srinivasan(2.0, 1.0, 0.5), st.He, {"dt": 2.0}, st.He(2.0, 1.0)),
    (st.Srinivasan(2.0, 2.0, math.inf), st.He, {}, st.He(2.0, 0.0)),
    (st.Srinivasan(2.0, 2.0, math.inf), st.Stenman, {}, st.Stenman(2.0)),
    (st.Choudhury(3.0, 1.0), st.He, {}, st.He(2.0, 1.0)),
    (st.He(2.0, 1.0), st.Kano, {}, st.Kano(3.0, 1.0)),
    (st.He(2.0, 0.0), st.Stenman, {}, st.Stenman(2.0)),
    (st.Stenman(2.0), st.Kano, {}, st.Kano(2.0, 2.0)),
    (st.Kano(2.0, 2.0), st.Stenman, {}, st.Stenman(2.0)),
    (st.Ideal(), st.Kano, {}, st.Kano(0.0, 0.0)),
    (st.Kano(0.0, 0.0), st.Ideal, {}, st.Ideal()),
]


@pytest.mark.parametrize(("valve", "model", "options", "expected"), CONVERTED)
def test_what_converts(valve, model, options, expected):
    assert convert_valve(valve, model, **options) == expected
    assert convert_valve(valve, model.__name__, **options) == expected


def test_travel_comes_along():
    assert convert_valve(st.Kano(3.0, 1.0, travel=(0.0, 100.0)), "He").travel == (0.0, 100.0)


def test_he_there_and_back():
    valve = convert_valve(st.He(2.0, 1.0), "Srinivasan", dt=0.5)
    assert valve.r == pytest.approx(2.0, rel=1e-8)
    assert convert_valve(valve, "He", dt=0.5) == st.He(2.0, 1.0)


@given(op=inputs())
def test_bands_of_zero_are_the_ideal_valve(op):
    for valve in (st.Kano(0.0, 0.0), st.Stenman(0.0), st.He(0.0, 0.0), st.Srinivasan(0.0, 0.0, 3.0)):
        assert np.array_equal(st.stroke(valve, op, 1.0).mv, st.stroke(convert_valve(valve, "Ideal"), op, 1.0).mv)


@given(S=hs.floats(allow_nan=True, allow_infinity=True), J=hs.floats(allow_nan=True, allow_infinity=True))
def test_bad_numbers_get_a_sentence(S, J):
    if 0.0 <= J <= S < math.inf:
        assert convert_bands(S, J, "S, J", "fs, fd")[0] >= 0.0
    else:
        with pytest.raises(st.ParameterError, match=r"^[SJ]\b.*(give|finite|keep)"):
            convert_bands(S, J, "S, J", "fs, fd")
