"""Records as data frames and Parquet files: what is written, and equal records when it is read back."""

from __future__ import annotations

import os
from datetime import UTC, datetime, timedelta, timezone
from typing import TYPE_CHECKING
from zoneinfo import ZoneInfo

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as some

from stiction.errors import ParameterError, RecordError
from stiction.records.frames import to_frame
from stiction.records.parquet_writer import METADATA_KEY, to_parquet
from stiction.records.record import LOOP_TYPES, LoopRecord, Provenance
from stiction.sources import read
from stiction.sources.formats.stored_records import open_records

if TYPE_CHECKING:
    from pathlib import Path

STARTS = (
    None,
    datetime(2026, 3, 2, 6, 0, 0, 250_000),
    datetime(2026, 3, 2, 6, tzinfo=UTC),
    datetime(2026, 10, 25, 2, 30, tzinfo=ZoneInfo("Europe/Berlin"), fold=1),
    datetime(2026, 3, 2, 6, tzinfo=timezone(timedelta(hours=5, minutes=30))),
)


def record(tag: str = "FIC101", n: int = 40, seed: int = 0, start: datetime | None = STARTS[1], **more) -> LoopRecord:
    rng = np.random.default_rng(seed)
    op, pv = rng.normal(50.0, 3.0, n), rng.normal(3.0, 0.1, n)
    if n > 5:
        op[3] = pv[5] = np.nan
    return LoopRecord(tag, 5.0, op=op, pv=pv, start=start, **more)


@some.composite
def records(draw: some.DrawFn) -> LoopRecord:
    n = draw(some.integers(0, 30))
    optional = {
        name: np.random.default_rng(n).normal(size=n) for name in ("sp", "mv", "valve_signal") if draw(some.booleans())
    }
    if draw(some.booleans()):
        optional["auto"] = np.arange(n) % 3 > 0
    origin = Provenance(
        source=draw(some.text()),
        columns={"pv": draw(some.text())},
        rows=n,
        pv_unit=draw(some.sampled_from(["", "m³/h"])),
    )
    more = {"integrating": draw(some.sampled_from([None, True, False])), **optional}
    return record(
        draw(some.text(max_size=8)), n, n, draw(some.sampled_from(STARTS)), provenance=origin,
        loop_type=draw(some.sampled_from(LOOP_TYPES)), **more,
    )  # fmt: skip


@given(some.lists(records(), min_size=1, max_size=4))
def test_parquet_gives_equal_records(tmp_path_factory: pytest.TempPathFactory, loops: list[LoopRecord]) -> None:
    path = tmp_path_factory.mktemp("loops") / "loops.parquet"
    to_parquet(loops, path)
    found = read(path)
    assert found == loops
    assert [(each.start and each.start.isoformat()) for each in found] == [
        each.start and each.start.isoformat() for each in loops
    ]


def test_other_tools_read_the_file(tmp_path: Path) -> None:
    loops = [record(), record("LIC7", 25, 1, sp=np.full(25, 3.0), auto=np.arange(25) > 3)]
    path = tmp_path / "loops.parquet"
    to_parquet(loops, path)
    by_pandas = pd.read_parquet(path)
    assert list(by_pandas) == ["tag", "time", "pv", "op", "sp", "mv", "valve_signal", "auto"]
    one = by_pandas[by_pandas["tag"] == "LIC7"]
    assert np.array_equal(one["op"], loops[1].op, equal_nan=True)
    assert one["time"].iloc[2] == pd.Timestamp("2026-03-02 06:00:10.25")
    found = duckdb.sql(f"SELECT count(*), count(op), sum(op) FROM '{path}' WHERE tag = 'FIC101'").fetchall()[0]
    assert found[:2] == (40, 39)
    assert found[2] == pytest.approx(np.nansum(loops[0].op))


def test_one_loop_is_read_alone(tmp_path: Path) -> None:
    loops = [record(f"FIC{k}", 20 + k, k) for k in range(5)]
    to_parquet(loops, tmp_path / "a.parquet")
    assert read(tmp_path / "a.parquet", tag="fic3") == [loops[3]]
    stored = open_records(tmp_path / "a.parquet")
    assert stored is not None
    assert stored.tags == [loop.tag for loop in loops]
    assert stored.read_one(2) == loops[2]
    with pytest.raises(RecordError, match="has no loop 'FIC9'; its loops are FIC0, FIC1"):
        read(tmp_path / "a.parquet", tag="FIC9")


def test_file_of_records_read_with_an_option_is_a_table(tmp_path: Path) -> None:
    loops = [record("FIC1", 30), record("FIC2", 30, 1)]
    to_parquet(loops, tmp_path / "a.parquet")
    found = read(tmp_path / "a.parquet", op_range=(0.0, 200.0))
    assert [one.tag for one in found] == ["FIC1", "FIC2"]
    np.testing.assert_allclose(found[1].op, loops[1].op / 2.0)
    assert read(tmp_path / "a.parquet", dt=7.0)[0].dt == 7.0


def test_methods_of_a_record(tmp_path: Path) -> None:
    loop = record(loop_type="flow")
    loop.to_parquet(tmp_path / "a.parquet")
    assert read(tmp_path / "a.parquet") == [loop]
    for native in ("pandas", "polars", "pyarrow"):
        again = LoopRecord.from_frame(loop.to_frame(native=native), tag="FIC101", loop_type="flow")
        assert again == loop


def test_file_that_was_changed_since_is_an_ordinary_table(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    to_parquet([record("A"), record("B")], path)
    stored = pl.read_parquet_metadata(path)[METADATA_KEY]
    frame = pl.read_parquet(path)
    frame.head(79).write_parquet(path, metadata={METADATA_KEY: stored})
    assert open_records(path) is None
    frame.reverse().write_parquet(path, metadata={METADATA_KEY: stored})
    assert open_records(path) is None
    frame.write_parquet(path)
    assert open_records(path) is None


def test_old_file_stays_when_writing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.parquet"
    path.write_bytes(b"old")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(RecordError, match="No space left on device"):
        to_parquet(record(), path)
    assert [each.name for each in tmp_path.iterdir()] == ["a.parquet"]
    assert path.read_bytes() == b"old"
    monkeypatch.undo()
    with pytest.raises(RecordError, match=r"cannot be written"):
        to_parquet(record(), tmp_path / "none" / "a.parquet")
    with pytest.raises(RecordError, match="no record to write"):
        to_parquet([], path)


@pytest.mark.parametrize(
    ("native", "kind"), [("pandas", pd.DataFrame), ("polars", pl.DataFrame), ("pyarrow", pa.Table)]
)
@pytest.mark.parametrize("start", STARTS)
def test_frame_holds_time_and_signals(native: str, kind: type, start: datetime | None) -> None:
    loop = record(start=start, auto=np.arange(40) > 3, provenance=Provenance(pv_unit="m3/h"))
    frame = to_frame(loop, native=native)
    assert type(frame) is kind
    data = frame.to_pydict() if native == "pyarrow" else {name: frame[name].to_list() for name in frame.columns}
    assert list(data) == ["time", "pv", "op", "auto"]
    assert np.array_equal(np.array(data["op"], dtype=float), loop.op, equal_nan=True)
    assert data["auto"] == (np.arange(40) > 3).tolist()
    if start is None:
        assert data["time"] == loop.time.tolist()
    else:
        assert data["time"][7] - data["time"][0] == timedelta(seconds=35)
        assert data["time"][0].timestamp() == start.timestamp()
    if native == "pandas":
        assert frame.attrs == {"tag": "FIC101", "units": {"pv": "m3/h", "op": "%"}}
        assert frame["op"].isna().sum() == 1


def test_frame_of_several_records_has_their_tags() -> None:
    frame = to_frame([record("A", 3), record("B", 2, auto=np.ones(2, bool))], native="pandas")
    assert frame["tag"].tolist() == ["A"] * 3 + ["B"] * 2
    assert frame["auto"].isna().tolist() == [True] * 3 + [False] * 2
    assert to_frame([], native="polars").height == 0
    with pytest.raises(ParameterError, match="native = 'dask' is unknown"):
        to_frame(record(), native="dask")
    with pytest.raises(RecordError, match="of type str; give records"):
        to_frame(["a.csv"])  # type: ignore[list-item]
