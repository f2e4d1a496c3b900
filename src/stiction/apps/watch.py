"""``stiction watch``: a plant under watch, with alarms."""

import asyncio
import getpass
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from stiction.apps.options import JsonOption
from stiction.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from stiction.watch.store import WatchStore

__all__ = ["watch"]

Alarms = Group("Alarms", sort_key=2)


@Parameter(name="*", group=Alarms)
@dataclass(frozen=True)
class AlarmOptions:
    """What to do with alarms; each takes the identifier of an alarm, or the tag of a loop with one alarm.

    Parameters
    ----------
    alarms
        List the alarms.
    acknowledge
        Say that somebody has seen the alarm.
    shelve
        Announce the alarm no more until --until.
    out_of_service
        Raise no alarms of this loop, with or without an alarm now, until --in-service.
    in_service
        Raise alarms of this loop again.
    until
        End of the shelving, such as 2026-03-02.
    comment
        Text that is kept with the alarm; with no other option it is a comment of its own on --alarm.
    alarm
        Alarm of --comment.
    by
        Name of the person; the name of the user when not given.
    """

    alarms: Annotated[bool, Parameter(negative="")] = False
    acknowledge: str | None = None
    shelve: str | None = None
    out_of_service: str | None = None
    in_service: str | None = None
    until: str | None = None
    comment: str | None = None
    alarm: str | None = None
    by: str | None = None


def watch(
    file: str | None = None,
    *,
    init: str | None = None,
    tags: Annotated[tuple[str, ...], Parameter(negative="")] = (),
    map: str | None = None,  # noqa: A002 (--map)
    trust: str | None = None,
    check: Annotated[bool, Parameter(negative="")] = False,
    once: Annotated[bool, Parameter(negative="")] = False,
    as_json: JsonOption = False,
    alarm: AlarmOptions = AlarmOptions(),
) -> int:
    """Watch a plant: collect from its historians, judge each window, raise and clear alarms.

    Runs until SIGTERM or Ctrl-C; SIGHUP reads the configuration again. Exit code 3 when a source, a channel or the
    folder cannot be used.

    Parameters
    ----------
    file
        Configuration of the watch, such as plant.toml.
    init
        Print a configuration for this source: URL of an OPC UA server, PI Web API or database, or a folder.
    tags
        With --init: only tags that match this pattern, such as "FIC*". May be repeated.
    map
        With --init: mapping file that settles loop, role and unit of tags.
    trust
        Accept the certificate of this OPC UA server from now on, and show its fingerprint.
    check
        Try every source and channel, say what works, and end.
    once
        Do one round and end: read what is new, judge the windows that ended, send what is due.
    as_json
        Print alarms or the check as JSON.
    """
    if trust is not None:
        return _trust(trust)
    if init is not None:
        from stiction.watch.draft import draft_configuration

        print(draft_configuration(init, tags, map or ""), end="")
        return 0
    if file is None:
        raise ParameterError("no configuration was given; write one with stiction watch --init SOURCE > plant.toml.")
    if check:
        return _check(Path(file), as_json=as_json)
    chosen = _chosen_action(alarm)
    if chosen or alarm.alarms:
        return _alarms(Path(file), chosen, alarm, as_json=as_json)
    from stiction.apps.output import print_err
    from stiction.watch.service import Watch

    one = Watch(Path(file).absolute(), report=print_err)
    return 3 if asyncio.run(one.run_once() if once else one.run()) is False else 0


def _trust(url: str) -> int:
    from stiction.apps.output import print_out
    from stiction.sources.historians.address import parse_address
    from stiction.sources.historians.opc_ua_connection import trust_server
    from stiction.sources.historians.run_async import run_async

    if not url.lower().startswith("opc.tcp://"):
        raise ParameterError(f"--trust {url} is not the address of an OPC UA server; give opc.tcp://HOST:4840.")
    found = run_async(trust_server(parse_address(url)))
    if found is None:
        print_out("The server offers no encryption, so it has no certificate to accept.")
    else:
        print_out(f"The certificate with this SHA-256 fingerprint is accepted from now on:\n{found}")
        print_out("Compare it with that on the server. If it differs, delete its line in trusted-servers.toml.")
    return 0


def _check(file: Path, *, as_json: bool) -> int:
    from stiction.apps.output import print_json, print_table
    from stiction.watch.draft import check_configuration
    from stiction.watch.read_configuration import read_configuration

    found = check_configuration(read_configuration(file))
    if as_json:
        print_json([{"name": name, "works": works, "text": text} for name, works, text in found])
    else:
        print_table(["", "Source or channel", "Found"], [["ok" if w else "FAILED", n, t] for n, w, t in found])
    return 0 if all(works for _, works, _ in found) else 3


def _chosen_action(options: AlarmOptions) -> tuple[str, str] | None:
    """The action and its alarm; None where there is none."""
    names = ("acknowledge", "shelve", "out_of_service", "in_service")
    chosen = [(name, str(getattr(options, name))) for name in names if getattr(options, name) is not None]
    if len(chosen) > 1:
        raise ParameterError(f"--{chosen[1][0].replace('_', '-')} is given with another action; give one at a time.")
    if not chosen and options.comment is not None:
        if options.alarm is None:
            raise ParameterError("--comment needs an alarm; name it with --alarm.")
        return "comment", options.alarm
    return chosen[0] if chosen else None


def _alarms(file: Path, action: tuple[str, str] | None, options: AlarmOptions, *, as_json: bool) -> int:
    """Do something with an alarm, or list all."""
    from stiction.watch.alarm_actions import act_on_alarm
    from stiction.watch.read_configuration import read_configuration
    from stiction.watch.store import WatchStore

    folder = read_configuration(file).folder_beside(file)
    if not folder.is_dir():
        raise RecordError("there is no such watch yet; start it first.", where=folder)
    store = WatchStore(folder, read_only=action is None)
    try:
        if action is not None:
            until = None
            if options.until is not None:
                from stiction.fleet.time_text import parse_moment

                moment = parse_moment("until", options.until)
                until = moment and moment.timestamp()
            about = {"who": options.by or getpass.getuser(), "text": options.comment or "", "until": until}
            act_on_alarm(store, action[1], action[0], **about)
        return _list_alarms(store, as_json=as_json)
    finally:
        store.close()


def _list_alarms(store: "WatchStore", *, as_json: bool) -> int:
    from stiction.apps.output import print_json, print_out, print_table
    from stiction.watch.alarm import read_alarms
    from stiction.watch.alarm_actions import read_notes

    alarms = read_alarms(store)
    if as_json:
        print_json([asdict(one) | {"state": one.state, "notes": read_notes(store, one.id)} for one in alarms])
    elif not alarms:
        print_out("There is no alarm.")
    else:
        rows = [
            [one.id, one.state, one.priority, f"{datetime.fromtimestamp(one.raised):%Y-%m-%d %H:%M}", one.title]
            for one in alarms
        ]
        print_table(["Alarm", "State", "Priority", "Raised", ""], rows)
        for one in alarms:
            for note in read_notes(store, one.id):
                moment = datetime.fromtimestamp(note["time"])
                print_out(f"{one.id}: {note['who']}, {moment:%Y-%m-%d %H:%M}: {note['what']} {note['text']}".rstrip())
    return int(any(one.cleared is None for one in alarms))
