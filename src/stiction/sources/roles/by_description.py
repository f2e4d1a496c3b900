"""Groups of one description are one loop: "Reflux flow PV" and "Reflux valve OP"."""

from __future__ import annotations

import re

import numpy as np

from stiction.sources.roles.column_names import parse_column_name
from stiction.sources.roles.loop_roles import HOW_TO_OVERRULE, TagGroup, column_label
from stiction.sources.roles.tag_letters import parse_instrument_tag

__all__ = ["pair_by_description"]

GENERIC_WORDS = frozenset(
    (
        *(
            "FLOW",
            "LEVEL",
            "PRESSURE",
            "PRESS",
            "TEMPERATURE",
            "TEMP",
            "VALVE",
            "CONTROL",
            "CONTROLLER",
            "LOOP",
            "RATE",
        ),
        *("CV", "FCV", "LCV", "PCV", "TCV", "MEASUREMENT", "MEASURED", "INDICATOR", "TRANSMITTER", "ACTUATOR"),
        *("POSITIONER", "POSITION", "RATE", "THE", "OF", "TO"),
        *("DURCHFLUSS", "VENTIL", "REGELVENTIL", "STELLVENTIL", "DRUCK", "TEMPERATUR", "STAND", "FÜLLSTAND", "REGLER"),
        *("DÉBIT", "DEBIT", "VANNE", "NIVEAU", "PRESSION", "TEMPÉRATURE", "DE", "DU", "LA", "LE"),
        *("CAUDAL", "FLUJO", "VÁLVULA", "VALVULA", "NIVEL", "PRESIÓN", "PRESION", "TEMPERATURA", "DEL"),
        *("PORTATA", "VALVOLA", "LIVELLO", "PRESSIONE"),
    )
)
"""Words that say what is measured or moved, not where."""
MAX_PAIRS = 40_000
"""Pairs of groups up to which all are compared [-]."""


def pair_by_description(groups: list[TagGroup]) -> None:
    """Join a group with a PV and one with an OP whose tags or descriptions name the same place, in place.

    A group that has only a set point or a valve position joins the loop of the same place. The one PV and the one OP
    of a source are joined as well, unless the numbers of their tags say that they belong to different loops.
    """
    measured = [group for group in groups if "pv" in group.columns and "op" not in group.columns]
    moved = [group for group in groups if "op" in group.columns and not {"pv", "mv"} & group.columns.keys()]
    has_loop = any(group.is_loop for group in groups)
    pairs = _unique_pairs(measured, moved)
    if not pairs and not has_loop and len(measured) == len(moved) == 1 and not _are_two_loops(measured[0], moved[0]):
        pairs = [(measured[0], moved[0])]
    for pv_group, op_group in pairs:
        _join(pv_group, op_group, groups)
    loops = [group for group in groups if group.is_loop]
    rest = [group for group in groups if group.columns.keys() <= {"sp", "mv", "mode"} and group.tag]
    for loop, group in _unique_pairs(loops, rest):
        if not loop.columns.keys() & group.columns.keys():
            _join(loop, group, groups)


def _unique_pairs(one: list[TagGroup], other: list[TagGroup]) -> list[tuple[TagGroup, TagGroup]]:
    """Pairs of which each is the only best partner of the other."""
    if not one or not other or len(one) * len(other) > MAX_PAIRS:
        return []
    places = {id(group): _places(group) for group in (*one, *other)}
    scores = np.array([[_likeness(a, b, places) for b in other] for a in one])
    is_best = (scores > 0.0) & (scores == scores.max(axis=1, keepdims=True)) & (scores == scores.max(axis=0))
    is_best &= (is_best.sum(axis=1, keepdims=True) == 1) & (is_best.sum(axis=0) == 1)
    return [(one[i], other[j]) for i, j in np.argwhere(is_best)]


def _likeness(one: TagGroup, other: TagGroup, places: dict[int, list[frozenset[str]]]) -> float:
    """1 when both name the same place, less when one names it more closely, 0 when they do not."""
    shares = [_share(a, b) for a in places[id(one)] for b in places[id(other)]]
    return max(shares, default=0.0) if any(shares) and not _are_two_loops(one, other) else 0.0


def _share(one: frozenset[str], other: frozenset[str]) -> float:
    return len(one & other) / len(one | other) if one <= other or other <= one else 0.0


def _places(group: TagGroup) -> list[frozenset[str]]:
    """Words of the tag, and of each description, that say where."""
    texts = [group.tag, *(column.description for column in group.all_columns())]
    heads = [pair[0] if (pair := parse_column_name(text)) else text for text in texts]
    words = [frozenset(re.findall(r"[^\W_]+", head.upper())) - GENERIC_WORDS for head in heads]
    return [place for place in dict.fromkeys(words) if place]


def _are_two_loops(one: TagGroup, other: TagGroup) -> bool:
    """Whether both have tags by ISA-5.1, of different numbers."""
    tags = parse_instrument_tag(one.tag), parse_instrument_tag(other.tag)
    return tags[0] is not None and tags[1] is not None and tags[0].number != tags[1].number


def _join(target: TagGroup, group: TagGroup, groups: list[TagGroup]) -> None:
    """Put the columns of a group into another one that lacks them."""
    listed = " and ".join(column_label(column) for column in (target.all_columns()[0], group.all_columns()[0]))
    target.columns = {**group.columns, **target.columns}
    target.notes += [*group.notes, f"{listed} are taken as one loop, by their descriptions; {HOW_TO_OVERRULE}"]
    groups.remove(group)
