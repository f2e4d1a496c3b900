"""The C twin: compiled by the machine's own compiler, called by ctypes on the same arrays."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

_SERIES = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
_D, _N = ctypes.c_double, ctypes.c_size_t
_STROKES = {"kano": 2, "stenman": 2, "he": 2, "srinivasan": 3}

COMMAND = ("cc", "-O3", "-shared", "-fPIC", "-ffp-contract=off")


def build(source: str) -> ctypes.CDLL:
    """Compile a page of C beside this one and load it."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "twin.so"
        subprocess.run([*COMMAND, "-o", str(library), str(Path(__file__).with_name(source)), "-lm"], check=True)
        return ctypes.CDLL(str(library))


@cache
def twin() -> ctypes.CDLL:
    """The functions of twin.c, declared."""
    loaded = build("twin.c")
    for name, parameters in _STROKES.items():
        stroke = getattr(loaded, f"stroke_{name}")
        stroke.restype, stroke.argtypes = None, [_N, _SERIES, *[_D] * parameters, _D, _D, _SERIES]
    loaded.loop_kano.restype = None
    loaded.loop_kano.argtypes = [_N, *[_D] * 9, _N, _D, _SERIES, _SERIES, _SERIES]
    return loaded
