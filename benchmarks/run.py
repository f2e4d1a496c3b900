"""Measure speed and memory, beside others where there are any: `make bench`, or `python benchmarks/run.py loops`.

A section is one file with one function of its name, which returns a `bench.Section`; list it in SECTIONS.
"""

from __future__ import annotations

import importlib
import os
import platform
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

from bench import REPEATS, show

SECTIONS = (
    *("valves", "physical", "loops", "limitcycle", "identification", "evidence", "diagnosis", "compilation"),
    *("exported", "compensation", "sources", "start", "whatif", "web"),
)


def main(asked: list[str]) -> int:
    unknown = sorted(set(asked) - set(SECTIONS))
    if unknown:
        print(f"{', '.join(unknown)} unknown; sections are {', '.join(SECTIONS)}.", file=sys.stderr)
        return 2
    print(machine())
    for name in asked or SECTIONS:
        show(getattr(importlib.import_module(name), name)())
        sys.stdout.flush()
    return 0


def machine() -> str:
    """What the numbers were taken on."""
    cpu = platform.processor() or platform.machine()
    for line in Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else ():
        if line.startswith("model name"):
            cpu = line.split(":")[1].strip()
            break
    compiler = subprocess.run(["cc", "--version"], capture_output=True, text=True, check=False).stdout.splitlines()
    packages = ", ".join(f"{name} {version(name)}" for name in ("stiction", "numpy", "numba", "control"))
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    return (
        f"{cpu}, {os.cpu_count()} cores, load {load:.1f}; Python {platform.python_version()}, {packages}\n"
        f"{compiler[0] if compiler else 'no cc'}; medians of {REPEATS} runs (5 for programs and python-control);\n"
        f"beside C on one core the shortest of {4 * REPEATS - 1} each, taken in turn"
    )


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
