"""Tags of one number are one loop: FT, FIC and FV 4101 measure, control and move the same flow (ISA-5.1)."""

from __future__ import annotations

import re
from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

from stiction.sources.roles.loop_roles import FLAG_ROLES, HOW_TO_OVERRULE, TagGroup, column_label

if TYPE_CHECKING:
    from stiction.sources.tag_column import TagColumn

__all__ = ["InstrumentTag", "pair_by_letters", "parse_instrument_tag"]

_TAG = re.compile(r"(?<![A-Z])([A-Z]{2,5})[-_ .]?(\d{1,7})([A-Z]?)(?![A-Z0-9])")
_LETTERS = re.compile(r"([FLPTASWDQJIXHVGZ])([DFQ]?)([ICRTYEVZ]{1,3})")
# What a signal of an instrument is: kind of instrument -> role by its word -> role in the loop.
_ROLE_BY_KIND = {
    "measurement": {"pv": "pv", "op": "pv", "": "pv"},
    "valve": {"op": "op", "sp": "op", "fallback op": "op", "pv": "mv", "mv": "mv", "": "op"},
    "position": {"pv": "mv", "op": "mv", "mv": "mv", "": "mv"},
}
_ORDER = ("controller", "position", "measurement", "valve", "alone")


class InstrumentTag(NamedTuple):
    """A tag by ISA-5.1."""

    area: str
    """What stands before the letters, without separators."""
    variable: str
    """First letter, with the modifier D, F or Q after it: F is flow, PD a pressure difference, Z a position."""
    kind: str
    """"controller", "measurement", "valve" (also the converter in front of it) or "position"."""
    number: str
    """Loop number."""
    suffix: str
    """Letter after the number."""


def parse_instrument_tag(tag: str) -> InstrumentTag | None:
    """Read area, letters and number of an ISA-5.1 tag; None when the text is no such tag.

    Examples
    --------
    >>> parse_instrument_tag("12-FIC-4101A")
    InstrumentTag(area='12', variable='F', kind='controller', number='4101', suffix='A')
    >>> parse_instrument_tag("FV4101").kind, parse_instrument_tag("ZT4101").kind, parse_instrument_tag("CHEM1")
    ('valve', 'position', None)
    """
    text = tag.upper()
    for found in reversed(list(_TAG.finditer(text))):
        if letters := _LETTERS.fullmatch(found[1]):
            first, modifier, functions = letters.groups()
            if first == "Z" or "Z" in functions:
                kind = "position"
            elif functions[-1] in "VY":
                kind = "valve"
            else:
                kind = "controller" if "C" in functions else "measurement"
            area = re.sub(r"[^A-Z0-9]", "", text[: found.start()])
            return InstrumentTag(area, first + modifier, kind, found[2], found[3])
    return None


def pair_by_letters(groups: list[TagGroup], bare: list[TagColumn]) -> None:
    """Join the groups of one loop number, in place, and take the columns named by a tag alone out of `bare`."""
    members: dict[tuple[str, str, str, str], list[tuple[InstrumentTag, TagGroup]]] = defaultdict(list)
    own = {id(group) for group in groups}
    named = [(parse_instrument_tag(group.tag), group) for group in groups]
    alone = [(parse_instrument_tag(c.name), TagGroup(c.name, {"": [c]})) for c in bare]
    for tag, group in named + alone:
        if tag is not None:
            members[tag.area, tag.variable, tag.number, tag.suffix].append((tag, group))
    _add_positions(members)
    for (area, variable, number, suffix), parts in list(members.items()):
        if not suffix:  # a single valve with a letter after its number belongs to the loop of that number
            lettered = [key for key in members if key[:3] == (area, variable, number) and key[3]]
            if len(lettered) == 1 and not any(tag.kind == "controller" for tag, _ in members[lettered[0]]):
                parts = [*parts, *members[lettered[0]]]
        _join(parts, groups, bare, own)


def _add_positions(members: dict[tuple[str, str, str, str], list[tuple[InstrumentTag, TagGroup]]]) -> None:
    """Add a position tag (ZT 4101) to the loop of its number, where only one loop has that number."""
    for key in [key for key in members if key[1].startswith("Z")]:
        loops = [other for other in members if other[::2] == key[::2] and other[3] == key[3] and other[1] != key[1]]
        if len(loops) == 1:
            members[loops[0]] += members.pop(key)


def _join(
    parts: list[tuple[InstrumentTag, TagGroup]], groups: list[TagGroup], bare: list[TagColumn], own: set[int]
) -> None:
    """Join the parts of one loop number into one group, where they make a loop."""
    # A controller's tag alone may be any of its signals, so it comes last.
    parts = sorted(
        parts,
        key=lambda part: _ORDER.index(
            "alone" if part[0].kind == "controller" and "" in part[1].columns else part[0].kind
        ),
    )
    controllers = [group for tag, group in parts if tag.kind == "controller" and id(group) in own]
    if len(parts) < 2 or len(controllers) > 1 or {tag.kind for tag, _ in parts} <= {"valve", "position"}:
        return
    named = {tag.kind: group.tag for tag, group in reversed(parts)}
    target = controllers[0] if controllers else TagGroup(named.get("controller") or named["measurement"])
    extra: dict[str, list[TagColumn]] = {}
    taken: list[TagColumn] = []
    for tag, group in parts:
        for role, columns in group.columns.items() if group is not target else ():
            wanted = _ROLE_BY_KIND.get(tag.kind, {"": "pv"}).get(role, role)
            is_free = wanted not in target.columns and wanted not in extra and len(columns) == 1
            if wanted in ("pv", "sp", "op", "mv") and is_free and (wanted == "mv" or not target.is_loop):
                flags = {flag: group.columns.get(f"{role} {flag}", []) for flag in FLAG_ROLES}
                extra |= {wanted: columns} | {f"{wanted} {flag}": found for flag, found in flags.items() if found}
                taken += columns + [column for found in flags.values() for column in found]
    joined = TagGroup(target.tag, {**target.columns, **extra}, target.notes)
    if not extra or not joined.is_loop:
        return
    target.columns = joined.columns
    for _, group in parts:
        if group is not target:
            group.columns = {
                role: left
                for role, columns in group.columns.items()
                if (left := [column for column in columns if column not in taken])
            }
    groups[:] = [group for group in groups if group.columns and group is not target] + [target]
    bare[:] = [column for column in bare if column not in taken]
    listed = ", ".join(f"{column_label(columns[0])} = {role.upper()}" for role, columns in extra.items())
    target.notes.append(f"{listed} of the loop {target.tag}, by the number of the tags; {HOW_TO_OVERRULE}")
