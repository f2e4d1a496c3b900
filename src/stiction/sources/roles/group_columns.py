"""Columns to groups of one tag, by the words in their names and descriptions."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

from stiction.sources.roles.column_names import parse_column_name, role_of
from stiction.sources.roles.loop_roles import FLAG_ROLES, HOW_TO_OVERRULE, NUMERIC_ROLES, TagGroup, column_label
from stiction.sources.roles.pair_groups import parse_instrument_tag
from stiction.sources.values.quality_codes import are_quality_codes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.table import TagColumn

__all__ = ["add_bare_tags", "flag_role", "group_columns", "shorten_block_tags", "use_weaker_words"]

_BLOCK = re.compile(r"/P?ID\w*$|/PID_\w+$|\.PIDA$", re.IGNORECASE)


def group_columns(columns: Sequence[TagColumn]) -> tuple[list[TagGroup], list[TagColumn]]:
    """Group columns by tag ("", or the file where there are several) and role; give those without a known word too."""
    groups: dict[str, TagGroup] = {}
    bare: list[TagColumn] = []
    several = len({id(column.table) for column in columns}) > 1
    numbers = _instrument_numbers(columns)
    for column in columns:
        pair, note = parse_column_name(column.name), ""
        if pair and pair[0].isdigit() and (tag := parse_instrument_tag(column.name)):
            variable = "" if tag.kind == "position" else tag.variable
            pair = None if (variable, tag.number) in numbers else pair  # the valve PV 4101 beside PT 4101
        flag = ""
        if pair is None or role_of(pair[1]) == "fallback quality":
            flag = flag_role(
                column.name, [] if column.position is None else column.table.sample_column(column.position)
            )
        if flag and pair is None:
            pair, note = ("", "QUALITY"), f"{column_label(column)} is taken as quality, by its words; {HOW_TO_OVERRULE}"
        elif pair and role_of(pair[1]) == "fallback quality" and not flag:
            pair = None
        if pair is None and (pair := parse_column_name(column.description)):
            note = f"{column_label(column)} is the {pair[1]} of {pair[0]} by its description; {HOW_TO_OVERRULE}"
        if pair is None:
            bare.append(column)
            continue
        tag = pair[0] or (column.table.origin.stem if several else "")
        group = groups.setdefault(tag.upper(), TagGroup(tag))
        group.add(flag or role_of(pair[1]), column)
        group.notes += [note] if note else []
    _give_flags_to_signals(groups)
    for key in [key for key in groups if key.endswith(".DACA")]:  # of a point of Experion, DACA measures, PIDA controls
        if target := groups.get(key.removesuffix(".DACA") + ".PIDA"):
            target.columns = {**groups.pop(key).columns, **target.columns}
    return list(groups.values()), bare


def flag_role(name: str, cells: Sequence[str]) -> str:
    """Role of a column of flags, "quality" or "bad", by its heading or the words in `cells`; else empty."""
    pair = parse_column_name(name)
    role = role_of(pair[1]) if pair else ""
    if role in FLAG_ROLES:
        return role
    is_quality = role in ("", "fallback quality") and are_quality_codes(cells, named=bool(role))
    return "quality" if is_quality else ""


def _instrument_numbers(columns: Sequence[TagColumn]) -> set[tuple[str, str]]:
    """Variable ("" for any) and number of the instrument tags that are not a word of a signal with a number."""
    pairs = [(column.name, parse_column_name(column.name)) for column in columns]
    tags = [parse_instrument_tag(pair[0] if pair else name) for name, pair in pairs if not (pair and pair[0].isdigit())]
    return {(variable, tag.number) for tag in tags if tag for variable in ("", tag.variable)}


def _give_flags_to_signals(groups: dict[str, TagGroup]) -> None:
    """Give a flag of one signal to that signal: ``FIC-1.PV.Quality``, or one after each of several signals."""
    places = {
        (id(column.table), column.position): (group, role)
        for group in groups.values()
        for role, columns in group.columns.items()
        for column in columns
    }

    def signal_left_of(column: TagColumn) -> tuple[TagGroup, str] | None:
        position = column.position
        while position is not None and places.get((id(column.table), position), (None, ""))[1] in FLAG_ROLES:
            position -= 1
        group, role = places.get((id(column.table), position), (TagGroup(""), ""))
        return (group, role) if position is not None and role in NUMERIC_ROLES else None

    for key, group in list(groups.items()):
        owner = parse_column_name(group.tag) if group.columns.keys() <= set(FLAG_ROLES) else None
        target = groups.get(owner[0].upper()) if owner else None
        if owner and target is not None and (signal := role_of(owner[1])) in target.columns:
            target.columns |= {f"{signal} {flag}": columns for flag, columns in groups.pop(key).columns.items()}
            continue
        flags = [(flag, column) for flag in FLAG_ROLES for column in group.columns.get(flag, ())]
        own = [(flag, column, left) for flag, column in flags if (left := signal_left_of(column))]
        if len({(id(left[0]), left[1]) for *_, left in own}) > 1:
            for flag, column, (target, role) in own:
                group.columns[flag].remove(column)
                target.add(f"{role} {flag}", column)
        group.columns = {role: columns for role, columns in group.columns.items() if columns}


def use_weaker_words(group: TagGroup) -> None:
    """Use the fallback words of the vocabulary, and MV as OP, where the loop has no plainer signal."""
    columns, notes = group.columns, group.notes
    names = {"sp": "set point (SP)", "op": "controller output (OP)", "pv": "process variable (PV)"}
    for role, name in names.items():
        weaker = columns.pop(f"fallback {role}", [])
        has_needed = {"sp": True, "op": "pv" in columns and "mv" not in columns, "pv": "op" in columns}[role]
        if role not in columns and len(weaker) == 1 and has_needed:
            columns[role] = weaker
            notes.append(f"Column {column_label(weaker[0])} is taken as the {name}, as there is no other.")
    pairs = [(column, parse_column_name(column.name)) for column in columns.get("mv", ())]
    outputs = [column for column, pair in pairs if pair and pair[1] == "MV"]  # OP of CENTUM and GE, PV of ABB
    taken = f"Column {column_label(outputs[0])} is taken as the" if outputs else ""
    if outputs and {"op", "sp"} <= columns.keys() and "pv" not in columns:
        named = f"columns={{'pv': {column_label(outputs[0])!r}}} (--columns)"
        notes.append(f"{taken} valve position (MV); if it is the measured value (ABB), name it with {named}.")
    if "op" not in columns and len(outputs) == 1:
        columns["op"] = outputs
        columns["mv"].remove(outputs[0])
        if not columns["mv"]:
            del columns["mv"]
        position = "if it is the valve position, name the OP column"
        notes.append(f"{taken} {names['op']}, as there is no other; {position}.")


def add_bare_tags(groups: list[TagGroup], bare: list[TagColumn]) -> None:
    """Take a column that is named by the tag alone as the PV of the loop, as historians do."""
    by_tag = {group.tag.upper(): group for group in groups if "op" in group.columns}
    for column in list(bare):
        group = by_tag.get(column.name.strip().upper())
        if group is not None and "pv" not in group.columns:
            group.add("pv", column)
            bare.remove(column)
            group.notes.append(f"Column {column_label(column)} is taken as the PV; {HOW_TO_OVERRULE}")


def shorten_block_tags(groups: Sequence[TagGroup]) -> None:
    """``FIC-101/PID1`` is the loop FIC-101 unless the module has two control blocks."""
    short = [_BLOCK.sub("", group.tag) for group in groups]
    counts = Counter(short)
    for group, tag in zip(groups, short, strict=True):
        group.tag = tag if counts[tag] == 1 else group.tag
