"""Convert values to what JSON allows."""

from __future__ import annotations

import math
from typing import Any

__all__ = ["json_safe"]


def json_safe(value: Any) -> Any:
    """Return a value with numpy numbers as Python numbers, arrays as lists, and NaN and infinity as None.

    Examples
    --------
    >>> json_safe({"S": float("nan"), "levels": (1.0, 2.0)})
    {'S': None, 'levels': [1.0, 2.0]}
    """
    if isinstance(value, dict):
        return {str(key): json_safe(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [json_safe(entry) for entry in value]
    if value is None or isinstance(value, (bool, str, int)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if hasattr(value, "tolist"):
        return json_safe(value.tolist())
    return str(value)
