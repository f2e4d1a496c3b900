"""What an expression of a kernel is to the translator: known when it translates, or computed when the model runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from stiction.errors import ParameterError
from stiction.export.syntax import Struct, Type, Value

__all__ = ["Fixed", "Items", "Method", "Settings", "TranslationError", "Value", "tuple_type"]


class TranslationError(ParameterError):
    """A kernel uses what the translator does not know."""


@dataclass(frozen=True)
class Fixed:
    """A Python object that is known when the kernel is translated."""

    value: Any


@dataclass(frozen=True)
class Items:
    """Several values in a row."""

    items: tuple[Any, ...]


@dataclass(frozen=True)
class Settings:
    """A model whose settings with these names can be changed when it runs."""

    model: Any
    adjustable: frozenset[str]
    text: str = "self"

    prefix: str = ""
    """What stands before the names of its settings in the exported parameters."""


@dataclass(frozen=True)
class Method:
    """A method of such a model."""

    settings: Settings
    function: Any


def tuple_type(kinds: list[Type]) -> Struct:
    """Type of a row of numbers that a function returns."""
    shape = "" if all(kind == "double" for kind in kinds) else "".join(str(kind)[0] for kind in kinds)
    return Struct(f"numbers{len(kinds)}{shape}", tuple((f"f{k}", kind) for k, kind in enumerate(kinds)))
