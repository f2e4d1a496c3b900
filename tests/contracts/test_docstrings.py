"""Docstrings: every argument told, every number with its unit, every method with a source that exists."""

from __future__ import annotations

import ast
import dataclasses
import doctest
import importlib
import inspect
import pkgutil
import re
import textwrap
from pathlib import Path

import pytest

import stiction as st
from stiction import records

PACKAGE = Path(st.__file__).parent
HEADING = re.compile(r"^([A-Z][\w ]+)\n-{3,}$", re.M)
UNIT = re.compile(r"\[[^\]]+\]")
KEY = re.compile(r"\b[a-z][a-z_]+\d{4}[a-z]?\b")
NUMBER = re.compile(r"\bfloat\b")
WITH_DOC = (ast.Module, ast.ClassDef, ast.FunctionDef)

MODULES = [importlib.import_module(m.name) for m in pkgutil.walk_packages(st.__path__, "stiction.")]
FACE = {name: getattr(st, name) for name in st.__all__ if name != "__version__" and hasattr(st, name)}
RECORDS = {name: getattr(records, name) for name in records.__all__ if callable(getattr(records, name))}
FACE |= RECORDS | {name: getattr(st.quality, name) for name in st.quality.__all__}
FACE = {name: thing for name, thing in FACE.items() if not inspect.ismodule(thing)}
FACE = {name: thing for name, thing in FACE.items() if not (isinstance(thing, type) and issubclass(thing, Exception))}
RESULTS = {
    name: getattr(module, name)
    for module in MODULES
    if module.__name__.endswith(".result")
    for name in module.__all__
    if dataclasses.is_dataclass(getattr(module, name))
}
PAGES = [p for p in sorted(PACKAGE.rglob("*.py")) if p.stem != "__init__"]


def sections(doc: str | None) -> dict[str, str]:
    """Numpydoc sections by heading; what stands before the first is the summary."""
    parts = HEADING.split(doc or "")
    return {"Summary": parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}


def told(doc: str | None) -> dict[str, str]:
    """Argument -> what its entry under Parameters says, type line included."""
    found: dict[str, str] = {}
    entries = re.split(r"\n(?=\S)", sections(doc).get("Parameters", "").strip("\n"))
    for entry in filter(None, entries):
        names = entry.split("\n")[0].split(" : ")[0]
        found.update({name.strip().lstrip("*"): entry for name in names.split(",")})
    return found


def field_docs(cls: type) -> dict[str, str]:
    """Field -> the docstring under it."""
    body = ast.parse(textwrap.dedent(inspect.getsource(cls))).body[0]
    assert isinstance(body, ast.ClassDef)
    docs = {}
    for field, below in zip(body.body, [*body.body[1:], None], strict=True):
        if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            docs[ast.unparse(field.target)] = str(below.value.value)
    return docs


def documented(thing: object) -> dict[str, str]:
    """Argument or field -> its documentation, from wherever the form of `thing` puts it."""
    docs: dict[str, str] = {}
    for cls in reversed(thing.__mro__) if isinstance(thing, type) else ():
        if dataclasses.is_dataclass(cls):
            docs |= field_docs(cls) | told(inspect.getdoc(cls))
    return docs | told(inspect.getdoc(thing))


def arguments(thing) -> dict[str, str]:
    """Argument -> annotation."""
    parameters = inspect.signature(thing).parameters.values()
    return {p.name: str(p.annotation) for p in parameters if p.name not in ("self", "cls")}


@pytest.mark.parametrize("name", FACE)
def test_every_argument_is_told(name):
    missing = arguments(FACE[name]).keys() - documented(FACE[name]).keys()
    assert not missing, f"{name} does not tell {sorted(missing)}"


@pytest.mark.parametrize("name", FACE)
def test_every_number_has_a_unit(name):
    docs = documented(FACE[name])
    numbers = [argument for argument, kind in arguments(FACE[name]).items() if NUMBER.search(kind)]
    bare = [argument for argument in numbers if not UNIT.search(docs.get(argument, ""))]
    assert not bare, f"{name}: no unit in brackets for {bare}"


@pytest.mark.parametrize("name", [n for n, thing in FACE.items() if inspect.isfunction(thing)])
def test_function_tells_what_it_returns(name):
    assert "Returns" in sections(inspect.getdoc(FACE[name]))


@pytest.mark.parametrize("name", [n for n, thing in FACE.items() if told(inspect.getdoc(thing))])
def test_example_is_there(name):
    """Constructors and functions show one; results, told field by field, are made by functions that do."""
    assert ">>> " in sections(inspect.getdoc(FACE[name])).get("Examples", "")


@pytest.mark.parametrize("name", RECORDS)
def test_example_runs_as_it_is_pasted(name):
    """It imports what it uses: whoever copies it has none of the page's own names."""
    runner, said = doctest.DocTestRunner(), []
    for example in doctest.DocTestFinder(exclude_empty=True).find(RECORDS[name], name, globs={}):
        runner.run(example, out=said.append)
    assert not runner.failures, "".join(said)


@pytest.mark.parametrize("name", RESULTS)
def test_result_tells_every_field(name):
    docs = field_docs(RESULTS[name])
    fields = dataclasses.fields(RESULTS[name])
    bare = [f.name for f in fields if NUMBER.search(str(f.type)) and not UNIT.search(docs.get(f.name, ""))]
    assert docs.keys() >= {f.name for f in fields}
    assert not bare, f"{name}: no unit in brackets for {bare}"


@pytest.mark.parametrize("name", [n for n, thing in FACE.items() if isinstance(thing, type)])
def test_public_methods_are_told(name):
    for method, function in vars(FACE[name]).items():
        plain = getattr(function, "__func__", function)
        if method.startswith("_") or not inspect.isfunction(plain):
            continue
        doc = inspect.getdoc(getattr(FACE[name], method)) or ""
        numbers = [n for n, kind in arguments(plain).items() if NUMBER.search(kind) and n != "dt"]
        assert doc, f"{name}.{method} has no docstring"
        assert all(UNIT.search(told(doc).get(n, doc)) for n in numbers), f"{name}.{method}: no unit for {numbers}"


def bib_keys() -> list[str]:
    bib = PACKAGE / "references.bib"
    return re.findall(r"^@\w+\{([^,\s]+),", bib.read_text(encoding="utf-8"), re.M) if bib.exists() else []


def cited(page: Path) -> set[str]:
    """Keys named under References, between backticks, or as the source of a piece of evidence."""
    text = page.read_text(encoding="utf-8")
    if not KEY.search(text):
        return set()
    docs = [ast.get_docstring(node) for node in ast.walk(ast.parse(text)) if isinstance(node, WITH_DOC)]
    named = re.findall(r"source=\"([a-z_]+\d{4}[a-z]?)\"|`([a-z][a-z_]+\d{4}[a-z]?)`", text)
    return {key for doc in docs for key in KEY.findall(sections(doc).get("References", ""))} | {
        a or b for a, b in named
    }


@pytest.mark.parametrize(
    "page", [page for page in PAGES if cited(page)], ids=lambda p: p.relative_to(PACKAGE).as_posix()
)
def test_cited_sources_are_in_the_bibliography(page):
    assert cited(page) <= set(bib_keys())


def test_bibliography_has_no_double_and_no_orphan():
    keys = bib_keys()
    assert keys
    assert len(keys) == len(set(keys))
    pages = "".join(p.read_text(encoding="utf-8") for p in PAGES)
    assert not [key for key in keys if key not in pages]
