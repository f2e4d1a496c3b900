"""The order in which loops deserve attention."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.fleet.loop_metrics import compute_priority

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["rank_row", "rank_rows", "screen_order"]

FAULT_STATES = ("not_in_command", "valve_not_responding", "pv_frozen", "signals_swapped", "signals_unrelated")
"""Loop states that somebody should look into: full confidence."""
CHOSEN_STATES = ("manual", "saturated", "shut_in", "bad_data")
"""Loop states that may be somebody's choice, or a lack of data: half the confidence."""


def rank_row(row: dict[str, Any]) -> dict[str, Any]:
    """Add confidence and priority to a row.

    Notes
    -----
    Confidence is the probability of the main finding: of stiction, or of a cause of the oscillation, whichever is
    larger; 1 in a state that is a fault, 0.5 in a state that may be somebody's choice, and 0.5 before the diagnosis of
    a loop that oscillates (0.25 of one that does not). Priority is severity times confidence times importance
    (`compute_priority`). A loop without any finding has the confidence of its most probable one.

    Examples
    --------
    >>> row = {"status": "diagnosed", "loop_state": "in_control", "probability": 0.9, "severity": 0.5,
    ...        "importance": 2.0, "oscillation_causes": {"valve": 0.9}, "oscillating": True}
    >>> rank_row(row)["priority"]
    0.9
    """
    state = row["loop_state"]
    if state in FAULT_STATES:
        confidence = 1.0
    elif state in CHOSEN_STATES:
        confidence = 0.5
    elif row["status"] == "diagnosed":
        confidence = max([row["probability"], *(row["oscillation_causes"] or {}).values()])
    else:
        confidence = 0.5 if row["oscillating"] else 0.25
    severity, importance = row["severity"] or 0.0, row["importance"]
    return row | {"confidence": confidence, "priority": compute_priority(severity, confidence, importance)}


def rank_rows(rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Sort rows by priority, the highest first; loops without a result come last."""
    failed = ("error", "crashed", "timeout")
    return sorted(rows, key=lambda row: (row["status"] in failed, -row["priority"], row["tag"]))


def screen_order(row: dict[str, Any]) -> tuple[float, str]:
    """Key that sorts screened loops by their expected priority, the highest first."""
    return -row["priority"], row["tag"]
