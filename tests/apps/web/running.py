"""A running `stiction serve` for tests: its process, its address, requests with and without the cookie."""

from __future__ import annotations

import asyncio
import http.client
import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stiction.scratch import RUN_VARIABLE, SHARED_VARIABLE

ROOT = Path(__file__).resolve().parents[3]
ASSETS = ROOT / "src" / "stiction" / "apps" / "web" / "static" / "vendor" / "uPlot.esm.js"
WAIT_S = 180.0
"""Longest wait for an answer, kernels that compile included [s]."""


def run_apart(task: Any) -> Any:
    """Run a coroutine in a thread of its own: the browser of other tests keeps an event loop in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, task).result()


@dataclass
class Answer:
    """An answer of the server."""

    status: int
    body: bytes
    headers: dict[str, str]

    @property
    def json(self) -> Any:
        return json.loads(self.body)


@dataclass
class Server:
    """A process of `stiction serve`."""

    process: subprocess.Popen
    address: str
    cookie: str = ""
    headers: dict[str, str] = field(default_factory=dict)

    @property
    def port(self) -> int:
        return int(self.address.split(":")[2].split("/")[0])

    @property
    def token(self) -> str:
        return self.address.split("#token=")[1]

    def send(self, method: str, path: str, body: Any = None, headers: dict[str, str] | None = None) -> Answer:
        """Send one request with exactly these headers beside Host."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=WAIT_S)
        data = body if isinstance(body, (bytes, type(None))) else json.dumps(body).encode()
        try:
            connection.request(method, path, data, headers or {})
            response = connection.getresponse()
            found = {name.lower(): value for name, value in response.getheaders()}
            return Answer(response.status, response.read(), found)
        finally:
            connection.close()

    def sign_in(self) -> None:
        answer = self.send("POST", "/api/session", {"token": self.token}, {"X-Stiction": "1"})
        assert answer.status == 200, answer.body
        self.cookie = answer.headers["set-cookie"].split(";")[0]

    def call(self, method: str, path: str, body: Any = None) -> Answer:
        """Send one request as our own page does."""
        if not self.cookie:
            self.sign_in()
        return self.send(method, path, body, {"Cookie": self.cookie, "X-Stiction": "1"})

    def wait_for(self, path: str, is_done: Any) -> Any:
        """Ask until an answer satisfies a condition."""
        end = time.monotonic() + WAIT_S
        while time.monotonic() < end:
            answer = self.call("GET", path)
            if answer.status == 200 and is_done(answer.json):
                return answer.json
            time.sleep(0.1)
        raise AssertionError(f"{path}: {answer.status} {answer.body[:500]!r}")

    def read_and_diagnose(self, text: str, name: str = "FIC-101.csv") -> tuple[str, list[int]]:
        """Upload a file, read it and diagnose its loops."""
        file = self.call("PUT", f"/api/files?name={name}", text.encode()).json["id"]
        reading = self.call("POST", "/api/readings", {"files": [file]}).json["id"]
        self.wait_for(f"/api/readings/{reading}", lambda found: not found["running"])
        found = self.call("POST", f"/api/readings/{reading}/diagnose", {}).json
        return found["set"], found["keys"]

    def stop(self, number: int = signal.SIGINT) -> int:
        """End the process and return its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise


def start_server(*arguments: str, cwd: Path | None = None) -> Server:
    """Start `stiction serve` on a free port and wait until it answers."""
    temporary = {"TMPDIR": str(cwd)} if cwd is not None else {}
    environment = {**os.environ, **temporary, "PYTHONPATH": str(ROOT / "src"), "OPENBLAS_NUM_THREADS": "1"}
    for variable in (RUN_VARIABLE, SHARED_VARIABLE):  # the server is a run of its own, not a worker of the tests
        environment.pop(variable, None)
    command = [sys.executable, "-m", "stiction", "serve", "--no-open", *arguments]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, cwd=cwd
    )
    assert process.stdout is not None
    address = process.stdout.readline().strip()
    if not address:
        _, errors = process.communicate(timeout=10)
        raise AssertionError(f"stiction serve did not start: {errors}")
    server = Server(process, address)
    end = time.monotonic() + WAIT_S
    while time.monotonic() < end:
        try:
            if server.send("GET", "/healthz").status == 200:
                return server
        except OSError:
            time.sleep(0.05)
    process.kill()
    raise AssertionError("stiction serve does not answer")
