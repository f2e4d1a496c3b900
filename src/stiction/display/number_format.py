"""Numbers as text: only the digits that mean something, and no probability shown as certain."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["count_noun", "format_interval", "format_number", "format_probability", "list_first"]

MIN_SHARE_OF_INTERVAL = 1e-3
"""Share of the largest interval end below which a value is shown as 0 [-]."""
MAX_SIGNIFICANT_DIGITS = 4
"""Significant digits of the largest number of an interval [-]."""


def format_number(value: float, unit: str = "", significant: int = 3) -> str:
    r"""Return a number as text with a few significant digits, or a dash; a no-break space stands before the unit.

    `value`: the number [unit]. `unit`: its unit; left out when empty. `significant`: significant digits [-]. Returns
    the number; a large one has no power of ten.

    Examples
    --------
    >>> format_number(3.14159, "%"), format_number(1234.5), format_number(99.87, significant=2)
    ('3.14\xa0%', '1234', '100')
    >>> format_number(float("nan"), "s")
    '–'
    """
    if not math.isfinite(value):
        return "–"
    text = f"{value:.0f}" if abs(value) >= 10**significant - 0.5 else f"{value:.{significant}g}"
    return f"{text}\u00a0{unit}" if unit else text


def count_noun(number: int, noun: str, plural: str = "") -> str:
    """Return a count with its noun.

    `number`: the count [-]. `noun`, `plural`: the noun for one and for more; the plural gets an s when it is not given.
    Returns the number and the noun.

    Examples
    --------
    >>> count_noun(1, "row"), count_noun(3, "row"), count_noun(2, "stretch", "stretches")
    ('1 row', '3 rows', '2 stretches')
    """
    return f"{number} {noun if number == 1 else plural or f'{noun}s'}"


def list_first(texts: Sequence[str], most: int) -> str:
    """List the first texts, and say how many more there are.

    >>> list_first(["a", "b", "c"], 5), list_first(["a", "b", "c"], 1)
    ('a, b, c', 'a and 2 more')
    """
    return ", ".join(texts[:most]) + (f" and {len(texts) - most} more" if len(texts) > most else "")


def format_interval(value: float, low: float, high: float) -> tuple[str, str, str]:
    """Return a value and the ends of its interval with the same number of decimals.

    `value`, `low`, `high`: the value and the ends of its interval [any unit]. Returns value, lower and upper end: two
    significant digits of the value, or one when the interval reaches ten times as far; one digit of the width when that
    is finer. A value is shown as 0 only when it is tiny beside its interval.

    Examples
    --------
    >>> format_interval(3.0, 2.7, 3.3), format_interval(21.99, 21.97, 22.02), format_interval(2.04, 0.6, 3.4)
    (('3.0', '2.7', '3.3'), ('21.99', '21.97', '22.02'), ('2.0', '0.6', '3.4'))
    >>> format_interval(0.00567, 0.0040, 0.0792), format_interval(0.0, 0.0, 16.31)
    (('0.0057', '0.0040', '0.0792'), ('0', '0', '16'))
    >>> format_interval(4.0, float("nan"), 5.0)
    ('4', '–', '5')
    """
    if not all(map(math.isfinite, (value, low, high))):
        return format_number(value), format_number(low), format_number(high)
    largest = max(abs(value), abs(low), abs(high))
    if largest == 0.0:
        return "0", "0", "0"
    width_power = 2 if high <= low else -_power(0.4 * (high - low))
    by_width = min(width_power, MAX_SIGNIFICANT_DIGITS - 1 - _power(largest))
    if abs(value) < MIN_SHARE_OF_INTERVAL * largest:
        by_size = 1 - _power(largest)
    else:
        by_size = max(1 - _power(max(abs(value), 0.1 * largest)), -_power(value))
    decimals = max(by_width, by_size, 0)
    return f"{value:.{decimals}f}", f"{low:.{decimals}f}", f"{high:.{decimals}f}"


def format_probability(probability: float) -> str:
    """Return a probability as text, never as 0 or 1: an estimate from a record is not certain.

    `probability`: the probability [-]. Returns two decimals, `<0.01` or `>0.99` instead of 0 or 1, a dash when it is
    NaN.

    Examples
    --------
    >>> format_probability(0.9956), format_probability(0.0044), format_probability(0.9)
    ('>0.99', '<0.01', '0.90')
    >>> format_probability(float("nan"))
    '–'
    """
    if not math.isfinite(probability):
        return "–"
    text = f"{probability:.2f}"
    return {"1.00": ">0.99", "0.00": "<0.01"}.get(text, text)


def _power(value: float) -> int:
    """Power of ten of the first digit of a number other than 0."""
    return math.floor(math.log10(abs(value)))
