"""Loops of many kinds, in files of their own: what every surface must say alike."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

import stiction as st

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

KINDS = ("plain", "gaps", "manual", "all in manual", "shut in", "saturated", "long")
UNITS = {"%": (0.0, 100.0), "fraction": (0.0, 1.0), "mA": (4.0, 20.0), "counts": (0.0, 4095.0)}
"""Unit of OP -> its value at 0 and at 100 % of span."""
LOOPS_PER_FILE = 4


def draw_loop(k: int, samples: int = 1200) -> st.LoopRecord:
    """Simulate one loop: every second valve sticks; the kind is that of `KINDS` in turn."""
    rng, kind = np.random.default_rng([55, k]), KINDS[k % len(KINDS)]
    n = 10 * samples if kind == "long" else samples
    S = float(rng.uniform(2.0, 7.0)) if (k // len(KINDS)) % 2 == 0 else 0.0
    valve = st.Kano(S, S * float(rng.uniform(0.1, 0.7))) if S else st.Ideal()
    tau = float(rng.uniform(6.0, 12.0 if kind != "long" else 60.0))
    loop = st.Loop(st.PID(float(rng.uniform(0.1, 0.3)), tau), valve, st.FOPDT(2.0, tau, 0.5 * tau), dt=1.0, noise=0.05)
    sp, manual = np.full(n, 50.0), None
    if kind == "saturated":
        sp[n // 2 : n // 2 + n // 8] = 160.0
    if "manual" in kind:
        manual = np.full(n, np.nan)
        manual[: n if kind == "all in manual" else n // 4] = 45.0
    load = np.cumsum(rng.normal(0.0, 0.02, n))
    run = st.simulate(
        loop, sp, float(n), load, k, manual=manual, pv_start=50.0, op_start=50.0, tag=f"U{k % 3}-FIC{k:03d}",
        loop_type="flow",
    )  # fmt: skip
    op, pv = run.op.copy(), np.array(run.pv)
    if kind == "shut in":
        op[: n // 3], pv[: n // 3] = 0.0, rng.normal(0.0, 0.01, n // 3)
    if kind == "gaps":
        for first in rng.integers(0, n - 40, 5):
            op[first : first + 30], pv[first : first + int(rng.integers(1, 40))] = np.nan, np.nan
    return st.LoopRecord(run.tag, 1.0, op, pv, run.sp, auto=run.auto, loop_type="flow")


def write_drawn_plant(folder: Path, loops: int) -> Path:
    """Write the loops, those of one length to a file, and `map.csv` beside the folder; OP in four units in turn."""
    folder.mkdir()
    lines = [["tag", "loop", "role", "unit", "low", "high"]]
    records = sorted((draw_loop(k) for k in range(loops)), key=len)
    lengths = {len(one) for one in records}
    for length in lengths:
        alike = [one for one in records if len(one) == length]
        for first in range(0, len(alike), LOOPS_PER_FILE):
            columns: dict[str, NDArray | list[str]] = {"Time": np.arange(float(length))}
            for one in alike[first : first + LOOPS_PER_FILE]:
                unit = list(UNITS)[int(one.tag[-3:]) % len(UNITS)]
                low, high = UNITS[unit]
                signals = {"OP": low + (high - low) * one.op / 100.0, "PV": one.pv, "SP": one.sp}
                for name, values in signals.items():
                    columns[f"{one.tag}.{name}"] = np.asarray(values)
                    ends = [f"{low:g}", f"{high:g}"] if name == "OP" else ["", ""]
                    lines.append([f"{one.tag}.{name}", one.tag, name.lower(), "" if name == "OP" else "m3/h", *ends])
                if one.auto is not None:
                    columns[f"{one.tag}.MODE"] = ["AUTO" if on else "MAN" for on in one.auto]
                    lines.append([f"{one.tag}.MODE", one.tag, "mode", "", "", ""])
            pl.DataFrame(columns).write_parquet(folder / f"unit-{length}-{first:03d}.parquet")
    path = folder.with_name("map.csv")
    with path.open("w", newline="") as file:
        csv.writer(file).writerows(lines)
    return path
