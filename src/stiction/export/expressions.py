"""Translate the expressions of a kernel."""

from __future__ import annotations

import ast
import inspect
import math
import operator
from typing import Any

import numpy as np

from stiction.export.syntax import Array, Struct
from stiction.export.values import Fixed, Items, Method, Settings, TranslationError, Value

__all__ = ["Expressions"]

BINARY = {
    ast.Add: ("+", 7, operator.add),
    ast.Sub: ("-", 7, operator.sub),
    ast.Mult: ("*", 8, operator.mul),
    ast.Div: ("/", 8, operator.truediv),
    ast.FloorDiv: ("//", 8, operator.floordiv),
}
COMPARISONS = {
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
}
FUNCTIONS = {
    abs: "abs", round: "round", math.copysign: "copysign", math.exp: "exp", math.expm1: "expm1", math.sqrt: "sqrt",
    math.ceil: "ceil", math.floor: "floor", math.fabs: "fabs", math.log: "log",
}  # fmt: skip


class Expressions:
    """Values of expressions, in the names and records of one function.

    Parameters
    ----------
    translator : Translator
        Translates the functions that are called, and knows the records.
    """

    def __init__(self, translator: Any) -> None:
        self.translator = translator
        self.syntax = translator.syntax
        self.env: dict[str, Any] = {}
        self.known: dict[str, Any] = {}
        self.node: ast.AST | None = None
        self.temporaries = 0

    def keep(self, value: Any) -> Any:
        """The value in a variable of its own."""
        raise NotImplementedError

    def value(self, node: ast.expr) -> Any:
        """Translate an expression."""
        handle = getattr(self, f"_of_{type(node).__name__}", None)
        if handle is None:
            raise TranslationError(f"the expression `{ast.unparse(node)}` is not known")
        return handle(node)

    def number(self, value: Any) -> Value:
        """A value as a number with a fraction."""
        value = self.translator.as_value(value)
        if not isinstance(value, Value):
            raise TranslationError(f"{getattr(value, 'value', value)!r} is not a number")
        return self.translator.real(value)

    def truth(self, value: Any) -> Value | Fixed:
        """A value as a condition."""
        if isinstance(value, Fixed):
            return Fixed(bool(value.value))
        if isinstance(value, Value) and value.type == "double":
            return Value("bool", f"{value.text} {self.syntax.operators['!=']} 0.0", 6)
        if isinstance(value, Value) and value.type == "bool":
            return value
        raise TranslationError("a condition must be a comparison or a number")

    def unpack(self, value: Any, n: int | None = None) -> list[Any]:
        """The parts of a row of values, of a record or of an array."""
        if isinstance(value, Items):
            parts = list(value.items)
        elif isinstance(value, Fixed):
            parts = [Fixed(float(part) if isinstance(part, np.floating) else part) for part in value.value]
        elif isinstance(value, Value) and isinstance(value.type, Struct):
            kept = self.keep(value)
            parts = [Value(kind, self.syntax.field(kept.text, name)) for name, kind in value.type.fields]
        elif isinstance(value, Value) and isinstance(value.type, Array):
            parts = [Value("double", self.syntax.index(value.text, str(k))) for k in range(value.type.length)]
        else:
            raise TranslationError("only a tuple can be taken apart")
        if n is not None and len(parts) != n:
            raise TranslationError(f"{len(parts)} values for {n} names")
        return parts

    def _of_Constant(self, node: ast.Constant) -> Fixed:
        return Fixed(node.value)

    def _of_JoinedStr(self, node: ast.JoinedStr) -> Fixed:
        return Fixed(ast.unparse(node))

    def _of_Name(self, node: ast.Name) -> Any:
        if node.id in self.env:
            return self.env[node.id]
        if node.id in self.known:
            return Fixed(self.known[node.id])
        raise TranslationError(f"the name {node.id} is not known")

    def _of_Tuple(self, node: ast.Tuple | ast.List) -> Items:
        parts: list[Any] = []
        for element in node.elts:
            if isinstance(element, ast.Starred):
                parts += self.unpack(self.value(element.value))
            else:
                parts.append(self.value(element))
        return Items(tuple(parts))

    _of_List = _of_Tuple

    def _of_GeneratorExp(self, node: ast.GeneratorExp | ast.ListComp) -> Items:
        first = node.generators[0]
        if len(node.generators) > 1 or first.ifs or not isinstance(first.target, ast.Name):
            raise TranslationError("only a simple comprehension is known")
        name, parts = first.target.id, []
        before = self.env.get(name)
        for item in self.unpack(self.value(first.iter)):
            self.env[name] = item
            parts.append(self.value(node.elt))
        self.env.pop(name)
        if before is not None:
            self.env[name] = before
        return Items(tuple(parts))

    _of_ListComp = _of_GeneratorExp

    def _of_Attribute(self, node: ast.Attribute) -> Any:
        return self.attribute(self.value(node.value), node.attr)

    def attribute(self, base: Any, name: str) -> Any:
        """An attribute of a record, a model or a Python object."""
        if isinstance(base, Settings):
            if name in base.adjustable:
                return Value("double", self.syntax.parameter(base.text, base.prefix + name))
            found = inspect.getattr_static(base.model, name, None)
            if isinstance(found, property):
                return self.translator.call(found.fget, [base])
            if isinstance(found, staticmethod):
                return Fixed(found.__func__)
            return Method(base, found) if inspect.isfunction(found) else Fixed(getattr(base.model, name))
        if isinstance(base, Fixed):
            try:
                return Fixed(getattr(base.value, name))
            except AttributeError:
                raise TranslationError(f"{base.value!r} has no {name}") from None
        if isinstance(base, Value) and isinstance(base.type, Struct) and name in dict(base.type.fields):
            kept = base if base.rank == 10 and "(" not in base.text else self.keep(base)
            return Value(dict(base.type.fields)[name], self.syntax.field(kept.text, name))
        if isinstance(base, Value) and isinstance(base.type, Array) and name == "shape":
            n, columns = base.type.length, base.type.columns
            return Fixed((n // columns, columns) if columns else (n,))
        if isinstance(base, Items) and name == "size":
            return Fixed(len(base.items))
        raise TranslationError(f"the attribute {name} is not known")

    def _of_Subscript(self, node: ast.Subscript) -> Any:
        base, index = self.value(node.value), self.value(node.slice)
        if isinstance(base, Fixed) and isinstance(index, Fixed):
            return Fixed(base.value[index.value])
        if isinstance(base, Value) and isinstance(base.type, Array):
            place = self._place(index, base.type)
            if isinstance(place, Value) and place.type == "int":
                return Value("double", self.syntax.index(base.text, place.text))
        if isinstance(index, Fixed) and isinstance(index.value, int) and not isinstance(base, Fixed):
            return self.unpack(base)[index.value]
        raise TranslationError(f"`{ast.unparse(node)}` is not known; an index must be a whole number")

    def _place(self, index: Any, kind: Array) -> Any:
        """Place of an entry of a series or of a matrix."""
        if not (kind.columns and isinstance(index, Items)):
            return self.translator.as_value(index)
        row, column = (self.translator.as_value(item) for item in index.items)
        return Value("int", f"{_bracket(row, 8)} * {kind.columns} + {_bracket(column, 8)}", 7)

    def _of_UnaryOp(self, node: ast.UnaryOp) -> Any:
        value = self.value(node.operand)
        if isinstance(node.op, ast.Not):
            test = self.truth(value)
            if isinstance(test, Fixed):
                return Fixed(not test.value)
            return Value("bool", f"{self.syntax.operators['not']}{_bracket(test, 9)}", 9)
        if isinstance(value, Fixed):
            return Fixed(-value.value if isinstance(node.op, ast.USub) else +value.value)
        if isinstance(node.op, ast.USub) and isinstance(value, Value) and value.type in ("double", "int"):
            return Value(value.type, f"-{_bracket(value, 10)}", 9)
        raise TranslationError(f"`{ast.unparse(node)}` is not known")

    def _of_BinOp(self, node: ast.BinOp) -> Any:
        if type(node.op) not in BINARY:
            raise TranslationError(f"the operator in `{ast.unparse(node)}` is not known")
        sign, rank, compute = BINARY[type(node.op)]
        left, right = self.value(node.left), self.value(node.right)
        if isinstance(left, Fixed) and isinstance(right, Fixed):
            return Fixed(compute(left.value, right.value))
        a, b = self.translator.as_value(left), self.translator.as_value(right)
        if not (isinstance(a, Value) and isinstance(b, Value)):
            raise TranslationError(f"`{ast.unparse(node)}` is not a sum or product of numbers")
        if a.type == b.type == "int" and sign != "/":
            if sign == "//":
                return Value("int", self.syntax.divide_whole(_bracket(a, 8), _bracket(b, 9)), 8)
            return Value("int", f"{_bracket(a, rank)} {sign} {_bracket(b, rank + 1)}", rank)
        if sign == "//":
            raise TranslationError("`//` is known for whole numbers only")
        a, b = self.number(a), self.number(b)
        return Value("double", f"{_bracket(a, rank)} {sign} {_bracket(b, rank + 1)}", rank)

    def _of_BoolOp(self, node: ast.BoolOp) -> Any:
        every = isinstance(node.op, ast.And)
        parts: list[Value] = []
        for k, operand in enumerate(node.values):
            value = self.value(operand)
            if isinstance(value, Fixed):
                if bool(value.value) is every:
                    if k == len(node.values) - 1 and not parts:
                        return value
                    continue
                return value if not parts else self._joined([*parts, self.truth(value)], every=every)
            parts.append(self.truth(value))  # type: ignore[arg-type]
        return self._joined(parts, every=every)

    def _joined(self, parts: list[Any], *, every: bool) -> Value:
        sign = self.syntax.operators["and" if every else "or"]
        texts = [_bracket(self.translator.as_value(part), 5) for part in parts]
        return Value("bool", f" {sign} ".join(texts), 4 if len(parts) > 1 else 5)

    def _of_Compare(self, node: ast.Compare) -> Any:
        parts = []
        left = self.value(node.left)
        for sign, comparator in zip(node.ops, node.comparators, strict=True):
            right = self.value(comparator)
            parts.append(self._compared(left, sign, right))
            left = right
        if len(parts) == 1:
            return parts[0]
        if all(isinstance(part, Fixed) for part in parts):
            return Fixed(all(part.value for part in parts))
        return self._joined([part for part in parts if not (isinstance(part, Fixed) and part.value)], every=True)

    def _compared(self, left: Any, sign: ast.cmpop, right: Any) -> Any:
        if isinstance(sign, (ast.Is, ast.IsNot)):
            same = isinstance(left, Fixed) and isinstance(right, Fixed) and left.value is right.value
            return Fixed(same is isinstance(sign, ast.Is))
        if type(sign) not in COMPARISONS:
            raise TranslationError(f"the comparison `{type(sign).__name__}` is not known")
        shown, compute = COMPARISONS[type(sign)]
        if isinstance(left, Fixed) and isinstance(right, Fixed):
            return Fixed(compute(left.value, right.value))
        a, b = self.translator.as_value(left), self.translator.as_value(right)
        if not (isinstance(a, Value) and isinstance(b, Value)):
            raise TranslationError("only numbers can be compared")
        if a.type != b.type:
            a, b = self.number(a), self.number(b)
        return Value("bool", f"{_bracket(a, 7)} {self.syntax.operators.get(shown, shown)} {_bracket(b, 7)}", 6)

    def _of_IfExp(self, node: ast.IfExp) -> Any:
        test = self.truth(self.value(node.test))
        if isinstance(test, Fixed):
            return self.value(node.body if test.value else node.orelse)
        yes, no = (self.translator.as_value(self.value(branch)) for branch in (node.body, node.orelse))
        if not (isinstance(yes, Value) and isinstance(no, Value)):
            raise TranslationError(f"`{ast.unparse(node)}` is not a number")
        if yes.type != no.type:
            yes, no = self.number(yes), self.number(no)
        if "choose" in self.syntax.helpers:
            self.translator.helpers["choose"] = self.syntax.helpers["choose"]
        return Value(yes.type, self.syntax.choose(test.text, yes.text, no.text))

    def _of_Call(self, node: ast.Call) -> Any:
        function = self.value(node.func)
        arguments: list[Any] = []
        for argument in node.args:
            if isinstance(argument, ast.Starred):
                arguments += self.unpack(self.value(argument.value))
            else:
                arguments.append(self.value(argument))
        keywords = {word.arg: self.value(word.value) for word in node.keywords if word.arg}
        if isinstance(function, Method):
            return self.translator.call(function.function, [function.settings, *arguments])
        if not isinstance(function, Fixed):
            raise TranslationError(f"`{ast.unparse(node.func)}` is not a function")
        return self.call(function.value, arguments, keywords)

    def call(self, function: Any, arguments: list[Any], keywords: dict[str, Any]) -> Any:
        """Call a function: of `math`, of Python, a named tuple or another kernel."""
        if function is getattr and isinstance(arguments[0], Settings):
            return self.attribute(arguments[0], arguments[1].value)
        if function is isinstance:
            first = arguments[0]
            return Fixed(isinstance(first.value, arguments[1].value) if isinstance(first, Fixed) else False)
        if function in (tuple, list, np.array, np.asarray):
            parts = self.unpack(arguments[0])
            if function is np.array and all(isinstance(part, Fixed) for part in parts):
                return Fixed(np.array([part.value for part in parts]))
            return Items(tuple(parts))
        if hasattr(function, "_fields"):
            given = [*arguments, *(keywords[name] for name in function._fields[len(arguments) :])]
            kind = self.translator.named_tuple(function)
            texts = [
                self.number(one).text if want == "double" else one.text
                for one, (_, want) in zip(given, kind.fields, strict=True)
            ]
            return Value(kind, self.syntax.record(kind, texts))
        known = all(isinstance(one, Fixed) for one in [*arguments, *keywords.values()])
        if known and not hasattr(function, "py_func"):
            try:
                return Fixed(function(*(a.value for a in arguments), **{k: v.value for k, v in keywords.items()}))
            except Exception as error:
                name = getattr(function, "__name__", function)
                raise TranslationError(f"{name} cannot be computed beforehand ({error})") from None
        if keywords:
            raise TranslationError("a call with named arguments is not known")
        if function in (min, max):
            return self._extreme("min" if function is min else "max", arguments)
        if function in FUNCTIONS and function.__module__ in ("math", "builtins"):
            return self._function(FUNCTIONS[function], [self.number(one).text for one in arguments])
        if function is float:
            return self.number(arguments[0])
        if function is int:
            return Value("int", self.syntax.whole(self.number(arguments[0]).text), 9)
        if not inspect.isfunction(getattr(function, "py_func", function)):
            raise TranslationError(f"the function {getattr(function, '__name__', function)} is not known")
        return self.translator.call(function, arguments)

    def _extreme(self, name: str, arguments: list[Any]) -> Value:
        parts = [self.translator.as_value(one) for one in arguments]
        whole = all(part.type == "int" for part in parts)
        parts = parts if whole else [self.number(part) for part in parts]
        result = parts[0]
        for part in parts[1:]:
            call = self._function(name, [result.text, part.text], whole=whole)
            result = Value("int" if whole else "double", call.text)
        return result

    def _function(self, name: str, texts: list[str], *, whole: bool = False) -> Value:
        shown = ("int_" if whole and self.syntax.language == "C" else "") + self.syntax.functions[name]
        if shown in self.syntax.helpers:
            self.translator.helpers[shown] = self.syntax.helpers[shown]
        return Value("double", f"{shown}({', '.join(texts)})")


def _bracket(value: Value, rank: int) -> str:
    """The text of a value, in brackets where it binds less tightly than `rank`."""
    return value.text if value.rank >= rank else f"({value.text})"
