"""Parse transfer functions such as ``3 exp(-10s)/(10s+1)``."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.errors import ParameterError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["parse_transfer_function"]

_TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|(exp|e|s)|(\*\*|[-+*/^()]))")
_EXAMPLE = 'write for example "3 exp(-10s)/(10s+1)"'


class _Ratio(NamedTuple):
    """A ratio of polynomials in s, descending powers, with a dead time."""

    num: NDArray[Any]
    den: NDArray[Any]
    dead_time: float = 0.0


def parse_transfer_function(text: str) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Parse a transfer function in s; a product without a sign comes before a division, as on paper.

    Parameters
    ----------
    text : str
        Numbers, s, ``+ - * / ^``, brackets and ``exp(-L s)`` for a dead time of L seconds.

    Returns
    -------
    num, den : ndarray
        Coefficients, descending powers of s.
    dead_time : float
        Dead time [s].

    Raises
    ------
    ParameterError
        When the text cannot be parsed, or adds terms with different dead times.

    Examples
    --------
    >>> num, den, dead_time = parse_transfer_function("3 exp(-10s)/(10s+1)(2s+1)")
    >>> num.tolist(), den.tolist(), dead_time
    ([3.0], [20.0, 12.0, 1.0], 10.0)
    """
    reader = _Reader(text)
    ratio = reader.sum()
    if reader.peek():
        raise reader.fault(f"{reader.peek()!r} was not expected")
    return ratio.num, ratio.den, ratio.dead_time


class _Reader:
    """A recursive descent parser, one method for each level of precedence."""

    def __init__(self, text: str) -> None:
        self.text, self.place, self.tokens = text, 0, list[str]()
        end = 0
        while text[end:].strip():
            found = _TOKEN.match(text, end)
            if found is None:
                raise self.fault(f"{text[end:].strip()[:12]!r} cannot be read")
            self.tokens.append(found.group().strip().replace("**", "^"))
            end = found.end()

    def fault(self, why: str) -> ParameterError:
        return ParameterError(f'process "{self.text}" is not a transfer function in s: {why}; {_EXAMPLE}.')

    def peek(self) -> str:
        return self.tokens[self.place] if self.place < len(self.tokens) else ""

    def take(self, *wanted: str) -> str:
        token = self.peek()
        if wanted and token not in wanted:
            raise self.fault(f"{' or '.join(wanted)} is missing" + (f" before {token!r}" if token else " at the end"))
        self.place += 1
        return token

    def sum(self) -> _Ratio:
        total = self.product()
        while self.peek() in ("+", "-"):
            sign = 1.0 if self.take() == "+" else -1.0
            more = self.product()
            if more.dead_time != total.dead_time:
                raise self.fault("it adds terms of different dead times")
            num = np.polyadd(np.polymul(total.num, more.den), sign * np.polymul(more.num, total.den))
            total = _Ratio(num, np.polymul(total.den, more.den), total.dead_time)
        return total

    def product(self) -> _Ratio:
        total = self.signed()
        while self.peek() in ("*", "/"):
            total = self._times(total, self.signed()) if self.take() == "*" else self._over(total, self.signed())
        return total

    def signed(self) -> _Ratio:
        if self.peek() in ("+", "-"):
            sign = 1.0 if self.take() == "+" else -1.0
            inner = self.signed()
            return inner._replace(num=sign * inner.num)
        total = self.power()
        while self.peek() and self.peek() not in "+-*/^)":
            if self.peek()[0] in ".0123456789":
                raise self.fault(f"a sign is missing before {self.peek()!r}")
            total = self._times(total, self.power())
        return total

    def power(self) -> _Ratio:
        base = self.atom()
        if self.peek() != "^":
            return base
        self.take()
        exponent = self.signed()
        n = exponent.num[0] / exponent.den[0]
        if exponent.num.size > 1 or exponent.den.size > 1 or n != round(n) or not 0 <= n <= 20:
            raise self.fault("a power must be a whole number from 0 to 20")
        total = _Ratio(np.ones(1), np.ones(1))
        for _ in range(int(n)):
            total = self._times(total, base)
        return total

    def atom(self) -> _Ratio:
        token = self.take()
        if token == "(":
            inner = self.sum()
            self.take(")")
            return inner
        if token == "s":
            return _Ratio(np.array([1.0, 0.0]), np.ones(1))
        if token in ("exp", "e"):
            if token == "e":
                self.take("^")
            return self._delay(self.atom() if self.peek() == "(" else self.signed())
        try:
            return _Ratio(np.array([float(token)]), np.ones(1))
        except ValueError:
            raise self.fault(f"{token!r} was not expected" if token else "it ends too early") from None

    def _delay(self, exponent: _Ratio) -> _Ratio:
        num, den = np.trim_zeros(exponent.num, "f"), exponent.den
        if num.size == 0:
            return _Ratio(np.ones(1), np.ones(1))
        if num.size != 2 or num[1] != 0.0 or den.size != 1 or num[0] / den[0] > 0.0:
            raise self.fault("exp() takes -L s only, with a dead time L of 0 s or more")
        return _Ratio(np.ones(1), np.ones(1), -float(num[0] / den[0]))

    @staticmethod
    def _times(a: _Ratio, b: _Ratio) -> _Ratio:
        return _Ratio(np.polymul(a.num, b.num), np.polymul(a.den, b.den), a.dead_time + b.dead_time)

    def _over(self, a: _Ratio, b: _Ratio) -> _Ratio:
        if not np.any(b.num):
            raise self.fault("it divides by zero")
        if b.dead_time:
            raise self.fault("exp() stands below the fraction bar")
        return _Ratio(np.polymul(a.num, b.den), np.polymul(a.den, b.num), a.dead_time)
