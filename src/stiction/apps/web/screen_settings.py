"""Settings of a screen: quantities with units and limits, choices, and how an address or a message gives them."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar

from stiction.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Self

__all__ = ["Quantity", "ScreenSettings"]


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number that a slider moves.

    Examples
    --------
    >>> Quantity("Slip jump J", "% of span", 0.0, 100.0, "linear", "valve").check("3.5")
    3.5
    """

    label: str
    """Name on the screen."""
    unit: str
    """Unit; empty where it has none."""
    low: float
    """Smallest value accepted [unit]."""
    high: float
    """Largest value accepted [unit]."""
    scale: str
    """Scale of the slider: "linear", or "log" for a quantity whose ratio matters."""
    group: str
    """What it belongs to: valve, controller, process, simulation, ramp, sine, loop or pulse."""

    def check(self, value: Any) -> float:
        """Return a value as a number within the limits.

        Raises
        ------
        ParameterError
            When it is no number or outside the limits.
        """
        unit = f" {self.unit}" if self.unit not in ("", "-") else ""
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = math.nan
        if math.isnan(number):
            raise ParameterError(f"{self.label} must be a number{unit and f' in{unit}'}, got {value!r}.")
        if not self.low <= number <= self.high:
            raise ParameterError(
                f"{self.label} = {number:g}{unit} is outside {self.low:g} to {self.high:g}{unit}. "
                "Give a value within these limits."
            )
        return number


@dataclass(frozen=True)
class ScreenSettings:
    """Base of the settings of a screen; every field has a default and may be part of an address.

    Raises
    ------
    ParameterError
        When a number is outside the limits of its `Quantity`, or a choice is unknown.
    """

    SCREEN: ClassVar[str]
    """Name of the screen in messages."""
    QUANTITIES: ClassVar[Mapping[str, Quantity]]
    """Field -> what the number is."""
    CHOICES: ClassVar[Mapping[str, Mapping[str, str]]]
    """Field -> its values and their names on the screen."""

    def __post_init__(self) -> None:
        for name, quantity in self.QUANTITIES.items():
            object.__setattr__(self, name, quantity.check(getattr(self, name)))
        for name, known in self.CHOICES.items():
            if getattr(self, name) not in known:
                raise ParameterError(f"{name} = {getattr(self, name)!r} is unknown; use one of {', '.join(known)}.")

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Make settings of the texts or numbers in an address or a message.

        Parameters
        ----------
        values : mapping of str to str or number
            Field -> value; a field that is not named keeps its default.

        Raises
        ------
        ParameterError
            When a name is unknown, or a value is no number or outside its limits.
        """
        types = {one.name: one.type for one in fields(cls)}
        if unknown := sorted(set(values) - set(types)):
            raise ParameterError(f"{unknown[0]!r} is not a setting of {cls.SCREEN}; use one of {', '.join(types)}.")
        given = dict(values)
        for name in given:
            if types[name] == "bool":
                given[name] = str(given[name]).lower() in ("1", "true")
        return cls(**given)

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form, as `from_mapping` takes it."""
        return asdict(self)
