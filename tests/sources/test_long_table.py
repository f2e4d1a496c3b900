"""Tables with a row for each tag and time, against the values written into them, found the slow way."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

from stiction.records import assess_quality

START = datetime(2026, 2, 1, 13)
N = 900


@pytest.fixture(scope="module")
def events():
    """OP and PV of a made-up loop, each stored when it had moved by a deviation: tag -> list of (second, value)."""
    rng = np.random.default_rng(5)
    k = np.arange(N)
    signals = {
        "FIC-1.OP": np.round(50 + 6 * np.sin(2 * np.pi * k / 60) + rng.normal(0, 0.1, N), 3),
        "FIC-1.PV": np.round(200 + 9 * np.cos(2 * np.pi * k / 60) + rng.normal(0, 0.2, N), 3),
    }
    stored = {}
    for (tag, x), deviation in zip(signals.items(), (0.4, 0.7), strict=True):
        last = np.inf
        stored[tag] = []
        for second, value in enumerate(x):
            if abs(value - last) > deviation:
                last = float(value)
                stored[tag].append((second, last))
    return stored


def text(events, header="Tag,Timestamp,Value", more=""):
    rows = sorted((second, tag, value) for tag, list_ in events.items() for second, value in list_)
    lines = [f"{tag},{START + timedelta(seconds=second)},{value!r}{more}" for second, tag, value in rows]
    return "\n".join([header, *lines])


def test_each_tag_stands_until_its_next_value(events, read_text):
    [record] = read_text(text(events))
    assert (record.tag, record.dt, record.start) == ("FIC-1", 1.0, START)
    assert any("a value is used until the next one" in guess for guess in record.provenance.assumptions)
    for second in range(5, len(record), 7):
        if np.isfinite(record.op[second] + record.pv[second]):
            op = [value for when, value in events["FIC-1.OP"] if when <= second][-1]
            pv = [value for when, value in events["FIC-1.PV"] if when <= second][-1]
            assert (record.op[second], record.pv[second]) == (op, pv)


def test_what_was_made_up_is_counted_and_exception_storage_is_found(events, read_text):
    [record] = read_text(text(events))
    seconds = {tag: {second for second, _ in list_} for tag, list_ in events.items()}
    fresh = min(len(on) for on in seconds.values())
    made_up = record.provenance.held_samples + int(np.isnan(record.op).sum())
    assert made_up == pytest.approx(len(record) - fresh, abs=0.03 * len(record))
    found = {check.name: check for check in assess_quality(record, 60.0).checks}
    assert "resampled" not in found  # what was held had not changed
    assert record.provenance.unchanged_samples == record.provenance.held_samples
    # OP swings by 12 and a little, PV by 18.
    assert 12 / 0.4 > found["exception reporting"].value > 12 / 0.7


def test_an_even_long_table_is_as_good_as_a_wide_one(signals, table, read_text):
    t, pv, op, sp = signals
    events = {
        f"FIC-1.{name}": list(zip((10 * t).tolist(), x.tolist(), strict=True))
        for name, x in (("PV", pv), ("OP", op), ("SP", sp))
    }
    [record] = read_text(text(events))
    assert (record.dt, len(record), record.provenance.held_samples) == (10.0, len(t), 0)
    for name, x in (("op", op), ("pv", pv), ("sp", sp)):
        np.testing.assert_array_equal(getattr(record, name), x)


def flux(blocks, annotated):
    """What InfluxDB exports: a block for each series, each under a header of its own."""
    notes = (
        "#group,false,false,true,true,false,false,true,true\n"
        "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,string\n"
        "#default,_result,,,,,,,\n"
    )
    lines = []
    for k, (loop, field, values) in enumerate(blocks):
        lines += [notes * annotated + ",result,table,_start,_stop,_time,_value,_field,_measurement"]
        for second, value in enumerate(values):
            when = f"{(START + timedelta(seconds=second)).isoformat()}Z"
            lines += [f",,{k},2026-02-01T13:00:00Z,2026-02-01T14:00:00Z,{when},{value!r},{field},{loop}"]
        lines += [""]
    return "\r\n".join(lines)


@pytest.mark.parametrize("annotated", [True, False])
@pytest.mark.parametrize("n", [30, 120])
def test_blocks_by_field_of_influxdb(annotated, n, signals, read_text):
    _, pv, op, _ = (x[:n].tolist() for x in signals)
    one = [("FIC-1", "PV", pv), ("FIC-1", "OP", op)]
    [record] = read_text(flux(one, annotated))
    assert (record.tag, record.loop_type, record.dt, len(record)) == ("FIC-1", "flow", 1.0, n)
    assert (record.pv.tolist(), record.op.tolist()) == (pv, op)
    assert not any("have a time zone" in guess for guess in record.provenance.assumptions)
    flow, level = read_text(flux([*one, ("LIC-2", "pv", op), ("LIC-2", "op", pv)], annotated))
    assert (flow.op.tolist(), level.tag, level.op.tolist()) == (op, "LIC-2", pv)
    [record] = read_text(flux([("opc", "FIC-1.PV", pv), ("opc", "FIC-1.OP", op)], annotated))
    assert (record.tag, record.op.tolist()) == ("FIC-1", op)


def test_the_loop_in_one_column_and_its_signal_in_another(signals, read_text):
    _, pv, op, _ = signals
    rows = [(name, when, x) for name, values in (("PV", pv), ("OP", op)) for when, x in enumerate(values.tolist())]
    for loops in (("FIC-1",), ("FIC-1", "LIC-2")):
        lines = [f"{loop},{name},{START + timedelta(seconds=k)},{x!r}" for loop in loops for name, k, x in rows]
        records = read_text("\n".join(["Loop,Signal,Time,Value", *lines]))
        assert [record.tag for record in records] == list(loops)
        for record in records:
            np.testing.assert_array_equal(record.op, op)
    lines = [
        f"Feed {'flow' if name == 'PV' else 'valve'},{name},{START + timedelta(seconds=k)},{x!r}" for name, k, x in rows
    ]
    [record] = read_text("\n".join(["Name,Signal,Time,Value", *lines]))
    np.testing.assert_array_equal(record.op, op)


def test_values_that_share_a_stamp_with_the_next_are_said(events, read_text):
    twice = {tag: [*list_, (list_[40][0], 7.5), list_[-1]] for tag, list_ in events.items()}
    [record] = read_text(text(twice))
    for tag in ("FIC-1.PV", "FIC-1.OP"):
        note = f"1 value of {tag} with the same time stamp as the next value, which differs."
        assert any(note in one for one in record.provenance.assumptions)
    assert not any(
        "the same time stamp as the next" in note for note in read_text(text(events))[0].provenance.assumptions
    )


def test_several_loops_bad_values_and_any_order_of_columns(signals, read_text):
    t, pv, op, _ = signals
    lines = ["Value;Quality;TagName;Time"]
    for loop in ("FIC-1", "LIC-2"):
        for k in range(len(t)):
            moment = START + timedelta(seconds=k)
            status = "Bad" if (k, loop) == (7, "LIC-2") else "Good"
            lines += [f"{pv[k]};{status};{loop}.PV;{moment}", f"{op[k]};Good;{loop}.OP;{moment}"]
    flow, level = read_text("\n".join(lines))
    assert (flow.loop_type, level.loop_type) == ("flow", "level")
    np.testing.assert_array_equal(flow.pv, pv)
    assert np.isnan(level.pv[7])
    assert np.isnan(level.pv).sum() == 1
    assert level.provenance.bad_values == {"bad quality": 1}


@pytest.mark.parametrize("by_tag", [True, False], ids=["tag after tag", "time after time"])
def test_the_hour_that_comes_twice_is_there_twice(by_tag, read_text):
    k = np.arange(300)
    pv, op = np.round(np.sin(k / 9.0), 3), np.round(50.0 + np.cos(k / 9.0), 3)
    wall = [datetime(2026, 10, 25) + timedelta(minutes=i - 60 * (i >= 180)) for i in range(300)]
    rows = [(f"FIC-1.{name}", when, x[i]) for name, x in (("PV", pv), ("OP", op)) for i, when in enumerate(wall)]
    if not by_tag:
        rows = [row for pair in zip(rows[:300], rows[300:], strict=True) for row in pair]
    [record] = read_text("\n".join(["Tag,Time,Value", *(f"{tag},{when},{value}" for tag, when, value in rows)]))
    assert (record.dt, len(record), record.provenance.clock_jumps) == (60.0, 300, 1)
    np.testing.assert_array_equal(record.op, op)
    np.testing.assert_array_equal(record.pv, pv)
    assert sum("summer time" in guess for guess in record.provenance.assumptions) == 1
