"""Data of a table or figure as plain numbers and lists, for JSON."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

__all__ = ["to_plain"]


def to_plain(data: Any, *, series: bool = True) -> Any:
    """Return data as dicts, lists, numbers and text.

    Parameters
    ----------
    data : object
        A result of `stiction.paper`, or any value in one.
    series : bool
        Whether arrays are included; without them the numbers of a figure remain.

    Returns
    -------
    dict, list, number or text
        Complex numbers become [real, imaginary]; a valve becomes its description.

    Examples
    --------
    >>> from stiction.paper import equation5
    >>> from stiction.paper.to_plain import to_plain
    >>> [reply["last"] for reply in to_plain(equation5(), series=False)["replies"][:2]]
    [1.0, 9.0]
    """
    if isinstance(data, np.ndarray):
        return to_plain(data.tolist(), series=series)
    if isinstance(data, np.generic):
        return to_plain(data.item(), series=series)
    if isinstance(data, complex):
        return [data.real, data.imag]
    if isinstance(data, dict):
        selected = {str(key): value for key, value in data.items() if series or not _is_series(value)}
        return {key: to_plain(value, series=series) for key, value in selected.items()}
    if isinstance(data, (list, tuple)):
        return [to_plain(value, series=series) for value in data]
    if is_dataclass(data) and not isinstance(data, type):
        if not type(data).__module__.startswith("stiction.paper."):
            if hasattr(data, "to_dict"):
                return data.to_dict()  # type: ignore[union-attr]
            if not hasattr(data, "op"):
                return repr(data)
        return to_plain({entry.name: getattr(data, entry.name) for entry in fields(data)}, series=series)
    return data if data is None or isinstance(data, (bool, int, float, str)) else str(data)


def _is_series(value: Any) -> bool:
    """Whether it is an array, a record, or a dict of arrays."""
    if isinstance(value, dict):
        return bool(value) and all(_is_series(entry) for entry in value.values())
    return isinstance(value, np.ndarray) or hasattr(value, "op")
