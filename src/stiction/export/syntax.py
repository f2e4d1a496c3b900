"""How C99 and MATLAB write what the translator found: types, numbers, functions and statements."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

__all__ = ["MATLAB", "Array", "C", "CSyntax", "MatlabSyntax", "Struct", "Type", "Value"]

_C = (
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while main "
    "bool true false complex NAN INFINITY"
)
_MATLAB = (
    "break case catch classdef continue else elseif end for function global if otherwise parfor persistent return "
    "spmd switch try while i j pi inf nan eps"
)
C_RESERVED, MATLAB_RESERVED = frozenset(_C.split()), frozenset(_MATLAB.split())


class Struct(NamedTuple):
    """A record with named fields."""

    name: str
    fields: tuple[tuple[str, Type], ...]


class Array(NamedTuple):
    """An array of numbers of fixed length, handed over by reference."""

    length: int
    writable: bool = False
    columns: int = 0
    """Columns of a matrix, which is handed over row by row; 0 for a series."""


Type = str | Struct | Array
"""'double', 'int', 'bool', a record or an array."""


@dataclass(frozen=True)
class Value:
    """A number or record that is computed when the model runs."""

    type: Type
    text: str
    rank: int = 10
    """How tightly its operator binds; 10 for a name."""


C_HELPERS = {
    "least": "static double least(double a, double b) { return b < a ? b : a; }",
    "greatest": "static double greatest(double a, double b) { return b > a ? b : a; }",
    "int_least": "static int int_least(int a, int b) { return b < a ? b : a; }",
    "int_greatest": "static int int_greatest(int a, int b) { return b > a ? b : a; }",
}
MATLAB_HELPERS = {
    "choose": "function y = choose(c, a, b)\nif c\n    y = a;\nelse\n    y = b;\nend\nend",
    "copysign": "function y = copysign(x, s)\nif s < 0 || (s == 0 && 1 / s < 0)\n    y = -abs(x);\nelse\n"
    "    y = abs(x);\nend\nend",
    "round_even": "function y = round_even(x)\ny = round(x);\nif abs(x - fix(x)) == 0.5\n    y = 2 * round(x / 2);\n"
    "end\nend",
}


class CSyntax:
    """C99 with no library but ``math.h``."""

    language = "C"
    reserved = C_RESERVED
    helpers = C_HELPERS
    comment = "/* {} */"
    end = "}"
    functions = {  # noqa: RUF012 - a table
        "abs": "fabs", "min": "least", "max": "greatest", "round": "rint", "copysign": "copysign", "exp": "exp",
        "expm1": "expm1", "sqrt": "sqrt", "ceil": "ceil", "floor": "floor", "fabs": "fabs", "log": "log", "pow": "pow",
    }  # fmt: skip
    operators = {"!=": "!=", "not": "!", "and": "&&", "or": "||"}  # noqa: RUF012 - a table

    def __init__(self, prefix: str) -> None:
        self.prefix = prefix

    def type_name(self, kind: Type) -> str:
        """Name of a type."""
        if isinstance(kind, Struct):
            return f"{self.prefix}_{kind.name}"
        return "int" if kind == "bool" else str(kind)

    def statement(self, text: str) -> str:
        """A call without a result."""
        return f"{text};"

    def number(self, value: float | bool) -> str:
        """A constant; hexadecimal where a short decimal is not exact."""
        if isinstance(value, (bool, int)):
            return str(int(value))
        if math.isnan(value):
            return "NAN"
        if math.isinf(value):
            return "INFINITY" if value > 0 else "-INFINITY"
        return repr(value) if abs(value) < 1e6 and (value * 64.0).is_integer() else value.hex()

    def field(self, text: str, name: str) -> str:
        """Field of a record."""
        return f"{text}.{self.name(name)}"

    def parameter(self, text: str, name: str) -> str:
        """Field of the parameters, handed over by reference."""
        return f"{text}->{self.name(name)}"

    def member(self, name: str) -> str:
        """Field of the exported model."""
        return f"m->{name}"

    def name(self, name: str) -> str:
        """Name that the language does not reserve."""
        return f"{name}_" if name in self.reserved else name

    def index(self, text: str, index: str) -> str:
        """Entry of an array, counted from 0."""
        return f"{text}[{index}]"

    def record(self, kind: Struct, values: list[str]) -> str:
        """A record with these fields."""
        return f"({self.type_name(kind)}){{{', '.join(values)}}}"

    def choose(self, test: str, yes: str, no: str) -> str:
        """One of two values."""
        return f"({test} ? {yes} : {no})"

    def whole(self, text: str) -> str:
        """Whole part of a number."""
        return f"(int)({text})"

    def real(self, value: Value) -> Value:
        """A whole number as a number."""
        return Value("double", f"(double)({value.text})", 9)

    def divide_whole(self, a: str, b: str) -> str:
        """Quotient of two whole numbers of 0 or more."""
        return f"{a} / {b}"

    def assign(self, name: str, text: str, kind: Type | None) -> str:
        """Assignment; with a type also the declaration."""
        return f"{self.type_name(kind)} {name} = {text};" if kind is not None else f"{name} = {text};"

    def declare(self, name: str, kind: Type) -> str:
        """Declaration of a variable that is assigned in a branch."""
        zero = "{0}" if isinstance(kind, Struct) else "0" if kind in ("int", "bool") else "0.0"
        return f"{self.type_name(kind)} {name} = {zero};"

    def unused(self, name: str) -> str:
        """Statement that uses a variable."""
        return f"(void){name};"

    def begin_if(self, test: str, *, chained: bool = False) -> str:
        """First line of a branch."""
        return f"}} else if ({test}) {{" if chained else f"if ({test}) {{"

    def otherwise(self) -> str:
        """Line between two branches."""
        return "} else {"

    def begin_for(self, name: str, first: str, last: str) -> str:
        """First line of a loop over whole numbers."""
        return f"for (int {name} = {first}; {name} < {last}; {name}++) {{"

    def begin_while(self, test: str) -> str:
        """First line of a loop."""
        return f"while ({test}) {{"

    def returned(self, text: str, *, last: bool) -> list[str]:
        """Lines that return a value."""
        del last
        return [f"return {text};"]

    def fill(self, texts: list[str]) -> list[str]:
        """Lines that write the result to an array."""
        return [f"p[{k}] = {text};" for k, text in enumerate(texts)]

    def function(
        self, name: str, arguments: list[tuple[str, Type | None]], result: Type, comment: str, body: list[str]
    ) -> str:
        """A function; an argument without a type is the parameters."""
        signature = self.signature(arguments)
        if isinstance(result, Array):
            returned, signature = "void", f"{signature}, double *p"
        else:
            returned = self.type_name(result)
        return "\n".join([f"/* {comment} */", f"static {returned} {name}({signature}) {{", *body, "}"])

    def signature(self, arguments: list[tuple[str, Type | None]]) -> str:
        """The arguments of a function with their types."""
        shown = []
        for name, kind in arguments:
            if kind is None:
                shown.append(f"const {self.prefix}_parameters *{name}")
            elif isinstance(kind, Array):
                shown.append(f"{'' if kind.writable else 'const '}double *{name}")
            else:
                shown.append(f"{self.type_name(kind)} {name}")
        return ", ".join(shown) or "void"


class MatlabSyntax(CSyntax):
    """MATLAB, as in a function file or a MATLAB Function block."""

    language = "MATLAB"
    reserved = MATLAB_RESERVED
    helpers = MATLAB_HELPERS
    comment = "% {}"
    end = "end"
    functions = {**CSyntax.functions, "abs": "abs", "fabs": "abs", "min": "min", "max": "max", "round": "round_even"}  # noqa: RUF012 - a table
    operators = {"!=": "~=", "not": "~", "and": "&&", "or": "||"}  # noqa: RUF012 - a table

    def number(self, value: float | bool) -> str:
        """A constant with all its digits."""
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, int):
            return str(value)
        return {"nan": "NaN", "inf": "Inf", "-inf": "-Inf"}.get(repr(value), repr(value))

    def parameter(self, text: str, name: str) -> str:
        """Field of the parameters."""
        return f"{text}.{self.name(name)}"

    def member(self, name: str) -> str:
        """Field of the exported model."""
        return f"m.{name}"

    def index(self, text: str, index: str) -> str:
        """Entry of an array, counted from 0."""
        return f"{text}({int(index) + 1 if index.isdigit() else f'{index} + 1'})"

    def record(self, kind: Struct, values: list[str]) -> str:
        """A record with these fields."""
        fields = (f"'{self.name(name)}', {value}" for (name, _), value in zip(kind.fields, values, strict=True))
        return f"struct({', '.join(fields)})"

    def choose(self, test: str, yes: str, no: str) -> str:
        """One of two values, both of which are computed."""
        return f"choose({test}, {yes}, {no})"

    def whole(self, text: str) -> str:
        """Whole part of a number."""
        return f"fix({text})"

    def real(self, value: Value) -> Value:
        """A whole number as a number."""
        return Value("double", value.text, value.rank)

    def divide_whole(self, a: str, b: str) -> str:
        """Quotient of two whole numbers of 0 or more."""
        return f"floor({a} / {b})"

    def assign(self, name: str, text: str, kind: Type | None) -> str:
        """Assignment."""
        del kind
        return f"{name} = {text};"

    def begin_if(self, test: str, *, chained: bool = False) -> str:
        """First line of a branch."""
        return f"elseif {test}" if chained else f"if {test}"

    def otherwise(self) -> str:
        """Line between two branches."""
        return "else"

    def begin_for(self, name: str, first: str, last: str) -> str:
        """First line of a loop over whole numbers."""
        return f"for {name} = {first}:{last} - 1"

    def begin_while(self, test: str) -> str:
        """First line of a loop."""
        return f"while {test}"

    def returned(self, text: str, *, last: bool) -> list[str]:
        """Lines that return a value."""
        return [f"result = {text};"] + ([] if last else ["return"])

    def fill(self, texts: list[str]) -> list[str]:
        """Lines that return an array."""
        return [f"result = [{', '.join(texts)}];"]

    def function(
        self, name: str, arguments: list[tuple[str, Type | None]], result: Type, comment: str, body: list[str]
    ) -> str:
        """A function."""
        del result
        shown = ", ".join(argument for argument, _ in arguments)
        return "\n".join([f"function result = {name}({shown})", f"% {comment}", *body, "end"])


C, MATLAB = CSyntax, MatlabSyntax
