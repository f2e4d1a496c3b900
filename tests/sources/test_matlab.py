"""MATLAB files as scipy writes them (v5) and, of version 7.3, as MATLAB lays them out in HDF5."""

from __future__ import annotations

import struct
import sys
import zlib
from datetime import datetime
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
import pytest
import scipy.sparse
from scipy.io import savemat

from stiction.errors import MissingExtraError, RecordError
from stiction.sources import read as stiction_read
from stiction.sources.byte_source import open_sources
from stiction.sources.formats import matlab
from stiction.sources.options import ReadOptions

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.sources.table import RawTable

N = 50


def loop(number: float) -> dict[str, Any]:
    """One loop as the International Stiction Data Base holds it."""
    k = np.arange(float(N))
    return {"PV": k + number, "OP": 40.0 + k, "SP": np.full(N, 3.0), "Ts": 2.0, "Comments": "flow loop"}


DATA_BASE = {"cdata": {"chemicals": {"loop1": loop(1), "loop2": loop(2)}, "power": {"loop1": loop(3)}}}
VARIABLES = {"time": np.arange(N) * 5.0, "pv": np.arange(float(N)), "op": np.arange(N) + 40.0, "gain": 0.5}
MATRIX = {"data": np.arange(3.0 * N).reshape(N, 3), "names": ["time_s", "FIC1.PV", "FIC1.OP"]}


def save(path: Path, content: dict[str, Any], version: str) -> Path:
    """Write variables as version 5 or 7.3."""
    if version == "5":
        lists = {key: np.array(value, dtype=object) for key, value in content.items() if isinstance(value, list)}
        savemat(path, content | lists, do_compression=True)
        return path
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            put(file, name, value)
    data = bytearray(path.read_bytes())
    data[:19] = b"MATLAB 7.3 MAT-file"
    path.write_bytes(data)
    return path


def put(group: h5py.Group, name: str, value: Any) -> None:
    """Write one variable as MATLAB does: transposed, text as codes, cells as references."""
    if isinstance(value, dict):
        inner = group.create_group(name)
        inner.attrs["MATLAB_class"] = np.bytes_("struct")
        for key, one in value.items():
            put(inner, key, one)
        return
    if isinstance(value, str):
        stored, kind = np.array([[ord(letter)] for letter in value], dtype=np.uint16), "char"
    elif isinstance(value, list):
        cells = group.file.require_group("#refs#")
        for k, one in enumerate(value):
            put(cells, f"{name}{k}", one)
        references = [cells[f"{name}{k}"].ref for k in range(len(value))]
        stored, kind = np.array(references, dtype=h5py.ref_dtype).reshape(-1, 1), "cell"
    else:
        stored, kind = np.atleast_2d(np.asarray(value, dtype=float)).T, "double"
        stored = stored.T if np.ndim(value) < 2 else stored
    group.create_dataset(name, data=stored).attrs["MATLAB_class"] = np.bytes_(kind)


def read(path: Path, **asked: Any) -> list[RawTable]:
    source = open_sources(path, ReadOptions(**asked))[0]
    assert matlab.recognises(source.head, path.name)
    return matlab.read(source, ReadOptions(**asked))


def columns(table: RawTable) -> dict[str, list[Any]]:
    return {name: table.column(k).to_list() for k, name in enumerate(table.header[0])}


versions = pytest.mark.parametrize("version", ["5", "7.3"])


@versions
def test_loops_of_the_stiction_data_base(tmp_path: Path, version: str) -> None:
    path = save(tmp_path / "isdb.mat", DATA_BASE, version)
    tables = {table.origin.stem: columns(table) for table in read(path)}
    assert list(tables) == ["chemicals.loop1", "chemicals.loop2", "power.loop1"]
    for number, found in enumerate(tables.values(), start=1):
        assert found == {
            "time_s": [2.0 * k for k in range(N)],
            **{name: loop(number)[name].tolist() for name in ("PV", "OP", "SP")},
        }
    [one] = read(path, tag="Chemicals.Loop2")
    assert one.origin.stem == "chemicals.loop2"


@versions
def test_plain_variables(tmp_path: Path, version: str) -> None:
    [table] = read(save(tmp_path / "fic1.mat", VARIABLES, version))
    assert table.origin.stem == "fic1"
    assert columns(table) == {name: VARIABLES[name].tolist() for name in ("time", "pv", "op")}


@versions
def test_matrix_with_names(tmp_path: Path, version: str) -> None:
    [table] = read(save(tmp_path / "a.mat", MATRIX, version))
    assert columns(table) == {name: MATRIX["data"][:, k].tolist() for k, name in enumerate(MATRIX["names"])}
    [table] = read(save(tmp_path / "b.mat", {"x": MATRIX["data"]}, version))
    assert table.header == [["x(1)", "x(2)", "x(3)"]]


@versions
def test_set_point_as_one_number_stands_for_all_samples(tmp_path: Path, version: str) -> None:
    content = {"FIC1": {"pv": np.arange(float(N)), "op": np.arange(float(N)), "sp": 3.0, "dt": 0.5}}
    [table] = read(save(tmp_path / "a.mat", content, version))
    assert columns(table)["sp"] == [3.0] * N
    assert columns(table)["time_s"][:3] == [0.0, 0.5, 1.0]


def test_structure_array_is_named_by_its_tags(tmp_path: Path) -> None:
    kinds = [("PV", object), ("OP", object), ("tag", object)]
    loops = [(np.arange(5.0), np.arange(5.0), "FIC1"), (np.arange(6.0), np.arange(6.0), "FIC2")]
    savemat(tmp_path / "a.mat", {"loops": np.array(loops, dtype=kinds)})
    assert [(table.origin.stem, len(table.column(0))) for table in read(tmp_path / "a.mat")] == [
        ("FIC1", 5),
        ("FIC2", 6),
    ]


def test_day_numbers_and_texts_of_time(tmp_path: Path) -> None:
    first = 740_043.0  # datenum(2026, 3, 2): 366 days of year 0, and days since 0001-01-01
    savemat(tmp_path / "a.mat", {"t": first + np.arange(N) / 17_280, "pv": np.arange(N), "op": np.arange(N)})
    [record] = stiction_read(tmp_path / "a.mat")
    assert (record.start, record.dt) == (datetime(2026, 3, 2), 5.0)
    assert "The time column is taken as MATLAB serial days." in record.provenance.assumptions
    texts = [f"2026-03-02 00:00:{k:02d}" for k in range(N)]
    savemat(tmp_path / "b.mat", {"t": np.array(texts), "pv": np.arange(N), "op": np.arange(N)})
    assert read(tmp_path / "b.mat")[0].column(0).to_list() == texts


def test_what_holds_no_loop_is_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"gain": 3.0, "note": "none"})
    with pytest.raises(RecordError, match=r"contains no vectors of numbers; save time, pv, op"):
        read(tmp_path / "a.mat")
    with h5py.File(tmp_path / "b.mat", "w") as file:
        table = file.create_dataset("trend", data=np.zeros((1, 6), dtype=np.uint32))
        table.attrs["MATLAB_class"] = np.bytes_("timetable")
        table.attrs["MATLAB_object_decode"] = 3
    with pytest.raises(RecordError, match=r"trend can only be read by MATLAB; write it with writetimetable"):
        read(tmp_path / "b.mat")


def test_links_to_other_files_are_not_followed(tmp_path: Path) -> None:
    save(tmp_path / "secret.mat", VARIABLES, "7.3")
    with h5py.File(tmp_path / "a.mat", "w") as file:
        for name in ("pv", "op"):
            file[name] = h5py.ExternalLink(str(tmp_path / "secret.mat"), f"/{name}")
    with pytest.raises(RecordError, match="contains no vectors"):
        read(tmp_path / "a.mat")


def test_missing_h5py_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = save(tmp_path / "a.mat", VARIABLES, "7.3")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MissingExtraError, match=r'needs h5py; .* pip install "stiction\[matlab\]"'):
        read(path)


def test_compressed_variable_that_grows_too_large(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"pv": np.zeros(4_000_000), "op": np.zeros(4_000_000)}, do_compression=True)
    with pytest.raises(RecordError, match=r"decompresses to more than 200 times"):
        read(tmp_path / "a.mat")


@versions
def test_damaged_files(tmp_path: Path, version: str) -> None:
    path = save(tmp_path / "a.mat", DATA_BASE, version)
    whole = path.read_bytes()
    rng = np.random.default_rng(3)
    refused = 0
    for trial in range(40):
        damaged = bytearray(whole[: int(rng.integers(len(whole) // 2, len(whole)))] if trial % 2 else whole)
        for place in rng.integers(130 if version == "5" else 520, len(damaged), 3):
            damaged[place] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            tables = read(path)
        except RecordError:
            refused += 1
        else:
            assert all(len(table.column(0)) > 1 for table in tables)
    assert refused > 5


@pytest.mark.parametrize(("place", "value"), [(128, 0x780000), (176, 0x55), (144, 0x0906), (132, 10**7)])
def test_damage_on_which_scipy_crashes_is_refused(tmp_path: Path, place: int, value: int) -> None:
    """Type of the first variable, type of its values, the mark of complex numbers, and its size."""
    savemat(tmp_path / "a.mat", {"Time": np.arange(float(N)), "pv": np.arange(float(N)), "op": np.arange(float(N))})
    data = bytearray((tmp_path / "a.mat").read_bytes())
    data[place : place + 4] = value.to_bytes(4, "little")
    (tmp_path / "a.mat").write_bytes(data)
    with pytest.raises(RecordError, match=r"a.mat: is damaged .*save it again in MATLAB"):
        read(tmp_path / "a.mat")


def test_sparse_matrix_beside_signals_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, VARIABLES | {"gain": scipy.sparse.eye_array(4, format="csc")})
    [source] = open_sources(path, ReadOptions())
    [table] = matlab.read(source, ReadOptions())
    assert table.header[0] == ["time", "pv", "op"]


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize(
    ("intact", "damage"),
    [
        (b"\x09\0\0\0\x90\x01\0\0", b"\x08\0\0\0\x90\x01\0\0"),  # a reserved type of data: scipy 1.17 crashes
        (b"\x05\0\0\0\x08\0\0\0\x01\0\0\0\x32\0\0\0", b"\x05\0\0\0\x08\0\0\0\x01\0\0\0\x32\0\0\x32"),  # 800 M values
        (b"\x05\0\0\0\x08\0\0\0\x01\0\0\0\x01\0\0\0", b"\x05\0\0\0\x08\0\0\0\x01\0\0\x40\x01\0\0\0"),  # 1 G structures
    ],
)
def test_damaged_variable_is_refused_before_it_is_read(
    tmp_path: Path, intact: bytes, damage: bytes, compressed: bool
) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"loop": {name: np.arange(float(N)) for name in ("PV", "OP")}})
    data = path.read_bytes()
    assert intact in data
    variable = data[128:].replace(intact, damage)
    if compressed:
        packed = zlib.compress(variable)
        variable = struct.pack("<II", 15, len(packed)) + packed
    path.write_bytes(data[:128] + variable)
    [source] = open_sources(path, ReadOptions())
    with pytest.raises(RecordError, match="is damaged"):
        matlab.read(source, ReadOptions())
