"""The face: every promised name is there, and importing the package costs next to nothing."""

from __future__ import annotations

import subprocess
import sys

import pytest

import stiction as st

PROMISED = {
    "Stenman",
    "Choudhury",
    "Kano",
    "He",
    "Srinivasan",
    "PhysicalValve",
    "PID",
    "TransferFunction",
    "FOPDT",
    "Loop",
    "LoopRecord",
    "stroke",
    "simulate",
    "describing_function",
    "predict_limit_cycles",
    "read",
    "diagnose",
    "identify",
    "plan_ramp_test",
    "analyse_ramp",
    "plan_step_test",
    "analyse_steps",
}
"""Scripts outside the project call these."""


def run(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.parametrize("name", sorted(set(st.__all__) | PROMISED))
def test_name_is_there(name):
    assert getattr(st, name) is not None


def test_promised_names_are_listed():
    assert set(st.__all__) >= PROMISED
    assert dir(st) == st.__all__


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'Kanno'"):
        _ = st.Kanno


def test_import_is_light():
    heavy = "numba scipy polars plotly jinja2 pint control cyclopts rich numpy"
    loaded = run(f"import sys, stiction; print(*[n for n in '{heavy}'.split() if n in sys.modules])")
    assert loaded == ""


def test_import_is_fast():
    code = "import time; t = time.perf_counter(); import stiction; print(time.perf_counter() - t)"
    assert min(float(run(code)) for _ in range(3)) < 0.1


def test_missing_extra_stops_nothing_else():
    """Without `control` every public name still imports and a loop still runs."""
    run(
        "import sys; sys.modules['control'] = None\n"
        "import stiction as st\n"
        "names = [getattr(st, name) for name in st.__all__]\n"
        "loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), ([3.0], [10.0, 1.0], 10.0), dt=1.0)\n"
        "assert len(st.simulate(loop, sp=1.0, duration=20.0)) == 20\n"
    )
