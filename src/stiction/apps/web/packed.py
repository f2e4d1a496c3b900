"""Answers with arrays: JSON text, then the arrays as single-precision numbers, which a script reads at once.

The first four bytes hold the length of the JSON text (little-endian), which is padded to a multiple of four. In the
text, `{"$array": [first, length]}` stands for an array: its first number and its length in the numbers that follow.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["pack"]


def pack(value: Mapping[str, Any]) -> bytes:
    """Return a JSON-ready mapping that may hold arrays as bytes.

    Parameters
    ----------
    value : mapping
        Texts, numbers, lists, mappings and one-dimensional arrays, however nested; NaN outside an array becomes null.

    Returns
    -------
    bytes
        Length, text and numbers.

    Examples
    --------
    >>> pack({"y": np.array([1.0])})[4:-4].strip()
    b'{"y":{"$array":[0,1]}}'
    """
    arrays: list[NDArray[np.float32]] = []
    count = 0

    def plain(part: Any) -> Any:
        nonlocal count
        if isinstance(part, np.ndarray):
            arrays.append(np.ascontiguousarray(part, dtype="<f4"))
            count += part.size
            return {"$array": [count - part.size, part.size]}
        if isinstance(part, dict):
            return {key: plain(one) for key, one in part.items()}
        if isinstance(part, list | tuple):
            return [plain(one) for one in part]
        if isinstance(part, float | np.floating):
            return float(part) if np.isfinite(part) else None
        return part

    text = json.dumps(plain(dict(value)), separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return len(text).to_bytes(4, "little") + text + b"".join(one.tobytes() for one in arrays)
