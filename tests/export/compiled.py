"""Exported C, compiled and loaded; and one example of each valve and compensator, from its own docstring."""

from __future__ import annotations

import ast
import ctypes
import doctest
import inspect
import math
import shutil
import subprocess
from functools import cache
from pathlib import Path  # noqa: TC003 - of a fixture

import numpy as np
from tests.services import require

import stiction as st
from stiction.export.block import block_of
from stiction.models import Valve, compensators
from stiction.models.valves import __all__ as VALVE_NAMES

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off")
BUILDS = [(compiler, level) for compiler in ("gcc", "clang") for level in ("-O0", "-O2")]
COMPENSATOR_NAMES = [name for name in compensators.__all__ if name != "Compensator"]
_SERIES = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")


def example_of(kind: type):
    """The first model of this class that its docstring makes."""
    for example in doctest.DocTestParser().get_examples(inspect.getdoc(kind) or ""):
        for node in ast.walk(ast.parse(example.source)):
            if isinstance(node, ast.Call) and ast.unparse(node.func).startswith(f"st.{kind.__name__}"):
                return eval(ast.unparse(node), {"st": st})
    raise AssertionError(f"no example of {kind.__name__} in its docstring")


@cache
def physical(**options) -> st.PhysicalValve:
    """A physical valve with few sub-steps, so that 1e5 samples are quick."""
    return st.PhysicalValve(
        2.0, 1e5, 2000.0, 300.0, 800.0, 1e-3, 0.1, 0.1, lag=0.5, substep=0.005, bristle_stiffness=1e6, **options
    )


VARIANTS = {
    "choudhury_above": st.Choudhury(1.0, 3.0),
    "srinivasan_printed": st.Srinivasan(2.0, 1.0, 0.1, as_printed=True),
    "srinivasan_table": st.Srinivasan(st.Table([0.0, 100.0], [1.0, 2.0]), 1.0, 0.1),
    "srinivasan_never": st.Srinivasan(2.0, 1.0, math.inf),
    "kano_stops": st.Kano(3.0, 1.0, travel=(45.0, 55.0)),
    "hewang_rebound": st.HeWang(2.0, 1.0, 1.99),
    "physical_lugre": physical(friction="lugre"),
    "physical_positioner": physical(positioner=st.Positioner(3.0, 20.0, 0.1), hold="linear"),
    "physical_lugre_preload": physical(friction="lugre", preload=100.0, air_to_open=False),
    "four_move_wide": st.FourMove(1.0, 1.5, 0.3, 3.0, 1, 2),
}


def models() -> dict[str, object]:
    """Every valve and compensator by name, and variants."""
    known = {name: getattr(st, name) for name in [*VALVE_NAMES, *COMPENSATOR_NAMES]}
    found = {name.lower(): example_of(kind) for name, kind in known.items()}
    return {**found, "physicalvalve": physical(), **VARIANTS}


def sampling_period(model: object) -> float:
    """A sampling period at which the physical valve has ten sub-steps [s]."""
    return 0.05 if isinstance(model, st.PhysicalValve) else 1.0


def compile_all(made: dict[str, object], folder: Path, compiler: str, level: str, dt=None) -> ctypes.CDLL:
    """Export models, compile all of them to one library with a function `run_NAME(n, start, inputs, outputs)`."""
    require(shutil.which(compiler), f"no {compiler} on this machine")
    lines = ["#include <stddef.h>"]
    files = []
    for name, model in made.items():
        step = getattr(model, "dt", None) or dt or sampling_period(model)
        written = st.export_c(model, folder, dt=step, name=name)
        block = block_of(model, name, step)
        starts = ", ".join(f"start[{k}]" for k in range(len(block.start_arguments)))
        n, m = len(block.inputs), len(block.outputs)
        given = ", ".join(f"u[{n} * k + {j}]" for j in range(n))
        signature = f"int run_{name}(size_t n, const double *start, const double *u, double *y)"
        lines += [
            f'#include "{name}.h"', f"{signature};", f"{signature} {{", f"    {name}_model m;",
            f"    {name}_defaults(&m);",
            f"    int wrong = {name}_start(&m, {starts});",
            "    for (size_t k = 0; k < n && !wrong; k++) {", f"        {name}_step(&m, {given});",
            *(f"        y[{m} * k + {j}] = m.{one.name};" for j, one in enumerate(block.outputs)), "    }",
            "    return wrong;", "}",
        ]  # fmt: skip
        files.append(str(written.files[1]))
    driver = folder / "driver.c"
    driver.write_text("\n".join(lines) + "\n")
    library = folder / "library.so"
    command = [compiler, level, *FLAGS, "-shared", "-fPIC", "-o", str(library), str(driver), *files, "-lm"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(library))


def run(library: ctypes.CDLL, name: str, start, inputs, outputs: int) -> np.ndarray:
    """Drive an exported model; `inputs` (n_samples, n_inputs) gives outputs (n_samples, n_outputs)."""
    function = getattr(library, f"run_{name}")
    function.argtypes, function.restype = [ctypes.c_size_t, _SERIES, _SERIES, _SERIES], ctypes.c_int
    inputs = np.ascontiguousarray(inputs, dtype=np.float64)
    found = np.empty((inputs.shape[0], outputs))
    assert function(inputs.shape[0], np.array(start, dtype=np.float64), inputs, found) == 0
    return found


def random_op(n: int, seed: int = 0) -> np.ndarray:
    """A random OP with small and large moves, repeated values and reversals [% of span]."""
    rng = np.random.default_rng(seed)
    moves = rng.normal(0.0, 0.4, n) * (rng.random(n) < 0.7) + rng.normal(0.0, 4.0, n) * (rng.random(n) < 0.05)
    return 50.0 + 30.0 * np.sin(np.cumsum(moves) / 30.0)


def is_valve(model: object) -> bool:
    return isinstance(model, Valve)
