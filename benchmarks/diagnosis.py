"""The whole of `st.diagnose` on one core, beside the version before the rebuild, and the memory it takes."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from bench import Row, Section

import stiction as st
from calibration.historian import sample_slower

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stiction.records.record import LoopRecord

BASELINE_COMMIT = "839931f"
"""Last version before the diagnosis was rebuilt."""
TIME_SHARE_LIMITS = {2_000: 0.6, 86_400: 0.35}
"""Samples -> largest processor time over that of the baseline [-]."""
MEMORY_SAMPLES, MEMORY_LIMIT_MB = 30_000, 400.0
"""Samples of the record with which the memory is measured, and largest peak memory of the process [MB]."""
POSITIONS = ("sticky", "driven")
"""Loops that are diagnosed with the position of their valve as well: of one that sticks and of a good one."""
POSITION_NOISE = 0.05
"""Standard deviation of the noise of such a position [% of span]: that of a usual transmitter, so that neither kind of
valve leaves nothing, and the position of the good one is no echo of OP."""
PEERS = (
    ("curve fits of the Timeseer library", 360.0),
    ("core of the Seeq add-on", 560.0),
    ("regularity and shape index, chemai", 12.0),
)
"""Programs that can no longer be installed beside this one, with what one loop of 2 000 samples took them [ms]: medians
of five or more runs on a machine of this kind (two cores, one in use), taken once. The last gives no verdict on a valve
and no S."""


def diagnosis() -> Section:
    """Loops that a valve, a load and noise alone move, a slower record and two with positions."""
    before = _baseline_times()
    rows, verdicts, without_position = [], {n: [] for n in TIME_SHARE_LIMITS}, []
    with one_core():
        for n, limit in TIME_SHARE_LIMITS.items():
            for name, record in _loops(n).items():
                seconds, old = processor_time(record), before.get(f"{n} {name}")
                other = (
                    ("", None, None, None) if old is None else (BASELINE_COMMIT, old * 1e3, old / seconds, 1.0 / limit)
                )
                rows.append(Row(f"{n:,} samples, {name}", seconds * 1e3, "ms", *other))
                verdicts[n].append(f"{name} {st.diagnose(record).verdict}")
                if n == 2_000 and record.mv is None:  # as those that the peers were given
                    without_position.append(seconds)
    usual = statistics.median(without_position) * 1e3
    rows += [Row("2 000 samples, median", usual, "ms", f"{name}, then", peer, peer / usual) for name, peer in PEERS]
    peak = _peak_memory()
    rows.append(
        Row(
            f"{MEMORY_SAMPLES:,} samples, peak memory",
            peak,
            "MB",
            "limit",
            MEMORY_LIMIT_MB,
            MEMORY_LIMIT_MB / peak,
            1.0,
        )
    )
    notes = ["processor time, all threads added up: what the wall clock shows on a core with nothing else to do"]
    notes += [f"verdicts at {n:,} samples: {', '.join(found)}" for n, found in verdicts.items()]
    if not before:
        notes.append(f"no comparison: commit {BASELINE_COMMIT} is not in this checkout")
    return Section("Diagnosis of one loop, warm, on one core", rows, tuple(notes))


def _baseline_times() -> dict[str, float]:
    """Processor times of the baseline [s], measured in a process of its own; empty where git does not have it."""
    here = Path(__file__).parent
    with tempfile.TemporaryDirectory() as folder:
        command = ["git", "archive", "--format=tar", BASELINE_COMMIT, "src", "benchmarks"]
        archive = subprocess.run(command, cwd=here.parent, capture_output=True, check=False)
        if archive.returncode:
            return {}
        subprocess.run(["tar", "-x", "-C", folder], input=archive.stdout, check=True)
        work = (
            "import json, diagnosis as d\nwith d.one_core():\n    times = {f'{n} {name}': d.processor_time(record) "
            f"for n in {tuple(TIME_SHARE_LIMITS)} "
            "for name, record in d._loops(n).items()}\nprint(json.dumps(times))"
        )
        paths = os.pathsep.join([f"{folder}/src", f"{folder}/benchmarks"])
        done = subprocess.run(
            [sys.executable, "-c", work],
            env=os.environ | {"PYTHONPATH": paths},
            capture_output=True,
            text=True,
            check=True,
        )
    return json.loads(done.stdout)


def processor_time(record: LoopRecord, repeats: int = 3) -> float:
    """Median time that a diagnosis keeps the processor busy [s], after one to warm up."""
    st.diagnose(record)
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        st.diagnose(record)
        times.append(time.process_time() - begin)
    return statistics.median(times)


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process and its threads on one core, where the system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def _loops(n: int) -> dict[str, LoopRecord]:
    rng = np.random.default_rng(3)
    kick, swing = np.where(np.arange(n) < 20, 6.0, 0.0), 3.0 * np.sin(2.0 * np.pi * np.arange(n) / 60.0)
    white = np.convolve(rng.normal(size=n + 30), np.ones(30) / 6.0, "valid")[:n]
    cases = {
        "sticky": (st.Kano(5.0, 3.0), kick),
        "resting": (st.He(3.5, 1.5), np.where(np.arange(n) > 5, 6.0, 0.0)),
        "driven": (st.Ideal(), swing),
        "quiet": (st.Ideal(), white),
    }
    out, with_position = {}, {}
    base = st.Loop(st.PID(0.4, 8.0), st.Kano(5.0, 3.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    for name, (valve, load) in cases.items():
        loop = replace(base, valve=valve)
        run = st.simulate(loop, 70.0, float(n), load, seed=1, pv_start=70.0, op_start=50.0, tag=name, loop_type="flow")
        out[name] = replace(run, mv=None)
        if name in POSITIONS:
            stem = run.mv + POSITION_NOISE * np.random.default_rng(5).normal(size=n)
            with_position[f"{name} with position"] = replace(run, mv=stem, tag=f"{name} with position")
    run = st.simulate(
        base, 70.0, 3.0 * n, 6.0 * (np.arange(3 * n) < 20), seed=1, pv_start=70.0, op_start=50.0, tag="slower"
    )
    out["slower"] = replace(sample_slower(run, 3.0), mv=None, loop_type="flow", integrating=False)
    return out | with_position


def _peak_memory() -> float:
    """Peak resident memory of a fresh process that diagnoses a long record [MB]."""
    work = f"import resource, diagnosis, stiction as st; st.diagnose(diagnosis._loops({MEMORY_SAMPLES})['sticky']); "
    work += "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    done = subprocess.run(
        [sys.executable, "-c", work], capture_output=True, text=True, check=True, cwd=os.path.dirname(__file__)
    )
    return int(done.stdout) / (1024.0**2 if sys.platform == "darwin" else 1024.0)
