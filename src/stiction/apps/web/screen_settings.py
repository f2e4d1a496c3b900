"""Settings of a screen: quantities with units and limits, choices, and how an address or a message gives them."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar

from stiction.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Self

__all__ = ["Quantity", "ScreenSettings", "choice", "quantity"]


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


def quantity(
    default: float, label: str, unit: str, low: float, high: float, scale: str = "linear", *, group: str
) -> Any:
    """Return a field of `ScreenSettings` that holds a `Quantity`."""
    return field(default=default, metadata={"quantity": Quantity(label, unit, low, high, scale, group)})


def choice(default: str, choices: Mapping[str, str]) -> str:
    """Return a field of `ScreenSettings` that holds one of `choices`: value -> name on the screen."""
    return field(default=default, metadata={"choices": choices})


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

    def __post_init__(self) -> None:
        for name, setting in self.quantities().items():
            object.__setattr__(self, name, setting.check(getattr(self, name)))
        for setting in fields(self):
            known = setting.metadata.get("choices")
            if known is not None and getattr(self, setting.name) not in known:
                raise ParameterError(
                    f"{setting.name} = {getattr(self, setting.name)!r} is unknown; use one of {', '.join(known)}."
                )

    @classmethod
    def quantities(cls) -> dict[str, Quantity]:
        """Name in the address -> what the number is."""
        return {setting.name: setting.metadata["quantity"] for setting in fields(cls) if "quantity" in setting.metadata}

    @classmethod
    def options(cls) -> dict[str, Any]:
        """What the screen can move, and its example; JSON-ready."""
        quantities = {name: asdict(setting) for name, setting in cls.quantities().items()}
        return {"quantities": quantities, "example": asdict(cls())}

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Make settings of the texts or numbers in an address or a message; what is not named keeps its default.

        Raises ParameterError when a name is unknown, or a value is no number or outside its limits.
        """
        types = {setting.name: setting.type for setting in fields(cls)}
        if unknown := sorted(set(values) - set(types)):
            raise ParameterError(f"{unknown[0]!r} is not a setting of {cls.SCREEN}; use one of {', '.join(types)}.")
        given = dict(values)
        for name in given:
            if types[name] == "bool":
                given[name] = str(given[name]).lower() in ("1", "true")
        return cls(**given)
