"""The kernels' cache: one log message says that kernels are being compiled."""

from __future__ import annotations

import logging
import subprocess
import sys

import numba
import pytest

from stiction.models import numba_compile


@pytest.fixture
def listener(monkeypatch):
    monkeypatch.setattr(numba_compile._LISTENER, "has_logged", False)
    return numba_compile._LISTENER


def compile_one(module):
    def twice(x):
        return 2.0 * x

    twice.__module__ = module
    assert numba.njit(twice)(1.5) == 3.0


def test_compiling_is_logged_once(listener, caplog):
    with caplog.at_level(logging.INFO, "stiction"):
        compile_one("stiction.models.some")
        compile_one("stiction.models.another")
    assert [record.getMessage() for record in caplog.records] == [numba_compile.COMPILE_ONCE_TEXT]


def test_missing_cache_folder_is_logged(listener, caplog, monkeypatch):
    monkeypatch.setattr(numba_compile, "cache_folder", lambda: None)
    with caplog.at_level(logging.INFO, "stiction"):
        compile_one("stiction.models.some")
    assert "NUMBA_CACHE_DIR" in caplog.text


def test_kernels_of_other_packages_are_not_logged(listener, caplog):
    with caplog.at_level(logging.INFO, "stiction"):
        compile_one("somebody.else")
    assert not listener.has_logged
    assert not caplog.records


def test_stored_kernel_is_loaded_without_preparing_to_compile():
    program = (
        "import sys, stiction as st;"
        "print(st.stroke(st.Stenman(2.0), [0.0, 1.0, 3.0, 2.0], dt=1.0).mv.tolist(), 'numba.np.linalg' in sys.modules)"
    )
    runs = [subprocess.run([sys.executable, "-c", program], capture_output=True, text=True) for _ in range(2)]
    assert runs[1].stdout == "[0.0, 0.0, 3.0, 3.0] False\n", runs[1].stderr
