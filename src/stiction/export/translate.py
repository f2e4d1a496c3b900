"""Translate kernels from restricted Python to C99 or MATLAB.

Known are numbers, `math`, comparisons, `if`, `for` over a range, `while`, calls of other kernels, named tuples, arrays
of fixed length, and the methods of a model that compute its parameters. What depends only on values known beforehand,
such as the code of a model, is computed here. Anything else raises an error that names its file and line.
"""

from __future__ import annotations

import inspect
import sys
from typing import TYPE_CHECKING, Any

from stiction.export.function_body import FunctionBody
from stiction.export.syntax import Array, Struct, Type
from stiction.export.values import Fixed, Items, Settings, TranslationError, Value, tuple_type

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.export.syntax import CSyntax

__all__ = ["Translator"]


class Translator:
    """The functions and records that the translated kernels need, in the order of their use.

    Parameters
    ----------
    syntax : CSyntax
        The target language.
    """

    def __init__(self, syntax: CSyntax) -> None:
        self.syntax = syntax
        self.structs: dict[str, Struct] = {}
        self.functions: dict[str, str] = {}
        self.helpers: dict[str, str] = {}
        self.filling: Any = None
        self._done: dict[Any, tuple[str, Type] | Fixed] = {}

    def call(self, function: Any, arguments: Sequence[Any]) -> Any:
        """Translate a function for these arguments; return the value of its call."""
        function = getattr(function, "py_func", function)
        arguments = [self.as_value(one) if _is_plain(one) else one for one in arguments]
        key = (function, tuple(_key(one) for one in arguments))
        if key not in self._done:
            self._done[key] = FunctionBody(self, function, arguments).translate()
        done = self._done[key]
        if isinstance(done, Fixed):
            return done
        name, kind = done
        given = [one.text for one in arguments if isinstance(one, (Value, Settings))]
        return Value(kind, f"{name}({', '.join(given)})")

    def call_filling(self, function: Any, arguments: Sequence[Any]) -> tuple[str, int]:
        """Translate a function whose result is a row of numbers, which it writes to an array; its name and length."""
        self.filling = function
        try:
            done = FunctionBody(self, function, arguments).translate()
        finally:
            self.filling = None
        if isinstance(done, Fixed) or not isinstance(done[1], Array):
            raise TranslationError(f"{function.__name__} does not give a row of numbers")
        return done[0], done[1].length

    def as_value(self, one: Any) -> Any:
        """Several values as a record, a fixed number as a constant."""
        if isinstance(one, Fixed) and isinstance(one.value, (bool, int, float)):
            kind = "bool" if isinstance(one.value, bool) else "int" if isinstance(one.value, int) else "double"
            text = self.syntax.number(one.value)
            return Value(kind, text, 9 if text.startswith("-") else 10)
        if isinstance(one, Items) or (isinstance(one, Fixed) and isinstance(one.value, tuple)):
            items = one.items if isinstance(one, Items) else [Fixed(item) for item in one.value]
            parts = [self.as_value(item) for item in items]
            if parts and all(isinstance(part, Value) for part in parts):
                kind = self.use_struct(tuple_type([part.type for part in parts]))
                return Value(kind, self.syntax.record(kind, [part.text for part in parts]))
        return one

    def real(self, value: Value) -> Value:
        """The value as a number with a fraction."""
        if value.type == "double":
            return value
        if value.type == "int":
            if value.text.isdigit():
                return Value("double", f"{value.text}.0")
            return self.syntax.real(value)
        raise TranslationError(f"{value.text} is not a number")

    def use_struct(self, struct: Struct) -> Struct:
        """Remember that a record is used."""
        self.structs.setdefault(struct.name, struct)
        return struct

    def named_tuple(self, kind: Any) -> Struct:
        """The record of a named tuple; its fields are numbers, or other named tuples."""
        hints = inspect.get_annotations(kind)
        fields = []
        for name in kind._fields:
            hint = getattr(hints[name], "__forward_arg__", hints[name])
            inner = _globals_of(kind).get(hint) if isinstance(hint, str) else hint
            fields.append((name, self.named_tuple(inner) if hasattr(inner, "_fields") else "double"))
        return self.use_struct(Struct(kind.__name__, tuple(fields)))

    def name_function(self, function: Any) -> str:
        """A new name for a translated function."""
        name = f"kernel_{function.__name__.strip('_')}"
        while name in self.functions:
            name += "_"
        self.functions[name] = ""
        return name


def _is_plain(one: Any) -> bool:
    """Whether an argument is handed over as a number or a record although it may be known."""
    return isinstance(one, Items) or (isinstance(one, Fixed) and isinstance(one.value, float))


def _key(one: Any) -> Any:
    """What of an argument decides how a function is translated."""
    if isinstance(one, Value):
        return one.type
    if isinstance(one, Settings):
        return ("settings", id(one.model), one.adjustable, one.prefix)
    try:
        return ("fixed", type(one.value), hash(one.value), one.value)
    except TypeError:
        return ("fixed", id(one.value))


def _globals_of(kind: type) -> dict[str, Any]:
    return vars(sys.modules[kind.__module__])
