"""What the translator works with: types, values that are computed when the model runs, and models with settings.

Anything else that an expression gives is an ordinary Python object, known when the kernel is translated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from stiction.errors import ParameterError

__all__ = ["Array", "Settings", "Struct", "TranslationError", "Type", "Value", "is_known"]


class TranslationError(ParameterError):
    """A kernel uses what the translator does not know."""


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
"""'double', 'int', 'bool', 'void', a record or an array."""


@dataclass(frozen=True)
class Value:
    """A number or record that is computed when the model runs."""

    type: Type
    text: str
    rank: int = 10
    """How tightly its operator binds; 10 for a name."""

    def bracketed(self, rank: int) -> str:
        """Its text, in brackets where it binds less tightly than `rank`."""
        return self.text if self.rank >= rank else f"({self.text})"


@dataclass(frozen=True)
class Settings:
    """A model whose settings with these names can be changed when it runs."""

    model: Any
    adjustable: frozenset[str]
    text: str = "self"

    prefix: str = ""
    """What stands before the names of its settings in the exported parameters."""


def is_known(one: Any) -> bool:
    """Whether a value is known when the kernel is translated."""
    return all(map(is_known, one)) if isinstance(one, tuple) else not isinstance(one, (Value, Settings))
