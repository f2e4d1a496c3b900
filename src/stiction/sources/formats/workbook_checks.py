"""Checks of a workbook before and while calamine opens it: size after decompression, far cells, damage."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from functools import reduce
from typing import TYPE_CHECKING

from stiction.errors import RecordError
from stiction.foreign_errors import damage_refused, damaged
from stiction.sources.compression import ByteLimit

if TYPE_CHECKING:
    from stiction.sources.byte_source import ByteSource

__all__ = ["OLE_START", "REMEDY", "require_area", "require_size", "require_survivable"]

REMEDY = "open it in Excel and save it again"
OLE_START = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
"""First bytes of an xls workbook, and of an encrypted one of any kind."""
CELL_WITH_VALUE = re.compile(rb'<c r="([A-Z]{1,3})(\d{1,7})"[^>/]*>(?!</c>)')
TRIAL = """
import sys
from python_calamine import CalamineWorkbook
try:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[2]),) * 2)
except ImportError:
    pass
book = CalamineWorkbook.from_filelike(open(sys.argv[1], "rb"))
for name in book.sheet_names:
    book.get_sheet_by_name(name)
"""
"""Program that opens all sheets of a workbook with limited memory."""
MAX_TRIAL_BYTES = 4 << 30
"""Memory that it may take [bytes]."""
TRIAL_SECONDS = 60
MAX_COLUMNS = 16_384
MAX_COLUMNS_XLS = 256
CELL_BYTES = 100
"""Memory that a cell takes [bytes]."""


def require_size(source: ByteSource) -> None:
    """Inflate the members of a zipped workbook piece by piece, as the sizes that it states may be wrong."""
    if not source.head.startswith(b"PK"):
        return
    limit = ByteLimit(source.origin.name, source.max_bytes, source.path.stat().st_size)
    with damage_refused(source.origin.name, REMEDY), zipfile.ZipFile(source.path) as archive:
        for member in archive.infolist():
            rest, n_rows, n_columns = b"", 0, 0
            with archive.open(member) as stream:
                while piece := stream.read(1 << 20):
                    limit.add(len(piece))
                    if not member.filename.startswith("xl/worksheets/"):
                        continue
                    cells = CELL_WITH_VALUE.findall(rest + piece)
                    n_rows = max([n_rows, *(int(row) for _, row in cells[:1] + cells[-1:])])
                    n_columns = max([n_columns, *map(_column_number, {letters for letters, _ in cells})])
                    rest = piece[-64:]
            require_area(source, n_rows, n_columns)


def require_survivable(source: ByteSource) -> None:
    """Open a workbook in another process first, which it may end for lack of memory; a panic is a ValueError."""
    try:
        command = [sys.executable, "-c", TRIAL, source.path, str(MAX_TRIAL_BYTES)]
        trial = subprocess.run(command, capture_output=True, check=False, timeout=TRIAL_SECONDS)
        killed, said = trial.returncode < 0, trial.stderr.decode(errors="replace").partition("PanicException: ")
    except subprocess.TimeoutExpired:
        killed, said = True, ("", "", "")
    if said[1]:
        raise ValueError(said[2])
    if killed:
        raise damaged(source.origin.name, MemoryError("it takes more memory than a workbook can"), REMEDY)


def require_area(source: ByteSource, n_rows: int, n_columns: int) -> None:
    """Refuse a sheet with a cell far from the others: the area between them would fill the memory."""
    max_columns = MAX_COLUMNS_XLS if source.head.startswith(OLE_START) else MAX_COLUMNS
    if n_columns > max_columns or n_rows * n_columns * CELL_BYTES > source.max_bytes:
        raise RecordError(
            f"a sheet reaches to row {n_rows:,} and column {n_columns:,}, which needs more than "
            f"{source.max_bytes:,} bytes; delete cells that stand far from the table, or save it as CSV.",
            where=source.origin.name,
        )


def _column_number(letters: bytes) -> int:
    """Number of a column (from 1) by its letters."""
    return reduce(lambda number, letter: 26 * number + letter - 64, letters, 0)
