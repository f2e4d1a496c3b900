"""Physical quantities: SI floats, or text with an unambiguous unit."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any, overload

from stiction.errors import ParameterError, require_finite, require_not_negative, require_positive

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Quantity", "to_si"]

_POUND = re.compile(r"(?<![A-Za-z_])(?:lbs?|pounds?)(?![A-Za-z_])")
_COMMA = re.compile(r"\d,\d")
_EXAMPLE = {
    "kg": "lbm",
    "N": "lbf",
    "N/m": "lbf/in",
    "N*s/m": "lbf*s/in",
    "m/s": "in/s",
    "m": "in",
    "m**2": "in**2",
    "Pa": "psi",
    "s": "min",
}


@cache
def _registry() -> Any:
    import pint

    registry = pint.UnitRegistry()
    registry.define("lbm = pound")
    registry.define("psig = psi")
    registry.define("barg = bar")
    return registry


def to_si(name: str, value: object, unit: str) -> float:
    """Read a quantity in the SI unit `unit`.

    `name`: name of the quantity, for the error. `value`: an SI number, or text with a unit such as "300 lbf/in".
    Pressures are gauge pressures. `unit`: the SI unit, as pint writes it. Returns the number in `unit`. Raises
    ParameterError when the text has no unit, an unknown one, one of another dimension, a bare pound (which may be a
    mass or a force) or a decimal comma.

    Examples
    --------
    >>> from stiction.models.quantities import to_si
    >>> round(to_si("spring_rate", "300 lbf/in", "N/m"), 1)
    52538.1
    """
    if isinstance(value, str):
        return _read(name, value, unit)
    if hasattr(value, "magnitude") and hasattr(value, "units"):
        return _read(name, f"{value.magnitude!r} {value.units}", unit)  # pyright: ignore[reportAttributeAccessIssue]
    return require_finite(name, value, unit)  # pyright: ignore[reportArgumentType]


def _read(name: str, text: str, unit: str) -> float:
    remedy = f'give {name} in {unit}, as a number or as text such as "1 {_EXAMPLE[unit]}"'
    if _POUND.search(text):
        mass, force = (_POUND.sub(pound, text) for pound in ("lbm", "lbf"))
        raise ParameterError(
            f'{name} = "{text}" does not say whether the pound is a mass or a force: write "{mass}" or "{force}"; '
            f"{remedy}."
        )
    if _COMMA.search(text):
        raise ParameterError(f'{name} = "{text}" has a comma inside a number; write a decimal point.')
    try:
        quantity = _registry().Quantity(text)
    except Exception as fault:
        raise ParameterError(f'{name} = "{text}" cannot be read ({fault}); {remedy}.') from None
    if not hasattr(quantity, "units") or quantity.units == _registry().dimensionless:
        raise ParameterError(f'{name} = "{text}" has no unit; {remedy}.')
    if not quantity.check(_registry()(unit).dimensionality):
        raise ParameterError(f'{name} = "{text}" is not in a unit of {unit} ({quantity.units:P}); {remedy}.')
    return require_finite(name, quantity.to(unit).magnitude, unit)


class Quantity:
    """A field of a frozen dataclass that takes an SI number or text with a unit, and gives the SI number.

    Parameters
    ----------
    unit : str
        The SI unit, as pint writes it.
    default : float, optional
        Default value [unit]; without it the field is required.
    zero : bool
        Whether 0 is allowed.
    negative : bool
        Whether negative values are allowed.
    """

    def __init__(self, unit: str, default: float | None = None, *, zero: bool = False, negative: bool = False) -> None:
        self.unit = unit
        self.default = default
        self._check: Callable[[str, float, str], float] = (
            require_finite if negative else require_not_negative if zero else require_positive
        )

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, instance: None, owner: type) -> float: ...
    @overload
    def __get__(self, instance: object, owner: type) -> float: ...
    def __get__(self, instance: object | None, owner: type) -> float:
        if instance is not None:
            return instance.__dict__[self.name]
        if self.default is None:
            raise AttributeError(self.name)
        return self.default

    def __set__(self, instance: object, value: float | str) -> None:
        instance.__dict__[self.name] = self._check(self.name, to_si(self.name, value, self.unit), self.unit)
