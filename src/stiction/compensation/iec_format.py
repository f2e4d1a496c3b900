"""Format of IEC 61131-3 text: the templates in ``iec/``, literals, names and comments."""

from __future__ import annotations

import math
import re
from functools import cache
from textwrap import wrap
from typing import TYPE_CHECKING

from stiction.errors import ParameterError, require_finite

if TYPE_CHECKING:
    import jinja2

__all__ = ["block_name", "comment_lines", "format_dint", "format_lreal", "templates"]

MAX_SCANS = 2**31 - 1
"""Largest value of a DINT [scans]."""


@cache
def templates() -> jinja2.Environment:
    """Return the templates of the compensators, with filters for literals."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("stiction.compensation", "iec"),
        autoescape=False,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters.update(lreal=format_lreal, dint=format_dint)
    return environment


def format_lreal(value: float) -> str:
    """Return a number as an LREAL literal with full precision.

    Examples
    --------
    >>> format_lreal(0.1), format_lreal(3), format_lreal(-2e-9), format_lreal(1e22)
    ('0.1', '3.0', '-2.0E-9', '1.0E+22')
    """
    digits, _, power = repr(require_finite("setting", value)).partition("e")
    if not power:
        return digits
    return f"{digits}{'' if '.' in digits else '.0'}E{power[0]}{power[1:].lstrip('0')}"


def format_dint(value: float) -> str:
    """Return a whole number of scans as a DINT literal.

    Examples
    --------
    >>> format_dint(5.0)
    '5'
    """
    if value != math.floor(value) or not 1 <= value <= MAX_SCANS:
        raise ParameterError(
            f"A time of {value:g} scans is not a whole number from 1 to {MAX_SCANS}; change the time or dt."
        )
    return str(int(value))


def block_name(tag: str, page: str) -> str:
    """Return the name of the block: letters, digits and single underscores, a letter first."""
    words = re.sub(r"[^A-Z0-9]+", "_", f"{tag}_{page}".upper()).strip("_")
    return words if words[0].isalpha() else f"LOOP_{words}"


def comment_lines(text: str) -> list[str]:
    """Return text as indented lines for a comment: ASCII only, without comment marks."""
    plain = " ".join(text.split()).encode("ascii", "replace").decode()
    return wrap(plain.replace("(*", "( *").replace("*)", "* )"), 110, initial_indent="  ", subsequent_indent="  ") or [
        ""
    ]
