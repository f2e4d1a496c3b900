"""What changed since another audit, and how often people confirmed a verdict."""

from __future__ import annotations

from collections import Counter
from datetime import datetime
from typing import TYPE_CHECKING, Any

from stiction.diagnosis.verdict.history import Change
from stiction.diagnosis.verdict.over_time import describe_change
from stiction.display.finding_words import finding_level
from stiction.fleet.rank import FAULT_STATES

if TYPE_CHECKING:
    from stiction.fleet.audit_result import Audit
    from stiction.fleet.loop_row import LoopRow

__all__ = ["compare_audits", "confirmed_share", "has_finding"]

CHANGES = ("new", "worse", "same", "better", "gone")
CONFIRMED, REFUTED = ("stiction", "repaired"), ("not stiction",)


def compare_audits(
    audit: Audit, other: Audit, *, min_change: float = 0.05, relative_change: float = 0.2
) -> list[dict[str, Any]]:
    """Compare the findings of two audits, loop by loop.

    Parameters
    ----------
    audit, other : Audit
        The later and the earlier audit.
    min_change : float
        Change of the priority that counts, at least [-].
    relative_change : float
        Change of the priority that counts, over the larger of the two [-].

    Returns
    -------
    list of dict
        Each loop with a finding in one of the two: `tag`, `change` ("new", "worse", "same", "better" or "gone"), `why`,
        and `finding_text`, `verdict`, `priority`, `S`, `S_low`, `S_high` of both (`verdict_before`, ...); "new" first.

    Notes
    -----
    A finding is a fault of the loop itself: a sticky valve, another cause in the loop, or a loop state that is a fault.
    "worse" and "better" mean
    that the priority changed by more than the two limits, or that the intervals of S are apart. S and priority are
    those of all windows since the last change of the valve; `why` names the changes found since the earlier audit.

    Examples
    --------
    >>> from pathlib import Path
    >>> from stiction.fleet.audit_result import Audit
    >>> empty = Audit(Path("a"), [], [], {}, {})
    >>> compare_audits(empty, empty)
    []
    """
    now, before = ({row.tag: row for row in one.rows} for one in (audit, other))
    rows = []
    for tag in dict.fromkeys([*now, *before]):
        new, old = now.get(tag), before.get(tag)
        change, why = _change(new, old, min_change, relative_change)
        why = " ".join(filter(None, [why, *_changes_since(new, old)]))
        if change:
            row: dict[str, Any] = {"tag": tag, "change": change, "why": why}
            for name in ("finding_text", "verdict", "priority"):
                row |= {name: new and new[name], f"{name}_before": old and old[name]}
            for name in ("S", "S_low", "S_high"):
                row |= {name: _size(new, name), f"{name}_before": _size(old, name)}
            rows.append(row)
    return sorted(rows, key=lambda row: (CHANGES.index(row["change"]), -(row["priority"] or 0.0), row["tag"]))


def has_finding(row: LoopRow | None) -> bool:
    """Whether a row says that something is wrong with the loop itself: its valve, tuning, sensor or state."""
    if row is None or row.follows:
        return False
    is_faulty = row.verdict == "stiction" or finding_level(row.finding) == "alert"
    return row.loop_state in FAULT_STATES or (row.in_control and is_faulty)


def confirmed_share(audit: Audit) -> dict[str, Any]:
    """Count how many verdicts "stiction" people confirmed.

    Returns
    -------
    dict
        `confirmed` (labels "stiction" and "repaired"), `refuted` ("not stiction"), and `precision`, the share of the
        confirmed ones [-]; None when there is no label yet.
    """
    sticky = {row.tag for row in audit.rows if row.verdict == "stiction"}
    counts = Counter(label.label for tag, label in audit.labels().items() if tag in sticky)
    confirmed, refuted = sum(counts[name] for name in CONFIRMED), sum(counts[name] for name in REFUTED)
    total = confirmed + refuted
    return {"confirmed": confirmed, "refuted": refuted, "precision": confirmed / total if total else None}


def _size(row: LoopRow | None, name: str) -> float | None:
    """S or an end of its interval; None where neither stiction nor play is found."""
    return row[name] if row is not None and row.text("S") else None


def _changes_since(new: LoopRow | None, old: LoopRow | None) -> list[str]:
    """What happened to the valve since the earlier audit, in sentences."""
    if new is None or old is None:
        return []
    known = {(one["kind"], one["time"]) for one in old.history}
    fresh = [one for one in new.history if one["time"] and (one["kind"], one["time"]) not in known]
    return [describe_change(Change(**{**one, "time": datetime.fromisoformat(one["time"])})) for one in fresh]


def _change(new: LoopRow | None, old: LoopRow | None, min_change: float, relative_change: float) -> tuple[str, str]:
    if old is None or not has_finding(old):
        why = "No finding before." if old else "The loop was not in the earlier audit."
        return ("new", why) if has_finding(new) else ("", "")
    if new is None or not has_finding(new):
        return "gone", "The loop has no finding now." if new else "The loop is not in this audit."
    for one, two, change in ((new, old, "worse"), (old, new, "better")):
        low, high = _size(one, "S_low"), _size(two, "S_high")
        if low is not None and high is not None and low > high:
            texts = [row.text("S") + (" %" if row.op_unit == "% of span" else "") for row in (old, new)]
            return change, f"S was {texts[0]}, and is {texts[1]}; the intervals do not overlap."
    difference = new.priority - old.priority
    if abs(difference) > max(min_change, relative_change * max(new.priority, old.priority)):
        text = f"The priority was {old.text('priority')}, and is {new.text('priority')}."
        return ("worse" if difference > 0.0 else "better"), text
    return "same", ""
