from __future__ import annotations

from datetime import UTC, datetime, timedelta

import polars as pl
import pytest

from stiction.sources.options import ReadOptions
from stiction.sources.table import SNIFF_ROWS, Origin, RawTable
from stiction.sources.time.parse import parse_time
from stiction.sources.time.time_columns import find_time_columns


@pytest.fixture(scope="session")
def table():
    """Make a table of columns: ``table(["Time", "PV"], stamps, values)``; a column is a list of text or a Series."""

    def make(header, *columns, decimal="."):
        series = [pl.Series(str(i), column) for i, column in enumerate(columns)]
        heads = [["" if cell is None else str(cell) for cell in column.head(SNIFF_ROWS)] for column in series]
        rows = [list(row) for row in zip(*heads, strict=True)]
        names = [header] if header else []
        origin = Origin("file.csv", "file")
        return RawTable(
            origin, names, rows, len(columns), lambda wanted: pl.DataFrame([series[i] for i in wanted]), 2, decimal
        )

    return make


@pytest.fixture(scope="session")
def stamps_of(table):
    """Read the time of each row: ``stamps_of(["Time", "PV"], stamps, values, day_first=True)``."""

    def read(header, *columns, decimal=".", **options):
        made = table(header, *columns, decimal=decimal)
        chosen = ReadOptions(**options)
        return parse_time(made, find_time_columns(header, [""] * len(header), made, chosen), chosen)

    return read


@pytest.fixture(scope="session")
def since_1970():
    """Seconds since 1970 of a datetime; a naive one as if it were UTC."""

    def seconds(moment: datetime) -> float:
        aware = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
        return (aware - datetime(1970, 1, 1, tzinfo=UTC)) / timedelta(seconds=1)

    return seconds
