"""How text of IEC 61131-3 is written: the pages of ``iec/``, literals, names, comments."""

from __future__ import annotations

import math
import re
from functools import cache
from textwrap import wrap
from typing import TYPE_CHECKING

from stiction.errors import ParameterError, require_finite

if TYPE_CHECKING:
    import jinja2

__all__ = ["block_name", "comment", "dint", "lreal", "pages"]

MOST_SCANS = 2**31 - 1
"""Largest DINT."""


@cache
def pages() -> jinja2.Environment:
    """The pages of structured text, with the literals they use."""
    import jinja2

    found = jinja2.Environment(
        loader=jinja2.PackageLoader("stiction.compensation", "iec"),
        autoescape=False,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    found.filters.update(lreal=lreal, dint=dint)
    return found


def lreal(value: float) -> str:
    """A number as LREAL literal that reads back as the same double.

    Examples
    --------
    >>> lreal(0.1), lreal(3), lreal(-2e-9), lreal(1e22)
    ('0.1', '3.0', '-2.0E-9', '1.0E+22')
    """
    digits, _, power = repr(require_finite("setting", value)).partition("e")
    if not power:
        return digits
    return f"{digits}{'' if '.' in digits else '.0'}E{power[0]}{power[1:].lstrip('0')}"


def dint(value: float) -> str:
    """A whole number of scans as DINT literal.

    Examples
    --------
    >>> dint(5.0)
    '5'
    """
    if value != math.floor(value) or not 1 <= value <= MOST_SCANS:
        raise ParameterError(f"{value:g} scans do not fit a counter; give a time of 1 to {MOST_SCANS} whole scans.")
    return str(int(value))


def block_name(tag: str, page: str) -> str:
    """Name of the block: letters, digits and single underscores, a letter first."""
    words = re.sub(r"[^A-Z0-9]+", "_", f"{tag}_{page}".upper()).strip("_")
    return words if words[0].isalpha() else f"LOOP_{words}"


def comment(told: str) -> list[str]:
    """Lines that can stand in a comment of any compiler: ASCII, without the marks of comments, indented."""
    plain = " ".join(told.split()).encode("ascii", "replace").decode()
    return wrap(plain.replace("(*", "( *").replace("*)", "* )"), 110, initial_indent="  ", subsequent_indent="  ") or [
        ""
    ]
