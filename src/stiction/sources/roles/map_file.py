"""The mapping file: which tag is which signal of which loop; `stiction read --write-map` writes one to edit."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from stiction.errors import RecordError
from stiction.sources.roles.loop_roles import ROLES, LoopRoles, column_label
from stiction.sources.roles.vocabulary import loop_type_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from os import PathLike

    from stiction.sources.table import TagColumn

__all__ = ["MapRow", "apply_map", "map_text", "read_map"]

MAP_ROLES = (*ROLES, *(f"{role} {flag}" for role in ("pv", "sp", "op", "mv") for flag in ("bad", "quality")))


UNUSED = "unused"
"""Role of a column that is left out."""


@dataclass(frozen=True, slots=True)
class MapRow:
    """One row of a mapping file: a column of the source and its role. An empty unit keeps the unit of the source."""

    tag: str
    loop: str
    role: str
    unit: str = ""
    low: float | None = None
    """Value at 0 % of span [unit]; `high` is the one at 100 %."""
    high: float | None = None
    area: str = ""
    master: str = ""
    """Tag of the loop whose OP is the set point of this one."""
    importance: str = ""
    good: str = ""
    """Codes of a quality column that are good, with blanks between them; by the schemes of the vendors when empty."""
    place: str = ""
    """File and line, for messages."""


COLUMNS = tuple(field.name for field in fields(MapRow) if field.name != "place")
"""Columns of a mapping file."""


def read_map(path: str | PathLike[str]) -> list[MapRow]:
    """Read and check a mapping file.

    It is CSV with a header of `tag`, `loop`, `role` and, as needed, `unit`, `low`, `high`, `area`, `master`,
    `importance` and `good`; comma, semicolon or tab between the cells. Lines that begin with # are comments; rows with
    the role `unused` are left out.

    Raises RecordError when the file cannot be read, has an unknown column or role, gives one role or one tag twice,
    has a loop without OP, or a `low` that is not below `high`.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise RecordError("is not UTF-8 text; save the map as CSV in UTF-8.", where=path) from None
    except OSError as error:
        raise RecordError(f"the map cannot be read ({error.strerror}); check the path.", where=path) from None
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise RecordError("the map is empty; write one with stiction read FILE --write-map MAP.", where=path)
    delimiter = max(",;\t", key=lines[0][1].count)
    header = [cell.strip().lower() for cell in next(csv.reader([lines[0][1]], delimiter=delimiter))]
    if unknown := [name for name in header if name not in COLUMNS]:
        raise RecordError(
            f"column {unknown[0]!r} is unknown; use {', '.join(COLUMNS)}.", where=f"{path}, line {lines[0][0]}"
        )
    if absent := [name for name in COLUMNS[:3] if name not in header]:
        raise RecordError(f"has no column {absent[0]!r}; add it.", where=f"{path}, line {lines[0][0]}")
    rows = []
    for number, line in lines[1:]:
        cells = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
        given = dict(zip(header, cells, strict=False))
        if given.get("role", "").lower() != UNUSED:
            rows.append(_row(given, f"{path}, line {number}", delimiter))
    _check(rows, str(path))
    return rows


def _row(cells: dict[str, str], place: str, delimiter: str) -> MapRow:
    """One row, checked by itself."""
    role = " ".join(cells.get("role", "").lower().split())
    if not cells.get("tag") or not cells.get("loop"):
        raise RecordError("tag or loop is empty; fill in both, or delete the line.", where=place)
    if role not in MAP_ROLES:
        raise RecordError(
            f"role {cells.get('role', '')!r} is unknown; use one of {', '.join((*ROLES, UNUSED))}.", where=place
        )
    ends: dict[str, float] = {}
    for name in ("low", "high"):
        if text := cells.get(name, ""):
            try:
                ends[name] = float(text.replace(",", ".") if delimiter != "," else text)
            except ValueError:
                ends[name] = math.nan
            if not math.isfinite(ends[name]):
                raise RecordError(
                    f"{name} = {text!r} is not a number; give the value at this end of the span.", where=place
                )
    if len(ends) == 1:
        raise RecordError("gives only one of low and high; give both, or none.", where=place)
    if ends and not ends["low"] < ends["high"]:
        given = "low = {low:g} is not below high = {high:g}".format(**ends)
        raise RecordError(f"{given}; give the values at 0 % and at 100 %.", where=place)
    texts = {name: cells.get(name, "") for name in ("unit", "area", "master", "importance", "good")}
    if (good := texts["good"]) and not role.endswith("quality"):
        text = f"good = {good!r} is given for a column of the role {role!r}; give it for a quality column."
        raise RecordError(text, where=place)
    return MapRow(cells["tag"], cells["loop"], role, **texts, low=ends.get("low"), high=ends.get("high"), place=place)


def _check(rows: list[MapRow], path: str) -> None:
    """Check the rows together."""
    if not rows:
        raise RecordError(
            "the map has no rows below its header that assign a tag; add tag, loop and role of each signal.", where=path
        )
    by_role: dict[tuple[str, str], MapRow] = {}
    by_tag: dict[str, MapRow] = {}
    for row in rows:
        if (other := by_role.setdefault((row.loop.lower(), row.role), row)) is not row:
            has = f"{row.tag!r} is the {row.role.upper()} of {row.loop}, but {other.tag!r} is it already"
            raise RecordError(f"{has}; keep one of them.", where=row.place)
        if (other := by_tag.setdefault(row.tag.lower(), row)) is not row:
            has = f"{row.role} of {row.loop} and as {other.role} of {other.loop}"
            raise RecordError(f"{row.tag!r} is in the map twice: as {has}; keep one of them.", where=row.place)
    for row in rows:
        if (row.loop.lower(), "op") not in by_role:
            raise RecordError(f"loop {row.loop} has no row with role op; add its controller output.", where=row.place)
        if row.master and row.master.lower() == row.loop.lower():
            raise RecordError(
                f"{row.loop} is its own master; give the loop whose OP is its set point.", where=row.place
            )


def apply_map(columns: Sequence[TagColumn], rows: Sequence[MapRow]) -> list[LoopRoles]:
    """Give a `LoopRoles` for each loop of the map, in its order; loops without columns are noted, unless all are."""
    by_name = {column_label(column).strip().lower(): column for column in reversed(columns)}
    present = {row.loop.lower() for row in rows if row.tag.lower() in by_name}
    used = [row for row in rows if row.loop.lower() in present]
    absent = list(dict.fromkeys(row.loop for row in rows if row.loop.lower() not in present))
    listed = ", ".join(absent[:10]) + (" ..." if absent[10:] else "")
    left = f"Left out: {listed}, as {len(rows) - len(used)} of {len(rows)} tags of the map are not in the source."
    loops: dict[str, LoopRoles] = {}
    for row in used or rows:
        column = by_name.get(row.tag.lower())
        if column is None:
            listed = ", ".join(map(column_label, columns[:20]))
            raise RecordError(f"tag {row.tag!r} is not in the source; its columns are {listed}.", where=row.place)
        loop = loops.setdefault(row.loop.lower(), LoopRoles(row.loop, {}, loop_type_of(row.loop)))
        loop.roles[row.role] = column
        loop.area, loop.master = loop.area or row.area, loop.master or row.master
        loop.importance = loop.importance or row.importance
        if row.good:
            loop.good_codes[row.role] = tuple(row.good.upper().replace(",", " ").replace(";", " ").split())
        if row.unit:
            loop.units[row.role] = row.unit
        if row.low is not None and row.high is not None:
            loop.spans[row.role] = (row.low, row.high)
    for loop in loops.values():
        loop.notes += [left] if len(used) < len(rows) else []
    return list(loops.values())


def map_text(loops: Sequence[LoopRoles]) -> str:
    """Give the roles of loops, and the columns that they do not use, as the text of a mapping file to edit."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for loop in loops:
        tag = loop.tag or loop.roles["op"].table.origin.stem
        rows = []
        for role, column in loop.roles.items():
            low, high = loop.spans.get(role, (None, None))
            unit, name = loop.unit_of(role), column_label(column)
            good = " ".join(loop.good_codes.get(role, ()))
            shared = {"area": loop.area, "master": loop.master, "importance": loop.importance, "good": good}
            rows.append(MapRow(name, tag, role, unit, low, high, **shared))
        for row in (*rows, *(MapRow(name, tag, UNUSED) for name in loop.unused)):
            writer.writerow(["" if cell is None else cell for cell in astuple(row)[:-1]])
    return text.getvalue()
