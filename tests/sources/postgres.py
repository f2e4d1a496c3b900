"""A PostgreSQL server of its own for the tests, on a free port of the loopback interface."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
from contextlib import contextmanager
from glob import glob
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

if TYPE_CHECKING:
    from collections.abc import Iterator

PASSWORD = "s/e:c@r %t+ü"


@contextmanager
def postgres_server() -> Iterator[str]:
    """Start a server with password authentication, give the URL of its database, stop it."""
    path = os.pathsep.join([os.environ.get("PATH", ""), *sorted(glob("/usr/lib/postgresql/*/bin"), reverse=True)])
    initdb, postgres = shutil.which("initdb", path=path), shutil.which("postgres", path=path)
    if initdb is None or postgres is None:
        raise FileNotFoundError("initdb and postgres: install PostgreSQL (Debian: postgresql)")
    user = "postgres" if os.geteuid() == 0 else pwd.getpwuid(os.geteuid()).pw_name  # initdb refuses root
    drop = {"user": user, "group": pwd.getpwnam(user).pw_gid, "extra_groups": []} if os.geteuid() == 0 else {}
    with tempfile.TemporaryDirectory(prefix="stiction-pg-", dir="/tmp") as folder:
        Path(folder).chmod(0o755)
        home = Path(folder, "server")
        home.mkdir()
        password = home / "password"
        password.write_text(PASSWORD + "\n", encoding="utf-8")
        if drop:
            for place in (home, password):
                shutil.chown(place, user)
        data = home / "data"
        init = [initdb, "-D", str(data), "-U", "plant", "-A", "scram-sha-256", "--pwfile", str(password)]
        run = {"cwd": home, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, **drop}
        done = subprocess.run([*init, "-E", "UTF8", "--locale=C.UTF-8", "--no-sync"], check=False, **run)
        if done.returncode:
            raise RuntimeError(f"initdb failed: {done.stdout.decode(errors='replace')[-500:]}")
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        options = ["-h", "127.0.0.1", "-p", str(port), "-k", str(home), "-c", "fsync=off", "-c", "lc_messages=C"]
        server = subprocess.Popen([postgres, "-D", str(data), *options], **run)
        try:
            wait_until_open(server, port)
            yield f"postgresql+psycopg://plant:{quote(PASSWORD, safe='')}@127.0.0.1:{port}/postgres"
        finally:
            server.send_signal(signal.SIGINT)  # "fast": does not wait for open connections
            try:
                server.communicate(timeout=20)
            except subprocess.TimeoutExpired:
                server.kill()
                server.communicate()


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
