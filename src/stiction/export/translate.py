"""Translate kernels from restricted Python to C99 or MATLAB.

Known are numbers, `math`, comparisons, `if`, `for` over a range, `while`, calls of other kernels, named tuples, arrays
of fixed length, and the methods of a model that compute its parameters. What depends only on values known beforehand,
such as the code of a model, is computed here. Anything else raises an error that names its file and line.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_type_hints

from stiction.export.function_body import FunctionBody
from stiction.export.values import Settings, Struct, TranslationError, Type, Value, is_known

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.export.syntax import Syntax

__all__ = ["Translator"]


class Translator:
    """The functions and records that the translated kernels need, in the order of their use.

    Parameters
    ----------
    syntax : Syntax
        The target language.
    """

    def __init__(self, syntax: Syntax) -> None:
        self.syntax = syntax
        self.structs: dict[str, Struct] = {}
        self.functions: dict[str, tuple[list[tuple[str, Type | None]], Type, str, list[str]] | None] = {}
        """Arguments and their types (None: the parameters), type of the result, comment and lines of each function."""
        self.helpers: dict[str, None] = {}
        self._done: dict[Any, tuple[str | None, Any]] = {}

    def call(self, function: Any, arguments: Sequence[Any]) -> Any:
        """Translate a function for these arguments; return the value of its call.

        Whole numbers, texts and objects that are known are built into the function; numbers with a fraction are
        handed over.
        """
        function = getattr(function, "py_func", function)
        arguments = [
            self.as_value(one) if isinstance(one, float) or (isinstance(one, tuple) and not is_known(one)) else one
            for one in arguments
        ]
        key = (function, tuple(_key(one) for one in arguments))
        if key not in self._done:
            self._done[key] = FunctionBody(self, function, arguments).translate()
        name, result = self._done[key]
        if name is None:
            return result
        given = [one.text for one in arguments if isinstance(one, (Value, Settings))]
        return Value(result, f"{name}({', '.join(given)})")

    def as_value(self, one: Any) -> Any:
        """Several values as a record, a known number as a constant."""
        if isinstance(one, (bool, int, float)):
            kind = "bool" if isinstance(one, bool) else "int" if isinstance(one, int) else "double"
            text = self.syntax.number(one)
            return Value(kind, text, 9 if text.startswith("-") else 10)
        if isinstance(one, tuple) and not isinstance(one, Value):
            parts = [self.as_value(item) for item in one]
            if parts and all(isinstance(part, Value) for part in parts):
                kinds = [part.type for part in parts]
                shape = "" if set(kinds) == {"double"} else "".join(str(kind)[0] for kind in kinds)
                fields = tuple((f"f{k}", kind) for k, kind in enumerate(kinds))
                kind = self.use_struct(Struct(f"numbers{len(kinds)}{shape}", fields))
                return Value(kind, self.syntax.record(kind, [part.text for part in parts]))
        return one

    def real(self, value: Value) -> Value:
        """The value as a number with a fraction."""
        if value.type == "int":
            return self.syntax.real(value)
        if value.type != "double":
            raise TranslationError(f"{value.text} is not a number")
        return value

    def use_struct(self, struct: Struct) -> Struct:
        """Remember that a record is used."""
        self.structs.setdefault(struct.name, struct)
        return struct

    def named_tuple(self, kind: Any) -> Struct:
        """The record of a named tuple; its fields are numbers, or other named tuples."""
        hints = get_type_hints(kind)
        fields = [
            (name, self.named_tuple(hints[name]) if hasattr(hints[name], "_fields") else "double")
            for name in kind._fields
        ]
        return self.use_struct(Struct(kind.__name__, tuple(fields)))

    def name_function(self, function: Any) -> str:
        """A new name for a translated function."""
        name = f"kernel_{function.__name__.strip('_')}"
        while name in self.functions:
            name += "_"
        self.functions[name] = None
        return name


def _key(one: Any) -> Any:
    """What of an argument decides how a function is translated."""
    if isinstance(one, Value):
        return one.type
    if isinstance(one, Settings):
        return ("settings", id(one.model), one.adjustable, one.prefix)
    return ("fixed", type(one), one)
