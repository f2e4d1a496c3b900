"""Docstrings of public names: parameters, units, results, errors, examples, and sources that exist."""

from __future__ import annotations

import ast
import builtins
import dataclasses
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
NUMBER = re.compile(r"\b(float|int|ArrayLike)\b")
CALLED_OR_KEYED = re.compile(r"\b(Callable|Mapping|dict)\[.*\]")
WITH_DOC = (ast.Module, ast.ClassDef, ast.FunctionDef)

MODULES = [importlib.import_module(m.name) for m in pkgutil.walk_packages(st.__path__, "stiction.")]
PUBLIC = {name: getattr(st, name) for name in st.__all__ if name not in ("__version__", "quality")}
CHECKS = {name: getattr(st.quality, name) for name in st.quality.__all__}
RECORDS = {name: getattr(records, name) for name in records.__all__ if callable(getattr(records, name))}
NAMES = PUBLIC | CHECKS | RECORDS
NAMES = {name: one for name, one in NAMES.items() if not (isinstance(one, type) and issubclass(one, Exception))}
RESULTS = {
    name: getattr(module, name)
    for module in MODULES
    if module.__name__.endswith(".result")
    for name in module.__all__
    if dataclasses.is_dataclass(getattr(module, name))
}
PAGES = [p for p in sorted(PACKAGE.rglob("*.py")) if p.stem != "__init__"]
WRITTEN = "".join(page.read_text(encoding="utf-8") for page in (PACKAGE.parents[1] / "docs").rglob("*.md"))


def sections(doc: str | None) -> dict[str, str]:
    """Numpydoc sections by heading; what stands before the first is the summary."""
    parts = HEADING.split(doc or "")
    return {"Summary": parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}


def parameter_docs(doc: str | None) -> dict[str, str]:
    """Parameter -> its entry under Parameters, type line included."""
    docs: dict[str, str] = {}
    entries = re.split(r"\n(?=\S)", sections(doc).get("Parameters", "").strip("\n"))
    for entry in filter(None, entries):
        names = entry.split("\n")[0].split(" : ")[0]
        docs.update({name.strip().lstrip("*"): entry for name in names.split(",")})
    return docs


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
    """Parameter -> its documentation: under Parameters, or under the field of a dataclass."""
    docs: dict[str, str] = {}
    for cls in reversed(thing.__mro__) if isinstance(thing, type) else ():
        if dataclasses.is_dataclass(cls):
            docs |= field_docs(cls) | parameter_docs(inspect.getdoc(cls))
    return docs | parameter_docs(inspect.getdoc(thing))


def arguments(thing) -> dict[str, str]:
    """Parameter -> annotation."""
    parameters = inspect.signature(thing).parameters.values()
    return {p.name: str(p.annotation) for p in parameters if p.name not in ("self", "cls")}


def is_number(annotation: str) -> bool:
    """Whether a parameter takes a number or an array of numbers."""
    return bool(NUMBER.search(CALLED_OR_KEYED.sub("", annotation)))


def raises(thing) -> bool:
    """Whether a function, or the constructor of a class, raises or calls a check of its arguments."""
    if isinstance(thing, type):
        own = [vars(cls)[name] for cls in thing.__mro__ for name in ("__init__", "__post_init__") if name in vars(cls)]
        checks = [one for one in own if inspect.isfunction(one) and one.__module__.startswith("stiction")]
        checks = [one for one in checks if one.__code__.co_filename != "<string>"]  # not those that dataclass writes
    else:
        checks = [thing]
    trees = [ast.parse(textwrap.dedent(inspect.getsource(one))) for one in checks]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    calls = [ast.unparse(node.func) for node in nodes if isinstance(node, ast.Call)]
    return any(isinstance(node, ast.Raise) for node in nodes) or any(call.startswith("require_") for call in calls)


@pytest.mark.parametrize("name", NAMES)
def test_summary_is_a_sentence(name):
    first = (inspect.getdoc(NAMES[name]) or "").split("\n\n")[0].strip()
    assert first.endswith((".", ":")), f"{name}: the docstring begins with a sentence"
    assert not first.startswith(f"{name}("), f"{name}: the docstring is written by dataclass"


@pytest.mark.parametrize("name", NAMES)
def test_every_parameter_is_documented(name):
    missing = arguments(NAMES[name]).keys() - documented(NAMES[name]).keys()
    assert not missing, f"{name} does not document {sorted(missing)}"


@pytest.mark.parametrize("name", NAMES)
def test_every_number_has_a_unit(name):
    docs = documented(NAMES[name])
    numbers = [argument for argument, kind in arguments(NAMES[name]).items() if is_number(kind)]
    bare = [argument for argument in numbers if not UNIT.search(docs.get(argument, ""))]
    assert not bare, f"{name}: no unit in brackets, or [-], for {bare}"


@pytest.mark.parametrize("name", [name for name, one in NAMES.items() if inspect.isfunction(one)])
def test_function_documents_what_it_returns(name):
    assert sections(inspect.getdoc(NAMES[name])).get("Returns", "").strip()


@pytest.mark.parametrize("name", [name for name, one in NAMES.items() if raises(one)])
def test_errors_are_documented(name):
    assert "Error" in sections(inspect.getdoc(NAMES[name])).get("Raises", ""), f"{name} raises; say what and when"


def example_of(thing: object) -> str:
    return sections(inspect.getdoc(thing)).get("Examples", "")


@pytest.mark.parametrize("name", [name for name, one in (CHECKS | RECORDS).items() if inspect.isfunction(one)])
def test_example_is_there(name):
    assert ">>> " in example_of(NAMES[name])


@pytest.mark.parametrize("name", PUBLIC)
def test_example_can_be_pasted(name):
    """It imports what it uses; that it runs is a doctest."""
    example = example_of(PUBLIC[name])
    assert ">>> " in example, f"{name} has no example"
    lines = re.findall(r"^(?:>>>|\.\.\.) (.*)$", example, re.M)
    tree = ast.parse("\n".join(lines))
    bound = {
        ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            bound |= {alias.asname or alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            bound |= {node.name}
        elif isinstance(node, ast.arg):
            bound |= {node.arg}
        elif isinstance(node, ast.ExceptHandler):
            bound |= {str(node.name)}
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    assert not used - bound - set(dir(builtins)), f"the example of {name} does not import {used - bound}"


@pytest.mark.parametrize("name", PUBLIC)
def test_name_stands_on_a_page_of_the_documentation(name):
    assert re.search(rf"\b{name}\b", WRITTEN), f"{name} is in __all__ and on no page of docs/"


@pytest.mark.parametrize("name", RESULTS)
def test_result_documents_every_field(name):
    docs = field_docs(RESULTS[name])
    fields = dataclasses.fields(RESULTS[name])
    bare = [f.name for f in fields if re.search(r"\bfloat\b", str(f.type)) and not UNIT.search(docs.get(f.name, ""))]
    assert docs.keys() >= {f.name for f in fields}
    assert not bare, f"{name}: no unit in brackets for {bare}"


@pytest.mark.parametrize("name", [name for name, one in NAMES.items() if isinstance(one, type)])
def test_public_methods_are_documented(name):
    for method, function in vars(NAMES[name]).items():
        plain = getattr(function, "__func__", function)
        if method.startswith("_") or not inspect.isfunction(plain):
            continue
        doc = inspect.getdoc(getattr(NAMES[name], method)) or ""
        numbers = [n for n, kind in arguments(plain).items() if re.search(r"\bfloat\b", kind) and n != "dt"]
        assert doc, f"{name}.{method} has no docstring"
        assert all(UNIT.search(parameter_docs(doc).get(n, doc)) for n in numbers), (
            f"{name}.{method}: no unit: {numbers}"
        )


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


def test_every_source_is_listed_once_and_cited():
    keys = bib_keys()
    assert keys
    assert len(keys) == len(set(keys))
    pages = "".join(p.read_text(encoding="utf-8") for p in PAGES)
    assert not [key for key in keys if key not in pages]
