"""JSON of results: one rule for every dataclass of the package."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from operator import attrgetter
from typing import Any, ClassVar

__all__ = ["FOUR_DECIMALS", "Result", "fields_to_json", "json_as", "to_json"]


class Result:
    """Base class that gives a dataclass its `to_dict`.

    A subclass whose JSON has another order than its fields, or values that are not fields, lists all of them in
    `_json_keys`: names of fields and properties, and paths such as "loop.dt as dt_s", which name their key.
    """

    __slots__ = ()
    _json_keys: ClassVar[tuple[str, ...]] = ()

    def to_dict(self, *, series: bool = True) -> dict[str, Any]:
        """JSON-ready form, with or without arrays; unknown and infinite numbers are None."""
        return fields_to_json(self, series=series)


def json_as(key: str = "", *, digits: int | None = None, series: bool = False, omit: bool = False) -> dict[str, Any]:
    """Return the metadata of a field that has another form in JSON.

    `key` replaces its name and `digits` rounds it to so many decimals [-]; with `series` it is left out wherever arrays
    are, with `omit` always.
    """
    return {"json": (key, digits, series, omit)}


FOUR_DECIMALS = json_as(digits=4)
"""Metadata of shares and probabilities."""


def to_json(value: Any, *, series: bool = True) -> Any:
    """Return a value as JSON allows it.

    `value`: a number, text, array, list, dict or dataclass, however nested. `series`: whether dicts and dataclasses
    include their arrays. Returns NaN and infinity become None, complex numbers [real, imaginary], times ISO 8601, other
    objects their text.

    Examples
    --------
    >>> from dataclasses import dataclass, field
    >>> from stiction.display.json_form import Result, json_as
    >>> @dataclass
    ... class Peak(Result):
    ...     period: float = field(metadata=json_as("period_s"))
    ...     levels: tuple[float, ...] = ()
    >>> Peak(float("nan"), (1.0, 2.0)).to_dict()
    {'period_s': None, 'levels': [1.0, 2.0]}
    """
    if value is None or isinstance(value, (bool, str, int)):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, complex):
        return [to_json(value.real), to_json(value.imag)]
    if isinstance(value, Mapping):
        return {str(key): to_json(item, series=series) for key, item in value.items() if series or not _is_series(item)}
    if isinstance(value, (list, tuple)):
        return [to_json(item, series=series) for item in value]
    if hasattr(value, "tolist"):
        return to_json(value.tolist())
    if isinstance(value, Result):
        return value.to_dict(series=series)
    if is_dataclass(value):
        return fields_to_json(value, series=series)
    return value.isoformat() if hasattr(value, "isoformat") else str(value)


def fields_to_json(result: Any, *, series: bool = True) -> dict[str, Any]:
    """Return the fields of a dataclass as JSON allows them, or what its `_json_keys` lists."""
    data = {}
    for key, read, digits, is_array in _entries(type(result)):
        value = read(result)
        if series or not (is_array or _is_series(value)):
            data[key] = to_json(value if digits is None else round(float(value), digits), series=series)
    return data


@cache
def _entries(kind: type[Any]) -> list[tuple[str, Callable[[Any], Any], int | None, bool]]:
    """Key, function that reads the value, decimals, and whether it counts as an array, of each entry of a dataclass."""
    no_options = json_as()["json"]
    options = {field.name: field.metadata.get("json", no_options) for field in fields(kind)}
    entries = []
    for entry in getattr(kind, "_json_keys", ()) or options:
        path, _, path_key = entry.partition(" as ")
        key, digits, is_array, omit = options.get(path, no_options)
        if not omit:
            entries.append((path_key or key or path, attrgetter(path), digits, is_array))
    return entries


def _is_series(value: Any) -> bool:
    """Whether it is an array or a dict of arrays."""
    if isinstance(value, Mapping):
        return bool(value) and all(_is_series(item) for item in value.values())
    return getattr(value, "ndim", 0) > 0
