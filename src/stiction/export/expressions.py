"""Translate the expressions of a kernel.

An expression is evaluated by Python, with the operators and calls replaced by methods that write in the target
language what is known only when the model runs. What is known beforehand is thereby computed.
"""

from __future__ import annotations

import ast
import copy
import functools
import inspect
import math
import operator
from types import GeneratorType
from typing import Any

import numpy as np

from stiction.export.syntax import FUNCTIONS, HELPERS
from stiction.export.values import Array, Settings, Struct, TranslationError, Value, is_known

__all__ = ["Expressions"]

BINARY = {
    "Add": ("+", 7, operator.add), "Sub": ("-", 7, operator.sub), "Mult": ("*", 8, operator.mul),
    "Div": ("/", 8, operator.truediv), "FloorDiv": ("//", 8, operator.floordiv),
}  # fmt: skip
COMPARISONS = {
    "Lt": ("<", operator.lt), "LtE": ("<=", operator.le), "Gt": (">", operator.gt), "GtE": (">=", operator.ge),
    "Eq": ("==", operator.eq), "NotEq": ("!=", operator.ne),
}  # fmt: skip
UNARY = {"USub": operator.neg, "UAdd": operator.pos, "Not": operator.not_}
_NAMES = (
    "Constant Name Attribute Subscript Slice Call BinOp UnaryOp BoolOp Compare IfExp Tuple List Starred GeneratorExp "
    "ListComp JoinedStr FormattedValue"
)
KNOWN = frozenset(_NAMES.split())
"""Parts that an expression may have."""


def _method(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Attribute(ast.Name("_of_", ast.Load()), name, ast.Load()), list(arguments), [])


def _later(node: ast.expr) -> ast.expr:
    return ast.Lambda(ast.arguments([], [], kwonlyargs=[], kw_defaults=[], defaults=[]), node)


class _Replace(ast.NodeTransformer):
    """Replaces operators and calls by methods of `Expressions`."""

    def visit(self, node: ast.AST) -> Any:
        node = self.generic_visit(node)
        match node:
            case ast.BinOp(left, sign, right):
                return _method("binary", ast.Constant(type(sign).__name__), left, right)
            case ast.UnaryOp(sign, operand):
                return _method("unary", ast.Constant(type(sign).__name__), operand)
            case ast.BoolOp(sign, values):
                return _method("boolean", ast.Constant(isinstance(sign, ast.And)), *map(_later, values))
            case ast.Compare(left, signs, others):
                return _method("compare", ast.Constant(" ".join(type(one).__name__ for one in signs)), left, *others)
            case ast.IfExp(test, body, other):
                return _method("choice", test, _later(body), _later(other))
            case ast.Attribute(value, name):
                return _method("attribute", value, ast.Constant(name))
            case ast.Subscript(value, place):
                return _method("entry", value, place)
            case ast.Call(function, arguments, keywords):
                return ast.Call(_method("call").func, [function, *arguments], keywords)
            case ast.Starred(value, context):
                return ast.Starred(_method("parts", value), context)
            case ast.comprehension():
                node.iter = _method("parts", node.iter)
            case ast.JoinedStr():
                return ast.Constant(ast.unparse(node))
        return node


class Expressions:
    """Values of expressions, in the names and records of one function.

    Parameters
    ----------
    translator : Translator
        Translates the functions that are called, and knows the records.
    """

    def __init__(self, translator: Any) -> None:
        self.translator, self.syntax = translator, translator.syntax
        self.env: dict[str, Any] = {}
        self.known: dict[str, Any] = {}

    def keep(self, value: Value) -> Value:
        """The value in a variable of its own."""
        raise NotImplementedError

    def value(self, node: ast.expr) -> Any:
        """Translate an expression: a `Value`, or an object that is known."""
        for part in ast.walk(node):
            if isinstance(part, ast.expr) and type(part).__name__ not in KNOWN:
                raise TranslationError(f"the expression `{ast.unparse(part)}` is not known")
        tree = ast.fix_missing_locations(ast.Expression(_Replace().visit(copy.deepcopy(node))))
        try:
            found = eval(compile(tree, "kernel", "eval"), {**self.known, **self.env, "_of_": self})
            return tuple(found) if isinstance(found, (GeneratorType, list)) else found
        except TranslationError:
            raise
        except Exception as error:
            raise TranslationError(f"`{ast.unparse(node)}` is not known ({error})") from None

    def number(self, one: Any) -> Value:
        """A value as a number with a fraction."""
        value = self.translator.as_value(one)
        if not isinstance(value, Value):
            raise TranslationError(f"{one!r} is not a number")
        return self.translator.real(value)

    def truth(self, value: Any) -> Value | bool:
        """A value as a condition."""
        if not isinstance(value, Value):
            return bool(value)
        if value.type == "double":
            return Value("bool", f"{value.text} {self.syntax.write('!=')} 0.0", 6)
        if value.type == "bool":
            return value
        raise TranslationError("a condition must be a comparison or a number")

    def parts(self, value: Any, n: int | None = None) -> tuple[Any, ...]:
        """The parts of a row of values, of a record or of an array."""
        if isinstance(value, Value) and isinstance(value.type, Struct):
            text = self.keep(value).text
            parts = tuple(Value(kind, self.syntax.field(text, name)) for name, kind in value.type.fields)
        elif isinstance(value, Value) and isinstance(value.type, Array):
            parts = tuple(Value("double", self.syntax.entry(value.text, str(k))) for k in range(value.type.length))
        elif isinstance(value, (Value, Settings)):
            raise TranslationError("only a tuple can be taken apart")
        else:
            parts = tuple(value)
        if n is not None and len(parts) != n:
            raise TranslationError(f"{len(parts)} values for {n} names")
        return parts

    def attribute(self, base: Any, name: str) -> Any:
        """An attribute of a record, a model or a Python object."""
        if isinstance(base, Settings):
            if name in base.adjustable:
                return Value("double", self.syntax.write("parameter", base.text, self.syntax.name(base.prefix + name)))
            found = inspect.getattr_static(base.model, name, None)
            if isinstance(found, property):
                return self.translator.call(found.fget, [base])
            if isinstance(found, staticmethod):
                return found.__func__
            return functools.partial(found, base) if inspect.isfunction(found) else getattr(base.model, name)
        if not isinstance(base, Value):
            return len(base) if name == "size" and isinstance(base, tuple) else getattr(base, name)
        if isinstance(base.type, Struct) and name in dict(base.type.fields):
            kept = base if base.rank == 10 and "(" not in base.text else self.keep(base)
            return Value(dict(base.type.fields)[name], self.syntax.field(kept.text, name))
        if isinstance(base.type, Array) and name == "shape":
            n, columns = base.type.length, base.type.columns
            return (n // columns, columns) if columns else (n,)
        raise TranslationError(f"the attribute {name} is not known")

    def entry(self, base: Any, place: Any) -> Any:
        """An entry of a row of values, a record or an array."""
        if not isinstance(base, Value):
            return base[place]
        if not isinstance(base.type, Array):
            return self.parts(base)[place]
        if base.type.columns:
            row, column = (self.translator.as_value(one).bracketed(8) for one in place)
            place = Value("int", f"{row} * {base.type.columns} + {column}", 7)
        place = self.translator.as_value(place)
        if place.type != "int":
            raise TranslationError("an index must be a whole number")
        return Value("double", self.syntax.entry(base.text, place.text))

    def unary(self, name: str, value: Any) -> Any:
        """A sign, or `not`."""
        value = self.truth(value) if name == "Not" else value
        if is_known(value):
            return UNARY[name](value)
        if name == "Not":
            return Value("bool", self.syntax.write("not", value.bracketed(9)), 9)
        if name != "USub" or value.type not in ("double", "int"):
            raise TranslationError("this sign is not known")
        return Value(value.type, f"-{value.bracketed(10)}", 9)

    def binary(self, name: str, left: Any, right: Any) -> Any:
        """A sum, a product or another operation on two numbers."""
        if name not in BINARY:
            raise TranslationError(f"the operator {name} is not known")
        sign, rank, compute = BINARY[name]
        if is_known(left) and is_known(right):
            return compute(left, right)
        a, b = self.translator.as_value(left), self.translator.as_value(right)
        if not a.type == b.type == "int" or sign == "/":
            a, b = self.number(a), self.number(b)
        if sign == "//":
            if a.type != "int":
                raise TranslationError("`//` is known for whole numbers only")
            return Value("int", self.syntax.write("quotient", a.bracketed(8), b.bracketed(9)), 8)
        return Value(a.type, f"{a.bracketed(rank)} {sign} {b.bracketed(rank + 1)}", rank)

    def boolean(self, every: bool, *operands: Any) -> Any:
        """Operands joined by `and` (`every`) or `or`; each is a function that gives it."""
        parts: list[Value] = []
        for k, operand in enumerate(operands):
            value = operand()
            if not is_known(value):
                parts.append(self.truth(value))  # type: ignore[arg-type]
            elif bool(value) is not every or (k == len(operands) - 1 and not parts):
                return self._joined([*parts, self.translator.as_value(bool(value))], every) if parts else value
        return self._joined(parts, every)

    def _joined(self, parts: list[Value], every: bool) -> Value:
        text = self.syntax.write("and" if every else "or").join(part.bracketed(5) for part in parts)
        return Value("bool", text, 4 if len(parts) > 1 else 5)

    def compare(self, signs: str, *values: Any) -> Any:
        """Comparisons of neighbours."""
        found = [self._compared(sign, *values[k : k + 2]) for k, sign in enumerate(signs.split())]
        if any(part is False for part in found):
            return False
        parts = [part for part in found if isinstance(part, Value)]
        return self._joined(parts, every=True) if len(parts) > 1 else (parts or [True])[0]

    def _compared(self, name: str, left: Any, right: Any) -> Value | bool:
        if name in ("Is", "IsNot"):
            return (is_known(left) and is_known(right) and left is right) is (name == "Is")
        if name not in COMPARISONS:
            raise TranslationError(f"the comparison `{name}` is not known")
        sign, compute = COMPARISONS[name]
        if is_known(left) and is_known(right):
            return bool(compute(left, right))
        a, b = self.translator.as_value(left), self.translator.as_value(right)
        if a.type != b.type:
            a, b = self.number(a), self.number(b)
        shown = self.syntax.write("!=") if sign == "!=" else sign
        return Value("bool", f"{a.bracketed(7)} {shown} {b.bracketed(7)}", 6)

    def choice(self, test: Any, yes: Any, no: Any) -> Any:
        """One of two values; each is a function that gives it."""
        test = self.truth(test)
        if not isinstance(test, Value):
            return (yes if test else no)()
        first, second = (self.translator.as_value(one()) for one in (yes, no))
        if first.type != second.type:
            first, second = self.number(first), self.number(second)
        self._use("choose")
        return Value(first.type, self.syntax.write("choose", test.text, first.text, second.text))

    def call(self, function: Any, *arguments: Any, **keywords: Any) -> Any:
        """Call a function: of `math`, of Python, a named tuple or another kernel."""
        if isinstance(function, functools.partial):
            function, arguments = function.func, (*function.args, *arguments)
        if function is getattr and isinstance(arguments[0], Settings):
            return self.attribute(*arguments[:2])
        if function is isinstance:
            return is_known(arguments[0]) and isinstance(*arguments)
        if function in (tuple, list, np.array, np.asarray):
            parts = self.parts(*arguments[:1])
            return np.array(parts) if function is np.array and is_known(parts) else parts
        if hasattr(function, "_fields"):
            given = [*arguments, *(keywords[name] for name in function._fields[len(arguments) :])]
            kind = self.translator.named_tuple(function)
            texts = [
                self.number(one).text if want == "double" else one.text
                for one, (_, want) in zip(given, kind.fields, strict=True)
            ]
            return Value(kind, self.syntax.record(kind, texts))
        if is_known((*arguments, *keywords.values())) and not hasattr(function, "py_func"):
            return function(*arguments, **keywords)
        if keywords:
            raise TranslationError("a call with named arguments is not known")
        if function in (min, max):
            return functools.reduce(functools.partial(self._extreme, function.__name__), arguments)
        name = getattr(function, "__name__", str(function))
        if function is getattr(math, name, None) or function in (abs, round):
            return self._function(name, *(self.number(one).text for one in arguments))
        if function is float:
            return self.number(*arguments)
        if function is int:
            return Value("int", self.syntax.write("whole", self.number(*arguments).text), 9)
        if not inspect.isfunction(getattr(function, "py_func", function)):
            raise TranslationError(f"the function {name} is not known")
        return self.translator.call(function, arguments)

    def _extreme(self, name: str, one: Any, other: Any) -> Value:
        a, b = self.translator.as_value(one), self.translator.as_value(other)
        if a.type == b.type == "int":
            return Value("int", self._function(name, a.text, b.text, whole=self.syntax.is_c).text)
        return self._function(name, self.number(a).text, self.number(b).text)

    def _function(self, name: str, *texts: str, whole: bool = False) -> Value:
        names = FUNCTIONS[self.syntax.language]
        if name not in names:
            raise TranslationError(f"the function {name} is not known")
        shown = f"int_{names[name]}" if whole else names[name]
        self._use(shown)
        return Value("double", f"{shown}({', '.join(texts)})")

    def _use(self, helper: str) -> None:
        if helper in HELPERS[self.syntax.language]:
            self.translator.helpers[helper] = None
