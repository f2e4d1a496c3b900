"""The order in which loops deserve attention."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from stiction.fleet.loop_metrics import compute_priority
from stiction.fleet.loop_row import RESTING_STATES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from stiction.fleet.loop_row import LoopRow

__all__ = ["FAULT_STATES", "is_judged", "rank_members", "rank_row", "rank_rows"]

FAULT_STATES = ("not_in_command", "valve_not_responding", "pv_frozen", "signals_swapped", "signals_unrelated")
"""Loop states that somebody should look into."""
OWN_CAUSES = ("valve", "tuning", "sensor", "dead_zone")
"""Causes of an oscillation that are faults of the loop itself; an external load is not."""


def is_judged(row: LoopRow) -> bool:
    """Whether the row says something of the valve: the loop was screened or diagnosed, in a state that allows it."""
    return row.status in ("screened", "diagnosed") and row.loop_state not in RESTING_STATES


def rank_row(row: LoopRow) -> LoopRow:
    """Add confidence and priority to a row.

    Notes
    -----
    Confidence is the probability that the loop itself has a fault: the largest of the probability of stiction and of
    the causes `OWN_CAUSES` of its oscillation. An oscillation that an external load causes does not count. It is 1 in a
    state that is a fault, 0 where the loop cannot be judged, and before the diagnosis 0.5 of a loop that oscillates and
    0.25 of another. Priority is severity times confidence times importance (`compute_priority`).

    Examples
    --------
    >>> from stiction.fleet.loop_row import LoopRow
    >>> row = LoopRow("FIC-1", status="diagnosed", loop_state="in_control", probability=0.9, severity=0.5,
    ...               importance=2.0, oscillation_causes={"valve": 0.9})
    >>> rank_row(row).priority
    0.9
    """
    if not is_judged(row):
        confidence = 0.0
    elif row.loop_state in FAULT_STATES:
        confidence = 1.0
    elif row.status == "diagnosed":
        causes = row.oscillation_causes or {}
        confidence = max([row.probability or 0.0, *(causes.get(name, 0.0) for name in OWN_CAUSES)])
    else:
        confidence = 0.5 if row.oscillation_index > 0.0 else 0.25
    return replace(row, confidence=confidence, priority=compute_priority(row.severity, confidence, row.importance))


def rank_rows(rows: Iterable[LoopRow]) -> list[LoopRow]:
    """Sort rows by priority, the highest first; loops that cannot be judged come last, the most severe first."""
    return sorted(rows, key=lambda row: (not is_judged(row), -row.priority, -row.severity, row.tag))


def rank_members(rows: Iterable[LoopRow], groups: Iterable[dict[str, Any]]) -> list[LoopRow]:
    """Add the group to each row, and lower the priority of members that follow the source of their group.

    Notes
    -----
    What a loop shows of an oscillation that comes from another loop is no fault of its own. The confidence of a member
    that is none of the leading roots is multiplied by its probability of being the source over the largest one, and
    `follows` names the likeliest source. A verdict "stiction" keeps its confidence: a group may have a second sticky
    valve.

    Examples
    --------
    >>> from stiction.fleet.loop_row import LoopRow
    >>> roots = [{"tag": "FIC-1", "probability": 0.9}, {"tag": "FIC-2", "probability": 0.09}]
    >>> group = {"number": 1, "leading_roots": ["FIC-1"], "roots": roots}
    >>> [row] = rank_members([LoopRow("FIC-2", verdict="no_stiction", confidence=0.8, priority=0.4)], [group])
    >>> row.follows, row.group, round(row.priority, 3)
    ('FIC-1', 1, 0.04)
    """
    places = {root["tag"]: (group, root["probability"]) for group in groups for root in group["roots"]}
    ranked = []
    for row in rows:
        group, probability = places.get(row.tag, (None, 0.0))
        row = replace(row, group=group and group["number"], follows=None)
        if group and row.tag not in group["leading_roots"] and row.verdict != "stiction":
            source = group["roots"][0]
            share = probability / source["probability"]
            row = replace(row, confidence=share * row.confidence, priority=share * row.priority, follows=source["tag"])
        ranked.append(row)
    return ranked
