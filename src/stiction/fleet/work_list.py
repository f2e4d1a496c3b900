"""The work list of an audit: what to repair, retune, test and look at, with the state that people gave each item."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any, Literal

from stiction.display.json_form import Result
from stiction.display.number_format import format_number
from stiction.fleet.labels import newest_labels, read_labels

if TYPE_CHECKING:
    from collections.abc import Iterable

    from stiction.fleet.audit_result import Audit
    from stiction.fleet.labels import Label
    from stiction.fleet.loop_row import LoopRow

__all__ = ["KINDS", "STATES", "WorkItem", "work_list"]

WorkKind = Literal["repair", "retune", "test", "instrument"]
KINDS: dict[WorkKind, tuple[str, str]] = {
    "repair": ("Repair at the next shutdown", "valve shop"),
    "retune": ("Retune this week", "control engineer"),
    "test": ("Test to decide an open case", "operator and control engineer"),
    "instrument": ("Look at transmitter, selector or data", "instrument technician"),
}
"""Kind of work -> its heading and its crew."""
KIND_OF_FINDING: dict[str, WorkKind] = {
    "sticks": "repair", "probably_sticks": "test", "backlash": "repair", "valve_not_responding": "repair",
    "dead_zone": "repair", "tuning": "retune", "rate_limit": "retune", "sensor": "instrument",
    "not_in_command": "instrument", "no_data": "instrument", "cause_unknown": "test", "cannot_tell": "test",
}  # fmt: skip
"""Finding -> kind of work; the others need none in this loop."""
WorkState = Literal["open", "planned", "done", "rejected"]
STATES: tuple[WorkState, ...] = ("open", "planned", "done", "rejected")
"""States of an item."""
STATE_OF_LABEL: dict[str, WorkState] = {
    "planned": "planned", "done": "done", "repaired": "done", "rejected": "rejected", "not stiction": "rejected",
}  # fmt: skip
"""Label of a note -> state; others leave the item open."""


@dataclass(frozen=True, slots=True)
class WorkItem(Result):
    """One item of the work list."""

    tag: str
    """Tag of the loop."""
    area: str
    """Area of the plant."""
    kind: WorkKind
    """`repair`, `retune`, `test` or `instrument`."""
    crew: str
    """Who does it."""
    finding_text: str
    """The finding in words."""
    task: str
    """What to do."""
    check: str
    """Test that confirms the finding before, empty where the task is the test."""
    test: str
    """Time in manual and size of the test that it needs, as text; empty where it needs none."""
    why: str
    """Why it has its place: cost, certainty, loops that follow."""
    S: str
    """Deadband plus stickband with its unit, as text; empty where it is not known."""
    priority: float
    """Priority, as in the rows of the audit [-]."""
    follow: tuple[str, ...]
    """Tags of loops to look at again afterwards."""
    state: WorkState = "open"
    """`open`, `planned`, `done` or `rejected`."""
    note: str = ""
    """The newest note of a person, with its day and author."""
    result: str = ""
    """What the work changed, where it is done and the loop was audited before and after."""

    @property
    def state_text(self) -> str:
        """State, day, author and note, and what the work changed."""
        return ". ".join(text.rstrip(".") for text in (self.note or self.state, self.result) if text)


def work_list(audit: Audit, earlier: Audit | None = None) -> tuple[WorkItem, ...]:
    """Make the work list of an audit.

    Parameters
    ----------
    audit : Audit
        The audit.
    earlier : Audit, optional
        An earlier audit in another folder: its notes count too, and its rows are those from before the work.

    Returns
    -------
    tuple of WorkItem
        The items, by kind of work in the order of `KINDS`, then by area, the highest priority first. A loop that
        follows another, and one where nothing is found, has no item, but for one whose work is planned or done. A loop
        that does not oscillate and of which the record cannot tell whether its valve sticks has none either: its test
        can wait.

    Examples
    --------
    >>> from pathlib import Path
    >>> import stiction as st
    >>> st.work_list(st.Audit(Path("plant"), [], [], {}, {}))
    ()
    """
    labels = newest_labels(sorted((one for each in (earlier, audit) if each for one in read_labels(each.folder)),
                                  key=lambda one: one.time))  # fmt: skip
    follow: dict[str, list[str]] = {}
    for row in audit.rows:
        if row.follows:
            follow.setdefault(row.follows, []).append(row.tag)
    items = []
    for row in audit.rows:
        label = labels.get(row.tag)
        state = STATE_OF_LABEL.get(label.label, "open") if label else "open"
        kind = _kind_of(row)
        if kind is None and state in ("planned", "done"):
            kind = "repair"
        if kind is not None:
            result = _result(audit, earlier, row, label) if label and state == "done" else ""
            items.append(_make_item(row, kind, follow.get(row.tag, ()), state, label, result))
    order = list(KINDS)
    return tuple(sorted(items, key=lambda one: (order.index(one.kind), one.area, -one.priority, one.tag)))


def _kind_of(row: LoopRow) -> WorkKind | None:
    """Kind of work of a row; None where there is none."""
    if row.failed:
        return "instrument"
    if row.status == "screened" or row.finding is None or row.waits:
        return None
    if row.next_step.startswith("Put ") and "is the source" in row.next_step:
        return "test"
    kind = KIND_OF_FINDING.get(row.finding)
    return "test" if kind == "retune" and row.next_step.startswith("Put ") else kind


def _make_item(
    row: LoopRow, kind: WorkKind, follow: Iterable[str], state: WorkState, label: Label | None, result: str
) -> WorkItem:
    task, check = (row.action, row.next_step) if kind in ("repair", "retune") else (row.next_step or row.action, "")
    S = row.text("S")
    return WorkItem(
        tag=row.tag,
        area=row.area,
        kind=kind,
        crew=KINDS[kind][1],
        finding_text=row.finding_text or row.reason,
        task=task or row.reason,
        check="" if check == task else check,
        test=row.test,
        why=row.priority_reason,
        S=f"{S} %" if S and row.op_unit == "% of span" else S,
        priority=row.priority,
        follow=tuple(follow),
        state=state,
        note=_note(label) if label else "",
        result=result,
    )


def _day(time: str) -> str:
    moment = datetime.fromisoformat(time.rstrip("+"))
    return f"{moment.astimezone() if moment.tzinfo else moment:%Y-%m-%d}"


def _note(label: Label) -> str:
    words = STATE_OF_LABEL.get(label.label, label.label)
    text = f"{words} {_day(label.time)}" + (f", {label.author}" if label.author else "")
    return f"{text}: {label.note}" if label.note else text


def _result(audit: Audit, earlier: Audit | None, row: LoopRow, label: Label) -> str:
    """What the work changed: S before, and after or the smallest S that would have shown."""
    rows: list[dict[str, Any]] = []
    for each in (earlier, audit):
        if each is not None and any(one.tag == row.tag for one in each.rows):
            rows += each.history(row.tag)
    done = label.time.rstrip("+")
    before = [one for one in rows if one["end"] and _moment(one["end"]) <= _moment(done)]
    after = [one for one in rows if one["end"] and _moment(one["end"]) > _moment(done)]
    if not before or not after:
        return "The records of this audit are from before it." if not after else ""
    old, new = before[-1], after[-1]
    if old["S"] is None:
        return f"Before: {old['finding_text']}; now: {new['finding_text']}."
    was = format_number(old["S"], "%", 2)
    if new["S"] is not None:
        return f"S {was} to {format_number(new['S'], '%', 2)}."
    if new["verdict"] == "no_stiction" and new["S_detectable"] is not None:
        return f"S {was} to below {format_number(new['S_detectable'], '%', 2)}."
    return f"S was {was}; now: {new['finding_text']}."


def _moment(text: str) -> float:
    """Seconds of a time; one without a zone is local."""
    return datetime.fromisoformat(text).timestamp()
