"""Translate the statements of one function."""

from __future__ import annotations

import ast
import builtins
import inspect
import re
import textwrap
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.export.expressions import Expressions
from stiction.export.syntax import Array, Type
from stiction.export.values import Fixed, Items, Settings, TranslationError, Value

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
        self.depth = 0
        self.lines: list[str] = []
        self.top: list[str] = []
        self.declared: dict[str, Type] = {}
        self.result: Type | None = None
        self.fixed_result: list[Fixed] = []
        names = [argument.arg for argument in self.tree.args.args]
        if len(names) != len(arguments):
            raise TranslationError(f"{function.__name__} takes {len(names)} arguments, not {len(arguments)}")
        self.signature: list[tuple[str, Type | None]] = []
        for name, value in zip(names, arguments, strict=True):
            shown = self.syntax.name(name)
            if isinstance(value, Value):
                self.env[name] = Value(value.type, shown)
                self.declared[name] = value.type
                self.signature.append((shown, value.type))
            elif isinstance(value, Settings):
                self.env[name] = Settings(value.model, value.adjustable, shown, value.prefix)
                self.signature.append((shown, None))
            else:
                self.env[name] = value
        stores = [node.id for node in ast.walk(self.tree) if isinstance(node, ast.Name) and _is_store(node)]
        stores += [node.target.id for node in ast.walk(self.tree) if isinstance(node, ast.AugAssign)
                   and isinstance(node.target, ast.Name)]  # fmt: skip
        self.varies = {name for name in stores if stores.count(name) > 1 or name in names}

    def translate(self) -> tuple[str, Type] | Fixed:
        """Translate; return the name of the function and the type of its result, or the result if it is known."""
        name = self.translator.name_function(self.function)
        try:
            self.block(self.tree.body, last=True)
        except TranslationError as error:
            if not getattr(error, "placed", False):
                line = getattr(self.node, "lineno", 0)
                error = TranslationError(
                    f"{self.file}, line {line}: {error}; this cannot be translated to {self.syntax.language}."
                )
                error.placed = True  # type: ignore[attr-defined]
            raise error from None
        if self.result is None and self.lines:
            self.result = "void"
        if self.result is None:
            del self.translator.functions[name]
            return self.fixed_result[0] if self.fixed_result else Fixed(None)
        body = [f"    {line}" for line in [*self.top, *self.lines]]
        text = "\n".join(body)
        if self.syntax.language == "C":
            idle = [f"    {self.syntax.unused(shown)}" for shown, _ in self.signature if not _count(text, shown)]
            known = {shown for shown, _ in self.signature}
            for shown in (self.syntax.name(name) for name in self.declared):
                if shown not in known and _count(text, shown) == 1:
                    at = next(k for k, line in enumerate(body) if _count(line, shown))
                    body.insert(at + 1, f"    {self.syntax.unused(shown)}")
            body[:0] = idle
        comment = " ".join((inspect.getdoc(self.function) or self.function.__name__).split("\n\n")[0].split())
        comment = comment.replace("*/", "* /")
        self.translator.functions[name] = self.syntax.function(name, self.signature, self.result, comment, body)
        self.translator.functions[name] = self.translator.functions.pop(name)
        return name, self.result

    def emit(self, *lines: str) -> None:
        """Add lines at the depth of the current block."""
        self.lines += ["    " * self.depth + line for line in lines]

    def block(self, statements: Sequence[ast.stmt], *, last: bool = False) -> bool:
        """Translate statements; return whether they always leave the function."""
        for k, statement in enumerate(statements):
            self.node = statement
            handle = getattr(self, f"_do_{type(statement).__name__}", None)
            if handle is None:
                raise TranslationError(f"the statement `{type(statement).__name__.lower()}` is not known")
            if handle(statement, last and k == len(statements) - 1 and self.depth == 0):
                return True
        return False

    def _do_Expr(self, node: ast.Expr, last: bool) -> None:
        del last
        if isinstance(node.value, ast.Constant):
            return
        done = self.value(node.value)
        if not (isinstance(done, Value) and done.type == "void"):
            raise TranslationError("a statement without effect is not known")
        self.emit(self.syntax.statement(done.text))

    def _do_Pass(self, node: ast.Pass, last: bool) -> None:
        """Nothing to do."""

    def _do_Delete(self, node: ast.Delete, last: bool) -> None:
        """Nothing to do: the arguments deleted are not used."""

    def _do_Assert(self, node: ast.Assert, last: bool) -> None:
        """Nothing to do: it is for the type checker."""

    def _do_Assign(self, node: ast.Assign, last: bool) -> None:
        del last
        target, value = node.targets[0], self.value(node.value)
        if isinstance(target, ast.Tuple):
            names = [part.id for part in target.elts if isinstance(part, ast.Name)]
            parts = self.unpack(value, len(target.elts))
            later = {n.id for part in getattr(node.value, "elts", [])[1:] for n in ast.walk(part)
                     if isinstance(n, ast.Name)}  # fmt: skip
            if later & set(names[:-1]):
                parts = [self.keep(part) for part in parts]
            for part, item in zip(target.elts, parts, strict=True):
                self.store(part, item)
        else:
            self.store(target, value)

    def _do_AnnAssign(self, node: ast.AnnAssign, last: bool) -> None:
        del last
        if node.value is not None:
            self.store(node.target, self.value(node.value))

    def _do_AugAssign(self, node: ast.AugAssign, last: bool) -> None:
        del last
        left = ast.copy_location(ast.parse(ast.unparse(node.target), mode="eval").body, node)
        self.store(node.target, self.value(ast.copy_location(ast.BinOp(left, node.op, node.value), node)))

    def store(self, target: ast.expr, value: Any) -> None:
        """Assign a value to a name or to an entry of an array."""
        if isinstance(target, ast.Subscript):
            place = self.value(ast.copy_location(ast.Subscript(target.value, target.slice, ast.Load()), target))
            self.emit(self.syntax.assign(place.text, self.number(value).text, None))
            return
        if not isinstance(target, ast.Name):
            raise TranslationError("only a name or an entry of an array can be assigned")
        if target.id == "_":
            return
        name = target.id
        plain = isinstance(value, Fixed) and isinstance(value.value, (bool, int, float))
        if isinstance(value, (Fixed, Items, Settings)) and not (plain and (name in self.varies or self.depth)):
            if self.depth and name in self.declared:
                raise TranslationError(f"{name} is a number elsewhere")
            self.env[name] = value
            return
        value = self.translator.as_value(value)
        shown, known = self.syntax.name(name), self.declared.get(name)
        if value.text == shown:
            return
        if known == "double" and value.type == "int":
            value = self.translator.real(value)
        if known is not None and known != value.type:
            raise TranslationError(f"{name} has two types")
        if known is None:
            self.declared[name] = value.type
            if self.depth and self.syntax.language == "C":
                self.top.append(self.syntax.declare(shown, value.type))
                known = value.type
        self.emit(self.syntax.assign(shown, value.text, value.type if known is None else None))
        self.env[name] = Value(value.type, shown)

    def keep(self, value: Any) -> Any:
        """The value in a variable of its own."""
        if not isinstance(value, Value) or value.text.isidentifier():
            return value
        self.temporaries += 1
        name = f"t{self.temporaries}"
        self.emit(self.syntax.assign(name, value.text, value.type))
        return Value(value.type, name)

    def _do_If(self, node: ast.If, last: bool) -> bool:
        test = self.truth(self.value(node.test))
        if isinstance(test, Fixed):
            return self.block(node.body if test.value else node.orelse, last=last)
        self.emit(self.syntax.begin_if(test.text))
        left = [self.inner(node.body)]
        rest = node.orelse
        while len(rest) == 1 and isinstance(rest[0], ast.If):
            self.node = rest[0]
            test = self.truth(self.value(rest[0].test))
            if isinstance(test, Fixed):
                rest = rest[0].body if test.value else rest[0].orelse
                continue
            self.emit(self.syntax.begin_if(test.text, chained=True))
            left.append(self.inner(rest[0].body))
            rest = rest[0].orelse
        if rest:
            self.emit(self.syntax.otherwise())
            left.append(self.inner(rest))
        self.emit(self.syntax.end)
        return bool(rest) and all(left)

    def inner(self, statements: Sequence[ast.stmt]) -> bool:
        """Translate the statements of a branch or a loop."""
        self.depth += 1
        left = self.block(statements)
        self.depth -= 1
        return left

    def _do_For(self, node: ast.For, last: bool) -> None:
        del last
        call = node.iter
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"):
            raise TranslationError("a loop over anything but a range is not known")
        if not isinstance(node.target, ast.Name) or len(call.args) > 2 or node.orelse:
            raise TranslationError("a loop needs one name and at most two ends")
        ends = [self.translator.as_value(self.value(end)) for end in call.args]
        if any(end.type != "int" for end in ends):
            raise TranslationError("the ends of a range must be whole numbers")
        name = self.syntax.name(node.target.id)
        self.env[node.target.id] = Value("int", name)
        self.emit(self.syntax.begin_for(name, "0" if len(ends) == 1 else ends[0].text, ends[-1].text))
        self.inner(node.body)
        self.emit(self.syntax.end)

    def _do_While(self, node: ast.While, last: bool) -> None:
        del last
        test = self.truth(self.value(node.test))
        if isinstance(test, Fixed) or node.orelse:
            raise TranslationError("a loop without an end is not known")
        self.emit(self.syntax.begin_while(test.text))
        self.inner(node.body)
        self.emit(self.syntax.end)

    def _do_Return(self, node: ast.Return, last: bool) -> bool:
        value = self.value(node.value) if node.value is not None else Fixed(None)
        if self.translator.filling is self.function:
            parts = self.unpack(value)
            self.emit(*self.syntax.fill([self.number(part).text for part in parts]))
            self.result = Array(len(parts))
            return True
        if isinstance(value, Items) and all(isinstance(item, Fixed) for item in value.items):
            value = Fixed(tuple(item.value for item in value.items))
        if isinstance(value, Fixed) and self.depth == 0 and self.result is None and not self.lines:
            self.fixed_result.append(value)
            return True
        return self.leave(value, last=last)

    def _do_Raise(self, node: ast.Raise, last: bool) -> bool:
        """A refusal gives NaN, which the function that starts the model reports."""
        del node
        return self.leave(Fixed(float("nan")), last=last)

    def leave(self, value: Any, *, last: bool) -> bool:
        """Return a value from the function."""
        value = self.translator.as_value(value)
        if not isinstance(value, Value):
            raise TranslationError("the result is not a number or a record of numbers")
        if self.result == "double" and value.type == "int":
            value = self.translator.real(value)
        if self.result not in (None, value.type):
            raise TranslationError("the function returns two types")
        self.result = value.type
        self.emit(*self.syntax.returned(value.text, last=last))
        return True


def _count(text: str, name: str) -> int:
    return len(re.findall(rf"\b{re.escape(name)}\b", text))


def _is_store(node: ast.Name) -> bool:
    return isinstance(node.ctx, ast.Store)


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
