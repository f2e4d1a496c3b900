"""Parse transfer functions such as ``3 exp(-10s)/(10s+1)``."""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.errors import ParameterError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["parse_transfer_function"]

MAX_CHARACTERS = 500
"""Longest text [characters]."""
MAX_ORDER = 20
"""Largest power, and largest order of numerator and denominator [-]."""
_EXPONENTIAL = re.compile(r"(?:exp|e\s*(?:\^|\*\*))\s*(?!\s|\()([-+]?[^-+*/^()]+)")
"""An exponential without brackets: ``e^-10s``."""
_NUMBER = r"\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?"
_TOKEN = re.compile(rf"\s*(?:({_NUMBER})|(exp|e\s*(?:\^|\*\*)|s)|(\*\*|[-+*/^()]))")
_BINARY = {"+": "<<", "-": ">>", "*": "+", "/": "-", "^": "**", "**": "**"}
"""Sign -> Python's operator of the same rank, when a product without a sign has the rank of ``*``: it binds more than a
division, as on paper."""


class _Ratio(NamedTuple):
    """A ratio of polynomials in s, descending powers, with a dead time."""

    num: NDArray[Any]
    den: NDArray[Any]
    dead_time: float = 0.0


_ONE = _Ratio(np.ones(1), np.ones(1))


def parse_transfer_function(text: str) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Parse a transfer function in s; a product without a sign comes before a division, as on paper.

    `text`: numbers, s, ``+ - * / ^``, brackets and ``exp(-L s)`` for a dead time of L seconds. Returns `num`, `den`:
    coefficients, descending powers of s; `dead_time`: dead time [s]. Raises ParameterError when the text cannot be
    parsed, is too long or of too high an order, or adds terms with different dead times.

    Examples
    --------
    >>> num, den, dead_time = parse_transfer_function("3 exp(-10s)/(10s+1)(2s+1)")
    >>> num.tolist(), den.tolist(), dead_time
    ([3.0], [20.0, 12.0, 1.0], 10.0)
    """
    try:
        if len(text) > MAX_CHARACTERS:
            raise ValueError(f"it has more than {MAX_CHARACTERS} characters")
        return _evaluate(ast.parse(_as_python(text), mode="eval").body)
    except (SyntaxError, RecursionError, MemoryError):
        why = "a number, a sign or a bracket is missing"
    except ValueError as error:
        why = str(error)
    raise ParameterError(
        f'process "{text[:80]}" is not a transfer function in s: {why}; write for example "3 exp(-10s)/(10s+1)".'
    )


def _as_python(text: str) -> str:
    """Return the text as a Python expression; see `_BINARY` for its operators."""
    text = _EXPONENTIAL.sub(r"exp(\1)", text)
    parts, end, after_value = list[str](), 0, False
    while text[end:].strip():
        token = _TOKEN.match(text, end)
        if token is None:
            raise ValueError(f"{text[end:].strip()[:12]!r} cannot be read")
        end = token.end()
        number, name, sign = token.groups()
        if after_value and number:
            raise ValueError(f"a sign is missing before {number!r}")
        if after_value and (name or sign == "("):
            parts.append("*")  # a product without a sign
        if sign:
            parts.append(_BINARY.get(sign, sign) if after_value else sign)
        else:
            parts.append(str(float(number)) if number else "s" if name == "s" else "exp")
        after_value = bool(number) or name == "s" or sign == ")"
    return " ".join(parts)


def _evaluate(node: ast.AST) -> _Ratio:
    match node:
        case ast.Constant(value=float() as value):
            return _Ratio(np.array([value]), np.ones(1))
        case ast.Name(id="s"):
            return _Ratio(np.array([1.0, 0.0]), np.ones(1))
        case ast.Call(func=ast.Name(id="exp"), args=[exponent]):
            return _delay(_evaluate(exponent))
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=operand):
            inner = _evaluate(operand)
            return inner._replace(num=-inner.num) if isinstance(sign, ast.USub) else inner
        case ast.BinOp(left=left, op=operator, right=right):
            return _combine(operator, _evaluate(left), _evaluate(right))
    raise SyntaxError


def _combine(operator: ast.operator, a: _Ratio, b: _Ratio) -> _Ratio:
    match operator:
        case ast.LShift() | ast.RShift():
            if a.dead_time != b.dead_time:
                raise ValueError("it adds terms of different dead times")
            sign = 1.0 if isinstance(operator, ast.LShift) else -1.0
            num = np.polyadd(_product(a.num, b.den), sign * _product(b.num, a.den))
            return _Ratio(num, _product(a.den, b.den), a.dead_time)
        case ast.Add() | ast.Mult():
            return _Ratio(_product(a.num, b.num), _product(a.den, b.den), a.dead_time + b.dead_time)
        case ast.Sub():
            if not np.any(b.num):
                raise ValueError("it divides by zero")
            if b.dead_time:
                raise ValueError("exp() stands below the fraction bar")
            return _Ratio(_product(a.num, b.den), _product(a.den, b.num), a.dead_time)
        case _:  # ast.Pow
            n = b.num[0] / b.den[0]
            if b.num.size > 1 or b.den.size > 1 or n != round(n) or not 0 <= n <= MAX_ORDER:
                raise ValueError(f"a power must be a whole number from 0 to {MAX_ORDER}")
            power = _ONE
            for _ in range(int(n)):
                power = _combine(ast.Mult(), power, a)
            return power


def _product(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    if a.size + b.size > MAX_ORDER + 2:
        raise ValueError(f"its order is above {MAX_ORDER}")
    return np.polymul(a, b)


def _delay(exponent: _Ratio) -> _Ratio:
    num, den = np.trim_zeros(exponent.num, "f"), exponent.den
    if num.size == 0:
        return _ONE
    if num.size != 2 or num[1] != 0.0 or den.size != 1 or num[0] / den[0] > 0.0:
        raise ValueError("exp() takes -L s only, with a dead time L of 0 s or more")
    return _ONE._replace(dead_time=-float(num[0] / den[0]))
