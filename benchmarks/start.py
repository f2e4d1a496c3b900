"""What a user waits for at the command line: import, help, one diagnosis; cold and warm, and the memory they take."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from bench import Row, Section

import stiction as st

REPEATS = 5
WATCH = """
import resource, subprocess, sys, time
begin = time.perf_counter()
done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
seconds = time.perf_counter() - begin
if done.returncode not in (0, 1):
    sys.exit(done.stderr)
print(seconds, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""
"""A small process between: a child's peak counts what its parent held when it was forked."""


def start() -> Section:
    """Processes of their own; cold means that no compiled kernel is in the disk cache."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record = _record(folder)
        stiction = (str(Path(sys.executable).with_name("stiction")),)
        programs = [
            ("import stiction", (sys.executable, "-c", "import stiction")),
            ("stiction --help", (*stiction, "--help")),
            ("stiction diagnose FILE", (*stiction, "diagnose", str(record), "--json")),
        ]
        rows = []
        for what, command in programs:
            warm = folder / "warm"
            run(command, warm)
            cold = [run(command, folder / f"cold-{len(what)}-{k}") for k in range(REPEATS)]
            again = [run(command, warm) for _ in range(REPEATS)]
            rows.append(Row(f"{what}, cold", statistics.median(t for t, _ in cold), "s"))
            rows.append(Row(f"{what}, warm", statistics.median(t for t, _ in again), "s"))
            rows.append(Row(f"{what}, peak memory", max(m for _, m in cold + again), "MiB"))
    return Section("Start", rows)


def run(command: tuple[str, ...], kernels: Path) -> tuple[float, float]:
    """Wall time [s] and peak memory [MiB] of a program whose compiled kernels live in the folder `kernels`."""
    done = subprocess.run(
        (sys.executable, "-S", "-c", WATCH, *command),
        env=os.environ | {"NUMBA_CACHE_DIR": str(kernels)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: {done.stderr.strip()}")
    seconds, peak = done.stdout.split()
    return float(seconds), float(peak) / (1024.0 if sys.platform == "linux" else 1024.0**2)


def _record(folder: Path) -> Path:
    """A sticky loop of 2 000 samples as a plant would export it."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    record = st.simulate(loop, 10.0, 2_000.0, seed=1, pv_start=0.0)
    path = folder / "FIC-101.csv"
    lines = ["time,sp,pv,op"]
    lines += [
        f"{k},{r:g},{y:.4f},{u:.4f}" for k, (r, y, u) in enumerate(zip(record.sp, record.pv, record.op, strict=True))
    ]
    path.write_text("\n".join(lines) + "\n")
    return path
