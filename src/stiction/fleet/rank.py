"""The order in which loops deserve attention, and what their groups say of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from stiction.display.number_format import count_noun, format_number, format_probability
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
    0.25 of another. Priority is severity times confidence times importance (`compute_priority`), and 0 where an open
    question can wait.

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
    priority = 0.0 if row.waits else compute_priority(row.severity, confidence, row.importance)
    return replace(row, confidence=confidence, priority=priority)


def rank_rows(rows: Iterable[LoopRow]) -> list[LoopRow]:
    """Sort rows by priority, the highest first; loops that cannot be judged come last, the most severe first."""
    return sorted(rows, key=lambda row: (not is_judged(row), -row.priority, -row.severity, row.tag))


def rank_members(rows: Iterable[LoopRow], groups: Iterable[dict[str, Any]]) -> list[LoopRow]:
    """Say in each row what its group means for it, and give the priority of followers to their source.

    Notes
    -----
    What a loop shows of an oscillation that comes from another loop is no fault of its own. A member that is none of
    the leading roots, and whose valve does not stick with the highest grade, follows: its finding is `follows`, its
    next step is to look again after the source was put right, and its confidence is multiplied by its probability of
    being the source over the largest one. Its severity counts for the leading roots, by their probability of being the
    source. Where two roots lead, a test decides between them before anything is changed.

    Examples
    --------
    >>> from stiction.fleet.loop_row import LoopRow
    >>> roots = [{"tag": "FIC-1", "probability": 0.9}, {"tag": "FIC-2", "probability": 0.09}]
    >>> group = {"number": 1, "leading_roots": ["FIC-1"], "roots": roots}
    >>> rows = [LoopRow(tag, severity=0.5, confidence=0.8, priority=0.4) for tag in ("FIC-1", "FIC-2")]
    >>> source, follower = rank_members(rows, [group])
    >>> follower.finding_text, follower.next_step, round(follower.priority, 2)
    ('Oscillates with FIC-1', 'Look again after FIC-1 was put right.', 0.04)
    >>> source.followers, round(source.priority, 2)
    (1, 0.76)
    """
    rows, of_tag = list(rows), {root["tag"]: group for group in groups for root in group["roots"]}
    ranked = {row.tag: replace(row, group=None, follows=None, followers=0) for row in rows}
    for group in {id(group): group for group in of_tag.values()}.values():
        _rank_group(ranked, group)
    return [replace(row, priority_reason=_explain_priority(row)) for row in ranked.values()]


def _rank_group(rows: dict[str, LoopRow], group: dict[str, Any]) -> None:
    """Change the rows of the members of one group."""
    probability = {root["tag"]: root["probability"] for root in group["roots"] if root["tag"] in rows}
    leading = [tag for tag in group["leading_roots"] if tag in rows]
    if not leading:
        return
    moved, followers, first = 0.0, 0, leading[0]
    for tag, share in probability.items():
        row = replace(rows[tag], group=group["number"])
        if tag not in leading and not _surely_sticks(row):
            share /= probability[first]
            moved += (1.0 - share) * row.severity * row.importance
            followers += 1
            names = " or ".join(leading)
            step = f"Look again after {names} was put right."
            row = replace(
                row, confidence=share * row.confidence, priority=share * row.priority, follows=first,
                finding="follows", finding_text=f"Oscillates with {names}", next_step=step, action=step,
                test_time_s=None, test_size=None,
            )  # fmt: skip
        rows[tag] = row
    total = sum(probability[tag] for tag in leading)
    for tag in leading:
        row = rows[tag]
        more = row.confidence * moved * probability[tag] / total
        row = replace(row, followers=followers, priority=row.priority + more)
        if len(leading) > 1 and not _surely_sticks(row):
            [other] = [name for name in leading if name != tag][:1]
            step = _explain_test(tag, other)
            row = replace(row, finding_text=f"Oscillates with {other}; one of the two is the source", next_step=step,
                          action=step, test_time_s=3.0 * group["period_s"], test_size=None)  # fmt: skip
        rows[tag] = row


def _surely_sticks(row: LoopRow) -> bool:
    """Whether the valve is called sticky with the highest grade: a group may have a second sticky valve."""
    return row.verdict == "stiction" and row.finding != "probably_sticks"


def _explain_test(tag: str, other: str) -> str:
    """The test that tells which of two loops is the source."""
    return f"Put {tag} in manual for three periods: if {other} goes on swinging, {other} is the source, else {tag} is."


def _explain_priority(row: LoopRow) -> str:
    """What the fault costs, how sure it is, and how many loops follow, in a sentence."""
    if not is_judged(row):
        return "Not judged."
    if row.waits:
        return "Can wait: the loop does not oscillate."
    costs = []
    if row.variability is not None:
        costs.append(f"the control error has a standard deviation of {format_number(row.variability, '% of span', 2)}")
    if row.reversals_per_day:
        costs.append(f"OP reverses {format_number(row.reversals_per_day, '', 2)} times a day")
    if row.saturated_share:
        costs.append(f"OP is at a limit {100.0 * row.saturated_share:.0f} % of the time")
    text = " and ".join(costs) or f"severity {format_number(row.severity, '', 2)}"
    if row.follows:
        return f"{text[0].upper()}{text[1:]}; counted for {row.follows}, which it follows."
    sure = f"probability that the fault is in this loop {format_probability(row.confidence)}"
    many = f"; {count_noun(row.followers, 'loop follows', 'loops follow')}" if row.followers else ""
    weight = f"; importance {row.importance:g}" if row.importance != 1.0 else ""
    return f"{text[0].upper()}{text[1:]}; {sure}{many}{weight}."
