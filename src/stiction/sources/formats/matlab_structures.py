"""Which structures of a MATLAB file hold the signals of a loop."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["TIME_NAMES", "find_loops"]

SAMPLE_TIME_NAMES = ("ts", "dt", "tsample", "sampletime", "sample_time", "samplingtime", "sampling_time", "h")
"""Names of a single number that is the sampling period [s]."""
TIME_NAMES = ("t", "time", "times", "timestamp", "timestamps", "datetime", "date", "datenum", "tout")
TAG_NAMES = ("tag", "tagname", "name", "loop", "loopname")
SET_POINT_NAMES = ("sp", "setpoint", "set_point")
"""Names of a set point, of which a single number stands for all samples."""
COLUMN_NAME_LISTS = ("names", "colheaders", "headers", "header", "columns", "tags", "varnames", "labels")
"""Names of a list of texts that are the headings of a matrix."""


def find_loops(path: str, fields: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Find the structures that hold vectors of one length, from the outermost to the innermost.

    Parameters
    ----------
    path : str
        Name of the structure, such as ``cdata.chemicals``; empty for the file.
    fields : dict
        Name -> value: numbers, texts, arrays, structures as dict, lists of them.

    Yields
    ------
    tuple of (str, dict)
        Name of the structure, and its columns by name. A single number `Ts` gives a column ``time_s`` where there is
        no time; a set point that is a single number stands for all samples.

    Examples
    --------
    >>> loop = {"PV": np.zeros(3), "OP": np.zeros(3), "Ts": 2.0}
    >>> [(name, columns)] = find_loops("", {"flow": {"loop1": loop}})
    >>> name, columns["time_s"]
    ('flow.loop1', array([0., 2., 4.]))
    """
    loop = _signals_of(fields)
    if loop:
        yield path, loop
    for name, value in fields.items():
        inner = f"{path}.{name}" if path else name
        if isinstance(value, dict):
            yield from find_loops(inner, value)
        elif _is_list_of_structs(value):
            for k, one in enumerate(value):
                tag = next((one[key] for key in one if key.lower() in TAG_NAMES and isinstance(one[key], str)), "")
                yield from find_loops(tag or f"{inner}({k + 1})", one)


def _signals_of(fields: dict[str, Any]) -> dict[str, Any]:
    """Give the columns of a structure: vectors of one length, a matrix with its names, or nothing."""
    vectors = {name: value for name, value in fields.items() if _shape(value) is not None and len(value.shape) == 1}
    lengths = Counter(value.shape[0] for value in vectors.values() if value.dtype.kind in "fiub")
    n = max(lengths, key=lambda length: (lengths[length], length), default=0)
    columns = {name: value for name, value in vectors.items() if value.shape[0] == n and n > 1}
    if lengths.get(n, 0) < 2:
        columns = {}
    for name, value in fields.items():
        is_matrix = _shape(value) is not None and len(value.shape) == 2 and value.dtype.kind in "fiub"
        if is_matrix and (not columns or value.shape[0] == n):
            n = value.shape[0]
            columns |= _matrix_columns(name, value, fields)
    if not columns:
        return {}
    scalars = {name.lower(): value for name, value in fields.items() if isinstance(value, (int, float))}
    known = {name.lower() for name in columns}
    for name, value in fields.items():
        if name.lower() in SET_POINT_NAMES and name.lower() in scalars and name.lower() not in known:
            columns[name] = np.full(n, float(value))
    period = next((float(scalars[name]) for name in SAMPLE_TIME_NAMES if name in scalars), None)
    if period and not known & set(TIME_NAMES):
        columns = {"time_s": np.arange(n) * period, **columns}
    return columns


def _matrix_columns(name: str, matrix: Any, fields: dict[str, Any]) -> dict[str, Any]:
    """Give the columns of a matrix, named by a list of texts beside it where there is one."""
    width = matrix.shape[1]
    lists = {key.lower(): _texts(value) for key, value in fields.items()}
    headings = next((lists[key] for key in COLUMN_NAME_LISTS if len(lists.get(key) or ()) == width), None)
    headings = headings or [f"{name}({k + 1})" for k in range(width)]
    return {heading: _Column(matrix, k) for k, heading in enumerate(headings)}


class _Column:
    """One column of a matrix, which may be on disk."""

    def __init__(self, matrix: Any, number: int) -> None:
        self.matrix, self.number = matrix, number
        self.shape, self.dtype = matrix.shape[:1], matrix.dtype

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.asarray(self.matrix[:, self.number], dtype=dtype)


def _shape(value: Any) -> tuple[int, ...] | None:
    """Shape of an array of numbers or texts; None of anything else."""
    dtype = getattr(value, "dtype", None)
    if dtype is None or dtype.kind not in "fiubUO" or getattr(dtype, "names", None):
        return None
    if dtype.kind == "O" and not _texts(value):
        return None
    return tuple(value.shape)


def _texts(value: Any) -> list[str]:
    """Give a list of texts; empty when it is none."""
    cells = value.tolist() if isinstance(value, np.ndarray) and value.dtype.kind in "UO" and value.ndim == 1 else value
    return cells if isinstance(cells, list) and cells and all(isinstance(cell, str) for cell in cells) else []


def _is_list_of_structs(value: Any) -> bool:
    items = value.ravel().tolist() if isinstance(value, np.ndarray) and value.dtype.kind == "O" else value
    return isinstance(items, list) and bool(items) and all(isinstance(item, dict) for item in items)
