"""Text of a source as it may be shown: characters that a screen would obey are written as their codes."""

from __future__ import annotations

import re

__all__ = ["visible"]

_OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters but tab and line feed, marks of the writing direction, and halves of characters."""


def visible(text: str) -> str:
    r"""Write control characters, marks of the writing direction and surrogates as their codes.

    Examples
    --------
    >>> visible("FIC-101\x1b[2J \u202e101-CIF"), visible("Süd\n")
    ('FIC-101\\x1b[2J \\u202e101-CIF', 'Süd\n')
    """
    return _OBEYED.sub(_as_code, text)


def _as_code(match: re.Match[str]) -> str:
    number = ord(match[0])
    return f"\\x{number:02x}" if number < 256 else f"\\u{number:04x}"
