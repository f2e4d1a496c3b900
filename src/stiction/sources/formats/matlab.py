"""MATLAB files, v5 and v7.3: vectors, matrices with names, structures such as those of the ISDB."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import RecordError
from stiction.sources.formats.matlab_structures import TIME_NAMES, find_loops
from stiction.sources.table import Origin
from stiction.sources.typed_table import table_from_series

if TYPE_CHECKING:
    import polars as pl

    from stiction.sources.byte_source import ByteSource
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["read", "recognises"]

HDF5_START = b"\x89HDF\r\n\x1a\n"
MATLAB_DAY_OF_1970 = 719_529.0
"""MATLAB day number of 1 January 1970 [d]."""
MATLAB_DAYS = (693_962.0, 803_000.0)
"""MATLAB day numbers of 1900 and 2198 [d]."""


def recognises(head: bytes, name: str) -> bool:
    """Say whether a file is a MATLAB file, by its first bytes and, of other HDF5 files, by its name.

    Examples
    --------
    >>> recognises(b"MATLAB 5.0 MAT-file, Platform: GLNXA64", "loops.mat"), recognises(b"time,PV", "loops.mat")
    (True, False)
    """
    if head.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")):
        return True
    return name.lower().endswith(".mat") and (head.startswith(HDF5_START) or b"\0" in head[:32])


def read(source: ByteSource, options: ReadOptions) -> list[RawTable]:
    """Read the variables of a MATLAB file, one table per structure or matrix that holds signals.

    Parameters
    ----------
    source : ByteSource
        The file.
    options : ReadOptions
        `tag` picks the structure of this name, such as ``chemicals.loop1``, where there is one.

    Returns
    -------
    list of RawTable
        Named by the path of the structure without the name of the outermost variable, when that is the only one. Time
        is computed from a single number `Ts` where there is no vector of times.

    Raises
    ------
    RecordError
        When the file is damaged, or holds no vectors of one length.
    MissingExtraError
        When h5py is needed for a file of version 7.3 and not installed.
    """
    variables = _load(source)
    found = list(find_loops("", variables))
    roots = {path.split(".")[0] for path, _ in found}
    if len(roots) == 1 and all("." in path for path, _ in found):
        found = [(path.split(".", 1)[1], loop) for path, loop in found]
    if not found:
        objects = ", ".join(sorted(name for name, value in variables.items() if _is_object(value))[:5])
        remedy = (
            f"{objects} can only be read by MATLAB; write it with writetimetable(x, 'loop.csv')"
            if objects
            else "save time, pv, op and sp as vectors of one length"
        )
        raise RecordError(f"{source.origin.name}: holds no vectors of numbers; {remedy}.")
    asked = (options.tag or "").casefold()
    named = [(path, loop) for path, loop in found if asked and path.casefold() == asked]
    return [_table(source, path, loop) for path, loop in named or found]


def _load(source: ByteSource) -> dict[str, Any]:
    """Read the variables of a file; of version 7.3 vectors are read later."""
    name = source.origin.name
    if source.head.startswith(HDF5_START) or source.head[512:520] == HDF5_START:
        from stiction.sources.formats.matlab_hdf5 import load_hdf5

        return load_hdf5(source)
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    _require_size(source)
    try:
        stored = loadmat(source.path, simplify_cells=True)
    except (MatReadError, OSError, ValueError, TypeError, KeyError, IndexError, EOFError, OverflowError, MemoryError,
            NotImplementedError, AttributeError, UnicodeError) as error:  # fmt: skip
        text = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        raise RecordError(f"{name}: is damaged ({text[:200]}); save it again in MATLAB.") from None
    return {key: value for key, value in stored.items() if not key.startswith("__")}


def _require_size(source: ByteSource) -> None:
    """Inflate the compressed variables of a v5 file piece by piece, and refuse those that grow too large."""
    import zlib

    from stiction.sources.compression import ByteLimit

    limit = ByteLimit(source.origin.name, source.max_bytes, source.path.stat().st_size)
    order = "little" if source.head[126:128] == b"IM" else "big"
    with source.path.open("rb") as file:
        file.seek(128)
        while len(tag := file.read(8)) == 8:
            kind, size = int.from_bytes(tag[:4], order), int.from_bytes(tag[4:], order)
            if kind != 15:  # not compressed
                file.seek(size, 1)
                continue
            inflater, rest = zlib.decompressobj(), size
            while rest > 0 and (piece := file.read(min(rest, 1 << 16))):
                rest -= len(piece)
                try:
                    while piece:
                        limit.add(len(inflater.decompress(piece, 1 << 20)))
                        piece = inflater.unconsumed_tail
                except zlib.error as error:
                    raise RecordError(f"{source.origin.name}: is damaged ({error}); save it again in MATLAB.") from None


def _table(source: ByteSource, path: str, loop: dict[str, Any]) -> RawTable:
    """Make the table of one loop."""
    notes: list[str] = []

    def load(name: str) -> pl.Series:
        import polars as pl

        values = np.asarray(loop[name])
        if _is_day_number(name, values):
            milliseconds = pl.Series((values - MATLAB_DAY_OF_1970) * 86_400e3).round()
            return milliseconds.fill_nan(None).cast(pl.Int64).cast(pl.Datetime("ms"))
        return _column(values)

    first = next(iter(loop))
    if _is_day_number(first, np.asarray(loop[first])):
        notes.append(f"{first} was taken as MATLAB day numbers.")
    origin = source.origin if not path else Origin(f"{source.origin.name}, {path}", path, source.origin.sha256)
    table = table_from_series(origin, list(loop), load, {}, {}, notes)
    read_columns = table.reader
    table.reader = lambda positions, _file=source: read_columns(positions)  # keeps a temporary file alive
    return table


def _column(values: np.ndarray) -> pl.Series:
    import polars as pl

    if values.dtype.kind in "fiub":
        return pl.Series(np.ascontiguousarray(values.astype(values.dtype.newbyteorder("="))))
    return pl.Series([str(cell).strip() for cell in values], dtype=pl.String)


def _is_day_number(name: str, values: np.ndarray) -> bool:
    if name.lower() not in TIME_NAMES or values.dtype.kind != "f":
        return False
    finite = values[np.isfinite(values)]
    return finite.size > 0 and bool(MATLAB_DAYS[0] <= finite.min() <= finite.max() <= MATLAB_DAYS[1])


def _is_object(value: Any) -> bool:
    return type(value).__name__ in ("MatlabOpaque", "MatlabFunction", "MatlabObject")
