"""An audit of 100, 1 000 and 10 000 loops: time, processor time and memory: `python benchmarks/fleet.py PLANT`.

PLANT is the folder that `benchmarks/fleet_plant.py` wrote (0.5 GB); the smaller plants are its first files.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import psutil

SCRIPT = """import sys, time, json, resource
import stiction as st
began, seen = time.perf_counter(), {}
def note(progress):
    seen.setdefault(progress.stage, time.perf_counter() - began)
if __name__ == "__main__":
    found = st.audit(sys.argv[1], sys.argv[2], workers=int(sys.argv[3]), progress=note)
    seen["end"] = time.perf_counter() - began
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    seen["cpu"] = sum(one.ru_utime + one.ru_stime for one in used)
    print(json.dumps(seen | {"counts": found.counts, "groups": len(found.groups)}))
"""


def measure(plant: Path, loops: int, workers: int) -> dict[str, float]:
    """Audit the first loops of a plant in a process of its own; memory is the sum of the PSS of all its processes."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "plant")
        source.mkdir()
        for path in sorted(plant.glob("unit-*.parquet"))[: -(-loops // 100)]:
            os.link(path, source / path.name)
        script = Path(folder, "run.py")
        script.write_text(SCRIPT)
        command = [sys.executable, str(script), str(source), str(Path(folder, "audit")), str(workers)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            peak = {"MB": 0.0}
            watcher = threading.Thread(target=_watch, args=(process, peak))
            watcher.start()
            out = process.communicate()[0]
            watcher.join()
        return json.loads(out.splitlines()[-1]) | peak


def _watch(process: subprocess.Popen[str], peak: dict[str, float]) -> None:
    parent = psutil.Process(process.pid)
    while process.poll() is None:
        total = 0.0
        try:
            for one in [parent, *parent.children(recursive=True)]:
                total += one.memory_full_info().pss
        except psutil.Error:
            pass
        peak["MB"] = max(peak["MB"], total / 1e6)
        time.sleep(1.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("plant", type=Path)
    parser.add_argument("--loops", type=int, nargs="*", default=[100, 1000, 10000])
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores, {asked.workers} workers")
    for loops in asked.loops:
        found = measure(asked.plant, loops, asked.workers)
        screen, rest = found["diagnose"] - found["screen"], found["group"] - found["diagnose"]
        cpu = 1e3 * found["cpu"] / loops
        print(
            f"{loops} loops: screened in {screen:.0f} s, diagnosed in {rest:.0f} s, grouped in "
            f"{found['end'] - found['group']:.0f} s, all in {found['end']:.0f} s; {cpu:.0f} ms of processor time "
            f"a loop; peak PSS {found['MB']:.0f} MB; {found['counts']}, {found['groups']} groups",
            flush=True,
        )


if __name__ == "__main__":
    main()
