"""What people do with alarms: acknowledge, shelve, take out of service, comment. Each is a note with name and time."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError
from stiction.watch.alarm import Alarm, read_alarms, write_alarm

if TYPE_CHECKING:
    from stiction.watch.store import WatchStore

__all__ = ["ACTIONS", "act_on_alarm", "read_notes"]

ACTIONS = ("acknowledge", "shelve", "unshelve", "out_of_service", "in_service", "comment")
"""What can be done with an alarm."""


def act_on_alarm(
    store: WatchStore, ident: str, action: str, *, who: str, text: str = "", until: float | None = None
) -> Alarm | None:
    """Do something with an alarm, and note who did it.

    Parameters
    ----------
    store : WatchStore
        The watch.
    ident : str
        Identifier of the alarm, or the tag of a loop with one open alarm. A loop of the watch can be taken out of
        service, and back, without an alarm too.
    action : str
        One of `ACTIONS`.
    who : str
        Name of the person.
    text : str
        Comment.
    until : float, optional
        End of the shelving [s since 1970].

    Returns
    -------
    Alarm or None
        The alarm as it is now; None of a loop without one.

    Raises
    ------
    ParameterError
        When there is no such alarm or action, or something is missing.
    """
    if action not in ACTIONS:
        raise ParameterError(f"action = {action!r} is unknown; give one of {', '.join(ACTIONS)}.")
    if not who.strip():
        raise ParameterError("who is empty; give the name of the person.")
    if action == "comment" and not text.strip():
        raise ParameterError("the comment is empty; write one.")
    if action == "shelve" and (until is None or until <= time.time()):
        raise ParameterError("until is not in the future; give the date until which the alarm is shelved.")
    with store.transaction():
        now, rests = time.time(), action in ("out_of_service", "in_service")
        is_quiet = rests and ident in store.fact("loops", []) and not _alarms_of(store, ident)
        alarm = None if is_quiet else _find(store, ident)
        changes: dict[str, dict[str, Any]] = {
            "acknowledge": {"acknowledged": now, "acknowledged_by": who},
            "shelve": {"shelved_until": until},
            "unshelve": {"shelved_until": 0.0},
            "out_of_service": {"out_of_service": True},
            "in_service": {"out_of_service": False},
        }
        if alarm:
            alarm = replace(alarm, **changes.get(action, {}))
            write_alarm(store, alarm)
        if rests:
            loop = alarm.loop if alarm else ident
            others = set(store.fact("out of service", [])) - {loop}
            store.set_fact("out of service", sorted(others | ({loop} if action == "out_of_service" else set())))
        row = (alarm.id if alarm else ident, now, who, action, text)
        store.change("INSERT INTO note (alarm, time, who, what, text) VALUES (?, ?, ?, ?, ?)", *row)
    return alarm


def read_notes(store: WatchStore, ident: str) -> list[dict[str, Any]]:
    """Notes on an alarm, the earliest first: time [s since 1970], who, what, text."""
    return store.query("SELECT time, who, what, text FROM note WHERE alarm = ? ORDER BY id", ident)


def _alarms_of(store: WatchStore, loop: str) -> list[Alarm]:
    """Alarms of a loop that are open or out of service."""
    return [one for one in read_alarms(store) if one.loop == loop and (one.cleared is None or one.out_of_service)]


def _find(store: WatchStore, ident: str) -> Alarm:
    alarms = read_alarms(store)
    chosen = [one for one in alarms if one.id == ident] or _alarms_of(store, ident)
    if len(chosen) == 1:
        return chosen[0]
    if chosen:
        listed = ", ".join(f"{one.id} ({one.kind})" for one in chosen)
        raise ParameterError(f"{ident} has {len(chosen)} alarms; give the identifier of one: {listed}.")
    known = ", ".join(f"{one.id} ({one.loop})" for one in alarms[:5]) or "there is none"
    raise ParameterError(f"there is no alarm {ident!r}; give one of the alarms: {known}.")
