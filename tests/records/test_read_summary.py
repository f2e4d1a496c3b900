"""What the summary of a reading lists, and for which loop."""

from __future__ import annotations

from datetime import UTC, datetime

from stiction.records import LoopRecord, summarise
from stiction.records.record import Provenance


def record(tag="FIC-1", *assumptions, start=None, **origin):
    provenance = Provenance(source=f"{tag}.csv", assumptions=assumptions, **origin)
    return LoopRecord(tag, 2.0, op=[50.0] * 31, pv=[3.0] * 31, start=start, provenance=provenance)


def test_long_lists_are_cut():
    counts = {f"15{k},4": 1 for k in range(9)} | {"bad quality": 7}
    [line] = summarise([record(bad_values=counts, unused_columns=tuple(f"X{k}" for k in range(30)))]).loops
    assert "bad values: 7 x 'bad quality', 1 x '150,4', 1 x '151,4', 1 x '152,4', 1 x '153,4' and 5 more\n" in (
        line.summary() + "\n"
    )
    assert line.summary().endswith("X18, X19 and 10 more")
    assert line.to_dict()["bad_values"] == counts


def test_time_span_and_unit():
    [line] = summarise([record(start=datetime(2026, 3, 2, 6, tzinfo=UTC), pv_unit="t/h")]).loops
    stored = line.to_dict()
    assert (stored["start"], stored["end"]) == ("2026-03-02T06:00:00+00:00", "2026-03-02T06:01:00+00:00")
    for part in ("every 2 s from 2026-03-02 06:00 UTC to 2026-03-02 06:01 UTC,", "; PV in t/h"):
        assert part in line.summary()
    [line] = summarise([record()]).loops
    assert (line.record.start, line.end) == (None, None)
    assert "PV in" not in line.summary()


def test_an_assumption_names_its_loops():
    summary = summarise([record("A", "One.", "All."), record("B", "All."), record("C", "Two.", "All.", "One.")])
    assert summary.assumptions == ("A, C: One.", "All.", "C: Two.")
    assert summarise([record("A", "One.")]).assumptions == ("One.",)
    summary = summarise([record(tag, "Many.") for tag in "ABCDE"] + [record("F"), record("F", "Own.")])
    assert summary.assumptions == ("A, B, C and 2 more: Many.", "F from F.csv: Own.")
