"""Packed answers, read back by other code than the page's and the server's."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from stiction.apps.web.packed import pack


def unpack(body: bytes) -> Any:
    """Read a packed answer."""
    [length] = struct.unpack_from("<I", body)
    numbers = np.frombuffer(body, "<f4", offset=4 + length)

    def restore(part: dict[str, Any]) -> Any:
        if "$array" not in part:
            return part
        first, size = part["$array"]
        return numbers[first : first + size]

    return json.loads(body[4 : 4 + length], object_hook=restore)


def test_arrays_and_texts_come_back() -> None:
    value = {
        "text": 'µ "<img>"',
        "x": np.arange(5.0),
        "nested": [{"y": np.array([1.5, np.nan])}, (1, None, True)],
        "none": float("nan"),
        "empty": np.empty(0),
    }
    back = unpack(pack(value))
    assert back["text"] == value["text"]
    assert back["none"] is None
    np.testing.assert_array_equal(back["x"], np.arange(5.0))
    np.testing.assert_array_equal(back["nested"][0]["y"], [1.5, np.nan])
    assert back["nested"][1] == [1, None, True]
    assert back["empty"].size == 0


def test_the_numbers_begin_at_a_multiple_of_four_bytes() -> None:
    for text in ("", "a", "ab", "abc", "ä"):
        body = pack({"text": text, "x": np.ones(3)})
        assert int.from_bytes(body[:4], "little") % 4 == 0
        assert len(body) % 4 == 0
