"""The search for cyclic garbage is stopped for a first diagnosis only."""

import gc
import sys

from stiction.apps.cli import main
from stiction.apps.collection import pause_collection, resume_collection


def test_search_is_stopped_until_the_modules_are_imported(monkeypatch):
    monkeypatch.delitem(sys.modules, "stiction.diagnosis", raising=False)
    try:
        pause_collection()
        assert not gc.isenabled()
    finally:
        resume_collection()
    assert gc.isenabled()
    gc.unfreeze()


def test_search_goes_on_after_an_error(monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "stiction.diagnosis", raising=False)
    assert main(["diagnose", "no-such-file.csv", "--no-report"]) == 3
    assert "no-such-file.csv" in capsys.readouterr().err
    assert gc.isenabled()
    gc.unfreeze()


def test_search_is_not_stopped_once_all_is_imported(monkeypatch):
    monkeypatch.setitem(sys.modules, "stiction.diagnosis", sys)
    pause_collection()
    assert gc.isenabled()
