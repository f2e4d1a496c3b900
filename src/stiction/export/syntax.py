"""How C99 and MATLAB write what the translator found: numbers, names, operators and statements."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.export.values import Struct, Value

if TYPE_CHECKING:
    from stiction.export.values import Type

__all__ = ["FUNCTIONS", "HELPERS", "RESERVED", "Syntax"]

_WORDS = {
    "C": "auto break case char const continue default do double else enum extern float for goto if inline int long "
    "register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while main "
    "bool true false complex NAN INFINITY alignas alignof asm constexpr nullptr static_assert thread_local typeof",
    "MATLAB": "break case catch classdef continue else elseif end for function global if otherwise parfor persistent "
    "return spmd switch try while i j pi inf Inf nan NaN eps true false ans nargin nargout varargin varargout",
    "Modelica": "algorithm and annotation assert block class connect connector constant constrainedby der discrete "
    "each elsewhen encapsulated end enumeration equation expandable extends external final flow function impure import "
    "in initial inner input loop model not operator or outer output package parameter partial protected public pure "
    "record redeclare replaceable stream then time true false type when within Real Integer Boolean String Clock "
    "Complex StateSelect ExternalObject AssertionLevel Connections Modelica",
    "FMI": "math stdio stdlib string stdint stdbool fmu fmi2 fmi3 fmi_common sample_model memory",
}
RESERVED = {language: frozenset(words.split()) for language, words in _WORDS.items()}
"""Words that no name can be, of each language; of FMI the files and functions of an FMU, in any case."""

FORMS = {
    "C": {
        "!=": "!=", "not": "!{}", "and": " && ", "or": " || ", "choose": "({} ? {} : {})", "whole": "(int)({})",
        "quotient": "{} / {}", "field": "{}.{}", "parameter": "{}->{}", "member": "m->{}", "entry": "{}[{}]",
        "call": "{};", "assign": "{} = {};", "return": "return {};", "unused": "(void){};",
        "if": "if ({}) {{", "elif": "}} else if ({}) {{", "else": "}} else {{", "end": "}}",
        "for": "for (int {0} = {1}; {0} < {2}; {0}++) {{", "while": "while ({}) {{",
    },
    "MATLAB": {
        "!=": "~=", "not": "~{}", "and": " && ", "or": " || ", "choose": "choose({}, {}, {})", "whole": "fix({})",
        "quotient": "floor({} / {})", "field": "{}.{}", "parameter": "{}.{}", "member": "m.{}", "entry": "{}({})",
        "call": "{};", "assign": "{} = {};", "return": "result = {};",
        "if": "if {}", "elif": "elseif {}", "else": "else", "end": "end",
        "for": "for {0} = {1}:{2} - 1", "while": "while {}",
    },
}  # fmt: skip
"""Texts of operators and statements."""

_PLAIN = {name: name for name in ("copysign", "exp", "expm1", "sqrt", "ceil", "floor", "log")}
FUNCTIONS = {
    "C": {**_PLAIN, "abs": "fabs", "fabs": "fabs", "min": "least", "max": "greatest", "round": "rint"},
    "MATLAB": {**_PLAIN, "abs": "abs", "fabs": "abs", "min": "min", "max": "max", "round": "round_even"},
}
"""Function of Python or `math` -> its name."""

HELPERS = {"C": ("least", "greatest", "int_least", "int_greatest"), "MATLAB": ("choose", "copysign", "round_even")}
"""Functions that a language lacks; the templates hold them."""


class Syntax:
    """Writes in one language.

    Parameters
    ----------
    language : str
        "C" or "MATLAB".
    prefix : str
        What the names of records begin with.
    """

    def __init__(self, language: str, prefix: str) -> None:
        self.language, self.prefix, self.is_c = language, prefix, language == "C"

    def write(self, form: str, *parts: str) -> str:
        """An operator or a statement of `FORMS`."""
        return FORMS[self.language][form].format(*parts)

    def number(self, value: float | bool) -> str:
        """A constant; in C hexadecimal where a short decimal is not exact."""
        if isinstance(value, (bool, int)):
            return str(int(value)) if self.is_c else str(value).lower()
        value = float(value)
        if not math.isfinite(value):
            names = {"nan": "NAN", "inf": "INFINITY"} if self.is_c else {"nan": "NaN", "inf": "Inf"}
            return f"{'-' if value < 0 else ''}{names[str(abs(value))]}"
        exact = abs(value) < 1e6 and (value * 64.0).is_integer()
        return value.hex() if self.is_c and not exact else repr(value)

    def name(self, name: str) -> str:
        """Name that the language does not reserve."""
        return f"{name}_" if name in RESERVED[self.language] else name

    def field(self, text: str, name: str) -> str:
        """Field of a record."""
        return self.write("field", text, self.name(name))

    def entry(self, text: str, index: str) -> str:
        """Entry of an array, counted from 0."""
        if not self.is_c:
            index = str(int(index) + 1) if index.isdigit() else f"{index} + 1"
        return self.write("entry", text, index)

    def type_name(self, kind: Type) -> str:
        """Name of a type."""
        if isinstance(kind, Struct):
            return f"{self.prefix}_{kind.name}"
        return "int" if kind == "bool" else str(kind)

    def record(self, kind: Struct, values: list[str]) -> str:
        """A record with these fields."""
        if self.is_c:
            return f"({self.type_name(kind)}){{{', '.join(values)}}}"
        fields = (f"'{self.name(name)}', {value}" for (name, _), value in zip(kind.fields, values, strict=True))
        return f"struct({', '.join(fields)})"

    def real(self, value: Value) -> Value:
        """A whole number as a number with a fraction."""
        if value.text.isdigit():
            return Value("double", f"{value.text}.0")
        return Value("double", f"(double)({value.text})", 9) if self.is_c else Value("double", value.text, value.rank)

    def assign(self, name: str, text: str, kind: Type | None = None) -> str:
        """Assignment; in C with a type also the declaration."""
        declared = f"{self.type_name(kind)} " if kind is not None and self.is_c else ""
        return declared + self.write("assign", name, text)
