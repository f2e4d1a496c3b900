"""Tags below each other, each with a heading that names it and rows of its own: read as a row for each tag and time."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from stiction.records.columns import is_time, signal_of
from stiction.records.dialects import TAG_WORDS
from stiction.records.numbers import is_number
from stiction.records.timestamps import is_stamp

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

__all__ = ["in_blocks", "tagged"]

_MARKS = ("\t", ";", "|", ",")
_TAG = "|".join(sorted(map(re.escape, TAG_WORDS), key=len, reverse=True))
_HEADING = re.compile(rf"(?:(?:{_TAG})\s*[:=,;|\t]\s*)?([^:,;|\t]{{1,80}})", re.IGNORECASE)
_UNITS = re.compile(r"(?:eng\w*\.?\s+)?units?\s*[:=,;|\t]\s*([^,;|\t\s]{1,12})", re.IGNORECASE)
_HEADER = "Time{0}Value"


def in_blocks(lines: Iterable[str]) -> bool:
    """Whether a heading stands over rows, and another one below them.

    Parameters
    ----------
    lines : iterable of str
        The file; read to that second heading, or to the first row where that stands under none.

    Examples
    --------
    >>> rows = ["2026-02-01 10:00:00,50.1", "2026-02-01 10:00:01,50.3"]
    >>> in_blocks(["Tag: FIC-1.PV", "Time,Value", *rows, "", "Tag: FIC-1.OP", "Time,Value", *rows])
    True
    >>> in_blocks(["FIC-1.PV", *rows, *rows])
    False
    """
    name = mark = ""
    for line in lines:
        if found := _heading(line):
            if mark and found != name:
                return True
            name = found
        elif not mark and (mark := _mark_of_row(line)) and not name:
            return False
    return False


def tagged(lines: Iterable[str]) -> Iterator[str]:
    r"""Put the tag of a block before each of its rows; every line keeps its place.

    Examples
    --------
    >>> list(tagged(["Tag: FIC-1.PV", "Time,Value", "10:00:00,50.1", "", "Tag: FIC-1.OP", "Time,Value", "10:00:00,40"]))
    ['\n', 'Tag,Time,Value', 'FIC-1.PV,10:00:00,50.1', '\n', '\n', '\n', 'FIC-1.OP,10:00:00,40']
    """
    name, unit, headed, above = "", "", False, []
    for line in lines:
        if found := _heading(line):
            name, unit = found, ""
        elif not name:
            yield line
            continue
        elif units := _UNITS.fullmatch(line.strip()):
            unit = f" [{units[1]}]"
        elif mark := _mark_of_row(line):
            if not headed:
                yield from ["Tag" + mark + _HEADER.format(mark) + "\n", *above[1:]]
                headed = True
            yield f"{name}{unit}{mark}{line}"
            continue
        elif not headed and (mark := _mark(line)) and is_time(line.split(mark)[0]):
            yield from above
            headed = True
            yield f"Tag{mark}{line}"
            continue
        if headed:
            yield "\n"
        else:
            above.append("\n")


def _heading(line: str) -> str:
    """The tag that a line names and holds nothing beside; empty where it is no heading."""
    text = line.strip(" \t\r\n,;|\"'[]#")
    if len(text) > 100 or text[-1:].isdigit() or _UNITS.fullmatch(text):  # mA is a word for a mode as well
        return ""
    found = _HEADING.fullmatch(text)
    pair = signal_of(found[1]) if found else None
    return found[1] if found and pair and pair[0] else ""


def _mark(line: str) -> str:
    return next((mark for mark in _MARKS if mark in line), "")


def _mark_of_row(line: str) -> str:
    """What parts the columns of a row of data; empty where the line is none."""
    mark = _mark(line)
    first = line.split(mark)[0].strip(" \"'") if mark else ""
    return mark if first and (is_stamp(first) or is_number(first, ".")) else ""
