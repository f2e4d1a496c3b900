"""When alarms are raised and cleared: counted over windows, with hysteresis, once while they are open."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from stiction.watch.alarm import KINDS, Alarm, alarm_id, read_alarms, write_alarm

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.fleet import LoopRow
    from stiction.watch.configuration import AlarmSettings, WatchConfig
    from stiction.watch.store import WatchStore

__all__ = ["add_message", "is_present", "update_alarms"]

DAY_S = 86_400.0


@dataclass
class _Condition:
    """Consecutive windows with and without a finding of a loop."""

    present: int = 0
    absent: int = 0


def is_present(row: LoopRow, kind: str, settings: AlarmSettings, *, is_open: bool) -> bool | None:
    """Whether a row speaks for an alarm of a kind; None where it says nothing, so that the counts stay.

    The valve is judged by the probability, with one limit to raise and a lower one to clear.
    """
    if not row.in_control and not (kind == "valve_not_responding" and row.finding == kind):
        return None
    if kind != "valve":
        return row.finding == kind
    if row.probability is None:
        return None
    if row.probability >= settings.raise_at and row.finding in settings.findings:
        return True
    if row.probability < settings.clear_at:
        return False
    return None if is_open else False


def update_alarms(store: WatchStore, config: WatchConfig, rows: Sequence[LoopRow], moment: float) -> None:
    """Raise and clear alarms by the rows of a window, worst first; inside a transaction of the store."""
    settings = config.alarms
    open_alarms = {(one.loop, one.kind): one for one in read_alarms(store, only_open=True)}
    stored = store.query("SELECT loop, kind, body FROM condition")
    conditions = {(one["loop"], one["kind"]): _Condition(**json.loads(one["body"])) for one in stored}
    resting = set(store.fact("out of service", []))
    store.set_fact("loops", sorted({*store.fact("loops", []), *(row.tag for row in rows)}))
    new, kinds = 0, _kinds(settings)
    announced = store.query("SELECT body FROM alarm WHERE raised > ?", moment - DAY_S)
    sent = sum(json.loads(one["body"])["is_announced"] for one in announced)
    for row in rows:
        for kind in kinds:
            key = (row.tag, kind)
            alarm = open_alarms.get(key)
            present = is_present(row, kind, settings, is_open=alarm is not None)
            known = conditions.get(key, _Condition())
            if present is True:
                known = _Condition(present=known.present + 1)
            elif present is False:
                known = _Condition(absent=known.absent + 1)
            if known != conditions.get(key, _Condition()):
                store.change("INSERT OR REPLACE INTO condition VALUES (?, ?, ?)", *key, json.dumps(vars(known)))
            if alarm is None and present and known.present >= settings.raise_windows and row.tag not in resting:
                is_sent = sent + new < settings.max_per_day
                new += is_sent
                alarm = Alarm(id=alarm_id(*key, moment), loop=row.tag, kind=kind, raised=moment, is_announced=is_sent)
                alarm = replace(alarm.with_row(row), raised_S=row.S_high)
                write_alarm(store, alarm)
                if is_sent:
                    add_message(store, config, alarm.message("raised", settings.link))
            elif alarm is not None:
                is_over = present is False and known.absent >= settings.clear_windows
                alarm = replace(alarm if present is None else alarm.with_row(row), cleared=moment if is_over else None)
                write_alarm(store, alarm)
                if is_over and alarm.is_announced and alarm.shelved_until < moment:
                    add_message(store, config, alarm.message("cleared", settings.link))


def _kinds(settings: AlarmSettings) -> list[str]:
    """Kinds of alarms that are asked for; the grades of stiction are one kind."""
    sticky = any(one in settings.findings for one in ("sticks", "probably_sticks"))
    return [kind for kind in KINDS if kind in settings.findings or (kind == "valve" and sticky)]


def add_message(store: WatchStore, config: WatchConfig, body: dict[str, Any]) -> None:
    """Put a message in the queue of each channel that takes it, once."""
    what = "digest" if body["event"] == "digest" else "alarms"
    ident = f"{body['id']} {body['event']}"
    for number, channel in enumerate(config.channel):
        if channel.what in (what, "all"):
            store.change(
                "INSERT OR IGNORE INTO message (channel, ident, body, due) VALUES (?, ?, ?, 0)",
                f"{number} {channel.name}", ident, json.dumps(body),
            )  # fmt: skip
