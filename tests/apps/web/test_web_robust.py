"""`stiction serve` as a command and under trouble: bad input, cut uploads, many clients, killed processes."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import stiction as st
from apps.web.running import ROOT
from apps.web.test_web_flow import sticky_csv
from stiction.apps.cli import main

pytestmark = pytest.mark.processes
NAMED = ("FIC-101.SP", "FIC-101.PV", "FIC-101.OP")


def test_first_line_is_the_address_and_interrupt_ends_it(serve, tmp_path):
    server = serve()
    assert server.address.startswith(f"http://127.0.0.1:{server.port}/#token=")
    assert len(server.token) >= 32
    assert server.stop(signal.SIGINT) == 0
    assert server.process.stderr.read() == ""
    assert list(tmp_path.glob("stiction-run-*")) == []


def test_files_of_the_command_line_are_diagnosed_at_once(serve, tmp_path):
    (tmp_path / "FIC-101.csv").write_text(sticky_csv(NAMED))
    (tmp_path / "broken.csv").write_text("PV,OP\n")
    server = serve(str(tmp_path / "FIC-101.csv"), str(tmp_path / "broken.csv"))
    assert server.call("GET", "/api/start").json == {"screen": "loops", "watch": False}
    found = server.wait_for(
        "/api/sets/session/rows", lambda one: one["rows"] and one["rows"][0]["status"] == "diagnosed"
    )
    [row] = found["rows"]
    assert (row["tag"], row["verdict"]) == ("FIC-101", "stiction")
    [reading] = server.call("GET", "/api/readings").json["readings"]
    assert reading["files"] == ["FIC-101.csv", "broken.csv"]
    [failure] = reading["failures"]
    assert failure.startswith("broken.csv")


def test_port_can_be_chosen_and_a_taken_one_is_named(serve, capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert main(["serve", "--no-open", "--port", str(port)]) == 2
    told = capsys.readouterr().err
    assert f"--port {port}" in told
    assert "another port" in told
    assert serve("--port", str(port)).port == port


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--port", "70000"], 2, "between 1 and 65535"),
        (["no-such-file.csv"], 3, "no such file"),
        (["empty"], 3, "is not an audit"),
        (["nothing-*.csv"], 3, "no file matches"),
        (["--prot", "1"], 2, "--prot"),
    ],
)
def test_bad_arguments_end_with_a_message(tmp_path, monkeypatch, capsys, arguments, code, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    assert main(["serve", "--no-open", *arguments]) == code
    captured = capsys.readouterr()
    assert words in captured.err
    assert "Traceback" not in captured.err
    assert captured.out == ""


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"audit.toml": 'format = 99\nversion = "9.9"\n'}, ["is an audit of format 99", "stiction 9.9", "new audit"]),
        ({"audit.toml": "not = [toml"}, ["cannot be read", "start a new audit"]),
        ({"audit.toml": f'format = 1\nversion = "{st.__version__}"\n'}, ["ledger.sqlite", "is missing"]),
        ({"june/audit.toml": "format = 1"}, ["is not an audit", "june"]),
        ({"report.html": "<!doctype html><p>S"}, ["is not an audit", "report.html: is an HTML page"]),
    ],
)
def test_folder_that_cannot_be_served_is_refused(tmp_path, capsys, files, words):
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    assert main(["serve", "--no-open", str(tmp_path)]) == 3
    captured = capsys.readouterr()
    assert captured.out == ""
    assert [word for word in (str(tmp_path), *words) if word not in captured.err] == []


def test_the_printed_address_listens(web_assets, tmp_path):
    """A client that connects as soon as the address is printed is not refused."""
    command = [sys.executable, "-m", "stiction", "serve", "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment(), cwd=tmp_path) as process:
        assert process.stdout is not None
        port = int(process.stdout.readline().split(":")[2].split("/")[0])
        with socket.create_connection(("127.0.0.1", port), timeout=5) as wire:
            wire.sendall(f"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
            wire.settimeout(60)
            assert wire.recv(100).startswith(b"HTTP/1.1 200")
        process.terminate()


def test_missing_extra_names_the_pip_line(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "starlette", None)
    assert main(["serve", "--no-open"]) == 3
    assert 'pip install "stiction[web]"' in capsys.readouterr().err


def test_without_the_plot_library_the_command_is_named(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("stiction.apps.web.STATIC", tmp_path)
    assert main(["serve", "--no-open"]) == 3
    assert "python .ci/web_assets.py" in capsys.readouterr().err


def test_help_names_the_address():
    command = [sys.executable, "-m", "stiction", "serve", "--help"]
    done = subprocess.run(command, capture_output=True, env=environment(), check=True)
    assert b"127.0.0.1" in done.stdout


def wait_for(condition, seconds=10.0):
    """Wait until a condition holds; fail when it does not within the time."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_upload_that_is_cut_leaves_nothing(serve, tmp_path):
    server = serve()
    server.sign_in()
    with socket.create_connection(("127.0.0.1", server.port)) as wire:
        wire.sendall(
            f"PUT /api/files?name=a.csv HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nX-Stiction: 1\r\n"
            f"Cookie: {server.cookie}\r\nContent-Length: 1000000\r\n\r\n".encode()
            + b"time_s,PV,OP\n" * 100
        )
        wait_for(lambda: any(tmp_path.glob("stiction-run-*/*/uploads/*")))
    wait_for(lambda: not any(tmp_path.glob("stiction-run-*/*/uploads/*")))
    assert server.call("PUT", "/api/files?name=a.csv", sticky_csv(NAMED).encode()).status == 201


def test_ten_clients_at_once(serve):
    """Each uploads, reads and diagnoses its own file; every loop comes once, none is lost."""
    server = serve()
    server.sign_in()
    errors: list[BaseException] = []

    def client(k: int) -> None:
        try:
            names = [name.replace("101", str(200 + k)) for name in NAMED]
            server.read_and_diagnose(sticky_csv(names), f"{k}.csv")
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=client, args=(k,)) for k in range(10)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    found = server.wait_for("/api/sets/session/rows?since=0", lambda one: not one["progress"]["running"])
    assert sorted(row["tag"] for row in found["rows"]) == [f"FIC-{200 + k}" for k in range(10)]
    assert {row["verdict"] for row in found["rows"]} == {"stiction"}


def test_diagnoses_can_be_stopped_and_go_on(serve):
    server = serve()
    for k in range(6):
        server.read_and_diagnose(sticky_csv([name.replace("101", str(200 + k)) for name in NAMED]), f"{k}.csv")
    server.call("POST", "/api/sets/session/run", {"run": False})
    time.sleep(3.0)
    stopped = server.call("GET", "/api/sets/session/rows?since=0").json
    time.sleep(2.0)
    later = server.call("GET", "/api/sets/session/rows?since=0").json
    assert stopped["progress"]["done"] == later["progress"]["done"]
    server.call("POST", "/api/sets/session/run", {"run": True})
    server.wait_for("/api/sets/session/rows?since=0", lambda one: one["progress"]["done"] == 6)


def test_killed_worker_costs_one_try(serve):
    server = serve()
    server.wait_for("/api/sets", lambda _: True)
    server.read_and_diagnose(sticky_csv(NAMED))
    for child in children(server.process.pid):
        if "spawn_main" in child.read_text():
            os.kill(int(child.parent.name), signal.SIGKILL)
    found = server.wait_for("/api/sets/session/rows?since=0", lambda one: one["progress"]["done"] == 1)
    assert found["rows"][0]["verdict"] == "stiction"


def test_killed_server_leaves_no_worker_and_no_half_written_note(serve, tmp_path):
    from stiction.fleet.labels import append_label, read_labels

    server = serve()
    server.read_and_diagnose(sticky_csv(NAMED))
    workers = [int(child.parent.name) for child in children(server.process.pid)]
    server.process.send_signal(signal.SIGKILL)
    server.process.wait()
    end = time.monotonic() + 20
    while time.monotonic() < end and any(Path(f"/proc/{one}").exists() for one in workers):
        time.sleep(0.2)
    assert not [one for one in workers if Path(f"/proc/{one}").exists()]
    append_label(tmp_path, "FIC-101", "note", "after")
    assert [one.note for one in read_labels(tmp_path)] == ["after"]


def test_server_stays_small(serve):
    """The science is in the workers: the server itself stays under 100 MB."""
    server = serve()
    server.read_and_diagnose(sticky_csv(NAMED))
    server.wait_for("/api/sets/session/rows?since=0", lambda one: one["progress"]["done"] == 1)
    status = Path(f"/proc/{server.process.pid}/status")
    if not status.exists():
        pytest.skip("no /proc on this machine")
    resident = next(line for line in status.read_text().splitlines() if line.startswith("VmRSS"))
    assert int(resident.split()[1]) < 100_000


def test_server_imports_no_science():
    code = (
        "import sys, stiction.apps.web.app, stiction.apps.web.workspace, stiction.apps.web.workers\n"
        "print([name for name in ('numpy', 'numba', 'scipy', 'polars', 'sqlalchemy') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, env=environment(), text=True, check=True)
    assert json.loads(done.stdout.replace("'", '"')) == []


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT / "src")}


def children(process: int) -> list[Path]:
    """Command lines of the children of a process."""
    if not Path("/proc").exists():
        pytest.skip("no /proc on this machine")
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            if int(stat.read_text().rsplit(")", 1)[1].split()[1]) == process:
                found.append(stat.with_name("cmdline"))
        except (OSError, ValueError):
            continue
    return found


def test_interrupted_audit_goes_on(serve, tmp_path):
    """An audit whose budget allowed only the screen is finished by the page, in a process of its own."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    record = st.simulate(loop, 150.0, 1200.0, seed=1, pv_start=148.0, op_start=50.0, tag="FIC-101")
    record.to_parquet(tmp_path / "p.parquet")
    found = st.audit(tmp_path / "p.parquet", tmp_path / "audit", workers=1, budget=0.001)
    assert found.rows[0]["status"] == "screened"
    server = serve(str(tmp_path / "audit"))
    [row] = server.call("GET", "/api/sets/audit1/rows?since=0").json["rows"]
    assert (row["status"], "verdict" in row) == ("screened", False)
    assert server.call("POST", "/api/sets/audit1/run", {"run": True}).json["running"]
    ended = server.wait_for("/api/sets/audit1/rows?since=0", lambda one: one["rows"][0]["status"] == "diagnosed")
    assert ended["rows"][0]["verdict"] == "stiction"
    assert ended["rows"][0]["key"] == row["key"]
