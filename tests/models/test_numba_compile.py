"""The kernels' cache: one log message says that kernels are being compiled."""

from __future__ import annotations

import logging

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
