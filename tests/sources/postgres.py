"""A PostgreSQL server of its own for the tests, on a free port of the loopback interface."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
from glob import glob
from pathlib import Path
from urllib.parse import quote

PASSWORD = "s/e:c@r %t+ü"


def find_program(name: str) -> str | None:
    """Path of a program of PostgreSQL, also where Debian keeps it."""
    path = os.pathsep.join([os.environ.get("PATH", ""), *sorted(glob("/usr/lib/postgresql/*/bin"), reverse=True)])
    return shutil.which(name, path=path)


def has_postgres() -> bool:
    """Whether a server can be started here."""
    return bool(find_program("initdb") and find_program("postgres"))


class PostgresServer:
    """A server with password authentication that can be stopped and started again."""

    def __enter__(self) -> PostgresServer:
        initdb, postgres = find_program("initdb"), find_program("postgres")
        assert initdb is not None
        assert postgres is not None
        user = "postgres" if os.geteuid() == 0 else pwd.getpwuid(os.geteuid()).pw_name  # initdb refuses root
        drop = {"user": user, "group": pwd.getpwnam(user).pw_gid, "extra_groups": []} if os.geteuid() == 0 else {}
        self._folder = tempfile.TemporaryDirectory(prefix="stiction-pg-", dir="/tmp")
        Path(self._folder.name).chmod(0o755)
        home = Path(self._folder.name, "server")
        home.mkdir()
        password = home / "password"
        password.write_text(PASSWORD + "\n", encoding="utf-8")
        if drop:
            for place in (home, password):
                shutil.chown(place, user)
        data = home / "data"
        init = [initdb, "-D", str(data), "-U", "plant", "-A", "scram-sha-256", "--pwfile", str(password)]
        self._run = {"cwd": home, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, **drop}
        done = subprocess.run([*init, "-E", "UTF8", "--locale=C.UTF-8", "--no-sync"], check=False, **self._run)
        if done.returncode:
            raise RuntimeError(f"initdb failed: {done.stdout.decode(errors='replace')[-500:]}")
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        options = ["-h", "127.0.0.1", "-p", str(self.port), "-k", str(home), "-c", "fsync=off", "-c", "lc_messages=C"]
        self._command = [postgres, "-D", str(data), *options]
        self.url = f"postgresql+psycopg://plant:{quote(PASSWORD, safe='')}@127.0.0.1:{self.port}/postgres"
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self._folder.cleanup()

    def start(self) -> None:
        """Start the server, and wait until it answers."""
        self._server = subprocess.Popen(self._command, **self._run)
        wait_until_open(self._server, self.port)

    def stop(self) -> None:
        """Stop the server without waiting for open connections."""
        self._server.send_signal(signal.SIGINT)
        try:
            self._server.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            self._server.kill()
            self._server.communicate()


def wait_until_open(server: subprocess.Popen[bytes], port: int) -> None:
    """Wait until the server answers, at most 20 s."""
    import time

    import psycopg

    for _ in range(400):
        if server.poll() is not None:
            raise RuntimeError(f"postgres stopped: {server.communicate()[0].decode(errors='replace')[-500:]}")
        try:
            psycopg.connect(host="127.0.0.1", port=port, user="plant", password=PASSWORD, dbname="postgres").close()
            return
        except psycopg.OperationalError:
            time.sleep(0.05)
    raise RuntimeError("postgres did not answer within 20 s")
