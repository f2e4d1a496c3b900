"""Which column is PV, OP, SP, valve position, mode or quality of which loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.errors import ParameterError, RecordError, Setting
from stiction.sources.roles.by_data import find_roles_by_data
from stiction.sources.roles.column_names import normalise_name, parse_column_name
from stiction.sources.roles.group_columns import add_bare_tags, group_columns, shorten_block_tags, use_weaker_words
from stiction.sources.roles.loop_roles import (
    FLAG_ROLES,
    HOW_TO_OVERRULE,
    NUMERIC_ROLES,
    ROLES,
    LoopRoles,
    TagGroup,
    column_label,
    list_roles,
)
from stiction.sources.roles.map_file import apply_map
from stiction.sources.roles.pair_groups import pair_by_description, pair_by_letters, parse_instrument_tag
from stiction.sources.roles.vocabulary import INDEX_WORDS, loop_type_of
from stiction.sources.table import find_column

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.options import ReadOptions
    from stiction.sources.roles.map_file import MapRow
    from stiction.sources.table import TagColumn

__all__ = ["assign_roles", "choose_loops"]

MAX_LISTED = 20
"""Names in a message [-]."""


def assign_roles(
    columns: Sequence[TagColumn], options: ReadOptions, map_rows: Sequence[MapRow] | None = None, name: str = ""
) -> list[LoopRoles]:
    """Give each column its role by the map, else by name; `options.columns` or `options.tag` choose one loop."""
    if not columns:
        raise RecordError("has no columns except the time; export PV and OP of a loop.", where=name or "The source")
    source = columns[0].table.origin.name
    if map_rows is not None:
        loops = apply_map(columns, map_rows)
        _name_unused(columns, loops, None)
        return choose_loops(loops, options, source)
    chosen = {role: _choose_column(role, name, columns) for role, name in options.columns.items() if role != "time"}
    groups, bare = group_columns([column for column in columns if column not in chosen.values()])
    wanted = _put_chosen(chosen, groups)
    for group in groups:
        use_weaker_words(group)
    if wanted is None or not wanted.is_loop:
        pair_by_letters(groups, bare)
        add_bare_tags(groups, bare)
        pair_by_description(groups)
    if not any(group.is_loop for group in groups):
        _add_by_data(groups, bare)
    if wanted is not None:
        wanted = next(group for group in groups if set(chosen.values()) & set(group.all_columns()))
        wanted = _join_only_loop(wanted, groups)
    shorten_block_tags(groups)
    return choose_loops(_make_loops(columns, groups, wanted, options.tag or "", source), options, source)


def _choose_column(role: str, name: str | int, columns: Sequence[TagColumn]) -> TagColumn:
    """Find the column that the user names for a role, by its name or by its number (from 0)."""
    if role not in ROLES:
        raise ParameterError(f"{role!r} is not a signal; name columns for time, {', '.join(ROLES)}.")
    names, positions = [column.name for column in columns], [column.position for column in columns]
    table = columns[0].table
    return columns[find_column(name, names, positions, table.width - 1, role.upper(), table.origin.name)]


def _put_chosen(chosen: dict[str, TagColumn], groups: list[TagGroup]) -> TagGroup | None:
    """Put the columns that the user named into their group, and give it if one of them is a number."""
    if not chosen:
        return None
    pairs = [parse_column_name(column.name) for column in chosen.values()]
    tags = {pair[0].upper() for pair in pairs if pair}
    own = [group for group in groups if group.tag.upper() in tags]
    others = [group for group in groups if group.has_numbers]
    if len(own) == 1 or (not own and len(others) == 1):
        target = (own or others)[0]
    else:
        groups[:] = [group for group in groups if group.tag or not own]
        target = next((group for group in groups if not group.tag), None) or TagGroup("")
    if target not in groups:
        groups.append(target)
    target.columns |= {role: [column] for role, column in chosen.items()}
    return target if TagGroup("", {role: [] for role in chosen}).has_numbers else None


def _join_only_loop(wanted: TagGroup, groups: list[TagGroup]) -> TagGroup:
    """Put columns that the user named, and that are no loop alone, into the only loop that was found."""
    loops = [group for group in groups if group.is_loop]
    if wanted.is_loop or wanted.tag or len(loops) != 1:
        return wanted
    guessed = {r: found[0] for r, found in loops[0].columns.items() if r in NUMERIC_ROLES and r not in wanted.columns}
    if wanted.columns.keys() & loops[0].columns.keys():
        loops[0].notes = [f"{list_roles(guessed)} of the loop {loops[0].tag}, by the tags; {HOW_TO_OVERRULE}"]
    loops[0].columns |= wanted.columns
    groups[:] = [group for group in groups if group is not wanted]
    return loops[0]


def _add_by_data(groups: list[TagGroup], bare: list[TagColumn]) -> None:
    """Complete the only group, or make one, by what the data say of the columns without a role."""
    partial = [group for group in groups if group.has_numbers] or [TagGroup("")]
    if len(partial) > 1:
        return
    known = {role: columns[0] for role, columns in partial[0].columns.items()}
    roles, note = find_roles_by_data([c for c in bare if normalise_name(c.name) not in INDEX_WORDS[1:]], known)
    for role, column in roles.items():
        partial[0].add(role, column)
        bare.remove(column)
    if roles:
        partial[0].notes.append(note)
        groups[:] = [group for group in groups if group is not partial[0]] + partial


def _make_loops(
    columns: Sequence[TagColumn], groups: list[TagGroup], wanted: TagGroup | None, tag: str, source: str
) -> list[LoopRoles]:
    """Loops of the groups that have PV and OP."""
    usable = [group for group in groups if group.is_loop and wanted in (None, group)]
    if not usable:
        known = [list_roles({role: found[0]}) for group in groups for role, found in group.columns.items()]
        recognised = f" (recognised: {', '.join(known[:MAX_LISTED])})" if known else ""
        names = ", ".join(column.name for column in columns[:MAX_LISTED] if column.name) or "(no header)"
        found = {role for group in groups for role in group.columns}
        no_op = "the controller output OP is missing: export it too, or " if "pv" in found and "op" not in found else ""
        raise RecordError(
            f"no loop with OP and PV or valve position (MV) was found among the columns {names}{recognised}",
            remedy=(
                f"{no_op}assign the columns with ",
                Setting("columns", {"op": None, "pv": None}),
                " or ",
                Setting("columns", {"op": None, "mv": None}),
                ", or with a map",
            ),
            where=f"{source}, line {max(1, columns[0].table.first_line - 1)}",
        )
    doubled = {id(group): text for group in usable if (text := _role_with_two(group))}
    for group in usable:
        if id(group) in doubled and (len(doubled) == len(usable) or tag.lower() == group.tag.lower()):
            raise RecordError(f"{doubled[id(group)]}", where=source)
    notes = [f"Left out: {text}" for text in doubled.values()]
    left = [group.tag for group in groups if group.tag and group not in usable and group.has_numbers]
    if left and wanted is None:
        notes.insert(0, f"Left out, as PV or OP is missing: {', '.join(left[:10])}{' ...' if left[10:] else ''}.")
    without_tag = next((group for group in groups if not group.tag and group not in usable), TagGroup(""))
    shared = {role: c for role, c in _number_flags(without_tag).items() if role in (*FLAG_ROLES, "mode")}
    loops = [
        LoopRoles(group.tag, shared | _number_flags(group), loop_type_of(group.tag), notes=[*group.notes, *notes])
        for group in usable
        if id(group) not in doubled
    ]
    _name_unused(columns, loops, None if wanted is None else loops[0])
    return loops


def _role_with_two(group: TagGroup) -> str:
    """Say which role of a loop has two columns; empty when none has."""
    for role, found in group.columns.items():
        if len(found) > 1 and role.split()[-1] not in FLAG_ROLES:
            one, other = (column_label(column) for column in found[:2])
            both = f"columns {one!r} and {other!r} are both the {role.upper()} of one loop"
            return f"{both}; name the right one (--column, in Python columns=)."
    return ""


def _number_flags(group: TagGroup) -> dict[str, TagColumn]:
    """Role -> column; the second flag of a kind gets a number."""
    pairs = ((role, k, column) for role, found in group.columns.items() for k, column in enumerate(found, 1))
    return {role if k == 1 else f"{role} {k}": column for role, k, column in pairs}


def choose_loops(
    loops: list[LoopRoles], options: ReadOptions, source: str, others: Sequence[str] = ()
) -> list[LoopRoles]:
    """Pick the loops that the user asks for, or none where one of the `others` has the tag.

    A single loop without a tag takes any; of several, each is called after its file. Raises RecordError when none is
    the wanted one, or files without tags share its name.
    """
    if options.tag is None or (len(loops) == 1 and not loops[0].tag and not others):
        return loops
    names = [loop.tag or loop.roles["op"].table.origin.stem for loop in loops]
    wanted = options.tag.casefold()
    chosen = [loop for loop, name in zip(loops, names, strict=True) if name.casefold() == wanted]
    if not chosen and wanted not in map(str.casefold, others):
        listed = ", ".join([*names, *others][:MAX_LISTED])
        if len(loops) == 1 and options.map is None and set(options.columns) & set(NUMERIC_ROLES):
            raise RecordError(
                "",
                Setting("columns"),
                f" assigns columns of the loop {listed}, but ",
                Setting("tag"),
                f" asks for the loop {options.tag}",
                remedy="leave one of them out",
                where=source,
            )
        raise RecordError(f"has no loop {options.tag!r}; its loops are {listed}.", where=source)
    if len(chosen) > 1 and not any(loop.tag for loop in chosen):
        files = ", ".join(loop.roles["op"].table.origin.name for loop in chosen[:MAX_LISTED])
        raise RecordError(
            f"{len(chosen)} files without a tag have this name ({files}); give one of them.", where=wanted
        )
    return chosen


def _name_unused(columns: Sequence[TagColumn], loops: list[LoopRoles], wanted: LoopRoles | None) -> None:
    """Name each unused column in the loop of its tag or number, or of the next used column to its left."""

    def number_of(tag: str) -> tuple[str, ...]:
        parts = parse_instrument_tag(tag)
        return (parts.area, parts.variable, parts.number) if parts else ()

    owner = {id(column): loop for loop in loops for column in loop.roles.values()}
    by_tag = {key: loop for loop in loops for key in (number_of(loop.tag), loop.tag.upper()) if key}
    left, table = None, None
    for column in columns:
        left = owner.get(id(column)) or (left if column.table is table else None)
        table = column.table
        if id(column) in owner:
            continue
        pair = parse_column_name(column.name)
        tag = pair[0] if pair else column.name
        loop = by_tag.get(tag.upper()) or by_tag.get(number_of(tag))
        if loop is None and normalise_name(column.name) not in INDEX_WORDS:
            loop = wanted if pair and pair[0] else wanted or left
        if loop is not None:
            loop.unused.append(column_label(column))
