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
        Condition in the target language, and the condition in words.
    """
    found: list[tuple[str, str]] = []
    for kind in type(settings.model).__mro__:
        if "__post_init__" in vars(kind):
            body = FunctionBody(translator, vars(kind)["__post_init__"], [settings])
            _find_refusals(body, body.tree.body, found)
    return found


WORDS = {
    ast.Gt: "above", ast.Lt: "below", ast.GtE: "not below", ast.LtE: "not above", ast.Eq: "", ast.NotEq: "not",
}  # fmt: skip
"""Comparison -> what stands after "is"."""


def _in_words(body: FunctionBody, node: ast.expr) -> str:
    """A condition as a sentence without its full stop, such as "sj is above 2 sb"."""
    match node:
        case ast.UnaryOp(ast.Not(), ast.Compare(low, [ast.LtE(), ast.LtE()], [middle, high])):
            low, middle, high = (_in_words(body, one) for one in (low, middle, high))
            return f"{middle} is not between {low} and {high}"
        case ast.Compare(left, [kind], [right]) if type(kind) in WORDS:
            return " ".join(f"{_in_words(body, left)} is {WORDS[type(kind)]} {_in_words(body, right)}".split())
        case ast.BoolOp(kind, parts):
            return (" and " if isinstance(kind, ast.And) else " or ").join(_in_words(body, one) for one in parts)
        case ast.BinOp(left, ast.Mult(), right):
            # A factor that only widens a limit by a rounding error reads as 1.
            factors = [text for text in (_in_words(body, left), _in_words(body, right)) if text != "1"]
            return " ".join(factors) or "1"
        case ast.Attribute(ast.Name(), name):
            owner = body.value(node.value)
            return f"{getattr(owner, 'prefix', '')}{name}"
    if not any(isinstance(one, ast.Attribute) for one in ast.walk(node)):
        known = body.value(node)
        if isinstance(known, (int, float)):
            return f"{known:g}"
        if isinstance(known, str):
            return known
    return ast.unparse(node).replace("self.", "")


def _find_refusals(body: FunctionBody, statements: Sequence[ast.stmt], found: list[tuple[str, str]]) -> None:
    for statement in statements:
        try:
            if isinstance(statement, ast.If):
                test = body.truth(body.value(statement.test))
                if not isinstance(test, Value):
                    _find_refusals(body, statement.body if test else statement.orelse, found)
                elif isinstance(statement.body[-1], ast.Raise) and not body.lines:
                    found.append((test.text, _in_words(body, statement.test)))
            elif isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
                called = body.value(statement.value.func)
                if inspect.isfunction(called):
                    given = [body.value(one) for one in statement.value.args]
                    inner = FunctionBody(body.translator, called, given)
                    inner.env = dict(zip(inner.env, given, strict=True))
                    _find_refusals(inner, inner.tree.body, found)
        except TranslationError:
            body.lines.clear()
