"""MATLAB files of version 7.3, which are HDF5 files; vectors are read when they are asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import MissingExtraError, RecordError

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.sources.byte_source import ByteSource

__all__ = ["MatlabObject", "load_hdf5"]

MAX_DEPTH = 12
"""Structures within structures that are followed [-]."""


class MatlabObject:
    """A table, timetable, string or other object that only MATLAB can read."""


class StoredArray:
    """An array of numbers in the file, in MATLAB's order of rows and columns; a vector has one dimension."""

    def __init__(self, path: Path, dataset: Any, name: str, max_bytes: int) -> None:
        self.path, self.place, self.name, self.max_bytes = path, dataset.name, name, max_bytes
        self.dtype = dataset.dtype
        self.shape = tuple(n for n in reversed(dataset.shape) if n != 1)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        values = self._read(())
        return np.asarray(values.reshape(tuple(reversed(self.shape))).T, dtype=dtype)

    def __getitem__(self, key: tuple[slice, int]) -> np.ndarray:
        return self._read((key[1], slice(None)))

    def _read(self, key: tuple[Any, ...]) -> np.ndarray:
        import h5py

        if 8 * int(np.prod(self.shape)) > self.max_bytes:
            raise RecordError(
                f"{self.name}: {self.place} is larger than {self.max_bytes:,} bytes; save a part, or allow more with "
                "max_bytes."
            )
        try:
            with h5py.File(self.path, "r") as file:
                dataset: Any = file[self.place]
                return np.asarray(dataset[key])
        except (OSError, KeyError, ValueError, RuntimeError, TypeError) as error:
            raise RecordError(f"{self.name}: is damaged ({error}); save it again in MATLAB.") from None


def load_hdf5(source: ByteSource) -> dict[str, Any]:
    """Read the variables of a MATLAB file of version 7.3.

    Parameters
    ----------
    source : ByteSource
        The file.

    Returns
    -------
    dict
        Name -> number, text, array, dict (structure) or list of dict (structure array).

    Raises
    ------
    MissingExtraError
        When h5py is not installed.
    RecordError
        When the file is damaged.
    """
    try:
        import h5py
    except ImportError:
        raise MissingExtraError(
            f"{source.origin.name}: is a MATLAB 7.3 file, which needs h5py; pip install 'stiction[matlab]', or save it "
            "with save(..., '-v7')."
        ) from None
    try:
        with h5py.File(source.path, "r") as file:
            return _fields(file, source, 0)
    except (OSError, KeyError, ValueError, RuntimeError, TypeError) as error:
        if isinstance(error, RecordError):
            raise
        raise RecordError(f"{source.origin.name}: is damaged ({error}); save it again in MATLAB.") from None


def _fields(group: Any, source: ByteSource, depth: int) -> dict[str, Any]:
    """Read the fields of a structure; links to other files are not followed."""
    import h5py

    names = [name for name in group if not name.startswith("#")] if depth <= MAX_DEPTH else []
    return {
        name: _value(group[name], source, depth)
        for name in names
        if isinstance(group.get(name, getlink=True), h5py.HardLink)
    }


def _value(item: Any, source: ByteSource, depth: int) -> Any:
    """Read one variable, or say where it stands."""
    import h5py

    if isinstance(item, h5py.Datatype):
        return None
    if isinstance(item, h5py.Group):
        fields = _fields(item, source, depth + 1)
        lists = [value for value in fields.values() if isinstance(value, _FieldOfArray)]
        if not lists or len(lists) < len(fields):
            return fields
        return [
            {name: values[k] for name, values in fields.items() if k < len(values)} for k in range(max(map(len, lists)))
        ]
    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode() if isinstance(kind, bytes) else str(kind)
    if "MATLAB_object_decode" in item.attrs:
        return MatlabObject()
    if item.attrs.get("MATLAB_empty") or item.shape is None:
        return None
    if h5py.check_ref_dtype(item.dtype) is not None:
        references = item[()].T.ravel() if depth <= MAX_DEPTH else []
        cells = [_value(item.file[reference], source, depth + 1) for reference in references if reference]
        return cells if kind == "cell" else _FieldOfArray(cells)
    if kind == "char":
        return _text(item[()])
    if item.dtype.kind not in "fiub":
        return None
    if item.size == 1:
        return float(item[()].ravel()[0])
    return StoredArray(source.path, item, source.origin.name, source.max_bytes)


class _FieldOfArray(list):
    """Values of one field, one for each element of a structure array."""


def _text(codes: np.ndarray) -> Any:
    """Make text of character codes; of several rows an array of texts."""
    rows = ["".join(map(chr, row)) for row in np.atleast_2d(codes.T)]
    return rows[0] if len(rows) == 1 else np.array(rows)
