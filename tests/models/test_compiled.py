"""The kernels' cache: that compiling is told, once, to whoever listens."""

from __future__ import annotations

import logging

import numba
import pytest

from stiction.models import compiled


@pytest.fixture
def told(monkeypatch):
    monkeypatch.setattr(compiled._TOLD, "told", False)
    return compiled._TOLD


def compile_one(module):
    def twice(x):
        return 2.0 * x

    twice.__module__ = module
    assert numba.njit(twice)(1.5) == 3.0


def test_compiling_is_told_once(told, caplog):
    with caplog.at_level(logging.INFO, "stiction"):
        compile_one("stiction.models.some")
        compile_one("stiction.models.another")
    assert [record.getMessage() for record in caplog.records] == [compiled.ONCE]


def test_that_nothing_can_be_kept_is_told(told, caplog, monkeypatch):
    monkeypatch.setattr(compiled, "cache_folder", lambda: None)
    with caplog.at_level(logging.INFO, "stiction"):
        compile_one("stiction.models.some")
    assert "NUMBA_CACHE_DIR" in caplog.text


def test_the_kernels_of_others_are_not_told(told, caplog):
    with caplog.at_level(logging.INFO, "stiction"):
        compile_one("somebody.else")
    assert not told.told
    assert not caplog.records
