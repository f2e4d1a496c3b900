"""Groups of one description are one loop: "Reflux flow PV" and "Reflux valve OP"."""

from __future__ import annotations

import re

import numpy as np

from stiction.sources.roles.column_names import parse_column_name
from stiction.sources.roles.loop_roles import HOW_TO_OVERRULE, TagGroup, column_label
from stiction.sources.roles.tag_letters import parse_instrument_tag
from stiction.sources.roles.vocabulary import GENERIC_WORDS

__all__ = ["pair_by_description"]


def pair_by_description(groups: list[TagGroup]) -> None:
    """Join a group with a PV and one with an OP whose tags or descriptions name the same place, in place.

    A group that has only a set point or a valve position joins the loop of the same place. The one PV and the one OP
    of a source are joined as well, unless the numbers of their tags say that they belong to different loops.
    """
    measured = [group for group in groups if "pv" in group.columns and "op" not in group.columns]
    moved = [group for group in groups if "op" in group.columns and not {"pv", "mv"} & group.columns.keys()]
    pairs = _unique_pairs(measured, moved)
    is_only_pair = len(measured) == len(moved) == 1 and not any(group.is_loop for group in groups)
    if not pairs and is_only_pair and not _are_two_loops(measured[0], moved[0]):
        pairs = [(measured[0], moved[0])]
    for pv_group, op_group in pairs:
        _join(pv_group, op_group, groups)
    loops = [group for group in groups if group.is_loop]
    rest = [group for group in groups if group.columns.keys() <= {"sp", "mv", "mode"} and group.tag]
    for loop, group in _unique_pairs(loops, rest):
        if not loop.columns.keys() & group.columns.keys():
            _join(loop, group, groups)


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


def _join(target: TagGroup, group: TagGroup, groups: list[TagGroup]) -> None:
    """Put the columns of a group into another one that lacks them."""
    listed = " and ".join(column_label(one.all_columns()[0]) for one in (target, group))
    target.columns = {**group.columns, **target.columns}
    target.notes += [*group.notes, f"{listed} are taken as one loop, by their descriptions; {HOW_TO_OVERRULE}"]
    groups.remove(group)
