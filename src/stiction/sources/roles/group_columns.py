"""Columns to groups of one tag, by the words in their names and descriptions."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

from stiction.sources.roles.column_names import parse_column_name, role_of
from stiction.sources.roles.loop_roles import FLAG_ROLES, HOW_TO_OVERRULE, NUMERIC_ROLES, TagGroup, column_label
from stiction.sources.roles.tag_letters import parse_instrument_tag
from stiction.sources.roles.vocabulary import BLOCK_PAIRS, FALLBACK_SIGNAL_WORDS, OUTPUT_IF_NO_OTHER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.tag_column import TagColumn

__all__ = ["add_bare_tags", "group_columns", "shorten_block_tags", "use_fallback_words", "use_mv_as_output"]

_BLOCK = re.compile(r"/P?ID\w*$|/PID_\w+$|\.PIDA$", re.IGNORECASE)
_LABELS = {"sp": "set point (SP)", "op": "controller output (OP)", "pv": "process variable (PV)"}


def group_columns(columns: Sequence[TagColumn]) -> tuple[list[TagGroup], list[TagColumn]]:
    """Group columns by tag, and give each its role; also give the columns whose names hold no word of a signal.

    The group without a tag has the tag "", or the stem of its file when the source has several tables.
    """
    groups: dict[str, TagGroup] = {}
    bare: list[TagColumn] = []
    several = len({id(column.table) for column in columns}) > 1
    numbers = _instrument_numbers(columns)
    for column in columns:
        pair, note = parse_column_name(column.name), ""
        if pair and pair[0].isdigit() and (tag := parse_instrument_tag(column.name)):
            variable = "" if tag.kind == "position" else tag.variable
            pair = None if (variable, tag.number) in numbers else pair  # the valve PV 4101 beside PT 4101
        if pair is None and (pair := parse_column_name(column.description)):
            note = f"{column_label(column)} is the {pair[1]} of {pair[0]} by its description; {HOW_TO_OVERRULE}"
        if pair is None:
            bare.append(column)
            continue
        tag = pair[0] or (column.table.origin.stem if several else "")
        group = groups.setdefault(tag.upper(), TagGroup(tag))
        group.add(role_of(pair[1]), column)
        group.notes += [note] if note else []
    _move_flags(groups)
    _join_blocks(groups)
    return list(groups.values()), bare


def _instrument_numbers(columns: Sequence[TagColumn]) -> set[tuple[str, str]]:
    """Variable ("" for any) and number of the instrument tags that are not a word of a signal with a number."""
    tags = []
    for column in columns:
        pair = parse_column_name(column.name)
        if not (pair and pair[0].isdigit()):
            tags.append(parse_instrument_tag(pair[0] if pair else column.name))
    return {(variable, tag.number) for tag in tags if tag for variable in ("", tag.variable)}


def _move_flags(groups: dict[str, TagGroup]) -> None:
    """Give a flag of one signal to that signal: ``FIC-1.PV.Quality``, or one after each of several signals."""
    signals: dict[tuple[int, int | None], tuple[TagGroup, str]] = {}
    flags: dict[tuple[int, int | None], TagColumn] = {}
    for group in groups.values():
        for role in (*NUMERIC_ROLES, *FLAG_ROLES):
            for column in group.columns.get(role, ()):
                if role in FLAG_ROLES:
                    flags[id(column.table), column.position] = column
                elif column.position is not None:
                    signals[id(column.table), column.position] = group, role

    def signal_left_of(column: TagColumn) -> tuple[TagGroup, str] | None:
        table, position = id(column.table), column.position
        while position is not None and (table, position) in flags:
            position -= 1
        return signals.get((table, position))

    for key, group in list(groups.items()):
        owner = parse_column_name(group.tag) if group.columns.keys() <= set(FLAG_ROLES) else None
        target = groups.get(owner[0].upper()) if owner else None
        if owner and target is not None and role_of(owner[1]) in target.columns:
            del groups[key]
            target.columns |= {f"{role_of(owner[1])} {flag}": columns for flag, columns in group.columns.items()}
            continue
        own = [
            (flag, c, left) for flag in FLAG_ROLES for c in group.columns.get(flag, ()) if (left := signal_left_of(c))
        ]
        if len({(id(left[0]), left[1]) for *_, left in own}) > 1:
            for flag, column, (target, role) in own:
                group.columns[flag].remove(column)
                target.add(f"{role} {flag}", column)
        group.columns = {role: columns for role, columns in group.columns.items() if columns}


def _join_blocks(groups: dict[str, TagGroup]) -> None:
    """Give what one block of a point measures to the block that controls it, where that has none of its own."""
    for measures, controls in BLOCK_PAIRS:
        for key in [key for key in groups if key.endswith(measures)]:
            if target := groups.get(key[: -len(measures)] + controls):
                target.columns = {**groups.pop(key).columns, **target.columns}


def use_fallback_words(group: TagGroup) -> None:
    """Use the words of `FALLBACK_SIGNAL_WORDS` where the loop has no plainer one."""
    for role in dict.fromkeys(FALLBACK_SIGNAL_WORDS.values()):
        columns = group.columns.pop(f"fallback {role}", [])
        needs = {"sp": True, "op": "pv" in group.columns and "mv" not in group.columns, "pv": "op" in group.columns}
        if role not in group.columns and len(columns) == 1 and needs[role]:
            group.columns[role] = columns
            group.notes.append(
                f"Column {column_label(columns[0])} is taken as the {_LABELS[role]}, as there is no other."
            )


def use_mv_as_output(group: TagGroup) -> None:
    """Take a column MV as the controller output where the loop has no other, also beside a valve position."""
    pairs = [(column, parse_column_name(column.name)) for column in group.columns.get("mv", ())]
    outputs = [column for column, pair in pairs if pair and pair[1] in OUTPUT_IF_NO_OTHER]
    taken = f"Column {column_label(outputs[0])} is taken as the" if outputs else ""
    if outputs and {"op", "sp"} <= group.columns.keys() and "pv" not in group.columns:
        named = f"columns={{'pv': {column_label(outputs[0])!r}}} (--columns)"
        group.notes.append(f"{taken} valve position (MV); if it is the measured value (ABB), name it with {named}.")
    if "op" in group.columns or len(outputs) != 1:
        return
    group.columns["op"] = outputs
    group.columns["mv"].remove(outputs[0])
    if not group.columns["mv"]:
        del group.columns["mv"]
    position = "if it is the valve position, name the OP column"
    group.notes.append(f"{taken} controller output (OP), as there is no other; {position}.")


def add_bare_tags(groups: list[TagGroup], bare: list[TagColumn]) -> None:
    """Take a column that is named by the tag alone as the PV of the loop, as historians do."""
    by_tag = {group.tag.upper(): group for group in groups if "op" in group.columns and "pv" not in group.columns}
    for column in list(bare):
        group = by_tag.get(column.name.strip().upper())
        if group is not None and "pv" not in group.columns:
            group.add("pv", column)
            bare.remove(column)
            group.notes.append(f"Column {column_label(column)} is taken as the PV; {HOW_TO_OVERRULE}")


def shorten_block_tags(groups: Sequence[TagGroup]) -> None:
    """``FIC-101/PID1`` is the loop FIC-101 unless the module has two control blocks."""
    short = {id(group): _BLOCK.sub("", group.tag) for group in groups}
    counts = Counter(short.values())
    for group in groups:
        if counts[short[id(group)]] == 1:
            group.tag = short[id(group)]
