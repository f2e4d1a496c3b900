"""Parquet and Arrow files: types, pandas' index, data sets of several files, damage."""

from __future__ import annotations

import contextlib
import time
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import polars as pl
import pytest

import stiction as st
from stiction.errors import RecordError
from stiction.sources.byte_source import open_sources
from stiction.sources.formats import columnar
from stiction.sources.options import ReadOptions

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.sources.table import RawTable

START = datetime(2026, 3, 2)


def loop_frame(n: int = 100, tag: str = "FIC101", start: datetime = START) -> pl.DataFrame:
    times = [start + timedelta(seconds=5 * k) for k in range(n)]
    wave = np.sin(np.arange(n) / 9.0)
    return pl.DataFrame({"Time": times, f"{tag}.PV": 3.0 + wave, f"{tag}.OP": 40.0 + wave})


def read(path: Path, options: ReadOptions | None = None) -> RawTable:
    source = open_sources(path, options or ReadOptions())[0]
    assert columnar.recognises(source.head, path.name)
    [table] = columnar.read(source, options or ReadOptions())
    return table


def test_columns_have_the_types_of_the_file(tmp_path: Path) -> None:
    frame = loop_frame().with_columns(
        mode=pl.Series(["AUTO", "MAN"] * 50, dtype=pl.Categorical),
        exact=pl.Series([1.25] * 100).cast(pl.Decimal(10, 2)),
        many=pl.Series([[1.0, 2.0]] * 100),
    )
    frame.write_parquet(tmp_path / "a.parquet")
    table = read(tmp_path / "a.parquet")
    assert table.header == [frame.columns]
    assert table.column(0).equals(frame["Time"])
    assert table.column(1).equals(frame["FIC101.PV"])
    assert table.column(3).to_list() == ["AUTO", "MAN"] * 50
    assert table.column(4).to_list() == [1.25] * 100
    assert table.column(5).null_count() == len(table.column(5)) == 100  # lists are no signal
    assert table.sample[1][:2] == ["2026-03-02T00:00:05", str(frame["FIC101.PV"][1])]


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_index_levels_and_units_of_pandas(tmp_path: Path, zone: str | None) -> None:
    index = pd.date_range(START, periods=50, freq="5s", tz=zone)
    frame = pd.DataFrame({("FIC101", "PV"): np.arange(50.0), ("FIC101", "OP"): np.arange(50.0)}, index=index)
    frame.attrs["units"] = {"FIC101.PV": "m3/h"}
    frame.to_parquet(tmp_path / "a.parquet")
    table = read(tmp_path / "a.parquet")
    assert table.header == [["Time", "FIC101.PV", "FIC101.OP"], ["", "m3/h", ""]]
    assert table.column(0).dtype == pl.Datetime("us", zone)
    assert table.column(0).dt.epoch("s").to_list() == [int(stamp.timestamp()) for stamp in index]


@pytest.mark.parametrize("form", ["file", "stream"])
def test_arrow_file_and_stream(tmp_path: Path, form: str) -> None:
    frame = loop_frame()
    path = tmp_path / "a.arrow"
    frame.write_ipc(path) if form == "file" else frame.write_ipc_stream(path)
    table = read(path)
    assert table.header == [frame.columns]
    assert table.column(2).equals(frame["FIC101.OP"])


def test_one_loop_of_300_columns_is_quick(tmp_path: Path) -> None:
    values = np.random.default_rng(0).normal(size=(17_280, 300)).round(3)
    names = [f"FIC{k // 2}.{'PV' if k % 2 == 0 else 'OP'}" for k in range(300)]
    frame = pl.DataFrame(values, schema=names).insert_column(0, loop_frame(17_280)["Time"])
    frame.write_parquet(tmp_path / "a.parquet")
    source = open_sources(tmp_path / "a.parquet", ReadOptions())[0]
    seconds = []
    for _ in range(5):
        began = time.process_time()
        [table] = columnar.read(source, ReadOptions())
        table.load([0, 151, 152])
        seconds.append(time.process_time() - began)
    assert min(seconds) < 0.06  # 0.02 s on a quiet machine
    assert table.header[0][151] == "FIC75.PV"
    assert len(table.column(151)) == 17_280


def test_data_set_of_several_files(tmp_path: Path) -> None:
    frames = {
        "a": loop_frame(start=START),
        "b": loop_frame(start=START + timedelta(seconds=500)),  # the same loop, later
        "c": loop_frame(tag="FIC102"),
    }
    for name, frame in frames.items():
        frame.write_parquet(tmp_path / f"{name}.parquet")
    records = {record.tag: record for record in st.read(tmp_path)}
    assert {tag: record.provenance.rows for tag, record in records.items()} == {"FIC101": 200, "FIC102": 100}


def test_long_data_set_is_one_table(tmp_path: Path) -> None:
    for k in range(3):
        long = loop_frame(tag=f"FIC{k}").unpivot(index="Time", variable_name="Tag", value_name="Value")
        long.write_parquet(tmp_path / f"{k}.parquet")
    assert [(record.tag, len(record)) for record in st.read(tmp_path)] == [(f"FIC{k}", 100) for k in range(3)]


def test_columns_larger_than_allowed_are_refused(tmp_path: Path) -> None:
    pl.DataFrame({"PV": np.zeros(200_000), "OP": np.zeros(200_000)}).write_parquet(tmp_path / "a.parquet")
    table = read(tmp_path / "a.parquet", ReadOptions(max_bytes=2_000_000))
    table.load([0])
    table = read(tmp_path / "a.parquet", ReadOptions(max_bytes=2_000_000))
    with pytest.raises(RecordError, match=r"200,000 rows of 2 columns exceed 2,000,000 bytes"):
        table.load([0, 1])


@pytest.mark.parametrize("kind", ["parquet", "arrow"])
def test_damaged_files_are_refused_or_read_in_full(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"a.{kind}"
    loop_frame(2000).write_parquet(path) if kind == "parquet" else loop_frame(2000).write_ipc(path)
    whole = path.read_bytes()
    rng = np.random.default_rng(5)
    for trial in range(30):
        damaged = bytearray(whole[: int(rng.integers(8, len(whole)))] if trial % 2 else whole)
        for place in rng.integers(0, len(damaged), 1 + trial % 7):
            damaged[place] ^= int(rng.integers(1, 256))
        path.write_bytes(b"PAR1" + damaged[4:] if kind == "parquet" else b"ARROW1" + damaged[6:])
        lengths = set()
        with contextlib.suppress(RecordError):  # any other error fails the test
            table = read(path)
            lengths = {len(table.column(k)) for k in range(table.width)}
        assert lengths in (set(), {2000})
