"""Read the loops of a file: one row per format, one page per reader."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import NoneType
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

from numpy import integer

from stiction.errors import ParameterError, RecordError, require_finite, require_kind, require_positive
from stiction.records.layout import Options
from stiction.records.loops import loops_of
from stiction.records.source import load, text_encoding

if TYPE_CHECKING:
    import os

    from stiction.records.record import LoopRecord

__all__ = ["FORMATS", "Format", "read"]


class Format(NamedTuple):
    """A kind of file."""

    name: str
    signature: bytes
    """First bytes of such a file; empty for text."""
    opener: str | None
    """``module:function`` that takes a `Source` and returns a `Table`, or None while there is none."""
    remedy: str = ""


FORMATS = (
    Format("an Excel workbook or zip archive", b"PK\x03\x04", None, "save the sheet as CSV"),
    Format("an old Excel workbook", b"\xd0\xcf\x11\xe0", None, "save the sheet as CSV"),
    Format("a Parquet file", b"PAR1", None, "export it as CSV"),
    Format("a MATLAB file", b"MATLAB 5.0", None, "export it as CSV"),
    Format("an HDF5 or MATLAB 7.3 file", b"\x89HDF", None, "export it as CSV"),
    Format("a gzip archive", b"\x1f\x8b", None, "unpack it first"),
    Format("a PDF document", b"%PDF", None, "export the trend as CSV"),
    Format("text", b"", "stiction.records.csv_file:open_csv"),
)
"""Formats by their first bytes. A new reader is one more page and its name in this table."""


def read(
    path: str | os.PathLike[str] | BinaryIO,
    *,
    dt: float | None = None,
    tag: str | None = None,
    columns: Mapping[str, str | int] | None = None,
    loop_type: str | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    time_format: str | None = None,
    op_range: tuple[float, float] | None = None,
    mv_range: tuple[float, float] | None = None,
    day_first: bool | None = None,
) -> list[LoopRecord]:
    """Read every control loop of a file.

    Parameters
    ----------
    path : str, path or binary file
        A CSV file in any of the usual dialects; "-" is the standard input.
    dt : float, optional
        Sampling period [s]; the median step of the time stamps when not given. Stamps that do not fit it are taken as
        wrong: the rows are then `dt` apart in the order they come, gaps and all. Of tags with stamps of their own it is
        the step at which these are laid out.
    tag : str, optional
        Which loop of a file with several; the name of the loop where the header has none.
    columns : mapping, optional
        Signal (time, pv, sp, op, mv, valve_signal, mode, bad, quality) -> column name, or index from 0; the others are
        found by their names.
    loop_type : str, optional
        One of `LOOP_TYPES`; by the tag's ISA-5.1 letters when not given, or those with a number in the file's name.
    delimiter, decimal : str, optional
        How the text is written; found out when not given.
    time_format : str, optional
        A `datetime.strptime` format.
    op_range : pair of float, optional
        OP at 0 and at 100 % of span [unit of the column], to convert OP to % of span; never converted on suspicion.
    mv_range : pair of float, optional
        Valve position at 0 and at 100 % of span [unit of the column], to convert it likewise.
    day_first : bool, optional
        Whether 01/02/2026 is the first of February.

    Returns
    -------
    list of LoopRecord
        One for each loop, evenly sampled; all that was guessed stands in ``record.provenance.assumptions``.

    Raises
    ------
    RecordError
        When the file cannot be read as loops: what, where and what to do about it.
    ParameterError
        When an argument lies outside its limits.

    Examples
    --------
    >>> import io
    >>> from stiction.records import read
    >>> lines = ["time_s,FIC-101.PV,FIC-101.OP", *(f"{k},{50 + k % 5},{40 + k % 7}" for k in range(60))]
    >>> [record] = read(io.BytesIO(chr(10).join(lines).encode()))
    >>> record.tag, record.loop_type, record.dt, len(record)
    ('FIC-101', 'flow', 1.0, 60)
    """
    if dt is not None:
        dt = require_positive("dt", dt, "s")
    for name, text in (("tag", tag), ("delimiter", delimiter), ("time_format", time_format)):
        require_kind(name, text, (str, NoneType), "a text")
    require_kind("day_first", day_first, (bool, NoneType), "True or False")
    if decimal not in (None, ".", ","):
        raise ParameterError(f"decimal = {decimal!r} is no decimal mark; give '.' or ','.")
    if delimiter is not None and (len(delimiter) != 1 or delimiter in "\r\n\"'"):
        raise ParameterError(f"delimiter = {delimiter!r} is not one character; give for example ',' or ';' or a tab.")
    if columns is not None and not isinstance(columns, Mapping):
        raise ParameterError(
            f"columns = {columns!r} is no mapping of signals to columns; give for example columns={{'op': 'CO'}}."
        )
    for signal, column in (columns or {}).items():
        require_kind("a signal of columns", signal, str, "its name, as in columns={'op': 'CO'}")
        require_kind(f"columns[{signal!r}]", column, (str, int, integer), "the name or the number of a column")
    spans = _span("op_range", "OP", op_range), _span("mv_range", "valve position", mv_range)
    source = load(path, _refuse_binary)
    kind = next(form for form in FORMATS if source.data.startswith(form.signature))
    assert kind.opener is not None
    module, function = kind.opener.split(":")
    table = getattr(import_module(module), function)(source, delimiter=delimiter, decimal=decimal)
    return loops_of(table, Options(dt, tag, columns, loop_type, time_format, *spans, day_first))


def _span(name: str, what: str, span: tuple[float, float] | None) -> tuple[float, float] | None:
    """A signal at 0 and at 100 % of span, or the error that says why it cannot be."""
    if span is None:
        return None
    try:
        zero, full = span
    except (TypeError, ValueError):
        raise ParameterError(
            f"{name} = {span!r} is no pair of numbers; give the {what} at 0 % and at 100 %, for example (4, 20)."
        ) from None
    low, high = require_finite(name, zero), require_finite(name, full)
    if not low < high:
        raise ParameterError(
            f"{name} = ({low:g}, {high:g}) is empty; give the {what} at 0 % and a larger one at 100 %."
        )
    return low, high


def _refuse_binary(name: str, head: bytes) -> None:
    """Refuse from the first bytes, before the rest of a long stream is read."""
    kind = next(form for form in FORMATS if head.startswith(form.signature))
    if kind.opener is None:
        raise RecordError(f"{name}: is {kind.name}, which is not read yet; {kind.remedy}.")
    if not kind.signature and text_encoding(head) is None:
        raise RecordError(f"{name}: is binary, not text; export the loop as CSV.")
