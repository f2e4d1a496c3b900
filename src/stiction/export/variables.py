"""The variables of an exported model: names, units, ranges and descriptions, from the model's page."""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
import struct
from dataclasses import dataclass
from typing import Any

from stiction.errors import ParameterError

__all__ = ["Variable", "describe", "settings_of"]

_UNIT = re.compile(r"\[([^\]]+)\]\.?")
_SMALL, _LARGE, _EXTREME = 1e-250, 1e250, 2.0**900
"""What is below and above these counts as 0 and as no limit; factor on the other settings."""


@dataclass(frozen=True)
class Variable:
    """One variable of an exported model."""

    name: str
    """Its name."""
    value: float
    """Its value at the start [unit]."""
    unit: str
    """Unit, as in the documentation: "% of span", "s", "-"."""
    description: str
    """What it is, one sentence."""
    low: float = -math.inf
    """Smallest value [unit]."""
    high: float = math.inf
    """Largest value [unit]."""
    above: bool = False
    """Whether the smallest value itself is not allowed."""


def settings_of(model: Any, adjustable: frozenset[str], prefix: str = "") -> list[Variable]:
    """The settings of a model that can be changed after its export.

    Parameters
    ----------
    model : Valve, Compensator or PID
        The model.
    adjustable : frozenset of str
        Names of the settings.
    prefix : str
        What stands before each name.

    Returns
    -------
    list of Variable
        The settings with their ranges, found by trying which values the model accepts.
    """
    texts = describe(type(model))
    names = [field.name for field in dataclasses.fields(model) if field.name in adjustable]
    found = []
    for name in names:
        text, unit = texts.get(name, (name, "-"))
        low, above = _lowest(model, name, names)
        high = -_lowest(model, name, names, sign=-1.0)[0]
        found.append(Variable(prefix + name, float(getattr(model, name)), unit, text, low, high, above))
    return found


def describe(kind: type) -> dict[str, tuple[str, str]]:
    """Description and unit of each parameter in the docstring of a class.

    Examples
    --------
    >>> from stiction import Kano
    >>> describe(Kano)["J"]
    ('Slip jump; J > S overshoots.', '% of span')
    """
    section = (inspect.getdoc(kind) or "").partition("Parameters\n----------\n")[2].partition("\n\n")[0]
    found: dict[str, tuple[str, str]] = {}
    for head, body in re.findall(r"^(\S.*?) : .*\n((?:    .*\n?)+)", section, re.MULTILINE):
        text = " ".join(body.split())
        unit = _UNIT.search(text)
        plain = " ".join(_UNIT.sub("", text).split()).replace(" ;", ";").replace(" ,", ",").replace(" .", ".")
        plain = plain.rstrip(".;, ") + "."
        for name in head.split(","):
            found[name.strip()] = (plain, unit[1] if unit else "-")
    return found


def _lowest(model: Any, name: str, names: list[str], sign: float = 1.0) -> tuple[float, bool]:
    """Smallest value of a setting whatever the others are, and whether it is not allowed itself; -`sign`: largest."""
    best = _limit(model, name, sign)
    if math.isinf(best[0]):
        return best
    for other in names:
        if other == name:
            continue
        value = getattr(model, other)
        for trial in (0.0, value / _EXTREME, min(value * _EXTREME, 1e300)):
            changed = _replaced(model, {other: trial})
            if changed is not None:
                best = min(best, _limit(changed, name, sign))
    return best


def _limit(model: Any, name: str, sign: float) -> tuple[float, bool]:
    def accepts(value: float) -> bool:
        return _replaced(model, {name: sign * value}) is not None

    inside = sign * float(getattr(model, name))
    if accepts(-1e300):
        return -math.inf, False
    for end in (0.0, 1.0):
        if accepts(end) and not accepts(math.nextafter(end, -math.inf)):
            return end, False
        if not accepts(end) and accepts(math.nextafter(end, math.inf)):
            return end, True
    low, high = _place(-1e300), _place(min(inside, 1e300))
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if accepts(_at(middle)) else (middle, high)
    high = _at(high)
    if abs(high) < _SMALL:
        return 0.0, True
    return (-math.inf, False) if abs(high) > _LARGE else (high, False)


def _place(value: float) -> int:
    """Place of a number among all numbers in their order."""
    return int(math.copysign(struct.unpack("<q", struct.pack("<d", abs(value)))[0], value))


def _at(place: int) -> float:
    return math.copysign(struct.unpack("<d", struct.pack("<q", abs(place)))[0], place)


def _replaced(model: Any, changes: dict[str, float]) -> Any | None:
    try:
        return dataclasses.replace(model, **changes)
    except (ParameterError, OverflowError, ZeroDivisionError):
        return None
