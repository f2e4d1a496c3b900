"""Values as strict JSON holds them."""

from __future__ import annotations

import math
from typing import Any

__all__ = ["strict"]


def strict(value: Any) -> Any:
    """Return the value with numpy numbers as Python's, arrays as lists, and what is not finite as None.

    Examples
    --------
    >>> strict({"S": float("nan"), "levels": (1.0, 2.0)})
    {'S': None, 'levels': [1.0, 2.0]}
    """
    if isinstance(value, dict):
        return {str(key): strict(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [strict(entry) for entry in value]
    if value is None or isinstance(value, (bool, str, int)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if hasattr(value, "tolist"):
        return strict(value.tolist())
    return str(value)
