"""Alarms: raised after some windows, cleared with hysteresis, once while open, not too many a day, kept with notes."""

from __future__ import annotations

import time

import pytest

from stiction.errors import ParameterError
from stiction.fleet import LoopRow
from stiction.watch.alarm import read_alarms
from stiction.watch.alarm_actions import act_on_alarm, read_notes
from stiction.watch.alarm_rules import update_alarms
from stiction.watch.configuration import AlarmSettings, ChannelSettings, SourceSettings, WatchConfig
from stiction.watch.digest import make_digest
from stiction.watch.store import WatchStore

DAY = 86_400.0


@pytest.fixture
def store(tmp_path):
    one = WatchStore(tmp_path)
    yield one
    one.close()


def config(**alarms):
    hook = ChannelSettings(kind="webhook", url="http://127.0.0.1:9/")
    return WatchConfig(source=(SourceSettings(address="data"),), alarms=AlarmSettings(**alarms), channel=(hook,))


def row(probability, tag="FIC-101", finding=None, **about):
    known = {"status": "diagnosed", "loop_state": "in_control", "priority": 0.3, "S": 4.0, "S_high": 5.0}
    name = finding or ("sticks" if probability >= 0.9 else "probably_sticks" if probability >= 0.5 else "nothing_found")
    return LoopRow(tag=tag, probability=probability, finding=name, **known | about)


def run(store, settings, windows, begin=0.0, **about):
    """Judge windows of four hours, and give the number of open alarms after each."""
    counts = []
    for k, probability in enumerate(windows):
        rows = [] if probability is None else [row(probability, **about)]
        with store.transaction():
            update_alarms(store, settings, rows, begin + (k + 1) * DAY / 6.0)
        counts.append(len(read_alarms(store, only_open=True)))
    return counts


def messages(store):
    return [one["ident"].split()[1] for one in store.query("SELECT ident FROM message ORDER BY id")]


def test_an_alarm_is_raised_once_and_cleared_after_windows_below_the_lower_limit(store):
    settings = config(raise_at=0.8, clear_at=0.4, raise_windows=2, clear_windows=2)
    windows = [0.95, 0.3, 0.9, 0.85, 0.99, 0.6, 0.3, 0.6, 0.3, 0.2, 0.1]
    assert run(store, settings, windows) == [0, 0, 0, 1, 1, 1, 1, 1, 0, 0, 0]
    assert messages(store) == ["raised", "cleared"]
    [alarm] = read_alarms(store)
    assert (alarm.raised, alarm.cleared, alarm.state) == (4 * DAY / 6, 9 * DAY / 6, "returned")


def test_windows_that_say_nothing_change_no_count(store):
    settings = config(raise_windows=2)
    with store.transaction():
        update_alarms(store, settings, [row(0.95)], 1.0)
        update_alarms(store, settings, [row(0.25, status="skipped", loop_state="manual")], 2.0)
        update_alarms(store, settings, [], 3.0)
        update_alarms(store, settings, [row(0.95)], 4.0)
    assert len(read_alarms(store, only_open=True)) == 1


def test_a_window_judged_twice_gives_the_same_alarm_and_one_message(store, tmp_path):
    settings = config(raise_windows=1)
    run(store, settings, [0.95])
    [first] = read_alarms(store)
    for table in ("alarm", "condition"):
        store.change(f"DELETE FROM {table}")
    run(store, settings, [0.95])
    assert [one.id for one in read_alarms(store)] == [first.id]
    assert messages(store) == ["raised"]


def test_another_finding_is_an_alarm_of_its_own(store):
    settings = config(raise_windows=1, clear_windows=1)
    run(store, settings, [0.1], finding="tuning")
    [alarm] = read_alarms(store)
    assert (alarm.kind, alarm.title) == ("tuning", "FIC-101: Tuning makes the loop oscillate")
    run(store, settings, [0.95], begin=DAY)
    assert {one.kind: one.cleared is None for one in read_alarms(store)} == {"tuning": False, "valve": True}


def test_only_so_many_are_sent_in_a_day_worst_first_and_the_others_are_in_the_digest(store):
    settings = config(raise_windows=1, max_per_day=3)
    rows = [row(0.95, tag=f"FIC-{k}") for k in range(5)]
    with store.transaction():
        update_alarms(store, settings, rows, 100.0)
    assert messages(store) == ["raised"] * 3
    assert [one.loop for one in read_alarms(store) if one.is_announced] != []
    assert {one.loop for one in read_alarms(store) if one.is_announced} == {"FIC-0", "FIC-1", "FIC-2"}
    assert len(make_digest(store, 0.0, 200.0)["new"]) == 5
    with store.transaction():
        update_alarms(store, settings, [row(0.95, tag="FIC-9")], 100.0 + 1.1 * DAY)
    assert messages(store) == ["raised"] * 4


def test_what_people_do_is_kept_with_name_and_time(store):
    settings = config(raise_windows=1, clear_windows=1)
    run(store, settings, [0.95])
    [alarm] = read_alarms(store)
    assert alarm.state == "unacknowledged"
    before = time.time()
    acknowledged = act_on_alarm(store, alarm.id, "acknowledge", who="Ana")
    assert acknowledged is not None
    assert acknowledged.state == "acknowledged"
    act_on_alarm(store, "FIC-101", "comment", who="Bo", text="Packing is new.")
    shelved = act_on_alarm(store, alarm.id, "shelve", who="Ana", until=time.time() + DAY)
    assert shelved is not None
    assert shelved.state == "shelved"
    notes = read_notes(store, alarm.id)
    assert [(one["who"], one["what"], one["text"]) for one in notes] == [
        ("Ana", "acknowledge", ""), ("Bo", "comment", "Packing is new."), ("Ana", "shelve", ""),
    ]  # fmt: skip
    assert all(before <= one["time"] <= time.time() for one in notes)
    run(store, settings, [0.1], begin=DAY)
    assert messages(store) == ["raised"]  # a shelved alarm is cleared without a message
    assert read_alarms(store)[0].acknowledged_by == "Ana"


def test_a_loop_out_of_service_raises_nothing_until_it_is_back(store):
    settings = config(raise_windows=1, clear_windows=1)
    run(store, settings, [0.95])
    act_on_alarm(store, "FIC-101", "out_of_service", who="Ana")
    assert run(store, settings, [0.1, 0.95, 0.95], begin=DAY) == [0, 0, 0]
    act_on_alarm(store, "FIC-101", "in_service", who="Ana")
    assert run(store, settings, [0.95], begin=2 * DAY) == [1]


def test_a_loop_without_an_alarm_can_be_out_of_service(store):
    settings = config(raise_windows=1, clear_windows=1)
    run(store, settings, [0.1])
    assert act_on_alarm(store, "FIC-101", "out_of_service", who="Ana", text="valve is out") is None
    assert [one["what"] for one in read_notes(store, "FIC-101")] == ["out_of_service"]
    assert run(store, settings, [0.95], begin=DAY) == [0]
    act_on_alarm(store, "FIC-101", "in_service", who="Ana")
    assert run(store, settings, [0.95], begin=2 * DAY) == [1]
    with pytest.raises(ParameterError, match="there is no alarm 'FIC-999'"):
        act_on_alarm(store, "FIC-999", "out_of_service", who="Ana")


@pytest.mark.parametrize(
    ("ident", "action", "about", "message"),
    [
        ("none", "acknowledge", {"who": "Ana"}, "there is no alarm 'none'; give one of the alarms: "),
        ("FIC-101", "erase", {"who": "Ana"}, "action = 'erase' is unknown"),
        ("FIC-101", "acknowledge", {"who": " "}, "who is empty"),
        ("FIC-101", "shelve", {"who": "Ana", "until": 1.0}, "until is not in the future"),
        ("FIC-101", "comment", {"who": "Ana"}, "the comment is empty"),
    ],
)
def test_what_cannot_be_done_is_reported(store, ident, action, about, message):
    run(store, config(raise_windows=1), [0.95])
    with pytest.raises(ParameterError, match=message.replace("(", r"\(")):
        act_on_alarm(store, ident, action, **about)


def test_the_digest_has_new_worse_cleared_and_overdue_alarms(store):
    settings = config(raise_windows=1, clear_windows=1)
    with store.transaction():
        update_alarms(store, settings, [row(0.95, tag=f"FIC-{k}") for k in range(3)], 1 * DAY)
        update_alarms(store, settings, [row(0.95, tag="FIC-0", S=7.0, S_high=8.0), row(0.1, tag="FIC-1")], 9 * DAY)
        update_alarms(store, settings, [row(0.95, tag="FIC-4")], 9.5 * DAY)
    found = make_digest(store, 8.5 * DAY, 10 * DAY)
    assert {name: sorted(one.loop for one in alarms) for name, alarms in found.items()} == {
        "new": ["FIC-4"], "worse": ["FIC-0"], "cleared": ["FIC-1"], "overdue": ["FIC-0", "FIC-2"],
    }  # fmt: skip
