"""A whole round of a watch over a folder that grows, and the commands around it."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from datetime import UTC, datetime, timedelta

import numpy as np
import polars as pl
import pytest

import stiction as st
from stiction.apps import cli
from stiction.apps.cli import main
from stiction.errors import RecordError
from stiction.watch.service import Watch, lock_watch
from stiction.watch.store import WatchStore

LENGTH_S = 3600


@pytest.fixture
def plant(tmp_path):
    """A folder with two hours of a sticky loop and a loop without values, up to now; and its configuration."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=2.0, noise=0.1)
    record = st.simulate(loop, sp=10.0, duration=2.0 * LENGTH_S, seed=1)
    end = datetime.fromtimestamp(time.time() // LENGTH_S * LENGTH_S, UTC)
    times = [end - timedelta(seconds=2.0 * (len(record) - k)) for k in range(len(record))]
    data = tmp_path / "data"
    data.mkdir()
    columns = {"Time": times, "FIC-101.PV": record.pv, "FIC-101.OP": record.op, "FIC-101.SP": record.sp}
    nothing = [None] * len(record)
    frame = pl.DataFrame(
        columns | {"TIC-9.PV": nothing, "TIC-9.OP": nothing}, schema_overrides={"TIC-9.PV": pl.Float64}
    )
    frame.write_parquet(data / "plant.parquet")
    file = tmp_path / "plant.toml"
    lines = ['window = "1h"', "workers = 1", "[[source]]", 'address = "DATA"', 'delay = "0s"', "[alarms]"]
    file.write_text("\n".join([*lines, "raise_windows = 1"]).replace("DATA", str(data)))
    return file


@pytest.mark.processes
def test_one_round_judges_the_window_that_ended_and_raises_its_alarm(plant, capsys):
    asyncio.run(Watch(plant, report=lambda _: None).run_once())
    folder = plant.parent / "watch"
    store = WatchStore(folder, read_only=True)
    [window] = store.query("SELECT * FROM window")
    store.close()
    end = time.time() // LENGTH_S * LENGTH_S
    assert (window["state"], window["finish"] - window["start"]) == ("judged", 1_000_000 * LENGTH_S)
    assert window["finish"] == round(1e6 * end)
    found = st.open_audit(folder / "audit")
    [record] = [one for one in st.read(plant.parent / "data") if one.tag == "FIC-101"]
    cut = record.window(len(record) - LENGTH_S // 2, len(record))
    row = found.row("FIC-101")
    assert row.verdict == st.diagnose(cut).verdict == "stiction"
    np.testing.assert_array_equal(found.read("FIC-101").pv, cut.pv)
    assert main(["watch", str(plant), "--alarms", "--json"]) == 1
    [alarm] = json.loads(capsys.readouterr().out)
    assert (alarm["loop"], alarm["kind"], alarm["state"]) == ("FIC-101", "valve", "unacknowledged")
    assert main(["watch", str(plant), "--acknowledge", alarm["id"], "--by", "Ana", "--comment", "Seen."]) == 1
    assert "Ana" in capsys.readouterr().out

    asyncio.run(Watch(plant, report=lambda _: None).run_once())  # nothing new: nothing is judged or raised twice
    assert main(["watch", str(plant), "--alarms", "--json"]) == 1
    [again] = json.loads(capsys.readouterr().out)
    assert (again["id"], again["state"]) == (alarm["id"], "acknowledged")


def test_a_second_watch_in_the_folder_is_refused(tmp_path):
    message = r"a watch is running in this folder \(.* process"
    with lock_watch(tmp_path), pytest.raises(RecordError, match=message), lock_watch(tmp_path):
        pass


def test_another_window_length_is_refused_while_samples_wait(plant):
    one = Watch(plant)
    with lock_watch(one.folder):
        one._open()
        (one.folder / "samples" / "20260302T060000Z.samples").write_bytes(b"")
        one.store.close()
    plant.write_text(plant.read_text().replace('"1h"', '"2h"'))
    with pytest.raises(RecordError, match="window = '2h' differs from that of the samples that are waiting"):
        asyncio.run(Watch(plant).run_once())


def test_a_source_that_is_gone_is_reported_and_the_round_goes_on(plant, capsys):
    text = plant.read_text().replace("[alarms]", '[[source]]\naddress = "no-such-folder"\n[alarms]')
    plant.write_text(text)
    assert main(["watch", str(plant), "--check"]) == 3
    said = capsys.readouterr().out
    assert "no-such-folder" in said
    assert "FAILED" in said
    assert "2 loops" in said or "1 loops" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["watch"], "no configuration was given"),
        (["watch", "none.toml"], "cannot be read"),
        (["watch", "none.toml", "--trust", "https://host"], "is not the address of an OPC UA server"),
        (["watch", "none.toml", "--comment", "text"], "--comment needs an alarm"),
        (["watch", "none.toml", "--shelve", "a", "--acknowledge", "b"], "is given with another action"),
    ],
)
def test_wrong_commands_are_reported(arguments, message, capsys):
    assert main(arguments) in (2, 3)
    assert message in capsys.readouterr().err


def test_a_configuration_is_drafted_and_can_be_read(plant, capsys, tmp_path):
    assert main(["watch", "--init", str(plant.parent / "data")]) == 0
    text = capsys.readouterr().out
    assert "#   FIC-101" in text
    draft = tmp_path / "draft.toml"
    draft.write_text(text)
    assert Watch(draft).config.window_s == 14_400.0


@pytest.mark.skipif(sys.platform == "win32", reason="Unix sockets")
def test_systemd_is_notified(tmp_path, monkeypatch):
    import socket

    from stiction.watch.systemd import notify_systemd, watchdog_interval

    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as one:
        one.bind(path)
        one.settimeout(5.0)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        monkeypatch.setenv("WATCHDOG_USEC", "10000000")
        notify_systemd("READY=1")
        assert one.recv(100) == b"READY=1"
        assert watchdog_interval() == 5.0


def test_one_round_with_a_server_that_does_not_answer_ends_with_3(tmp_path, capsys):
    file = tmp_path / "plant.toml"
    file.write_text('window = "2m"\n[[source]]\naddress = "opc.tcp://127.0.0.1:9"\n')
    assert cli.main(["watch", str(file), "--once"]) == 3
    assert "cannot be reached" in capsys.readouterr().err
