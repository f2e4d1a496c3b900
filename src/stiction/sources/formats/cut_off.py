"""Find out whether a text file was cut off within its last row."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from stiction.sources.formats.text_dialect import split_lines

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


__all__ = ["find_cut_off", "is_cut_off"]

ROWS_BEFORE = 50
"""Rows with which the last one is compared [-]."""
MAX_SHOWN = 24
"""Characters of the incomplete row in the message."""


def find_cut_off(path: Path, delimiter: str, skip_lines: int) -> tuple[int, str]:
    """Find where the whole rows of a UTF-8 file end [bytes], and the end of the incomplete row after them, if any."""
    size, n_bytes = path.stat().st_size, 65_536
    with open(path, "rb") as file:
        file.seek(size - 1)
        if file.read() == b"\n":
            return size, ""
        while True:
            file.seek(max(size - n_bytes, 0))
            lines = file.read().split(b"\n")
            if n_bytes >= size or len(lines) > ROWS_BEFORE + 1:
                break
            n_bytes *= 4
    skipped = skip_lines if n_bytes >= size else 1
    *before, last = [line.decode(errors="replace") for line in lines[skipped:]] or [""]
    rows = [row for line in before for row in split_lines([line], delimiter)[0] if any(map(str.strip, row))]
    for row in split_lines([last], delimiter)[0]:
        if is_cut_off(row, rows[-ROWS_BEFORE:]):
            return size - len(lines[-1]), last[-MAX_SHOWN:]
    return size, ""


def is_cut_off(row: Sequence[str], before: Sequence[Sequence[str]], *, min_rows: int = 20) -> bool:
    """Whether the last row of a file is incomplete: it has less than all rows before it.

    From `min_rows` rows with equally many decimals on, fewer decimals mean an incomplete number.
    """
    if before and all(len(row) == len(other) - 1 and not other[-1].strip() for other in before):
        before = [other[:-1] for other in before]  # a delimiter ends each row, and need not end the last
    ends = [other[-1].strip() for other in before if len(other) == len(row)]
    if len(ends) < len(before) or len(before) < 2:
        return len(before) > 1 and all(len(row) < len(other) for other in before)
    last = row[-1].strip()
    if not last:  # a column that is shorter than others ends so, and nothing is lost
        return False
    if last[-1] in ".,+-eE":
        return not any(end.endswith(last[-1]) for end in ends)
    decimals = [re.search(r"\d[.,](\d+)$", end) for end in ends]
    if not all(decimals):
        return all(end != last and end.startswith(last) for end in ends) and not last[-1].isdigit()
    places = {len(match[1]) for match in decimals if match}
    match = re.search(r"\d[.,](\d+)$", last)
    return len(ends) >= min_rows and len(places) == 1 and (len(match[1]) if match else 0) < places.pop()
