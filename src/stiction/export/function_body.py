"""Translate the statements of one function."""

from __future__ import annotations

import ast
import builtins
import inspect
import re
import textwrap
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.export.expressions import Expressions
from stiction.export.values import Settings, TranslationError, Type, Value, is_known

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["FunctionBody"]


class FunctionBody(Expressions):
    """The body of one function while it is translated."""

    def __init__(self, translator: Any, function: Any, arguments: Sequence[Any]) -> None:
        super().__init__(translator)
        self.function = function
        self.file, self.tree = _parse(function)
        self.known = {**vars(builtins), **function.__globals__}
        self.node: ast.stmt | None = None
        self.depth = self.temporaries = 0
        self.lines: list[str] = []
        self.top: list[str] = []
        self.result: Type | None = None
        self.fixed_result: list[Any] = []
        names = [argument.arg for argument in self.tree.args.args]
        if len(names) != len(arguments):
            raise TranslationError(f"{function.__name__} takes {len(names)} arguments, not {len(arguments)}")
        self.env = dict(zip(names, arguments, strict=True))
        self.signature: list[tuple[str, Type | None]] = []
        for name, value in self.env.items():
            shown = self.syntax.name(name)
            if isinstance(value, (Value, Settings)):
                self.env[name] = Value(value.type, shown) if isinstance(value, Value) else replace(value, text=shown)
                self.signature.append((shown, getattr(value, "type", None)))
        self.declared = {name: one.type for name, one in self.env.items() if isinstance(one, Value)}
        stores = [
            node.id for node in ast.walk(self.tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
        ]
        self.varies = {name for name in stores if stores.count(name) > 1 or name in names}

    def translate(self) -> tuple[str, Type] | tuple[None, Any]:
        """Translate; return the name of the function and the type of its result, or None and the result if known."""
        name = self.translator.name_function(self.function)
        try:
            self.block(self.tree.body, last=True)
        except TranslationError as error:
            del self.translator.functions[name]
            if getattr(error, "placed", False):
                raise
            line = getattr(self.node, "lineno", 0)
            placed = TranslationError(
                f"{self.file}, line {line}: {error}; this cannot be translated to {self.syntax.language}."
            )
            placed.placed = True  # type: ignore[attr-defined]
            raise placed from None
        if self.result is None and not self.lines:
            del self.translator.functions[name]
            return None, (self.fixed_result or [None])[0]
        result = self.result or "void"
        body = [f"    {line}" for line in [*self.top, *self.lines]]
        if self.syntax.is_c:
            self._mark_unused(body)
        comment = " ".join((inspect.getdoc(self.function) or self.function.__name__).split("\n\n")[0].split())
        del self.translator.functions[name]  # behind the functions that it calls
        self.translator.functions[name] = (self.signature, result, comment, body)
        return name, result

    def _mark_unused(self, body: list[str]) -> None:
        text, known = "\n".join(body), [shown for shown, _ in self.signature]
        for shown in (self.syntax.name(name) for name in self.declared):
            if shown not in known and _count(text, shown) == 1:
                at = next(k for k, line in enumerate(body) if _count(line, shown))
                body.insert(at + 1, f"    {self.syntax.write('unused', shown)}")
        body[:0] = [f"    {self.syntax.write('unused', shown)}" for shown in known if not _count(text, shown)]

    def emit(self, *lines: str) -> None:
        """Add lines at the depth of the current block."""
        self.lines += ["    " * self.depth + line for line in lines]

    def block(self, statements: Sequence[ast.stmt], *, last: bool = False) -> bool:
        """Translate statements; return whether they always leave the function."""
        for k, statement in enumerate(statements):
            self.node = statement
            if self.statement(statement, last=last and k == len(statements) - 1 and self.depth == 0):
                return True
        return False

    def statement(self, node: ast.stmt, *, last: bool) -> bool:
        """Translate a statement; return whether it always leaves the function."""
        match node:
            case ast.Pass() | ast.Delete() | ast.Assert() | ast.Expr(ast.Constant()) | ast.AnnAssign(value=None):
                pass
            case ast.Expr(call):
                done = self.value(call)
                if not (isinstance(done, Value) and done.type == "void"):
                    raise TranslationError("a statement without effect is not known")
                self.emit(self.syntax.write("call", done.text))
            case ast.Assign([target], value) | ast.AnnAssign(target, _, ast.expr() as value):
                self.assign(target, value)
            case ast.AugAssign(target, sign, value):
                self.assign(target, ast.copy_location(ast.BinOp(_loaded(target), sign, value), node))
            case ast.If():
                return self.branches(node, last=last)
            case ast.For(ast.Name(name), ast.Call(ast.Name("range"), ends), orelse=[]) if len(ends) < 3:
                values = [self.translator.as_value(self.value(end)) for end in ends]
                if any(value.type != "int" for value in values):
                    raise TranslationError("the ends of a range must be whole numbers")
                shown = self.syntax.name(name)
                self.env[name] = Value("int", shown)
                self.loop(node.body, "for", shown, "0" if len(ends) == 1 else values[0].text, values[-1].text)
            case ast.For():
                raise TranslationError("a loop needs a range of at most two ends, and one name")
            case ast.While(orelse=[]):
                self.loop(node.body, "while", self.condition(node.test).text)
            case ast.Return(value):
                return self.leave(value and self.value(value), last=last)
            case ast.Raise():  # a refusal gives NaN, which the function that starts the model reports
                return self.leave(float("nan"), last=last)
            case _:
                raise TranslationError(f"the statement `{type(node).__name__.lower()}` is not known")
        return False

    def assign(self, target: ast.expr, node: ast.expr) -> None:
        """Assign the value of an expression to names or entries of arrays."""
        value = self.value(node)
        if not isinstance(target, ast.Tuple):
            self.store(target, value)
            return
        parts = self.parts(value, len(target.elts))
        later = {n.id for part in getattr(node, "elts", [])[1:] for n in ast.walk(part) if isinstance(n, ast.Name)}
        if later & {part.id for part in target.elts[:-1] if isinstance(part, ast.Name)}:
            parts = [self.keep(part) if isinstance(part, Value) else part for part in parts]
        for part, item in zip(target.elts, parts, strict=True):
            self.store(part, item)

    def store(self, target: ast.expr, value: Any) -> None:
        """Assign a value to a name or to an entry of an array."""
        if isinstance(target, ast.Subscript):
            self.emit(self.syntax.assign(self.value(_loaded(target)).text, self.number(value).text))
            return
        if not isinstance(target, ast.Name):
            raise TranslationError("only a name or an entry of an array can be assigned")
        if (name := target.id) == "_":
            return
        is_number = isinstance(value, (bool, int, float)) and (name in self.varies or self.depth > 0)
        if not (is_number or isinstance(value, Value)):
            if self.depth and name in self.declared:
                raise TranslationError(f"{name} is a number elsewhere")
            if not is_known(value) and self.varies & set(re.findall(r"\w+", repr(value))):
                raise TranslationError(f"{name} holds numbers that change")
            self.env[name] = value
            return
        value = self.translator.as_value(value)
        shown, known = self.syntax.name(name), self.declared.get(name)
        if value.text == shown:
            return
        if known == "double" and value.type == "int":
            value = self.translator.real(value)
        if known not in (None, value.type):
            raise TranslationError(f"{name} has two types")
        if known is None:
            self.declared[name] = value.type
            if self.depth and self.syntax.is_c:
                zero = {"int": "0", "bool": "0", "double": "0.0"}.get(str(value.type), "{0}")
                self.top.append(self.syntax.assign(shown, zero, value.type))
                known = value.type
        self.emit(self.syntax.assign(shown, value.text, value.type if known is None else None))
        self.env[name] = Value(value.type, shown)

    def keep(self, value: Value) -> Value:
        """The value in a variable of its own."""
        if value.text.isidentifier():
            return value
        self.temporaries += 1
        self.emit(self.syntax.assign(f"t{self.temporaries}", value.text, value.type))
        return Value(value.type, f"t{self.temporaries}")

    def condition(self, node: ast.expr) -> Value:
        """A condition that is evaluated again and again, or after others."""
        before, test = len(self.lines), self.truth(self.value(node))
        if not isinstance(test, Value) or len(self.lines) > before:
            raise TranslationError("this condition is constant, or takes a record apart")
        return test

    def branches(self, node: ast.If, *, last: bool) -> bool:
        """Translate an `if` and its `elif` and `else`; what is known beforehand is left out."""
        left, rest, word = [], [node], "if"
        while len(rest) == 1 and isinstance(rest[0], ast.If):
            self.node, before = rest[0], len(self.lines)
            test = self.truth(self.value(rest[0].test))
            if not isinstance(test, Value):
                rest = rest[0].body if test else rest[0].orelse
                continue
            if word == "elif" and len(self.lines) > before:
                raise TranslationError("a condition after `elif` takes a record apart")
            self.emit(self.syntax.write(word, test.text))
            left.append(self.inner(rest[0].body))
            rest, word = rest[0].orelse, "elif"
        if word == "if":
            return self.block(rest, last=last)
        if rest:
            self.emit(self.syntax.write("else"))
            left.append(self.inner(rest))
        self.emit(self.syntax.write("end"))
        return bool(rest) and all(left)

    def loop(self, statements: Sequence[ast.stmt], *parts: str) -> None:
        """A loop with these words at its head."""
        self.emit(self.syntax.write(*parts))
        self.inner(statements)
        self.emit(self.syntax.write("end"))

    def inner(self, statements: Sequence[ast.stmt]) -> bool:
        """Translate the statements of a branch or a loop."""
        self.depth += 1
        left = self.block(statements)
        self.depth -= 1
        return left

    def leave(self, value: Any, *, last: bool) -> bool:
        """Return a value from the function."""
        if is_known(value) and not self.lines and self.depth == 0 and self.result is None:
            self.fixed_result.append(value)
            return True
        value = self.translator.as_value(value)
        if not isinstance(value, Value):
            raise TranslationError("the result is not a number or a record of numbers")
        if self.result == "double" and value.type == "int":
            value = self.translator.real(value)
        if self.result not in (None, value.type):
            raise TranslationError("the function returns two types")
        self.result = value.type
        self.emit(self.syntax.write("return", value.text), *([] if last or self.syntax.is_c else ["return"]))
        return True


def _loaded(target: ast.expr) -> ast.expr:
    """The target of an assignment as an expression."""
    return ast.parse(ast.unparse(target), mode="eval").body


def _count(text: str, name: str) -> int:
    return len(re.findall(rf"\b{re.escape(name)}\b", text))


@cache
def _parse(function: Any) -> tuple[str, ast.FunctionDef]:
    """File name and syntax tree of a function, its lines numbered as in the file."""
    try:
        lines, first = inspect.getsourcelines(function)
    except (OSError, TypeError):
        raise TranslationError(f"{function!r} has no source") from None
    tree = ast.parse(textwrap.dedent("".join(lines)))
    ast.increment_lineno(tree, first - 1)
    node = tree.body[0]
    if not isinstance(node, ast.FunctionDef):
        raise TranslationError(f"{function!r} is not a function")
    return Path(inspect.getsourcefile(function) or "?").name, node
