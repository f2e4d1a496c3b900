"""The whole of `st.diagnose` on one core, all evidence and the gates included, and the memory it takes."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from bench import Row, Section

import stiction as st
from stiction.simulation.historian import sampled

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stiction.records.record import LoopRecord

ASKED = {2_000: 0.15, 30_000: 1.0}
"""Samples -> the longest that a warm diagnosis may take on one core [s]."""
ASKED_MEMORY = 400.0
"""Largest peak memory of a process that diagnoses 30 000 samples [MB]."""
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
    """Loops that a valve, a load and noise alone move, a slower record and two with positions, of 2 000 and of 30 000
    samples."""
    rows, found, blind = [], {n: [] for n in ASKED}, {n: [] for n in ASKED}
    with one_core():
        for n, asked in ASKED.items():
            for name, record in _loops(n).items():
                took = processor_time(record)
                rows.append(Row(f"{n:,} samples, {name}", took * 1e3, "ms", "asked", asked * 1e3, asked / took, 1.0))
                found[n].append(f"{name} {st.diagnose(record).verdict}")
                if record.mv is None:  # as those that the peers were given
                    blind[n].append(took)
    usual = statistics.median(blind[2_000]) * 1e3
    rows += [Row("2 000 samples, median", usual, "ms", f"{name}, then", told, told / usual) for name, told in PEERS]
    peak = _peak_memory()
    rows.append(Row("30,000 samples, peak memory", peak, "MB", "asked", ASKED_MEMORY, ASKED_MEMORY / peak, 1.0))
    how = "processor time, all threads added up: what the wall clock shows on a core with nothing else to do"
    note = f"found at 2 000 samples: {', '.join(found[2_000])}; at 30 000: {', '.join(found[30_000])}"
    return Section("Diagnosis of one loop, warm, on one core", rows, (how, note))


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
    out, seen = {}, {}
    for name, (valve, load) in cases.items():
        loop = st.Loop(st.PID(0.4, 8.0), valve, st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
        run = st.simulate(loop, 70.0, float(n), load, seed=1, pv_start=70.0, op_start=50.0, tag=name, loop_type="flow")
        out[name] = replace(run, mv=None)
        if name in POSITIONS:
            stem = run.mv + POSITION_NOISE * np.random.default_rng(5).normal(size=n)
            seen[f"{name} with position"] = replace(run, mv=stem, tag=f"{name} with position")
    loop = replace(loop, valve=st.Kano(5.0, 3.0))
    run = st.simulate(
        loop, 70.0, 3.0 * n, 6.0 * (np.arange(3 * n) < 20), seed=1, pv_start=70.0, op_start=50.0, tag="slower"
    )
    out["slower"] = replace(sampled(run, 3.0), mv=None, loop_type="flow", integrating=False)
    return out | seen


def _peak_memory() -> float:
    """Peak resident memory of a fresh process that diagnoses the longest of the loops [MB]."""
    work = "import resource, diagnosis, stiction as st; st.diagnose(diagnosis._loops(30_000)['sticky']); "
    work += "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    told = subprocess.run(
        [sys.executable, "-c", work], capture_output=True, text=True, check=True, cwd=os.path.dirname(__file__)
    )
    return int(told.stdout) / (1024.0**2 if sys.platform == "darwin" else 1024.0)
