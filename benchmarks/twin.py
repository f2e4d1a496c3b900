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


@cache
def twin() -> ctypes.CDLL:
    """Compile twin.c and declare its functions."""
    folder = tempfile.TemporaryDirectory()
    library = Path(folder.name) / "twin.so"
    source = Path(__file__).with_name("twin.c")
    subprocess.run([*COMMAND, "-o", str(library), str(source), "-lm"], check=True)
    loaded = ctypes.CDLL(str(library))
    folder.cleanup()
    for name, parameters in _STROKES.items():
        stroke = getattr(loaded, f"stroke_{name}")
        stroke.restype, stroke.argtypes = None, [_N, _SERIES, *[_D] * parameters, _D, _D, _SERIES]
    loaded.loop_kano.restype = None
    loaded.loop_kano.argtypes = [_N, *[_D] * 9, _N, _D, _SERIES, _SERIES, _SERIES]
    return loaded
