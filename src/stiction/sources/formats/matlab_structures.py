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
HEADING_NAMES = ("names", "colheaders", "headers", "header", "columns", "tags", "varnames", "labels")
"""Names of a list of texts that are the headings of a matrix."""


def find_loops(path: str, fields: dict[str, Any]) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Find the structures that hold vectors of one length, the outermost first: path and columns of each.

    A single number `Ts` gives a column ``time_s`` where there is no time; a set point that is a single number stands
    for all samples.
    """
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
    if columns and period and not known & set(TIME_NAMES):
        columns = {"time_s": np.arange(n) * period, **columns}
    if columns and not known & set(SET_POINT_NAMES):
        columns |= {name: np.full(n, numbers[name]) for name in numbers if name.lower() in SET_POINT_NAMES}
    return columns


def _as_texts(value: Any) -> np.ndarray:
    """Give a list of texts as an array; empty when it is none."""
    cells = value.tolist() if isinstance(value, np.ndarray) and value.ndim == 1 else value
    is_list = isinstance(cells, list) and all(isinstance(cell, str) for cell in cells)
    return np.array(cells if is_list else [], dtype=object)
