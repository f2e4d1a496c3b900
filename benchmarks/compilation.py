"""What the first diagnosis compiles: seconds per module, in a process with an empty kernel cache."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile

from bench import Row, Section

LIMIT_S = 25.0
"""Longest first diagnosis with an empty kernel cache, on a quiet machine [s]."""
WORK = """
import collections, json, time
from numba.core import event
import diagnosis
seconds, open_calls = collections.Counter(), []
class Listener(event.Listener):
    def on_start(self, e):
        open_calls.append([time.perf_counter(), 0.0])
    def on_end(self, e):
        begin, inner = open_calls.pop()
        whole = time.perf_counter() - begin
        seconds[e.data["dispatcher"].py_func.__module__] += whole - inner
        if open_calls:
            open_calls[-1][1] += whole
begin = time.perf_counter()
with event.install_listener("numba:compile", Listener()):
    diagnosis.st.diagnose(diagnosis._loops(2_000)["sticky"])
print(json.dumps([time.perf_counter() - begin, seconds]))
"""
"""A callee that is compiled on the way counts for its own module."""


def compilation() -> Section:
    """Compile seconds of each module, the longest first."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", WORK], capture_output=True, text=True, check=True, cwd=os.path.dirname(__file__),
            env=os.environ | {"NUMBA_CACHE_DIR": folder},
        )  # fmt: skip
    whole, seconds = json.loads(done.stdout)
    rows = [Row("simulation of the record and first diagnosis", whole, "s", "limit", LIMIT_S, LIMIT_S / whole, 1.0)]
    rows += [Row(name, t, "s") for name, t in sorted(seconds.items(), key=lambda item: -item[1])]
    return Section("First diagnosis with an empty kernel cache", rows)
