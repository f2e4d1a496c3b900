"""Memory of the reading of a loop: only its columns, and of a long table the last rows."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import h5py
import numpy as np
import polars as pl
import pytest
from scipy.io import savemat

import stiction as st
from stiction.errors import ParameterError, RecordError
from stiction.sources import memory, open_loops

if TYPE_CHECKING:
    from pathlib import Path

PEAK = """
import sys
from pathlib import Path
from stiction.sources import open_loops
loops = open_loops(sys.argv[1], max_memory=sys.argv[2])
for k in range(len(loops)):
    assert len(loops.read_one(k)) > 1000
[line] = [line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM")]
print(int(line.split()[1]) * 1024)
"""


def peak_memory(path: Path, limit: str) -> int:
    done = subprocess.run([sys.executable, "-c", PEAK, str(path), limit], capture_output=True, text=True, check=True)
    return int(done.stdout)


def write_long(path: Path, rows: int, loops: int = 1) -> None:
    k = np.arange(rows)
    columns = {"Time": pl.Series(k * 1000).cast(pl.Datetime("ms"))}
    for i in range(loops):
        columns[f"F{i}.PV"] = pl.Series(50.0 + (k * 7 + i) % 101 / 10.0)
        columns[f"F{i}.OP"] = pl.Series(40.0 + (k * 5 + i) % 97 / 10.0)
    pl.DataFrame(columns).write_parquet(path)


@pytest.mark.parametrize(("text", "size"), [("2GB", 2e9), ("500 MB", 5e8), ("1.5g", 1.5e9), (2e9, 2e9), ("2GiB", 2e9)])
def test_amounts_of_memory(text, size):
    assert memory.parse_memory(text) == size


@pytest.mark.parametrize("text", ["", "much", "-2GB", "1kB", "2XB"])
def test_what_is_no_amount_is_refused(tmp_path, text):
    with pytest.raises(ParameterError, match=r"max_memory = .* is not an amount above 0.3 GB; give it as 2GB"):
        st.read(tmp_path, max_memory=text)


def test_last_rows_of_a_long_table_are_read_and_reported(tmp_path, monkeypatch):
    write_long(tmp_path / "a.parquet", 5000)
    whole = st.read(tmp_path / "a.parquet")[0]
    monkeypatch.setattr(memory, "CELL_BYTES", 100_000)
    part = st.read(tmp_path / "a.parquet", max_memory="1200MB")[0]
    assert len(part) == 3000  # 0.9 GB of 3 columns
    assert np.array_equal(part.op, whole.op[2000:])
    assert (part.start - whole.start).total_seconds() == 2000.0
    assert any("Of 5,000 rows only the last 3,000 are read" in note for note in part.provenance.assumptions)


def test_columns_of_one_loop_are_dropped_before_the_next(tmp_path):
    write_long(tmp_path / "a.parquet", 3000, loops=5)
    loops = open_loops(tmp_path / "a.parquet")
    for k in range(5):
        loops.read_one(k)
        [table] = {column.table for column in loops.roles[k].roles.values()}
        assert set(table._columns) <= {0}  # the time
    again = open_loops(tmp_path / "a.parquet").read()
    assert all(np.array_equal(loops.read_one(k).op, again[k].op) for k in range(5))


def test_more_than_the_memory_holds_is_refused_with_what_to_do(tmp_path, monkeypatch):
    write_long(tmp_path / "a.parquet", 3000, loops=5)
    monkeypatch.setattr("stiction.sources.loops.memory_limit", lambda _: 50_000)
    with pytest.raises(RecordError, match=r"5 loops take .* audit them, read one with tag, or allow more"):
        st.read(tmp_path / "a.parquet")


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
def test_peak_memory_stays_within_the_limit(tmp_path):
    write_long(tmp_path / "long.parquet", 6_000_000)  # 0.9 GB without a limit
    write_long(tmp_path / "many.parquet", 100_000, loops=60)  # 96 MB of cells, 1.5 MB a loop
    assert peak_memory(tmp_path / "long.parquet", "0.6GB") < 0.6e9
    assert peak_memory(tmp_path / "many.parquet", "0.4GB") < 0.4e9


@pytest.mark.parametrize("kind", ["packed.mat", "plain.mat", "v73.mat", "stream.arrow"])
def test_file_that_is_read_whole_is_refused_where_it_does_not_fit(kind: str, tmp_path: Path) -> None:
    path, k = tmp_path / kind, np.arange(100_000.0)
    signals = {"time_s": k, "PV": np.sin(k), "OP": np.cos(k)}
    if kind == "stream.arrow":
        pl.DataFrame(signals).write_ipc_stream(path)
    elif kind == "v73.mat":
        with h5py.File(path, "w") as file:
            file.update(signals)
    else:
        savemat(path, signals, do_compression=kind == "packed.mat")
    assert len(st.read(path)[0]) == 100_000
    with pytest.raises(
        RecordError, match=r"GB of memory, as it is read whole; 0.301 GB are allowed; save it as Parquet"
    ):
        st.read(path, max_memory=301_000_000)


def test_large_columnar_file_is_not_refused_by_its_size(tmp_path: Path) -> None:
    k = np.arange(20_000.0)
    names = [f"FIC-{i}.{word}" for i in range(20) for word in ("PV", "OP")]
    frame = pl.DataFrame({"time_s": k, **{name: np.random.default_rng(1).normal(size=k.size) for name in names}})
    for path, write in ((tmp_path / "a.parquet", frame.write_parquet), (tmp_path / "a.feather", frame.write_ipc)):
        write(path)
        assert path.stat().st_size > 2_000_000
        assert len(open_loops(path, max_bytes=2_000_000).read_one(3)) == k.size
