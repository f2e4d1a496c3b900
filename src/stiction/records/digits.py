"""Numbers as text: as many digits as they warrant, and no probability told as certain."""

from __future__ import annotations

import math

__all__ = ["chance", "digits", "interval", "number_of"]

SHOWN = 1e-3
"""Share of the farther end of its interval below which a value is nothing beside it [-]."""
MOST = 4
"""Significant digits of the largest beyond which a narrow interval shows nothing that matters [-]."""


def digits(value: float, unit: str = "", significant: int = 3) -> str:
    r"""Return a number as text with a few significant digits, or a dash; a space before the unit does not break.

    Parameters
    ----------
    value : float
        The number [unit].
    unit : str
        Its unit, if it is to be told.
    significant : int
        Significant digits [-].

    Returns
    -------
    str
        The number, a large one without a power of ten.

    Examples
    --------
    >>> digits(3.14159, "%"), digits(1234.5), digits(99.87, significant=2), digits(float("nan"), "s")
    ('3.14\xa0%', '1234', '100', '–')
    """
    if not math.isfinite(value):
        return "–"
    text = f"{value:.0f}" if abs(value) >= 10**significant - 0.5 else f"{value:.{significant}g}"
    return f"{text}\u00a0{unit}" if unit else text


def number_of(number: int, thing: str, things: str = "") -> str:
    """Return how many there are of a thing.

    Parameters
    ----------
    number : int
        How many [-].
    thing, things : str
        What one and what more of them are called; more with an s where that is not given.

    Returns
    -------
    str
        The number and the word that goes with it.

    Examples
    --------
    >>> number_of(1, "row"), number_of(3, "row"), number_of(2, "stretch", "stretches")
    ('1 row', '3 rows', '2 stretches')
    """
    return f"{number} {thing if number == 1 else things or f'{thing}s'}"


def interval(value: float, low: float, high: float) -> tuple[str, str, str]:
    """Return a value and the ends of its interval with the same decimals, as many as value and width warrant.

    Parameters
    ----------
    value, low, high : float
        The value and the ends of its interval [any unit].

    Returns
    -------
    tuple of str
        Value, lower and upper end: two significant digits of the value, or one where its interval reaches ten times as
        far; one of the width where that is finer. Only what is nothing beside its interval is shown as 0.

    Examples
    --------
    >>> interval(3.0, 2.7, 3.3), interval(21.99, 21.97, 22.02), interval(2.04, 0.6, 3.4)
    (('3.0', '2.7', '3.3'), ('21.99', '21.97', '22.02'), ('2.0', '0.6', '3.4'))
    >>> interval(0.00567, 0.0040, 0.0792), interval(0.0, 0.0, 16.31), interval(4.0, float("nan"), 5.0)
    (('0.0057', '0.0040', '0.0792'), ('0', '0', '16'), ('4', '–', '5'))
    """
    if not all(map(math.isfinite, (value, low, high))):
        return digits(value), digits(low), digits(high)
    largest = max(abs(value), abs(low), abs(high))
    if largest == 0.0:
        return "0", "0", "0"
    by_width = min(2 if high <= low else -_power(0.4 * (high - low)), MOST - 1 - _power(largest))
    if abs(value) < SHOWN * largest:
        by_size = 1 - _power(largest)
    else:
        by_size = max(1 - _power(max(abs(value), 0.1 * largest)), -_power(value))
    decimals = max(by_width, by_size, 0)
    return f"{value:.{decimals}f}", f"{low:.{decimals}f}", f"{high:.{decimals}f}"


def chance(probability: float) -> str:
    """Return a probability as text, never as 0 or 1: what is weighed from a record is not certain.

    Parameters
    ----------
    probability : float
        The probability [-].

    Returns
    -------
    str
        Two decimals, `<0.01` or `>0.99` where these would be 0 or 1, a dash where it is not known.

    Examples
    --------
    >>> chance(0.9956), chance(0.0044), chance(0.9), chance(0.0), chance(float("nan"))
    ('>0.99', '<0.01', '0.90', '<0.01', '–')
    """
    if not math.isfinite(probability):
        return "–"
    text = f"{probability:.2f}"
    return {"1.00": ">0.99", "0.00": "<0.01"}.get(text, text)


def _power(value: float) -> int:
    """Power of ten of the first digit of a number other than 0."""
    return math.floor(math.log10(abs(value)))
