"""Tables of averages, minima and maxima in each form, and series that several columns tell apart."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.errors import RecordError

N = 120
K = np.arange(N)
PV = np.round(150 + 8 * np.sin(K / 9), 3)
OP = np.round(50 + 6 * np.cos(K / 9), 3)
STAMPS = [f"2026-10-06 02:{k // 12:02d}:{5 * (k % 12):02d}" for k in K]
SPREAD = 1.6 / np.ptp(np.quantile(OP, [0.01, 0.99]))
KINDS = {"avg": 0.0, "min": -0.7, "max": 0.9}


def read(tmp_path, lines):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines))
    return st.read(path)


def rows(*columns):
    return [",".join(map(str, row)) for row in zip(*columns, strict=True)]


def check(record: st.LoopRecord, middle: float = 0.0):
    np.testing.assert_allclose(record.pv, PV + middle, atol=1e-9)
    np.testing.assert_allclose(record.op, OP + middle, atol=1e-9)
    assert (record.tag, record.dt) == ("FIC1", 5.0)


@pytest.mark.parametrize(
    "form",
    [
        "{}.Minimum|{}.Maximum|{}.Average",
        "{} (Min)|{} (Max)|{} (Avg)",
        "MIN({})|MAX({})|AVG({})",
        "{}_min|{}_max|{}_mean",
    ],
)
@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
def test_the_average_of_a_wide_table_is_taken(form, order, tmp_path):
    minimum, maximum, average = form.split("|")
    kinds = [(minimum, "min"), (maximum, "max"), (average, "avg")]
    names, columns = ["Time"], [np.array(STAMPS)]
    for tag, x in (("FIC1.PV", PV), ("FIC1.OP", OP)):
        for k in order:
            names.append(kinds[k][0].format(tag))
            columns.append((x + KINDS[kinds[k][1]]).round(3))
    [record] = read(tmp_path, [",".join(names), *rows(*columns)])
    check(record)
    assert any(minimum.format("FIC1.PV") in note for note in record.provenance.assumptions)
    assert record.provenance.interval_spread == pytest.approx(SPREAD, abs=1e-3)


def test_the_aggregate_stands_in_a_second_row_of_headings(tmp_path):
    columns = [(x + shift).round(3) for x in (PV, OP) for shift in KINDS.values()]
    head = [",FIC1.PV,FIC1.PV,FIC1.PV,FIC1.OP,FIC1.OP,FIC1.OP", ",mean,min,max,mean,min,max"]
    for extra in ([], ["time,,,,,,"]):
        check(*read(tmp_path, [*head, *extra, *rows(STAMPS, *columns)]))


def test_without_average_the_middle_is_taken(tmp_path):
    columns = [(x + KINDS[kind]).round(3) for x in (PV, OP) for kind in ("min", "max")]
    [record] = read(tmp_path, ["Time,FIC1.PV.Min,FIC1.PV.Max,FIC1.OP.Min,FIC1.OP.Max", *rows(STAMPS, *columns)])
    check(record, 0.1)
    assert any("middle of minimum and maximum" in note for note in record.provenance.assumptions)


def test_a_limit_beside_a_signal_is_no_aggregate(tmp_path):
    [record] = read(tmp_path, ["Time,FIC1.PV,FIC1.OP,FIC1.OP.Max", *rows(STAMPS, PV, OP, [100.0] * N)])
    check(record)


def test_a_named_column_is_kept(tmp_path):
    columns = [(x + shift).round(3) for x in (PV, OP) for shift in KINDS.values()]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["Time,PV avg,PV min,PV max,OP avg,OP min,OP max", *rows(STAMPS, *columns)]))
    [record] = st.read(path, columns={"pv": "PV max", "op": "OP avg"})
    np.testing.assert_allclose(record.pv, PV + 0.9)


@pytest.mark.parametrize("kinds", [["min", "max", "avg"], ["Average", "Maximum"], ["MAX", "MIN"]])
def test_a_long_table_names_the_aggregate_in_a_column(kinds, tmp_path):
    shift = {"av": 0.0, "mi": -0.7, "ma": 0.9}
    lines = ["tag,time,value,statistic"]
    for tag, x in (("FIC1.PV", PV), ("FIC1.OP", OP)):
        for kind in kinds:
            lines += rows([tag] * N, STAMPS, (x + shift[kind[:2].lower()]).round(3), [kind] * N)
    [record] = read(tmp_path, lines)
    check(record, 0.1 if "MIN" in kinds else 0.0)


def test_a_long_table_of_maxima_alone_is_refused(tmp_path):
    lines = ["tag,time,value,statistic", *rows(["FIC1.PV"] * N, STAMPS, PV, ["max", "count"] * (N // 2))]
    with pytest.raises(RecordError, match="aggregates COUNT, MAX, and no average"):
        read(tmp_path, lines)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0)])
def test_a_long_table_has_a_column_for_each_aggregate(order, tmp_path):
    names = [("min", "max", "avg")[k] for k in order]
    lines = [f"tag,bucket,{','.join(names)}"]
    for tag, x in (("FIC1.PV", PV), ("FIC1.OP", OP)):
        lines += rows([tag] * N, STAMPS, *((x + KINDS[name]).round(3) for name in names))
    [record] = read(tmp_path, lines)
    check(record)
    assert record.provenance.interval_spread == pytest.approx(SPREAD, abs=1e-3)


@pytest.mark.parametrize(("period", "severity"), [(600.0, "ok"), (50.0, "warn")])
def test_averages_over_a_large_part_of_a_cycle_are_reported(period, severity, tmp_path):
    t = np.arange(20.0 * 400)
    names, columns = ["time_s"], [20.0 * np.arange(400)]
    for tag, x in (("PV", np.sin(2 * np.pi * t / period)), ("OP", np.cos(2 * np.pi * t / period))):
        intervals = (50.0 + 5.0 * x).reshape(400, 20)
        names += [f"FIC1.{tag} {kind}" for kind in KINDS]
        columns += [intervals.mean(axis=1), intervals.min(axis=1), intervals.max(axis=1)]
    [record] = read(tmp_path, [",".join(names), *rows(*columns)])
    [found] = [one for one in st.records.assess_quality(record).checks if one.name == "averages"]
    assert found.severity == severity


def series(tags, extra):
    """Rows of a long table: tag, time, value, further cells; each loop has a level of its own."""
    lines = []
    for number, cells in enumerate(extra):
        for tag, x in zip(tags, (PV, OP), strict=True):
            lines += rows([tag] * N, STAMPS, x + number, *([cell] * N for cell in cells))
    return lines


@pytest.mark.parametrize(
    ("header", "tags", "extra", "names"),
    [
        ("_field,_time,_value,_measurement,loop", ["pv", "op"], [("plc", "FIC1"), ("plc", "FIC2")], ["FIC1", "FIC2"]),
        ("_field,_time,_value,loop,_measurement", ["pv", "op"], [("FIC1", "plc"), ("FIC2", "plc")], ["FIC1", "FIC2"]),
        ("tag,time,value,plant", ["FIC1.PV", "FIC1.OP"], [("North",), ("South",)], ["North.FIC1", "South.FIC1"]),
        ("tag,time,value,train,shift", ["FIC1.PV", "FIC1.OP"], [("1", "A"), ("2", "A")], ["1.FIC1", "2.FIC1"]),
    ],
)
def test_every_column_that_tells_series_apart_is_part_of_the_tag(header, tags, extra, names, tmp_path):
    records = read(tmp_path, [header, *series(tags, extra)])
    assert [record.tag for record in records] == names
    for number, record in enumerate(records):
        np.testing.assert_array_equal(record.pv, PV + number)
        np.testing.assert_array_equal(record.op, OP + number)


def test_two_values_at_one_time_without_a_column_that_tells_them_apart(tmp_path):
    lines = ["tag,time,value", *series(["FIC1.PV", "FIC1.OP"], [(), ()])]
    with pytest.raises(RecordError, match=r"120 of 240 values of FIC1.PV have the time of another value"):
        read(tmp_path, lines)
    [record] = read(tmp_path, [*lines[: 2 * N + 1], *lines[1 : 2 * N + 1]])
    np.testing.assert_array_equal(record.pv, PV)


@pytest.mark.parametrize(
    ("unit", "other", "factor"), [("L/h", "kL/h", 1e-3), ("bar", "mbar", 1e3), ("t/h", "kg/h", 1e3)]
)
def test_a_unit_that_changes_is_converted(unit, other, factor, tmp_path):
    changed = K % 40 > 25
    pv, units = np.where(changed, PV * factor, PV), np.where(changed, other, unit)
    lines = [
        "tag,time,value,unit",
        *rows(["FIC1.PV"] * N, STAMPS, pv, units),
        *rows(["FIC1.OP"] * N, STAMPS, OP, ["%"] * N),
    ]
    in_cells = [
        "Time,FIC1.PV,FIC1.OP",
        *rows(STAMPS, (f"{x!r} {u}" for x, u in zip(pv.tolist(), units, strict=True)), OP),
    ]
    for text in (lines, in_cells):
        [record] = read(tmp_path, text)
        np.testing.assert_allclose(record.pv, PV)
        assert record.provenance.pv_unit == unit
        assert any(f"in {other} were converted to {unit}" in note for note in record.provenance.assumptions)
    unknown = [line.replace(other, "widgets/h") for line in lines]
    with pytest.raises(RecordError, match=r"FIC1.PV: mixes units .*widgets/h"):
        read(tmp_path, unknown)


def test_value_between_minimum_and_maximum_is_the_average(tmp_path):
    lines = ["tag,time,minimum,value,maximum"]
    for tag, y in (("FIC1.PV", PV), ("FIC1.OP", OP)):
        lines += rows([tag] * N, STAMPS, y - 0.7, y, y + 2.9)
    [record] = read(tmp_path, lines)
    np.testing.assert_allclose(record.pv, PV)
    np.testing.assert_allclose(record.op, OP)
