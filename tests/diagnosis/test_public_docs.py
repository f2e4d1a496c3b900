"""What the diagnosis exports is documented in full, and each example runs where a user pastes it."""

from __future__ import annotations

import ast
import builtins
import doctest
import importlib
import inspect

import pytest

ROOMS = (
    "diagnosis", "diagnosis.detection", "diagnosis.identification", "diagnosis.oscillation", "valvetests",
)  # fmt: skip
EXPORTED = {
    f"{room}.{name}": getattr(module, name)
    for room in ROOMS
    for module in [importlib.import_module(f"stiction.{room}")]
    for name in module.__all__
    if inspect.isfunction(getattr(module, name))
}


@pytest.mark.parametrize("name", EXPORTED)
def test_parameters_returns_and_an_example_are_there(name):
    doc = inspect.getdoc(EXPORTED[name]) or ""
    assert all(f"\n{section}\n---" in doc for section in ("Parameters", "Returns", "Examples"))
    described = doc.partition("Parameters\n")[2].partition("Returns\n")[0]
    assert all(argument in described for argument in inspect.signature(EXPORTED[name]).parameters)


@pytest.mark.parametrize("name", EXPORTED)
def test_examples_use_only_what_they_import(name):
    examples = doctest.DocTestParser().get_examples(inspect.getdoc(EXPORTED[name]) or "")
    known, used = set(dir(builtins)), set()
    for node in ast.walk(ast.parse("".join(example.source for example in examples))):
        if isinstance(node, ast.Import | ast.ImportFrom):
            known |= {alias.asname or alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.Name):
            (known if isinstance(node.ctx, ast.Store) else used).add(node.id)
    assert examples
    assert not used - known
