"""One tag in a table, as when each tag is exported to a file of its own: time and value, perhaps quality."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from stiction.sources.layouts import headings
from stiction.sources.roles.column_names import normalise_name
from stiction.sources.roles.loop_roles import FLAG_ROLES
from stiction.sources.roles.vocabulary import INDEX_WORDS, UNIT_HEADINGS, VALUE_WORDS
from stiction.sources.time.time_columns import is_stamp_column, is_time_heading

if TYPE_CHECKING:
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import Origin, RawTable, TagColumn

__all__ = ["read"]

_EXPORT_DATE = re.compile(r"[-_. ]*\d{4}-?\d{2}-?\d{2}.*$")


def _value_column(table: RawTable) -> int | None:
    """Find the only column of values beside at most date, clock, quality and unit; None where it is not clear."""
    if table.width > 5:
        return None
    names = headings.table_headings(table).names
    words = [normalise_name(name) for name in names]
    roles = [(headings.parse_role(name) or ("", ""))[1] for name in names]
    if table.width == 2 and not any(roles) and not words[1] and is_stamp_column(table, 0):
        return 1
    columns = range(table.width)
    beside = {*headings.flag_positions(table), *(i for i in columns if words[i] in UNIT_HEADINGS)}
    values = [i for i in columns if (roles[i] and roles[i] not in FLAG_ROLES) or words[i] in VALUE_WORDS]
    times = [i for i in columns if is_time_heading(names[i]) or words[i] in INDEX_WORDS]
    times = times or [i for i in columns if i not in {*values, *beside} and is_stamp_column(table, i)]
    return values[0] if times and len(values) == 1 and {*values, *beside, *times} == set(columns) else None


def read(table: RawTable, options: ReadOptions) -> list[TagColumn] | None:
    """Give the one tag of a table, named by its heading, else by a line above the header, else by the file."""
    if (value := _value_column(table)) is None:
        return None
    clock, no_signals = headings.find_clock(table, options, taken=[value])
    column = headings.heading_column(table, value, clock)
    column.own_clock = True
    # A line above the header was joined with the heading.
    column.name = headings.tag_in_line([column.name]) or column.name
    column.unit = column.unit or headings.first_unit(table)
    if headings.parse_role(column.name) is None and (tag := headings.last_tag(table)):
        column.name = tag
        headings.forget_note_on_lines_above(table)
    column.name = _name_by_file(column.name, table.origin)
    words = [normalise_name(name) for name in headings.table_headings(table).names]
    if unit := next((i for i, word in enumerate(words) if word in UNIT_HEADINGS), None):
        headings.convert_units(column, table.column(unit))
    column.flags = headings.flag_loaders(table, {*headings.flag_positions(table)} - {*no_signals, value})
    return [column]


def _name_by_file(name: str, origin: Origin) -> str:
    """Complete a name without a tag by the file or sheet, or by its folder or workbook when that is only ``PV``."""
    role = headings.parse_role(name)
    if role and role[0]:
        return name
    stem = _EXPORT_DATE.sub("", origin.stem) or origin.stem
    by_stem = headings.parse_role(stem)
    if role and (by_stem is None or by_stem[1] != role[1]):
        return name
    if by_stem is None or by_stem[0]:
        return stem
    path = Path(origin.name.partition(", sheet ")[0])
    owner = path.stem if ", sheet " in origin.name else path.parent.stem
    return f"{owner}.{stem}" if owner else stem
