"""An alarm in the manner of ISA-18.2: what stands, since when, and who has seen it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from hashlib import sha256
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stiction.fleet import LoopRow
    from stiction.watch.store import WatchStore

__all__ = ["KINDS", "Alarm", "alarm_id", "read_alarms", "write_alarm"]

KINDS = {
    "valve": "Valve sticks",
    "backlash": "Valve has play",
    "valve_not_responding": "Valve does not follow",
    "tuning": "Tuning makes the loop oscillate",
    "sensor": "Measurement is in doubt",
}
"""Kind of an alarm -> its title."""
PRIORITIES = ((0.5, "high"), (0.2, "medium"), (0.0, "low"))
"""Least priority of the loop [-] -> priority of the alarm."""


@dataclass(frozen=True, kw_only=True)
class Alarm:
    """One alarm, from its raising to its end."""

    id: str
    """Identifier, the same in all messages."""
    loop: str
    """Tag of the loop."""
    kind: str
    """Key of `KINDS`."""
    raised: float
    """End of the window that raised it [s since 1970]."""
    area: str = ""
    """Area of the plant."""
    priority: str = "low"
    """high, medium or low."""
    probability: float | None = None
    """Probability of stiction in the newest window [-]."""
    S: float | None = None
    """Deadband plus stickband in the newest window [`op_unit`]."""
    raised_S: float | None = None
    """S when it was raised, upper end of its interval [`op_unit`]."""
    op_unit: str = "% of span"
    """Unit of S."""
    reason: str = ""
    """Why, in some sentences."""
    next_step: str = ""
    """What to do next."""
    cleared: float | None = None
    """End of the window that cleared it [s since 1970]; None while it is open."""
    acknowledged: float | None = None
    """When somebody acknowledged it [s since 1970]."""
    acknowledged_by: str = ""
    """Who did."""
    shelved_until: float = 0.0
    """Time until which it is not announced [s since 1970]."""
    out_of_service: bool = False
    """Whether it was taken out of service."""
    is_announced: bool = False
    """Whether it was sent at once; else it is in the digest."""

    @property
    def title(self) -> str:
        """Title for people."""
        return f"{self.loop}: {KINDS[self.kind]}"

    @property
    def state(self) -> str:
        """State by ISA-18.2: unacknowledged, acknowledged, returned (cleared, not seen), normal, shelved, ..."""
        if self.out_of_service:
            return "out of service"
        if self.cleared is not None:
            return "returned" if self.acknowledged is None else "normal"
        if self.shelved_until > datetime.now(UTC).timestamp():
            return "shelved"
        return "unacknowledged" if self.acknowledged is None else "acknowledged"

    @property
    def is_worse(self) -> bool:
        """Whether S has grown beyond the interval that it had when the alarm was raised."""
        return self.S is not None and self.raised_S is not None and self.raised_S < self.S

    def with_row(self, row: LoopRow) -> Alarm:
        """Take over what a row of the newest window says."""
        priority = next(name for least, name in PRIORITIES if row.priority >= least)
        about = {"area": row.area, "priority": priority, "probability": row.probability, "S": row.S}
        about |= {"op_unit": row.op_unit, "reason": row.reason, "next_step": row.next_step or row.action}
        return replace(self, **about)

    def message(self, event: str, link: str = "") -> dict[str, Any]:
        """What channels send: a JSON object with a ready text."""
        moment = self.raised if self.cleared is None else self.cleared
        head = self.title if event == "raised" else f"{self.loop}: cleared ({KINDS[self.kind]})"
        address = link.replace("{tag}", self.loop)
        lines = [head, self.reason, f"Next step: {self.next_step}" if self.next_step else "", address]
        return {
            "id": self.id, "event": event, "loop": self.loop, "area": self.area, "kind": self.kind, "title": head,
            "priority": self.priority, "probability": self.probability, "S": self.S, "op_unit": self.op_unit,
            "reason": self.reason, "next_step": self.next_step, "link": address,
            "time": datetime.fromtimestamp(moment, UTC).isoformat(), "text": "\n".join(filter(None, lines)),
        }  # fmt: skip


def alarm_id(loop: str, kind: str, raised: float) -> str:
    """Identifier of an alarm: the same however often its window is judged.

    Examples
    --------
    >>> alarm_id("FIC-101", "valve", 0.0) == alarm_id("FIC-101", "valve", 0.0)
    True
    """
    return sha256(f"{loop}|{kind}|{raised:.0f}".encode()).hexdigest()[:12]


def read_alarms(store: WatchStore, *, only_open: bool = False) -> list[Alarm]:
    """All alarms, the newest first."""
    where = "WHERE open = 1" if only_open else ""
    rows = store.query(f"SELECT body FROM alarm {where} ORDER BY raised DESC, id")
    return [Alarm(**json.loads(row["body"])) for row in rows]


def write_alarm(store: WatchStore, alarm: Alarm) -> None:
    """Keep an alarm; one with its identifier is replaced."""
    store.change(
        "INSERT OR REPLACE INTO alarm (id, loop, kind, open, raised, body) VALUES (?, ?, ?, ?, ?, ?)",
        alarm.id, alarm.loop, alarm.kind, int(alarm.cleared is None), alarm.raised, json.dumps(asdict(alarm)),
    )  # fmt: skip
