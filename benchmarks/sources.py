"""Reading large exports, beside polars' own read of the same text, each in fresh processes; and one loop alone."""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import polars as pl
from bench import Row, Section

PROCESSES = 5
"""Fresh processes of which the median is taken."""
MAX_RATIO = 3.0
"""Largest processor time of a wide export, of the time that polars takes for its cells alone [-]."""
MAX_WIDE_MB, MAX_LONG_MB = 450.0, 1000.0
"""Largest peak memory of a wide and of a long export [MB]."""
MAX_WIDE_S, MAX_LONG_S, MAX_CSV_S, MAX_PARQUET_S = 2.0, 6.0, 0.15, 0.02
"""Longest processor time of a wide export, a long one, one loop as CSV and one of 300 columns as Parquet [s]."""
_MEASURE = """
import gc, re, resource, sys, time
from pathlib import Path
import polars as pl
import stiction as st
import stiction.sources.formats, stiction.sources.layouts, stiction.sources.roles.assign
path = sys.argv[1]
{warm_up}
gc.collect()  # what the imports left is not part of the read
began = time.process_time()
{work}
used = time.process_time() - began
status = Path("/proc/self/status")  # its peak is that of this program, not of the one that started it
peak = re.search(r"VmHWM:\\s*(\\d+)", status.read_text())[1] if status.exists() else 0
print(used, (int(peak) or resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 1024)
"""
_BY_POLARS = """
frame = pl.read_csv(path, infer_schema=False)
values = frame.select(pl.all().exclude(frame.columns[0]).cast(pl.Float64, strict=False))
"""


def sources() -> Section:
    """A wide export, a long one, one loop as CSV and one loop out of a Parquet file of 300 columns."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        wide, long, one, parquet = (Path(folder, name) for name in ("wide.csv", "long.csv", "one.csv", "wide.parquet"))
        write_wide(wide, parquet)
        write_long(long)
        write_one(one)
        theirs, theirs_mb = measure(_BY_POLARS, wide)
        ours, ours_mb = measure("st.read(path)", wide)
        size = wide.stat().st_size / 1e6
        rows += [
            Row(
                f"wide CSV, {size:.0f} MB, 100 loops",
                ours,
                "s",
                "polars, text and cast",
                theirs,
                theirs / ours,
                1 / MAX_RATIO,
            ),
            bound("  of that, the bound on a quiet machine", ours, MAX_WIDE_S, "s"),
            Row("  peak memory", ours_mb, "MB", "bound", MAX_WIDE_MB, MAX_WIDE_MB / ours_mb, 1.0),
            Row("  peak memory of polars alone", theirs_mb, "MB"),
        ]
        ours, ours_mb = measure("st.read(path)", long)
        size = long.stat().st_size / 1e6
        rows += [
            bound(f"long CSV, {size:.0f} MB, 5 million rows, 20 loops", ours, MAX_LONG_S, "s"),
            bound("  peak memory", ours_mb, MAX_LONG_MB, "MB"),
        ]
        small = write_one(Path(folder, "small.csv"), 200)
        ours, _ = measure("st.read(path)", one, warm_up=f"st.read({str(small)!r})")
        rows.append(bound("one loop of 86 400 rows, CSV", ours, MAX_CSV_S, "s"))
        ours, _ = measure("st.read(path, tag='FIC-50')", parquet, warm_up="st.read(path, tag='FIC-3')")
        rows.append(bound("one loop of 300 columns, Parquet", ours, MAX_PARQUET_S, "s"))
    return Section(
        f"Sources: processor time and peak memory, medians of {PROCESSES} fresh processes, after the imports",
        rows,
        ("a ratio of 0.33 to polars is three times its time; single loops after one small read to warm up",),
    )


def bound(what: str, value: float, limit: float, unit: str) -> Row:
    return Row(what, value, unit, "bound", limit, limit / value, 1.0)


def measure(work: str, path: Path, *, warm_up: str = "") -> tuple[float, float]:
    """Median processor time [s] and peak memory [MB] of fresh processes."""
    code = _MEASURE.format(work=work, warm_up=warm_up)
    runs = []
    for _ in range(PROCESSES):
        done = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
        runs.append([float(word) for word in done.stdout.split()])
    seconds, megabytes = zip(*runs, strict=True)
    return statistics.median(seconds), statistics.median(megabytes)


def write_wide(text: Path, parquet: Path, loops: int = 100, n: int = 20_000, bad_cells: int = 3032) -> None:
    """PV, OP and SP of many loops, with a status text in some cells of the text."""
    rng = np.random.default_rng(0)
    columns = {"Time": stamps(n, 1.0)}
    for k in range(loops):
        for word in ("PV", "OP", "SP"):
            columns[f"FIC-{k}.{word}"] = pl.Series(np.round(50.0 + 0.1 * rng.normal(size=n).cumsum(), 4))
    frame = pl.DataFrame(columns)
    frame.write_parquet(parquet)
    cells = frame.with_columns(pl.all().exclude("Time").cast(pl.String))
    spoiled = rng.integers(0, len(columns) - 1, bad_cells)
    for k, count in zip(*np.unique(spoiled, return_counts=True), strict=True):
        name = frame.columns[1 + k]
        rows = rng.choice(n, count, replace=False)
        cells = cells.with_columns(cells[name].scatter(rows, "Bad"))
    cells.write_csv(text, datetime_format="%Y-%m-%d %H:%M:%S")


def write_long(path: Path, loops: int = 20, n: int = 5_000_000) -> None:
    """Tag, time, value and quality of 60 tags, row after row in order of time."""
    rng = np.random.default_rng(1)
    tags = [f"FIC-{k}.{word}" for k in range(loops) for word in ("PV", "OP", "SP")]
    each = n // len(tags)
    time = stamps(each, 1.0).gather(np.repeat(np.arange(each), len(tags)))
    value = np.round(50.0 + 0.1 * rng.normal(size=(each, len(tags))).cumsum(axis=0), 3).ravel()
    pl.DataFrame({"Tag": tags * each, "Time": time, "Value": value}).write_csv(
        path, datetime_format="%Y-%m-%d %H:%M:%S"
    )


def write_one(path: Path, n: int = 86_400) -> Path:
    """One loop of a day."""
    rng = np.random.default_rng(2)
    signals = {f"FIC-1.{word}": np.round(50.0 + 0.1 * rng.normal(size=n).cumsum(), 4) for word in ("PV", "OP", "SP")}
    pl.DataFrame({"Time": stamps(n, 1.0), **signals}).write_csv(path, datetime_format="%Y-%m-%d %H:%M:%S")
    return path


def stamps(n: int, dt: float) -> pl.Series:
    start = np.datetime64("2026-01-01T00:00:00", "us")
    return pl.Series(start + (np.arange(n) * dt * 1e6).astype("timedelta64[us]"))
