"""Results as JSON: every kind of value and every option of a field, against JSON written by hand."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import PurePosixPath
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from stiction.display.json_form import FOUR_DECIMALS, Result, fields_to_json, json_as, to_json

pytestmark = pytest.mark.quick


@dataclass(frozen=True, slots=True)
class Peak:
    """A plain dataclass, as it stands in a result."""

    time: float = field(metadata=json_as("time_s"))
    height: complex


@dataclass(frozen=True)
class Run:
    op: np.ndarray
    n: int


@dataclass(frozen=True)
class Base(Result):
    tag: str
    share: float = field(metadata=FOUR_DECIMALS)
    secret: str = field(metadata=json_as(omit=True))


@dataclass(frozen=True)
class Wave(Base):
    peaks: tuple[Peak, ...]
    signal: np.ndarray = field(metadata=json_as("y"))
    trends: dict[str, dict[str, np.ndarray]]
    phase: float = field(default=12.3456, metadata=json_as("phase_deg", digits=1))
    raw: tuple[float, ...] = field(default=(1.0,), metadata=json_as(series=True))
    limits: dict[int, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Report(Result):
    _json_keys = ("rank as place", "wave", "length", "wave.tag as tag", "notes")

    notes: tuple[str, ...]
    wave: Wave
    rank: int
    not_listed: float = 0.0

    @property
    def length(self) -> int:
        return len(self.wave.signal)


@dataclass(frozen=True, slots=True)
class Outer(Result):
    report: Report

    def to_dict(self, *, series: bool = True) -> dict[str, Any]:
        return {"more": 1, **fields_to_json(self, series=series)}


WAVE = Wave(
    "FIC-1",
    0.123456,
    "not shown",
    peaks=(Peak(1.5, 1.0 - 2.0j),),
    signal=np.array([[1.0, math.nan], [math.inf, 4.0]]),
    trends={"repair": {"op": np.array([1, 2])}},
    limits={1: np.float64(0.5), 2: [np.array([True, False])]},
)
WAVE_JSON = {
    "tag": "FIC-1",
    "share": 0.1235,
    "peaks": [{"time_s": 1.5, "height": [1.0, -2.0]}],
    "y": [[1.0, None], [None, 4.0]],
    "trends": {"repair": {"op": [1, 2]}},
    "phase_deg": 12.3,
    "raw": [1.0],
    "limits": {"1": 0.5, "2": [[True, False]]},
}
REPORT_JSON = {"place": 3, "wave": WAVE_JSON, "length": 2, "tag": "FIC-1", "notes": ["a", "b"]}


def as_text(value: Any) -> str:
    """JSON with the order of its keys."""
    return json.dumps(value, allow_nan=False)


def test_fields_of_a_dataclass_with_all_options():
    assert as_text(WAVE.to_dict()) == as_text(WAVE_JSON)


def test_listed_keys_have_their_order_and_may_be_properties_and_paths():
    assert as_text(Report(("a", "b"), WAVE, 3).to_dict()) == as_text(REPORT_JSON)


def test_a_nested_result_uses_its_own_method():
    nested = to_json([Outer(Report(("a", "b"), WAVE, 3))])
    assert as_text(nested) == as_text([{"more": 1, "report": REPORT_JSON}])


def test_without_series_arrays_are_left_out_at_every_depth():
    short = {key: value for key, value in WAVE_JSON.items() if key not in ("y", "trends", "raw")}
    assert as_text(WAVE.to_dict(series=False)) == as_text(short)
    found = Outer(Report((), WAVE, 3)).to_dict(series=False)
    assert as_text(found["report"]["wave"]) == as_text(short)
    mixed, rest = {"empty": {}, "op": np.zeros(2), 1: np.float64(1.0)}, {"empty": {}, "1": 1.0}
    assert to_json({"runs": [mixed], "run": mixed}, series=False) == {"runs": [rest], "run": rest}
    assert to_json([Run(np.zeros(2), 2)], series=False) == [{"n": 2}]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "null"),
        (np.bool_(True), "true"),
        (np.int64(7), "7"),
        (np.float32(0.5), "0.5"),
        (-math.inf, "null"),
        (complex(1.0, math.nan), "[1.0, null]"),
        (np.array([1 + 2j]), "[[1.0, 2.0]]"),
        (np.array(3.0), "3.0"),
        (datetime(2026, 3, 2, 6, 0, tzinfo=UTC), '"2026-03-02T06:00:00+00:00"'),
        (PurePosixPath("a/b"), '"a/b"'),
    ],
)
def test_single_values(value, text):
    assert as_text(to_json(value)) == text


def test_a_misspelt_key_is_an_error():
    @dataclass
    class Wrong(Result):
        _json_keys = ("perriod",)
        period: float = 1.0

    with pytest.raises(AttributeError, match="perriod"):
        Wrong().to_dict()


numbers = some.one_of(some.floats(allow_nan=False, allow_infinity=False), some.integers(), some.booleans(), some.none())
values = some.recursive(
    some.one_of(numbers, some.text()),
    lambda inner: some.one_of(some.lists(inner), some.dictionaries(some.text(), inner)),
    max_leaves=20,
)


@given(limits=values, signal=some.lists(some.floats(allow_nan=False, allow_infinity=False)), tag=some.text())
def test_json_gives_back_what_the_fields_hold(limits, signal, tag):
    """The fields as `dataclasses.asdict` gives them, and the array as the list of which it was made."""

    @dataclass
    class Holder(Result):
        tag: str
        limits: Any
        signal: np.ndarray

    found = json.loads(as_text(Holder(tag, limits, np.array(signal)).to_dict()))
    assert found == asdict(Holder(tag, limits, np.array(signal))) | {"signal": signal}


@given(x=some.floats())
def test_a_number_is_itself_or_unknown(x):
    assert to_json(x) == (x if math.isfinite(x) else None)
    assert to_json(np.array([x])) == [to_json(np.float64(x))] == [to_json(x)]
