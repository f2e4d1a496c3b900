"""The conditions between the settings of a model, from its constructor."""

from __future__ import annotations

import ast
import inspect
from typing import TYPE_CHECKING

from stiction.export.function_body import FunctionBody
from stiction.export.values import TranslationError, Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.export.translate import Translator
    from stiction.export.values import Settings

__all__ = ["relations"]


def relations(translator: Translator, settings: Settings) -> list[tuple[str, str]]:
    """The conditions between settings under which the constructor of a model raises an error.

    Returns
    -------
    list of tuple of str
        Condition in the target language, and the text of the condition in Python.
    """
    found: list[tuple[str, str]] = []
    for kind in type(settings.model).__mro__:
        if "__post_init__" in vars(kind):
            body = FunctionBody(translator, vars(kind)["__post_init__"], [settings])
            _find_refusals(body, body.tree.body, found)
    return found


def _find_refusals(body: FunctionBody, statements: Sequence[ast.stmt], found: list[tuple[str, str]]) -> None:
    for statement in statements:
        try:
            if isinstance(statement, ast.If):
                test = body.truth(body.value(statement.test))
                if not isinstance(test, Value):
                    _find_refusals(body, statement.body if test else statement.orelse, found)
                elif isinstance(statement.body[-1], ast.Raise) and not body.lines:
                    found.append((test.text, ast.unparse(statement.test).replace("self.", "")))
            elif isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
                called = body.value(statement.value.func)
                if inspect.isfunction(called):
                    given = [body.value(one) for one in statement.value.args]
                    inner = FunctionBody(body.translator, called, given)
                    inner.env = dict(zip(inner.env, given, strict=True))
                    _find_refusals(inner, inner.tree.body, found)
        except TranslationError:
            body.lines.clear()
