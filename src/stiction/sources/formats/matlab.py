"""MATLAB files, v5 and v7.3: vectors, matrices with names, structures such as those of the ISDB."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import polars as pl

from stiction.errors import MissingExtraError, RecordError
from stiction.foreign_errors import damage_refused, damaged
from stiction.sources.compression import ByteLimit
from stiction.sources.memory import require_memory
from stiction.sources.table import Origin
from stiction.sources.time.time_columns import is_time_heading
from stiction.sources.typed_table import make_series, typed_table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stiction.sources.byte_source import ByteSource
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["find_loops", "read", "recognises"]

SAMPLE_TIME_NAMES = ("ts", "dt", "tsample", "sampletime", "sample_time", "samplingtime", "sampling_time", "h")
"""Names of a single number that is the sampling period [s]."""
TAG_NAMES = ("tag", "tagname", "name", "loop", "loopname")
SET_POINT_NAMES = ("sp", "setpoint", "set_point")
"""Names of a set point, of which a single number stands for all samples."""
HEADING_NAMES = ("names", "colheaders", "headers", "header", "columns", "tags", "varnames", "labels")
"""Names of a list of texts that are the headings of a matrix."""


def find_loops(path: str, fields: dict[str, Any]) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Find structures of vectors of one length: path and columns; `Ts` gives ``time_s`` where there is no time."""
    if columns := _find_columns(fields):
        yield path, columns
    for name, value in fields.items():
        inner = f"{path}.{name}" if path else name
        if isinstance(value, dict):
            yield from find_loops(inner, value)
        elif isinstance(value, (list, np.ndarray)) and np.ndim(value) == 1:
            for k, one in enumerate(value):
                if isinstance(one, dict):
                    tags = [text for key, text in one.items() if key.lower() in TAG_NAMES and isinstance(text, str)]
                    yield from find_loops(tags[0] if tags else f"{inner}({k + 1})", one)


def _find_columns(fields: dict[str, Any]) -> dict[str, np.ndarray]:
    """Give the columns of a structure: vectors of one length, matrices with as many rows, or nothing."""
    lists = {name: texts for name, value in fields.items() if len(texts := _as_texts(value)) > 0}
    dense = {name: value for name, value in fields.items() if isinstance(value, (np.ndarray, np.generic))}
    arrays = {name: value for name, value in dense.items() if value.dtype.kind in "fiub"}
    lengths = Counter(len(value) for value in arrays.values() if value.ndim == 1)
    n = max(lengths, key=lambda length: (lengths[length], length), default=0)
    columns: dict[str, np.ndarray] = {}
    if lengths[n] > 1 and n > 1:
        columns = {name: value for name, value in (lists | arrays).items() if value.ndim == 1 and len(value) == n}
        columns = {name: columns[name] for name in fields if name in columns}
    for name, matrix in arrays.items():
        if matrix.ndim == 2 and (not columns or len(matrix) == n):
            n, width = matrix.shape
            headings = [texts for key, texts in lists.items() if key.lower() in HEADING_NAMES and len(texts) == width]
            names = headings[0].tolist() if headings else [f"{name}({k + 1})" for k in range(width)]
            columns |= {heading: matrix[:, k] for k, heading in enumerate(names)}
    numbers = {name: float(value) for name, value in fields.items() if isinstance(value, (int, float))}
    known = {name.lower() for name in columns}
    period = next((numbers[name] for name in numbers if name.lower() in SAMPLE_TIME_NAMES), None)
    if columns and period and not any(map(is_time_heading, known)):
        columns = {"time_s": np.arange(n) * period, **columns}
    if columns and not known & set(SET_POINT_NAMES):
        columns |= {name: np.full(n, numbers[name]) for name in numbers if name.lower() in SET_POINT_NAMES}
    return columns


def _as_texts(value: Any) -> np.ndarray:
    """Give a list of texts as an array; empty when it is none."""
    cells = value.tolist() if isinstance(value, np.ndarray) and value.ndim == 1 else value
    is_list = isinstance(cells, list) and all(isinstance(cell, str) for cell in cells)
    return np.array(cells if is_list else [], dtype=object)


REMEDY = "save it again in MATLAB"
HDF5_START = b"\x89HDF\r\n\x1a\n"
ITEM_BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
"""Bytes of an item of each type of number or text in a v5 file (MAT-File Format, table 1-1)."""
ELEMENT_KINDS = {*ITEM_BYTES, 14, 15}


def recognises(head: bytes, name: str) -> bool:
    """Whether a file is a MATLAB file, by its first bytes and, of other HDF5 files, by its name."""
    if head.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")):
        return True
    return name.lower().endswith(".mat") and (head.startswith(HDF5_START) or b"\0" in head[:32])


def read(source: ByteSource, options: ReadOptions) -> list[RawTable]:
    """Read a table, named by its path, of each structure or matrix that holds signals, or of `options.tag`."""
    is_hdf5 = source.head.startswith(HDF5_START) or source.head[512:520] == HDF5_START
    variables = _load_hdf5(source, options) if is_hdf5 else _load(source, options)
    loops = list(find_loops("", variables))
    if len({path.split(".")[0] for path, _ in loops}) == 1 and all("." in path for path, _ in loops):
        loops = [(path.split(".", 1)[1], columns) for path, columns in loops]
    if not loops:
        objects = sorted(name for name, value in variables.items() if type(value).__name__.startswith("Matlab"))
        remedy = "save time, pv, op and sp as vectors of one length"
        if objects:
            remedy = f"{', '.join(objects[:5])} can only be read by MATLAB; write it with writetimetable(x, 'loop.csv')"
        raise RecordError(f"contains no vectors of numbers; {remedy}.", where=source.origin.name)
    named = [(path, columns) for path, columns in loops if path.casefold() == (options.tag or "").casefold()]
    return [_make_table(source.origin, path, columns) for path, columns in named or loops]


def _load(source: ByteSource, options: ReadOptions) -> dict[str, Any]:
    """Read the variables of a file of version 5."""
    from scipy.io import loadmat

    _require_sound(source, options)
    with damage_refused(source.origin.name, REMEDY):
        stored = loadmat(source.path, simplify_cells=True)
    return {key: value for key, value in stored.items() if not key.startswith("__")}


def _load_hdf5(source: ByteSource, options: ReadOptions) -> dict[str, Any]:
    """Read the variables of a file of version 7.3."""
    try:
        import h5py
    except ImportError:
        raise MissingExtraError(
            "is a MATLAB 7.3 file, which needs h5py; save it with save(..., '-v7'), or "
            'install h5py with: pip install "stiction[matlab]"',
            where=source.origin.name,
        ) from None
    from stiction.sources.formats.matlab_hdf5 import read_group

    with damage_refused(source.origin.name, REMEDY), h5py.File(source.path, "r") as file:
        sizes: list[int] = []
        file.visititems(lambda _, item: sizes.append(8 * (getattr(item, "size", 0) or 0)))
        require_memory(sum(sizes), options.max_memory, source.origin.name)
        return read_group(file, source.origin.name, source.max_bytes)


def _require_sound(source: ByteSource, options: ReadOptions) -> None:
    """Walk over the variables of a v5 file: refuse damaged ones, on which scipy may crash, and too large ones."""
    import zlib

    limit = ByteLimit(source.origin.name, source.max_bytes, source.path.stat().st_size)
    order: Literal["little", "big"] = "little" if source.head[126:128] == b"IM" else "big"
    with source.path.open("rb") as file:
        file.seek(128)
        while len(tag := file.read(8)) == 8:
            kind, size = int.from_bytes(tag[:4], order), int.from_bytes(tag[4:], order)
            if kind not in (14, 15) or size > source.size - file.tell():
                raise damaged(source.origin.name, ValueError(f"no variable at byte {file.tell() - 8}"), REMEDY)
            require_memory(limit.size + size, options.max_memory, source.origin.name)
            limit.add(size if kind == 14 else 0)
            data, inflater = file.read(size), zlib.decompressobj()
            if kind == 15:
                with damage_refused(source.origin.name, REMEDY):
                    pieces = [inflater.decompress(data, 1 << 20)]
                    while inflater.unconsumed_tail:
                        limit.add(len(pieces[-1]))
                        require_memory(limit.size, options.max_memory, source.origin.name)
                        pieces.append(inflater.decompress(inflater.unconsumed_tail, 1 << 20))
                data = b"".join(pieces)[8:]  # without the tag of the variable
            if not _has_valid_tags(memoryview(data), order):
                raise damaged(source.origin.name, ValueError("a variable holds data of unknown type or size"), REMEDY)


def _has_valid_tags(data: memoryview, order: Literal["little", "big"]) -> bool:
    """Whether the elements of a variable have known types, fit into it, and are as many and as large as it says."""
    place, elements = 0, []
    while place + 8 <= len(data):
        word, size = (int.from_bytes(data[place + k : place + k + 4], order) for k in (0, 4))
        kind, begin = word, place + 8
        if word >> 16:  # up to 4 bytes stand in the tag itself
            kind, size, begin = word & 0xFFFF, word >> 16, place + 4
        inner = data[begin : begin + size]
        if kind not in ELEMENT_KINDS or len(inner) < size or (kind == 14 and not _has_valid_tags(inner, order)):
            return False
        elements.append((kind, inner))
        place = max(place + 8, begin + size + -(begin + size) % 8)
    if not elements or elements[0][0] != 6:
        return not elements
    flags = int.from_bytes(elements[0][1][:4], order)
    code, is_complex = flags & 0xFF, flags >> 11 & 1
    shape = elements[1][1] if elements[1:] else b""
    n = math.prod(int.from_bytes(shape[k : k + 4], order) for k in range(0, len(shape), 4))
    if code == 1:  # a cell array: flags, sizes, name, one element of each cell
        return len(elements) == 3 + n
    if code == 2:  # structures: two more elements with the names of the fields, then the fields of each
        widths, names = (elements[k][1] if len(elements) > k else b"" for k in (3, 4))
        width = int.from_bytes(widths, order)
        return len(widths) == 4 and width > 0 and len(elements) == 5 + n * (len(names) // width)
    if code == 4:  # text, of up to 4 bytes a character
        return len(elements) == 4 and n <= len(elements[3][1]) <= 4 * n
    if code not in range(6, 16):
        return True
    parts = elements[3:]  # after flags, sizes and name: values, and imaginary parts
    return len(parts) == 1 + is_complex and all(len(one) == n * ITEM_BYTES.get(kind, 0) for kind, one in parts)


def _make_table(origin: Origin, path: str, columns: dict[str, np.ndarray]) -> RawTable:
    """Make the table of one loop."""
    series = {name: _make_column(values) for name, values in columns.items()}
    named = origin if not path else Origin(f"{origin.name}, {path}", path, origin.digest)
    return typed_table(named, pl.DataFrame(series))


def _make_column(values: np.ndarray) -> pl.Series:
    if values.dtype.kind in "fiub":
        return pl.Series(np.ascontiguousarray(values, values.dtype.newbyteorder("=")))
    return make_series([str(cell).strip() for cell in values])
