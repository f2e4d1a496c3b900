"""One loop written by pandas, polars, openpyxl, scipy and DuckDB into each format gives the same table."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

import duckdb
import numpy as np
import openpyxl
import pandas as pd
import polars as pl
import pytest
import sqlalchemy as sa
from scipy.io import savemat

from stiction.records.frames import to_frame
from stiction.sources import read
from stiction.sources.byte_source import open_sources
from stiction.sources.formats import columnar, excel, matlab, text
from stiction.sources.frame import frame_to_table
from stiction.sources.options import ReadOptions
from stiction.sources.sql import read_database

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.sources.table import RawTable

N = 120
START = datetime(2026, 3, 1, 23, 55)
DATA = {
    "Time": [START + timedelta(seconds=5 * k) for k in range(N)],
    "FIC101.PV": [round(3.0 + 0.01 * np.sin(k / 5.0), 6) for k in range(N)],
    "FIC101.OP": [round(40.0 + np.sin(k / 5.0), 6) for k in range(N)],
    "FIC101.SP": [3.0] * N,
}


def one_record(frame, **options):
    [record] = read(frame, **options)
    return record


def by_openpyxl(path: Path) -> None:
    book = openpyxl.Workbook()
    page = book.active
    assert page is not None
    for row in [list(DATA), *zip(*DATA.values(), strict=True)]:
        page.append(list(row))
    book.save(path)


def by_scipy(path: Path) -> None:
    midnight = datetime.combine(START, datetime.min.time())
    days = [START.toordinal() + 366 + (stamp - midnight) / timedelta(days=1) for stamp in DATA["Time"]]
    signals = {name.replace(".", "_"): np.array(DATA[name]) for name in list(DATA)[1:]}
    savemat(path, {"Time": np.array(days), **signals})


def by_duckdb(path: Path) -> None:
    frame = pd.DataFrame(DATA)  # noqa: F841
    duckdb.sql(f"COPY (SELECT * FROM frame) TO '{path}'")


WRITERS = {
    "pandas.csv": lambda path: pd.DataFrame(DATA).to_csv(path, index=False),
    "index.csv": lambda path: pd.DataFrame(DATA).set_index("Time").to_csv(path),
    "packed.csv.gz": lambda path: pd.DataFrame(DATA).to_csv(path, index=False),
    "packed.csv.zst": lambda path: pd.DataFrame(DATA).to_csv(path, index=False),
    "packed.csv.zip": lambda path: pd.DataFrame(DATA).to_csv(path, index=False),
    "polars.csv": lambda path: pl.DataFrame(DATA).write_csv(path),
    "duckdb.csv": by_duckdb,
    "pandas.parquet": lambda path: pd.DataFrame(DATA).set_index("Time").to_parquet(path),
    "polars.parquet": lambda path: pl.DataFrame(DATA).write_parquet(path),
    "duckdb.parquet": by_duckdb,
    "pandas.feather": lambda path: pd.DataFrame(DATA).to_feather(path),
    "polars.arrow": lambda path: pl.DataFrame(DATA).write_ipc(path),
    "openpyxl.xlsx": by_openpyxl,
    "pandas.xlsx": lambda path: pd.DataFrame(DATA).to_excel(path, index=False),
    "pandas.ods": lambda path: pd.DataFrame(DATA).to_excel(path, index=False),
    "scipy.mat": by_scipy,
}


def assert_same(table: RawTable) -> None:
    """Compare a table with what was written."""
    headings = [name.replace("_", ".") for name in table.header[0]]
    assert headings == list(DATA)
    time = table.column(0)
    if time.dtype == pl.Float64:  # day numbers of MATLAB, 719 529 on 1 January 1970
        time = pl.from_epoch(((time - 719_529.0) * 86_400e3).round().cast(pl.Int64), time_unit="ms")
    stamps = time.str.replace(r"\.0+$", "").str.to_datetime() if time.dtype == pl.String else time
    assert stamps.dt.replace_time_zone(None).to_list() == DATA["Time"]
    for k, name in enumerate(list(DATA)[1:], start=1):
        assert table.column(k).cast(pl.Float64).to_list() == DATA[name]


@pytest.mark.parametrize("name", WRITERS)
def test_files(tmp_path: Path, name: str) -> None:
    WRITERS[name](tmp_path / name)
    source = open_sources(tmp_path / name, ReadOptions())[0]
    page = next(page for page in (columnar, matlab, excel, text) if page.recognises(source.head, source.origin.name))
    [table] = page.read(source, ReadOptions())
    assert_same(table)


FRAMES = {
    "pandas": pd.DataFrame(DATA),
    "pandas with an index": pd.DataFrame(DATA).set_index("Time"),
    "pandas with nullable types": pd.DataFrame(DATA).convert_dtypes(),
    "polars": pl.DataFrame(DATA),
    "lazy polars": pl.LazyFrame(DATA),
    "pyarrow": pl.DataFrame(DATA).to_arrow(),
}


@pytest.mark.parametrize("name", FRAMES)
def test_frames(name: str) -> None:
    assert_same(frame_to_table(FRAMES[name]))


def test_database(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path}/plant.db"
    pd.DataFrame(DATA).to_sql("trend", sa.create_engine(url), index=False)
    assert_same(read_database(url, table="trend", time="Time")[0])


@pytest.mark.parametrize("native", ["pandas", "polars", "pyarrow"])
def test_record_to_frame_and_back(native: str) -> None:
    record = one_record(pd.DataFrame(DATA), loop_type="flow")
    again = one_record(to_frame(record, native=native), tag="FIC101", loop_type="flow")
    assert replace(again, provenance=record.provenance) == record


def test_frame_of_several_loops() -> None:
    frame = pd.DataFrame(DATA | {"FIC102.PV": DATA["FIC101.PV"], "FIC102.OP": DATA["FIC101.OP"]})
    assert [record.tag for record in read(frame)] == ["FIC101", "FIC102"]
    assert one_record(frame, tag="FIC102").tag == "FIC102"


@pytest.mark.parametrize("name", WRITERS)
def test_all_formats_give_equal_records(tmp_path: Path, name: str) -> None:
    WRITERS[name](tmp_path / name)
    [record] = read(tmp_path / name)
    expected = one_record(pl.DataFrame(DATA))
    assert replace(record, tag="FIC101", provenance=expected.provenance) == expected
