"""Plot data as JSON that is small and safe inside a page."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np

__all__ = ["to_json"]


def to_json(plot: Any) -> str:
    r"""Return a plot as JSON for a `<script type="application/json">` element.

    Arrays become base64 typed arrays, as plotly.js reads them; NaN is a gap. Single precision is
    used where it moves no point by more than a ten-thousandth of the array's range.

    Raises ValueError when a bare number outside an array is not finite (JSON has no NaN).

    Examples
    --------
    >>> to_json({"name": "</script>", "y": np.array([0.0, 1.0])})
    '{"name":"\\u003c/script\\u003e","y":{"dtype":"f4","bdata":"AAAAAAAAgD8="}}'
    """
    text = json.dumps(plot, default=_plain, allow_nan=False, separators=(",", ":"))
    for mark in "<>&":
        text = text.replace(mark, f"\\u{ord(mark):04x}")
    return text


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if not isinstance(value, np.ndarray):
        raise TypeError(f"A plot holds a {type(value).__name__}; give numbers, text, lists, dicts or numpy arrays.")
    if value.dtype.kind not in "fiub":
        return value.tolist()
    packed: dict[str, Any] = {"dtype": "f4", "bdata": ""}
    array = value.astype(np.float64)
    small = array.astype(np.float32)
    finite = np.isfinite(array)
    if finite.any():
        good = array[finite]
        if np.abs(small[finite] - good).max() > 1e-4 * np.ptp(good):
            packed["dtype"] = "f8"
    data = (small if packed["dtype"] == "f4" else array).astype(f"<{packed['dtype']}")
    packed["bdata"] = base64.b64encode(data.tobytes()).decode("ascii")
    if array.ndim > 1:
        packed["shape"] = ", ".join(map(str, array.shape))
    return packed
