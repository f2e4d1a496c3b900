"""Groups of columns that are one loop by their tags (ISA-5.1: FT, FIC, FV 4101) or descriptions."""

from __future__ import annotations

import re
from collections import defaultdict
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.sources.roles.column_names import parse_column_name
from stiction.sources.roles.loop_roles import (
    FLAG_ROLES,
    HOW_TO_OVERRULE,
    NUMERIC_ROLES,
    TagGroup,
    column_label,
    list_roles,
)
from stiction.sources.roles.vocabulary import GENERIC_WORDS

if TYPE_CHECKING:
    from stiction.sources.table import TagColumn

__all__ = ["InstrumentTag", "pair_by_description", "pair_by_letters", "parse_instrument_tag"]

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
    """Tag by ISA-5.1; the variable keeps D, F or Q, the kind is controller, measurement, valve or position."""

    area: str
    variable: str
    kind: str
    number: str
    suffix: str


@lru_cache(maxsize=4096)
def parse_instrument_tag(tag: str) -> InstrumentTag | None:
    """Read area, letters and number of an ISA-5.1 tag; None when the text is no such tag.

    >>> parse_instrument_tag("12-FIC-4101A")
    InstrumentTag(area='12', variable='F', kind='controller', number='4101', suffix='A')
    >>> parse_instrument_tag("FV4101").kind, parse_instrument_tag("ZT4101").kind, parse_instrument_tag("CHEM1")
    ('valve', 'position', None)
    """
    text = tag.upper()
    for match in reversed(list(_TAG.finditer(text))):
        if letters := _LETTERS.fullmatch(match[1]):
            first, modifier, functions = letters.groups()
            kind = "controller" if "C" in functions else "measurement"
            kind = "valve" if functions[-1] in "VY" else kind
            kind = "position" if "Z" in first + functions else kind
            area = re.sub(r"[^A-Z0-9]", "", text[: match.start()])
            return InstrumentTag(area, first + modifier, kind, match[2], match[3])
    return None


def pair_by_letters(groups: list[TagGroup], bare: list[TagColumn]) -> None:
    """Join the groups of one loop number, in place, and take the columns named by a tag alone out of `bare`."""
    members: dict[tuple[str, ...], list[tuple[str, TagGroup]]] = defaultdict(list)
    variables: dict[tuple[str, ...], list[str]] = defaultdict(list)  # of an area, number and suffix
    suffixes: dict[tuple[str, ...], list[str]] = defaultdict(list)  # of an area, number and variable
    for group in (*groups, *(TagGroup(column.name, {"": [column]}) for column in bare)):
        if tag := parse_instrument_tag(group.tag):
            # The tag of a controller alone may be any of its signals, so it comes last.
            kind = "alone" if tag.kind == "controller" and "" in group.columns else tag.kind
            key = (tag.area, tag.number, tag.suffix, tag.variable)
            if key not in members:
                variables[key[:3]].append(tag.variable)
                suffixes[tag.area, tag.number, tag.variable].append(tag.suffix)
            members[key].append((kind, group))
    for key in [key for key in members if key[3].startswith("Z")]:
        loops = [variable for variable in variables[key[:3]] if variable != key[3] and (*key[:3], variable) in members]
        if len(loops) == 1:  # the position ZT 4101 belongs to the only loop of its number
            members[*key[:3], loops[0]] += members.pop(key)
    joined: list[TagGroup] = []
    for (area, number, suffix, variable), parts in members.items():
        if not suffix:  # a single valve with a letter after its number belongs to the loop of that number
            letters = [letter for letter in suffixes[area, number, variable] if letter]
            lettered = members.get((area, number, letters[0], variable), []) if len(letters) == 1 else []
            if all(kind != "controller" for kind, _ in lettered):
                parts = [*parts, *lettered]
        if target := _join(sorted(parts, key=lambda part: _ORDER.index(part[0]))):
            joined.append(target)
    if joined:
        moved, taken = {id(group) for group in joined}, {id(c) for group in joined for c in group.all_columns()}
        groups[:] = [group for group in groups if group.columns and id(group) not in moved] + joined
        bare[:] = [column for column in bare if id(column) not in taken]


def _join(parts: list[tuple[str, TagGroup]]) -> TagGroup | None:
    """Join the parts of one loop number into one group and return it; None where they do not make a loop."""
    tags = {kind: group.tag for kind, group in reversed(parts)}
    controllers = [group for kind, group in parts if kind == "controller"]
    if len(parts) < 2 or len(controllers) > 1 or tags.keys() <= {"valve", "position"}:
        return None
    target = controllers[0] if controllers else TagGroup(tags.get("alone") or tags["measurement"])
    has_both = {"pv", "op"} <= target.columns.keys()
    extra: dict[str, list[TagColumn]] = {}
    for kind, group in parts:
        for role, columns in group.columns.items() if group is not target else ():
            wanted = _ROLE_BY_KIND.get(kind, {"": "pv"}).get(role, role)
            is_open = wanted in ("pv", "sp", "op", "mv") and wanted not in target.columns | extra
            if is_open and len(columns) == 1 and (wanted == "mv" or not has_both):
                extra[wanted] = columns
                extra |= {f"{wanted} {flag}": group.columns.get(f"{role} {flag}", []) for flag in FLAG_ROLES}
    if not extra or not TagGroup(target.tag, target.columns | extra).is_loop:
        return None
    taken = {id(column) for columns in extra.values() for column in columns}
    for _, group in parts:
        left = {role: [c for c in columns if id(c) not in taken] for role, columns in group.columns.items()}
        group.columns = {role: columns for role, columns in left.items() if columns}
    target.columns |= {role: columns for role, columns in extra.items() if columns}
    listed = list_roles({role: columns[0] for role, columns in extra.items() if role in NUMERIC_ROLES})
    target.notes.append(f"{listed} of the loop {target.tag}, by the number of the tags; {HOW_TO_OVERRULE}")
    return target


def pair_by_description(groups: list[TagGroup]) -> None:
    """Join groups whose tags or descriptions name the same place, or the only PV and OP, in place."""
    measured = [group for group in groups if "pv" in group.columns and "op" not in group.columns]
    moved = [group for group in groups if "op" in group.columns and not {"pv", "mv"} & group.columns.keys()]
    pairs = _unique_pairs(measured, moved)
    is_only_pair = len(measured) == len(moved) == 1 and not any(group.is_loop for group in groups)
    if not pairs and is_only_pair and not _are_two_loops(measured[0], moved[0]):
        pairs = [(measured[0], moved[0])]
    for pv_group, op_group in pairs:
        _join_two(pv_group, op_group, groups)
    loops = [group for group in groups if group.is_loop]
    rest = [group for group in groups if group.columns.keys() <= {"sp", "mv", "mode"} and group.tag]
    for loop, group in _unique_pairs(loops, rest):
        if not loop.columns.keys() & group.columns.keys():
            _join_two(loop, group, groups)


def _unique_pairs(
    one: list[TagGroup], other: list[TagGroup], *, max_pairs: int = 40_000
) -> list[tuple[TagGroup, TagGroup]]:
    """Pairs of which each is the only best partner of the other."""
    if not one or not other or len(one) * len(other) > max_pairs:
        return []
    places = {id(group): _places(group) for group in (*one, *other)}
    scores = np.array([[_likeness(places[id(a)], places[id(b)]) for b in other] for a in one])
    for i, j in np.argwhere(scores > 0.0):
        scores[i, j] *= not _are_two_loops(one[i], other[j])
    is_best = (scores > 0.0) & (scores == scores.max(axis=1, keepdims=True)) & (scores == scores.max(axis=0))
    is_best &= (is_best.sum(axis=1, keepdims=True) == 1) & (is_best.sum(axis=0) == 1)
    return [(one[i], other[j]) for i, j in np.argwhere(is_best)]


def _likeness(one: set[frozenset[str]], other: set[frozenset[str]]) -> float:
    """1 when both name the same place, less when one names it more closely, 0 when they do not."""
    alike = [(a, b) for a in one for b in other if a <= b or b <= a]
    return max((len(a & b) / len(a | b) for a, b in alike), default=0.0)


def _places(group: TagGroup) -> set[frozenset[str]]:
    """Words of the tag, and of each description, that say where."""
    texts = [group.tag, *(column.description for column in group.all_columns())]
    heads = [pair[0] if (pair := parse_column_name(text)) else text for text in texts]
    return {frozenset(re.findall(r"[^\W_]+", head.upper())) - GENERIC_WORDS for head in heads} - {frozenset()}


def _are_two_loops(one: TagGroup, other: TagGroup) -> bool:
    """Whether both have tags by ISA-5.1, of different numbers."""
    tags = parse_instrument_tag(one.tag), parse_instrument_tag(other.tag)
    return tags[0] is not None and tags[1] is not None and tags[0].number != tags[1].number


def _join_two(target: TagGroup, group: TagGroup, groups: list[TagGroup]) -> None:
    """Put the columns of a group into another one that lacks them."""
    listed = " and ".join(column_label(one.all_columns()[0]) for one in (target, group))
    target.columns = {**group.columns, **target.columns}
    target.notes += [*group.notes, f"{listed} are taken as one loop, by their descriptions; {HOW_TO_OVERRULE}"]
    groups.remove(group)
