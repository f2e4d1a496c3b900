"""Variables of MATLAB files of version 7.3, which are HDF5 files."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

from stiction.errors import RecordError, Setting

__all__ = ["MatlabObject", "read_group"]

MAX_DEPTH = 12
"""Structures within structures that are followed [-]."""


class MatlabObject:
    """A table, timetable, string or other object that only MATLAB can read."""


class _FieldOfArray(list):
    """Values of one field, one for each element of a structure array."""


def read_group(group: Any, name: str, max_bytes: int, depth: int = 0) -> dict[str, Any]:
    """Read the variables of a file, or fields of a structure, `max_bytes` each; links are not followed."""
    keys = [key for key in group if not key.startswith("#")] if depth <= MAX_DEPTH else []
    own = [key for key in keys if isinstance(group.get(key, getlink=True), h5py.HardLink)]
    return {key: _read_item(group[key], name, max_bytes, depth) for key in own}


def _read_item(item: Any, name: str, max_bytes: int, depth: int) -> Any:
    """Read one variable."""
    if isinstance(item, h5py.Group):
        fields = read_group(item, name, max_bytes, depth + 1)
        if not fields or not all(isinstance(value, _FieldOfArray) for value in fields.values()):
            return fields
        n = max(map(len, fields.values()))
        return [{key: values[k] for key, values in fields.items() if k < len(values)} for k in range(n)]
    if not isinstance(item, h5py.Dataset) or item.shape is None or item.attrs.get("MATLAB_empty"):
        return None
    if "MATLAB_object_decode" in item.attrs:
        return MatlabObject()
    if 8 * (item.size or 0) > max_bytes:
        raise RecordError(
            f"{item.name} is larger than {max_bytes:,} bytes",
            remedy=("save a part, or allow more with ", Setting("max_bytes")),
            where=name,
        )
    kind = item.attrs.get("MATLAB_class", b"")
    values = item[()]
    if h5py.check_ref_dtype(item.dtype) is not None:
        references = values.T.ravel() if depth <= MAX_DEPTH else []
        cells = [_read_item(item.file[reference], name, max_bytes, depth + 1) for reference in references if reference]
        return cells if kind == b"cell" else _FieldOfArray(cells)
    if kind == b"char":
        rows = ["".join(map(chr, row)) for row in np.atleast_2d(values.T)]
        return rows[0] if len(rows) == 1 else np.array(rows)
    return np.squeeze(values.T) if values.size > 1 else float(values.ravel()[0])
