"""The digest: what is new, worse, repaired and confirmed, overdue."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any

from stiction.watch.alarm import read_alarms
from stiction.watch.alarm_rules import add_message

if TYPE_CHECKING:
    from stiction.watch.alarm import Alarm
    from stiction.watch.configuration import WatchConfig
    from stiction.watch.store import WatchStore

__all__ = ["add_due_digest", "make_digest"]

OVERDUE_S = 7 * 86_400.0
"""Time after which an alarm that nobody has acknowledged is overdue [s]."""
SECTIONS = {"new": "New", "worse": "Worse", "cleared": "Repaired and confirmed, or cleared", "overdue": "Overdue"}


def make_digest(store: WatchStore, since: float, until: float) -> dict[str, list[Alarm]]:
    """Alarms of each section: raised, grown worse or cleared in a time [s since 1970], or not seen for a week."""
    alarms = [one for one in read_alarms(store) if not one.out_of_service]
    still_open = [one for one in alarms if one.cleared is None]
    return {
        "new": [one for one in alarms if since < one.raised <= until],
        "worse": [one for one in still_open if one.is_worse and one.raised <= since],
        "cleared": [one for one in alarms if one.cleared is not None and since < one.cleared <= until],
        "overdue": [
            one for one in still_open
            if one.acknowledged is None and one.raised < until - OVERDUE_S and one.shelved_until < until
        ],
    }  # fmt: skip


def add_due_digest(store: WatchStore, config: WatchConfig, now: datetime) -> bool:
    """Put the digest in the queue when it is due by the clock of this machine; whether it was."""
    settings = config.alarms
    if settings.digest == "never":
        return False
    due = now.replace(hour=settings.digest_hour, minute=0, second=0, microsecond=0)
    if due > now:
        due -= timedelta(days=1)
    if settings.digest == "weekly":
        due -= timedelta(days=due.weekday())
    last = store.fact("digest", 0.0)
    if due.timestamp() <= last:
        return False
    begin = last or due.timestamp() - (7 if settings.digest == "weekly" else 1) * 86_400.0
    with store.transaction():
        found = make_digest(store, begin, due.timestamp())
        if any(found.values()):
            add_message(store, config, _message(found, due, settings.link))
        store.set_fact("digest", due.timestamp())
    return True


def _message(found: dict[str, list[Alarm]], due: datetime, link: str) -> dict[str, Any]:
    lines = []
    for name, title in SECTIONS.items():
        if found[name]:
            lines += [f"{title}:", *(f"- {one.title}. {one.reason} {_step(one)}".rstrip() for one in found[name]), ""]
    counts = ", ".join(f"{len(alarms)} {name}" for name, alarms in found.items() if alarms)
    return {
        "id": f"digest-{due:%Y%m%d}", "event": "digest", "title": f"Control valves: {counts}",
        "time": due.astimezone().isoformat(), "text": "\n".join(lines).strip(),
        "alarms": {name: [one.message(name, link) for one in alarms] for name, alarms in found.items()},
    }  # fmt: skip


def _step(alarm: Alarm) -> str:
    return f"Next step: {alarm.next_step}" if alarm.next_step and alarm.cleared is None else ""
