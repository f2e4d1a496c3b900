"""No module of the package imports itself through others, not even for type checking or inside a function."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "stiction"


def import_graph(package: Path) -> dict[str, set[str]]:
    """Return module name -> modules of the package that it imports anywhere in its text."""
    files = {".".join(path.relative_to(package.parent).with_suffix("").parts): path for path in package.rglob("*.py")}
    files = {name.removesuffix(".__init__"): path for name, path in files.items()}
    return {name: imported_by(path, set(files)) - {name} for name, path in files.items()}


def imported_by(path: Path, modules: set[str]) -> set[str]:
    """Return those of `modules` that a file imports; the package has no relative imports."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: write the import from the package's root"
            submodules = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= submodules & modules or {str(node.module)}
    return names & modules


def find_circle(graph: dict[str, set[str]]) -> list[str]:
    """Return the modules of one import circle, empty when there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_package_has_no_import_circle():
    graph = import_graph(PACKAGE)
    assert len(graph) > 100
    assert not find_circle(graph)


@pytest.mark.parametrize(
    "text", ["from pkg.b import x", "if TYPE_CHECKING:\n    import pkg.b", "def f():\n    from pkg import b"]
)
def test_a_circle_of_two_is_found(tmp_path, text):
    package = tmp_path / "pkg"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "a.py").write_text(text)
    (package / "b.py").write_text("from pkg.a import y")
    assert set(find_circle(import_graph(package))) == {"pkg.a", "pkg.b"}
