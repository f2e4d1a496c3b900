"""The build hook packs the plot library of the web page, and does not stop a build where it cannot."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

HOOK = Path(__file__).resolve().parents[2] / "hatch_build.py"


@pytest.fixture
def hook(monkeypatch, tmp_path):
    """The hook with a folder of its own, and what it warns of; the build backend is a stand-in."""
    interface = ModuleType("interface")
    interface.BuildHookInterface = object  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "hatchling.builders.hooks.plugin.interface", interface)
    cls = runpy.run_path(str(HOOK))["PlotLibraryHook"]
    names = cls.initialize.__globals__
    monkeypatch.setitem(names, "SCRIPT", tmp_path / "fetch.py")
    monkeypatch.setitem(names, "LIBRARY", tmp_path / "uPlot.esm.js")
    said: list[str] = []
    made = cls()
    made.app = SimpleNamespace(display_warning=said.append)
    return made, said, tmp_path


def test_registry_out_of_reach_leaves_the_library_out(hook):
    made, said, folder = hook
    (folder / "fetch.py").write_text("import sys\nsys.exit('no connection')")
    made.initialize("standard", {})
    assert said == ["The plot library of stiction serve is left out: no connection"]


def test_library_that_is_there_is_not_fetched_again(hook):
    made, said, folder = hook
    (folder / "fetch.py").write_text("raise RuntimeError('fetched again')")
    (folder / "uPlot.esm.js").write_text("")
    made.initialize("standard", {})
    assert (said, made.dependencies()) == ([], [])
