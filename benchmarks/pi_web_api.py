"""Read 500 tags and a day from a stand-in of the PI Web API: `python benchmarks/pi_web_api.py`.

The stand-in has the limits of AVEVA's documentation and runs in a process of its own. Printed are the time, the
processor time and the largest memory of the reading process, and whether each value came once.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from datetime import timedelta
from pathlib import Path

import numpy as np

sys.path[0] = str(Path(__file__).resolve().parents[1] / "tests")

LOOPS, SAMPLES, STEP_S = 250, 8640, 10.0


def values(k: int) -> np.ndarray:
    """Values of PV of a kind of loop; OP is the same with another sign."""
    return np.round(50.0 + np.cumsum(np.random.default_rng(k).normal(size=SAMPLES)) / 20.0, 4)


def serve() -> None:
    """Serve the points until the input ends; loops of one kind share their values."""
    from sources.pi_archive import PiArchive

    with PiArchive() as archive:
        seconds = np.arange(SAMPLES) * STEP_S
        for k in range(LOOPS):
            for sign, role in ((1.0, "PV"), (-1.0, "OP")):
                name, kind = f"FIC-{1000 + k}.{role}", f"FIC-{1000 + k % 5}.{role}"
                shown = (100.0 * (sign < 0.0) + sign * values(k % 5)).tolist() if k < 5 else []
                archive.add(name, shown, seconds=seconds if k < 5 else [], unit="%" if sign < 0.0 else "m3/h")
                archive.items[name], archive.times[name] = archive.items[kind], archive.times[kind]
        print(archive.url, flush=True)
        sys.stdin.read()


def main() -> None:
    """Read loop by loop, as an audit does."""
    server = subprocess.Popen(
        [sys.executable, __file__, "serve"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert server.stdout is not None
    url = server.stdout.readline().strip()
    from sources.pi_archive import START
    from stiction.sources import open_loops

    wall, cpu = time.perf_counter(), time.process_time()
    span = {"since": START.isoformat(), "until": (START + timedelta(seconds=SAMPLES * STEP_S)).isoformat()}
    loops = open_loops(url, **span)
    wrong = 0
    for number, tag in enumerate(loops.tags):
        record = loops.read_one(number)
        expected = values((int(tag[4:]) - 1000) % 5)
        wrong += not (np.array_equal(record.pv, expected) and record.dt == STEP_S)
    print(json.dumps({
        "tags": 2 * len(loops.tags), "values": 2 * len(loops.tags) * SAMPLES, "loops with a wrong value": wrong,
        "time [s]": time.perf_counter() - wall, "processor time [s]": time.process_time() - cpu,
        "memory [MB]": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    }, indent=1))  # fmt: skip
    server.kill()


if __name__ == "__main__":
    serve() if sys.argv[1:] == ["serve"] else main()
